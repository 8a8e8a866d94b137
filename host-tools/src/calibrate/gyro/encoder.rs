//! Error of the stand's encoder within a turn, of harmonic order 1 (eccentricity of the disc), with the device under test as the reference.
//!
//! Input: runs of whole turns of both signs at constant rate. In each turn the integral of the output is scaled so that the turn closes (2π by both): scale and
//! bias of the device drop out. What remains is the error of the encoder, minus the integral of what changes the output with the angle: the Earth's rotation
//! and gravity on a tilted stand. The integral over the time of a turn changes its sign with the sense of rotation, the error of the encoder does not: the mean of
//! both senses is the encoder's, to the lag of the device in the second order. Output: the coefficients of cos θ and sin θ, θ counted from the zero of the
//! encoder, and the largest amplitude that they allow for.

use super::{GyroSettings, dut_output};
use crate::calibrate::{AbsenceReason, Basis, Contribution, Findings, Meaning, Quantity, Step};
use crate::log::Log;
use crate::statistics::Extremes;
use std::f64::consts::TAU;

/// Fraction of the greatest setpoint from which the rate is constant, and the settling time, s.
const CONSTANT_FRACTION: f64 = 0.999_9;
const SETTLING_S: f64 = 0.2;
/// Fewest rows of a turn.
const MIN_ROWS: usize = 64;
/// Fewest turns of each sense.
const MIN_TURNS: usize = 3;

/// Coefficients of cos θ and sin θ by one turn, rad.
type TurnError = [f64; 2];

/// Adds the error of the encoder to the findings. Returns the greatest amplitude that it allows for, rad.
pub(super) fn add(steps: &[&Step], settings: &GyroSettings, findings: &mut Findings) -> Option<f64> {
    let mut senses: [Vec<TurnError>; 2] = Default::default();
    for step in steps.iter().filter(|step| step.log.note("profile") == Some("turns")) {
        if let Some(output) = dut_output(&step.log, settings) {
            add_turns(&step.log, output, &mut senses);
        }
    }
    if senses.iter().any(|turns| turns.len() < MIN_TURNS) {
        findings.add_absent("encoder_cosine_rad", AbsenceReason::NeedsWholeTurns { incomplete: 0 });
        findings.add_absent("encoder_sine_rad", AbsenceReason::NeedsWholeTurns { incomplete: 0 });
        return None;
    }
    let count = senses.iter().map(Vec::len).sum::<usize>();
    let dof = count as f64 - 2.0;
    let mut greatest = 0.0_f64;
    for (k, name) in ["encoder_cosine_rad", "encoder_sine_rad"].into_iter().enumerate() {
        let means = senses.each_ref().map(|turns| turns.iter().map(|turn| turn[k]).sum::<f64>() / turns.len() as f64);
        let squares: f64 = senses.iter().zip(means).flat_map(|(turns, mean)| turns.iter().map(move |turn| (turn[k] - mean).powi(2))).sum();
        let u = 0.5 * (squares / dof * senses.iter().map(|turns| 1.0 / turns.len() as f64).sum::<f64>()).sqrt();
        let value = 0.5 * (means[0] + means[1]);
        let quantity = Quantity::new(name, "rad", value, vec![Contribution::type_a("noise", u, dof, Basis::Turns { count })]);
        greatest = greatest.hypot(value.abs() + quantity.expanded_u());
        findings.quantities.push(quantity.meaning(Meaning::EncoderEccentricity));
    }
    Some(greatest)
}

/// Adds the whole turns of a log at constant rate.
fn add_turns(log: &Log, output: &[f64], senses: &mut [Vec<TurnError>; 2]) {
    let (Some(theta), Some(setpoint)) = (log.column("theta_rad"), log.column("rate_cmd_rad_s")) else { return };
    let t_s = log.t_s();
    let greatest = setpoint.iter().copied().max_abs();
    for segment in log.segments() {
        let is_constant = |k: usize| setpoint[k].abs() > CONSTANT_FRACTION * greatest;
        let Some(first) = segment.clone().find(|k| is_constant(*k)) else { continue };
        let end = (first..segment.end).find(|k| !is_constant(*k)).unwrap_or(segment.end);
        let Some(mut from) = (first..end).find(|k| t_s[*k] - t_s[first] >= SETTLING_S) else { continue };
        while let Some(to) = (from..end).find(|k| (theta[*k] - theta[from]).abs() >= TAU) {
            if to - from >= MIN_ROWS {
                let sense = usize::from(theta[to] < theta[from]);
                senses[sense].push(turn_error(&t_s[from..=to], &theta[from..=to], &output[from..=to]));
            }
            from = to;
        }
    }
}

/// Error of the encoder in one turn.
fn turn_error(t_s: &[f64], theta: &[f64], output: &[f64]) -> TurnError {
    let mut integral = vec![0.0; theta.len()];
    for k in 1..theta.len() {
        integral[k] = integral[k - 1] + 0.5 * (output[k] + output[k - 1]) * (t_s[k] - t_s[k - 1]);
    }
    let last = theta.len() - 1;
    let per_output = (theta[last] - theta[0]) / integral[last];
    // Over equal steps of the time, that is of the angle; both ends are one direction.
    let (mut cosine, mut sine) = (0.0, 0.0);
    for k in 0..last {
        let error = theta[k] - theta[0] - per_output * integral[k];
        cosine += error * theta[k].cos();
        sine += error * theta[k].sin();
    }
    [2.0 * cosine / last as f64, 2.0 * sine / last as f64]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::Mounting;
    use crate::log::{Column, Note, Notes};
    use hal_sim::peripherals::Noise;

    /// Ten turns of a platform whose encoder shows θ + c cos θ + s sin θ, and whose device also sees a rate of the base of 1e-3 rad/s.
    fn run(rate_rad_s: f64, error: [f64; 2], seed: u64) -> Step {
        let mut noise = Noise::new(seed, 0, 2e-3);
        let rows = 8000;
        let t_s: Vec<f64> = (0..rows).map(|k| f64::from(k) * 1e-3).collect();
        let angle = |t: f64| rate_rad_s * t + 0.4;
        let theta = t_s.iter().map(|t| angle(*t) + error[0] * angle(*t).cos() + error[1] * angle(*t).sin()).collect();
        let output = t_s.iter().map(|t| 1.01 * (rate_rad_s + 1e-3 * angle(*t).cos()) + 0.02 + noise.draw()).collect();
        let setpoint = vec![rate_rad_s; t_s.len()];
        let columns = [("t_s", t_s), ("theta_rad", theta), ("gyro_rad_s", output), ("rate_cmd_rad_s", setpoint)];
        let columns = columns.into_iter().map(|(name, values)| Column { name: name.to_owned(), values }).collect();
        let notes = Notes::from_iter([Note::Profile("turns".to_owned())]);
        let log = Log::new("turns.csv", columns, notes).unwrap();
        Step { name: "turns".to_owned(), log, mounting: Mounting::default(), added_inertia_kg_m2: None }
    }

    fn findings(error: [f64; 2], seed: u64, rates: &[f64]) -> (Findings, Option<f64>) {
        let steps: Vec<Step> = rates.iter().enumerate().map(|(k, rate)| run(*rate, error, 10 * seed + k as u64)).collect();
        let mut findings = Findings::default();
        let amplitude = add(&steps.iter().collect::<Vec<_>>(), &GyroSettings::default(), &mut findings);
        (findings, amplitude)
    }

    /// The rate of the base alone would be an error of 1.2e-4 rad in one sense of rotation.
    #[test]
    fn both_senses_separate_the_encoder_from_the_base() {
        let truth = [1e-4, -2e-4];
        let mut covered = 0;
        for seed in 0..40 {
            let (findings, amplitude) = findings(truth, seed, &[8.0, -8.0, -8.0, 8.0]);
            let quantities = ["encoder_cosine_rad", "encoder_sine_rad"].map(|name| findings.get(name).unwrap().clone());
            for (quantity, truth) in quantities.iter().zip(truth) {
                covered += u32::from((quantity.value - truth).abs() <= quantity.expanded_u());
                assert!(quantity.expanded_u() < 3e-5, "{quantity:?}");
            }
            let amplitude = amplitude.unwrap();
            assert!(amplitude > 2.236e-4 - 2e-5 && amplitude < 2.8e-4, "{amplitude}");
        }
        // 95 % of 80 less three standard errors.
        assert!(covered >= 70, "{covered}");
    }

    #[test]
    fn one_sense_of_rotation_does_not_suffice() {
        let (findings, amplitude) = findings([0.0; 2], 1, &[8.0, 8.0]);
        assert!(amplitude.is_none() && findings.get("encoder_sine_rad").is_none() && findings.absent.len() == 2);
    }
}
