//! Torque periodic in the angle, by harmonic order, from slow turns under rate control.
//!
//! T_n = J Ω′ − K i for harmonic order n (periods per turn). At a nearly constant rate Ω′ = −(n Ω)² Θ_n, where Θ_n is the ripple of the
//! angle.

use super::fitted_drive::Drive;
use super::reading_contributions;
use crate::calibrate::{AbsenceReason, Basis, Curve, CurveKind, Findings, Meaning, Remark, Step};
use crate::calibrate::{Contribution, Quantity};
use identification::statistics::robust::median;
use stand_acquire::calibration_session::Session;
use std::f64::consts::TAU;

/// Highest harmonic order analysed.
const MAX_ORDER: usize = 72;
/// Detection limit in standard uncertainties.
const DETECTION_SIGMAS: f64 = 6.0;
/// Smallest fraction of the largest harmonic: sampling of a ripple makes harmonics of that size.
const MIN_FRACTION: f64 = 0.02;
/// Harmonics that go into the model.
const MODEL_HARMONICS: usize = 3;
/// Harmonics that are reported.
const REPORTED_HARMONICS: usize = 8;
/// Fewest whole turns.
const MIN_TURNS: usize = 3;

/// Torque re sin nθ + im cos nθ of one harmonic order, N m.
#[derive(Clone, Copy)]
struct Harmonic {
    order: usize,
    re: f64,
    im: f64,
    /// Standard uncertainty by the scatter from turn to turn, N m.
    u: f64,
    /// Part that follows from the ripple of the rate and the inertia, N m.
    by_inertia: f64,
}

impl Harmonic {
    fn amplitude(&self) -> f64 {
        self.re.hypot(self.im)
    }
}

/// The harmonics of slow turns.
struct Spectrum {
    all: Vec<Harmonic>,
    /// Median standard uncertainty of all harmonics, N m: that of one harmonic over few turns is itself uncertain.
    level: f64,
    turns: usize,
}

impl Spectrum {
    /// Detected harmonics, largest first.
    fn detected(&self) -> Vec<Harmonic> {
        let is_significant = |h: &&Harmonic| h.amplitude() > DETECTION_SIGMAS * h.u.max(self.level);
        let mut detected: Vec<Harmonic> = self.all.iter().filter(is_significant).copied().collect();
        detected.sort_by(|a, b| b.amplitude().total_cmp(&a.amplitude()));
        let smallest = MIN_FRACTION * detected.first().map_or(0.0, Harmonic::amplitude);
        detected.retain(|h| h.amplitude() > smallest);
        detected
    }
}

fn slow_turn(steps: &[Step]) -> Option<&Step> {
    let is_slow =
        |s: &&Step| s.log.note("profile") == Some("constant") && s.log.note("mode") == Some("rate") && s.log.note("drive_s").is_none();
    steps.iter().find(is_slow)
}

fn spectrum(step: &Step, drive: &Drive, session: &Session) -> Result<Spectrum, AbsenceReason> {
    let (Some(theta), Some(i_A)) = (step.log.column("theta_rad"), step.log.column("i_A")) else {
        return Err(AbsenceReason::NeedsAngleAndCurrent);
    };
    let t_s = step.log.t_s();
    let from = t_s.partition_point(|t| *t < t_s[0] + session.settle_s);
    let angle = theta.last().map_or(0.0, |last| last - theta[from]);
    let turns = (angle.abs() / TAU).floor() as usize;
    if turns < MIN_TURNS {
        return Err(AbsenceReason::TooFewTurns { turns });
    }
    // Turn by turn: the mean is the harmonic, the scatter its uncertainty.
    let sign = angle.signum();
    let bounds: Vec<usize> = (0..=turns)
        .map(|n| (from..theta.len()).find(|k| (theta[*k] - theta[from]) * sign >= n as f64 * TAU).unwrap_or(theta.len() - 1))
        .collect();
    let (k, j) = (drive.motor_constant_N_m_A.0, drive.inertia_kg_m2.0);
    let mut all: Vec<Harmonic> = Vec::new();
    for order in 1..=MAX_ORDER {
        let n = order as f64;
        let phasors: Vec<[f64; 4]> = bounds
            .windows(2)
            .map(|w| {
                let rows = w[0]..w[1];
                let count = rows.len() as f64;
                let rate = (theta[w[1]] - theta[w[0]]) / (t_s[w[1]] - t_s[w[0]]);
                let acceleration = (n * rate).powi(2);
                let mean_i = i_A[rows.clone()].iter().sum::<f64>() / count;
                let mut sums = [0.0; 4];
                for row in rows {
                    let ripple = theta[row] - theta[w[0]] - rate * (t_s[row] - t_s[w[0]]);
                    let (motor, inertia) = (-k * (i_A[row] - mean_i), -j * acceleration * ripple);
                    let (sin, cos) = (n * theta[row]).sin_cos();
                    let each = [(motor + inertia) * sin, (motor + inertia) * cos, inertia * sin, inertia * cos];
                    for (sum, part) in sums.iter_mut().zip(each) {
                        *sum += 2.0 / count * part;
                    }
                }
                sums
            })
            .collect();
        let m = phasors.len() as f64;
        let [re, im, of_re, of_im] = [0, 1, 2, 3].map(|k| phasors.iter().map(|p| p[k]).sum::<f64>() / m);
        let spread: f64 = phasors.iter().map(|p| (p[0] - re).powi(2) + (p[1] - im).powi(2)).sum();
        let u = (spread / (2.0 * (m - 1.0)) / m).sqrt();
        all.push(Harmonic { order, re, im, u, by_inertia: of_re.hypot(of_im) });
    }
    let level = median(all.iter().map(|h| h.u)).unwrap_or(f64::NAN);
    Ok(Spectrum { all, level, turns })
}

/// The largest harmonics, for the model of the drive: harmonic order, amplitude, N m, phase, rad.
pub(super) fn strongest(steps: &[Step], drive: &Drive, session: &Session) -> Vec<(usize, f64, f64)> {
    let found = slow_turn(steps).and_then(|step| spectrum(step, drive, session).ok());
    let detected = found.map(|found| found.detected()).unwrap_or_default();
    detected.iter().take(MODEL_HARMONICS).map(|h| (h.order, h.amplitude(), h.im.atan2(h.re).rem_euclid(TAU))).collect()
}

/// Adds the detected harmonics.
pub(super) fn add(steps: &[Step], drive: Option<&Drive>, session: &Session, findings: &mut Findings) {
    let (Some(step), Some(drive)) = (slow_turn(steps), drive) else {
        return findings.add_absent("cogging_N_m", AbsenceReason::NeedsSlowTurns);
    };
    let found = match spectrum(step, drive, session) {
        Ok(found) => found,
        Err(reason) => return findings.add_absent("cogging_N_m", reason),
    };
    if !step.log.theta_zero_is_index() {
        findings.remarks.push(Remark::NoIndex);
    }
    let detected = found.detected();
    if detected.is_empty() {
        let limit_N_m = DETECTION_SIGMAS * found.level;
        findings.add_absent("cogging_N_m", AbsenceReason::NoHarmonic { highest_order: MAX_ORDER, limit_N_m });
    }
    let (k, j) = (drive.motor_constant_N_m_A, drive.inertia_kg_m2);
    for h in detected.into_iter().take(REPORTED_HARMONICS) {
        let value = h.amplitude();
        let dof = 2.0 * (found.turns as f64 - 1.0);
        let mut contributions = vec![
            Contribution::type_a("turn to turn", h.u.max(found.level), dof, Basis::Turns { count: found.turns }),
            Contribution::type_b("motor constant", k.1 / k.0, "1", value, Basis::ModelFit),
            Contribution::type_b("inertia", j.1 / j.0, "1", h.by_inertia, Basis::ModelFitOnRipple),
        ];
        contributions.extend(reading_contributions(session, value, [1, 1]));
        let phase_rad = h.im.atan2(h.re).rem_euclid(TAU);
        findings.quantities.push(
            Quantity::new(&format!("order_{}_N_m", h.order), "N m", value, contributions)
                .meaning(Meaning::HarmonicTorque { harmonic_order: h.order, phase_rad }),
        );
    }
    findings.curves.push(Curve::new(
        CurveKind::TorqueSpectrum,
        found.all.iter().map(|h| (h.order as f64, h.amplitude())).collect(),
        found.all.iter().map(|h| (h.order as f64, DETECTION_SIGMAS * h.u.max(found.level))).collect(),
    ));
}
