//! Memory of this process as reported by the operating system.

fn status(key: &str) -> f64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = text.lines().find(|l| l.starts_with(key)).unwrap_or_default().to_owned();
    line.split_whitespace().nth(1).and_then(|kb| kb.parse::<f64>().ok()).map_or(f64::NAN, |kb| kb / 1024.0)
}

/// Resident set now, MiB; NaN where the system does not report it.
pub fn resident_MiB() -> f64 {
    status("VmRSS")
}

/// Peak resident set, MiB.
pub fn peak_MiB() -> f64 {
    status("VmHWM")
}
