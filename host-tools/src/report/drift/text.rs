//! Results of the drift measurement for a terminal.

use super::{defect, warning};
use crate::drift::estimate::Estimate;
use crate::drift::measurement::SeparatedDrift;
use crate::drift::platform::PlatformResult;
use crate::drift::pulse_advice::PulseAdvice;
use crate::drift::{DEG_H, DriftResult, Measurement};
use crate::report::{plain, significant, with_sigma};

/// `name value ± σ unit`, the estimate divided by `scale`.
fn line(name: &str, unit: &str, estimate: &Estimate, scale: f64) -> String {
    let shown = match estimate.sigma {
        Some(sigma) => format!("{} {unit} (1σ)", with_sigma(estimate.value / scale, sigma / scale)),
        None => format!("{} {unit}", significant(estimate.value / scale, 5)),
    };
    format!("{name} {shown}")
}

/// Own drift, apparent drift, azimuth and further results.
pub(super) fn drift_lines(found: &SeparatedDrift) -> Vec<String> {
    let axes: &[&str] = if found.own_rad_s.len() == 3 { &[" x", " y", " z"] } else { &[""] };
    let mut lines = Vec::new();
    for (axis, estimate) in axes.iter().zip(&found.own_rad_s) {
        lines.push(line(&format!("own drift{axis}"), "°/h", estimate, DEG_H));
    }
    for (axis, estimate) in axes.iter().zip(&found.apparent_rad_s) {
        lines.push(line(&format!("apparent drift{axis}"), "°/h", estimate, DEG_H));
    }
    match &found.azimuth_rad {
        Some(azimuth) => {
            let second = found.second_azimuth_rad();
            let second = second.map(|second| format!(", or {}: positions 0,90,180,270 decide", plain(second.to_degrees(), 5)));
            lines.push(line("azimuth", "°", azimuth, 1_f64.to_radians()) + &second.unwrap_or_default());
        }
        None => lines.push("azimuth not determined: needs the latitude, and an apparent drift below the horizontal Earth rate".to_owned()),
    }
    if found.own_rad_s.iter().all(|estimate| estimate.sigma.is_none()) {
        lines.push("no uncertainty: needs two cycles of each sequence in each position".to_owned());
    }
    for (axis, inequality) in axes.iter().zip(&found.inequality) {
        let excess = inequality.excess;
        let percent = Estimate { value: 100.0 * excess.value, sigma: excess.sigma.map(|sigma| 100.0 * sigma) };
        lines.push(line(&format!("by two amplitudes, corrected: negative pulses{axis} stronger by"), "%", &percent, 1.0));
    }
    if let Some(fit) = &found.position_fit {
        for (estimate, axis) in fit.g_dependent.iter().zip(["sensitive", "output", "spin"]) {
            lines.extend(estimate.as_ref().map(|estimate| line(&format!("drift by g along the {axis} axis"), "°/h/g", estimate, DEG_H)));
        }
    }
    lines
}

/// The cycles that are not used, with the reason.
pub(super) fn defect_lines(measurement: &Measurement) -> Vec<String> {
    let defective = measurement.cycles.iter().filter_map(|cycle| cycle.defect.as_ref().map(|found| (cycle, defect(found))));
    defective.map(|(cycle, defect)| format!("cycle {} at {} s is not used: {defect}", cycle.number, plain(cycle.start_s, 5))).collect()
}

/// The result of a measurement.
pub fn text(result: &DriftResult) -> String {
    let m = &result.measurement;
    let valid = m.valid_cycles();
    let pulse_s = valid.first().map_or(0.0, |cycle| cycle.integral.pulse_s);
    let mut out = format!("{}: {} of {} cycles used, pulses of {} s\n", m.name, valid.len(), m.cycles.len(), plain(pulse_s, 5));
    for line in drift_lines(&result.corrected) {
        out += &format!("  {line}\n");
    }
    if let Some(rate_rad_s) = result.reference_rad_s {
        out += &format!("  torquer rate by the unswitched sums {} °/s\n", significant(rate_rad_s.to_degrees(), 5));
    }
    out += "without corrections:\n";
    for line in drift_lines(&result.uncorrected) {
        out += &format!("  {line}\n");
    }
    for line in defect_lines(m).into_iter().chain(m.warnings.iter().map(warning)) {
        out += &format!("{line}\n");
    }
    out
}

/// Advice on the pulse duration.
pub fn advice_text(log: &str, advice: &PulseAdvice) -> String {
    let mut out = String::new();
    let pulse_s = plain(advice.pulse_s, 5);
    if advice.period_s > 0.0 {
        let [error, wanted_error] = advice.line_error_rad_s.map(|rad_s| significant(rad_s / DEG_H, 3));
        out += &format!("{log}: pulses of {pulse_s} s, {} periods of {} s\n", advice.periods, plain(advice.period_s, 5));
        out += &format!("  greatest error of a cycle by all lines: {error} °/h; with the wanted duration {wanted_error} °/h\n");
    } else {
        out += &format!("{log}: no line exceeds the noise; pulses of {pulse_s} s are suitable\n");
    }
    out += &format!("  standard deviation of a cycle by noise: {} °/h\n", significant(advice.noise_rad_s / DEG_H, 3));
    for line in &advice.lines {
        out += &format!("  line at {} Hz, amplitude {}″\n", significant(line.frequency_Hz, 4), significant(line.amplitude_rad / DEG_H, 3));
    }
    out
}

/// Bias and scale of a rate gyro on the platform.
pub fn platform_text(log: &str, result: &PlatformResult) -> String {
    let shown = |estimate: Estimate| match estimate.sigma {
        Some(sigma) => with_sigma(estimate.value, sigma),
        None => significant(estimate.value, 7),
    };
    let label = |estimate: Estimate| if estimate.sigma.is_some() { " (1σ)" } else { "" };
    format!(
        "{log}: {} cycles\n  bias  {} rad/s{}\n  scale {}{}\n",
        result.cycles.len(),
        shown(result.bias_rad_s),
        label(result.bias_rad_s),
        shown(result.scale),
        label(result.scale)
    )
}
