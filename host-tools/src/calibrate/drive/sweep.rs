//! Frequency response from voltage to rate, along a chirp; its corner is the mechanical time constant seen another way.

use crate::calibrate::gyro::along_chirp;
use crate::calibrate::lock_in::Response;
use crate::calibrate::response::transfer;
use crate::calibrate::session::Session;
use crate::calibrate::{Curve, Findings, Step};
use crate::uncertainty::{Part, Quantity};

/// Adds what the sweep shows.
pub(super) fn add(steps: &[Step], _session: &Session, findings: &mut Findings) {
    let name = "drive_bandwidth_Hz";
    let chirp = steps.iter().find(|s| s.log.note("profile") == Some("chirp") && s.log.note("mode") == Some("voltage"));
    let Some(step) = chirp else { return findings.lacks(name, "it takes a chirp in voltage mode") };
    let (Some(u_V), Some(theta)) = (step.log.column("u_V"), step.log.column("theta_rad")) else { return };
    // Voltage over rate; turned over, rate over voltage. The voltage is held over its row: half a row late.
    let half_s: Vec<f64> = vec![-0.5 * step.log.median_dt_s(); step.log.len()];
    let found: Vec<Response> = along_chirp(&step.log, theta, u_V, Some(&half_s)).into_iter().map(inverse).collect();
    let Some(h) = transfer(&found) else { return findings.lacks(name, "the chirp gave too few frequencies: let it last longer") };
    if let Some((value, u)) = h.bandwidth_Hz() {
        let part = Part::measured("noise", u, h.dof, format!("{} frequencies", found.len()));
        findings.quantities.push(
            Quantity::new(name, "Hz", value, vec![part])
                .saying(format!("voltage to rate, where the gain has fallen by 3 dB; {}", h.order.says())),
        );
    } else {
        findings.lacks(name, "no fall by 3 dB is in sight: begin the chirp at a lower frequency");
    }
    let (low, high) = (found.first().map_or(1.0, |r| r.frequency_Hz), found.last().map_or(1.0, |r| r.frequency_Hz));
    let grid: Vec<f64> = (0..=100).map(|k| low * (high / low).powf(f64::from(k) / 100.0)).collect();
    let curve = |title: &str, y: &str, points: Vec<(f64, f64)>, line: Vec<(f64, f64)>| Curve {
        title: title.into(),
        x: "frequency, Hz".into(),
        y: y.into(),
        is_log: true,
        points,
        line,
        ..Curve::default()
    };
    let dB = |x: f64| 20.0 * x.max(1e-12).log10();
    findings.curves.push(curve(
        "Frequency response, voltage to rate: gain",
        "gain, dB re 1 rad/s/V",
        found.iter().map(|r| (r.frequency_Hz, dB(r.gain()))).collect(),
        grid.iter().map(|f| (*f, dB(h.at(*f).norm()))).collect(),
    ));
    findings.curves.push(curve(
        "Frequency response, voltage to rate: phase",
        "phase, °",
        found.iter().map(|r| (r.frequency_Hz, r.phase_rad().to_degrees())).collect(),
        grid.iter().map(|f| (*f, h.at(*f).arg().to_degrees())).collect(),
    ));
}

fn inverse(r: Response) -> Response {
    let size = r.re * r.re + r.im * r.im;
    Response { re: r.re / size, im: -r.im / size, sigma: r.sigma / size, ..r }
}
