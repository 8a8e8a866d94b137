//! Clocks: times of day, counts since 1970, timers that overflow, runs that are joined.

use super::{ForeignFile, ROWS, Rows, file};

const UIW: &[(&str, f64)] = &[("u_V", 1e-5), ("i_A", 1e-5), ("omega_rad_s", 1e-5)];

pub(super) fn files(r: &Rows) -> Vec<ForeignFile> {
    let rest = |k: usize| format!("{:.7},{:.7},{:.6}", r.u(k), r.i(k), r.rpm(k));
    let ms = |k: usize| (1e3 * r.t(k)).round() as u64;
    let named = "voltage_V,current_A,speed_rpm\n";
    let clock = |ms: u64| format!("{:02}:{:02}:{:02}.{:03}", ms / 3_600_000 % 24, ms / 60_000 % 60, ms / 1000 % 60, ms % 1000);
    let epoch = |name: &'static str, label: &str, time: &dyn Fn(usize) -> String| {
        file(name, r.text(&format!("{label},{named}"), |k| format!("{},{}", time(k), rest(k))), &[], UIW)
    };
    vec![
        epoch("time_of_day.csv", "Time", &|k| clock(43_200_000 + ms(k))),
        ForeignFile { said: "midnight", ..epoch("midnight.csv", "Time", &|k| clock(86_399_000 + ms(k))) },
        epoch("minutes.csv", "Time", &|k| {
            format!("{:02}:{:02}.{:03}", (58_500 + ms(k)) / 60_000, (58_500 + ms(k)) / 1000 % 60, (58_500 + ms(k)) % 1000)
        }),
        epoch("epoch_s.csv", "timestamp", &|k| format!("{:.6}", 1.7145576e9 + r.t(k))),
        epoch("epoch_ms.csv", "timestamp", &|k| format!("{}", 1_714_557_600_000 + ms(k))),
        epoch("epoch_us.csv", "timestamp", &|k| format!("{}", 1_714_557_600_000_000 + 1000 * ms(k))),
        epoch("epoch_ns.csv", "timestamp", &|k| format!("{}", 1_714_557_600_000_000_000 + 1_000_000 * ms(k))),
        ForeignFile {
            said: "overflow",
            stated: &["--unit", "millis=ms"],
            ..epoch("millis_wrap.csv", "millis", &|k| format!("{}", (4_294_966_000 + ms(k)) % (1 << 32)))
        },
        ForeignFile {
            said: "overflow",
            ..epoch("micros_wrap.csv", "micros", &|k| format!("{}", (4_294_000_000 + 1000 * ms(k)) % (1 << 32)))
        },
        ForeignFile { said: "restart", rows: (0, 1500), ..epoch("two_runs.csv", "t_ms", &|k| format!("{}", ms(k % 1500))) },
        ForeignFile { said: "restart", rows: (0, 1500), ..file("two_runs_with_headers.csv", two_runs(r), &[], UIW) },
    ]
}

/// Two files copied one after the other, each with its header.
fn two_runs(r: &Rows) -> String {
    let header = "t_ms,voltage_V,current_A,speed_rpm\n";
    let line = |k: usize| format!("{:.3},{:.7},{:.7},{:.6}\n", 1e3 * r.t(k % 1500), r.u(k), r.i(k), r.rpm(k));
    (0..ROWS).fold(String::new(), |text, k| text + if k % 1500 == 0 { header } else { "" } + &line(k))
}
