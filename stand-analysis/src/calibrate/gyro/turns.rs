//! Scale from whole turns: the integral of the output over a run that begins and ends at rest, against the angle turned.
//!
//! ∫y dt = s·Δθ + b·T + c₂·∫Ω² dt, with output y, scale s, angle Δθ, bias b, duration T and even term c₂. Neither a plateau nor settling is
//! needed. Bias and even term contribute equally to two opposite runs of the same profile, and so cancel in the scale. An odd term does
//! not: the scale is the mean over the rates of the runs, s + c₃ ∫|Ω|³ dt/∫|Ω| dt.

use super::influences::{clock, misalignment, misalignment_factor};
use super::{GyroSettings, dut_output};
use crate::calibrate::{AbsenceReason, Basis, Findings, Meaning, Remark, Step};
use crate::calibrate::{Contribution, Quantity};
use identification::statistics::Extremes;
use identification::statistics::least_squares;

/// Longest gap bridged by the integral, s: the error of linear interpolation over 20 ms is at most 1e-6 of ten turns.
const MAX_GAP_S: f64 = 0.02;

/// Adds the scale from whole turns to the findings.
pub(super) fn add(steps: &[&Step], settings: &GyroSettings, findings: &mut Findings) {
    let logs = steps.iter().filter(|s| s.log.note("profile") == Some("turns")).map(|s| &s.log);
    let (mut rows, mut integrals) = (Vec::new(), Vec::new());
    let (mut incomplete, mut greatest_rate) = (0, 0.0_f64);
    for log in logs {
        let (Some(output), Some(theta)) = (dut_output(log, settings), log.column("theta_rad")) else { continue };
        let (t_s, n) = (log.t_s(), log.len());
        if t_s.windows(2).any(|pair| pair[1] - pair[0] > MAX_GAP_S) {
            incomplete += 1;
            continue;
        }
        let integral: f64 = (1..n).map(|k| 0.5 * (output[k] + output[k - 1]) * (t_s[k] - t_s[k - 1])).sum();
        rows.push(vec![theta[n - 1] - theta[0], t_s[n - 1] - t_s[0]]);
        integrals.push(integral);
        greatest_rate = greatest_rate.max(log.column("rate_cmd_rad_s").map_or(0.0, |rate| rate.iter().copied().max_abs()));
    }
    // Runs in both directions are needed, each of more than 1 rad.
    let Some(fit) = least_squares(&rows, &integrals).filter(|_| rows.iter().any(|r| r[0] > 1.0) && rows.iter().any(|r| r[0] < -1.0)) else {
        return findings.add_absent("scale_whole_turns", AbsenceReason::NeedsWholeTurns { incomplete });
    };
    if incomplete > 0 {
        findings.remarks.push(Remark::IncompleteTurns { left_out: incomplete, total: incomplete + rows.len() });
    }
    let assumed = &settings.assumptions;
    let factor = misalignment_factor(assumed);
    let scale = fit.coefficients[0] * factor;
    let basis = Basis::WholeTurnRuns { count: rows.len() };
    let repeatability = Contribution::type_a("noise and repeatability", fit.sigma(0) * factor, fit.dof, basis);
    // The clock does not affect the angle; its relative frequency error is that of the integral, and so of the scale.
    let contributions = vec![repeatability, clock(assumed, scale), misalignment(assumed, -scale)];
    let meaning = Meaning::WholeTurnScale { greatest_rad_s: greatest_rate };
    findings.quantities.push(Quantity::new("scale_whole_turns", "1", scale, contributions).meaning(meaning));
}
