//! The method of whole turns: the integral of what the gyro shows over turns that begin and end at rest at the same angle, beside the angle.
//!
//! ∫y dt = s·Δθ + b·T + c₂·∫Ω² dt: needs no plateau and no settling; the bias, and what grows with the rate's square, fall out of a pair of opposite turns.

use super::{Given, samples};
use crate::calibrate::{Findings, Step};
use crate::statistics::least_squares;
use crate::statistics::uncertainty::{Part, Quantity};

/// Over rows that were lost for longer, an integral is no longer one, s: a straight line over 20 ms errs by a millionth of ten turns at the most.
const LONGEST_GAP_S: f64 = 0.02;

/// Adds the scale by whole turns.
pub(super) fn add(steps: &[&Step], given: &Given, findings: &mut Findings) {
    let logs = steps.iter().filter(|s| s.log.note("profile") == Some("turns")).map(|s| &s.log);
    let (mut rows, mut sums) = (Vec::new(), Vec::new());
    let mut torn = 0;
    for log in logs {
        let (Some(shown), Some(theta)) = (samples(log, given), log.column("theta_rad")) else { continue };
        let (t_s, n) = (log.t_s(), log.len());
        if t_s.windows(2).any(|pair| pair[1] - pair[0] > LONGEST_GAP_S) {
            torn += 1;
            continue;
        }
        let sum: f64 = (1..n).map(|k| 0.5 * (shown[k] + shown[k - 1]) * (t_s[k] - t_s[k - 1])).sum();
        rows.push(vec![theta[n - 1] - theta[0], t_s[n - 1] - t_s[0]]);
        sums.push(sum);
    }
    let Some(fit) = least_squares(&rows, &sums).filter(|_| rows.iter().any(|r| r[0] > 1.0) && rows.iter().any(|r| r[0] < -1.0)) else {
        let of_torn = if torn > 0 { format!("; {torn} had lost rows in their middle") } else { String::new() };
        let why = format!("it takes three whole runs of whole turns or more, of both signs (profile turns){of_torn}");
        return findings.lacks("scale_whole_turns", why);
    };
    if torn > 0 {
        findings.says.push(format!("{torn} of {} runs of whole turns had lost rows in their middle, and are left out", torn + rows.len()));
    }
    let says = format!("scatter of {} runs", rows.len());
    let scale = fit.coefficients[0];
    let part = Part::measured("noise and repeatability", fit.sigma(0), fit.dof, says);
    // An angle needs no clock: what the crystal is off, it is off in the integral; the encoder's turn is a turn.
    let clock = Part::within("clock", given.known.crystal_ppm * 1e-6, "1", scale, format!("crystal, ± {} ppm", given.known.crystal_ppm));
    findings.quantities.push(
        Quantity::new("scale_whole_turns", "1", scale, vec![part, clock]).saying("by the integral over whole turns, beside the plateaus"),
    );
}
