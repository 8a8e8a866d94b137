//! Error of the stand's encoder within a turn, of harmonic orders 1 (eccentricity of the disc) to [`HIGHEST_ORDER`], with the device under
//! test as the reference.
//!
//! Input: runs of whole turns of both signs at constant rate. In each turn the integral of the output is scaled so that the turn closes (2π
//! by both): scale and bias of the device drop out. What remains is the error of the encoder, minus the integral of what changes the output
//! with the angle: the Earth's rotation and gravity on a tilted stand. The integral over the time of a turn changes its sign with the sense
//! of rotation, the error of the encoder does not: the mean of both senses is the encoder's, to the lag of the device in the second order.
//! Output: the coefficients of cos nθ and sin nθ, θ counted from the zero of the encoder, for order 1 and each higher order that is
//! significant, and the amplitudes for the budgets.

use super::{GyroSettings, dut_output};
use crate::calibrate::{AbsenceReason, Basis, Contribution, Findings, Meaning, Quantity, Step};
use identification::log::Log;
use identification::statistics::Extremes;
use std::f64::consts::TAU;

/// Fraction of the greatest setpoint from which the rate is constant, and the settling time, s.
const CONSTANT_FRACTION: f64 = 0.999_9;
const SETTLING_S: f64 = 0.2;
/// Fewest rows of a turn.
const MIN_ROWS: usize = 64;
/// Fewest turns of each sense.
const MIN_TURNS: usize = 3;

/// Highest harmonic order.
pub const HIGHEST_ORDER: usize = 8;
/// Probability that noise shows any order above 1.
const FAMILYWISE_SIGNIFICANCE: f64 = 0.01;

/// Coefficients of cos nθ and sin nθ by one turn, rad; order 1 first.
type TurnError = [[f64; 2]; HIGHEST_ORDER];

/// Amplitudes of the encoder's error for the budgets, rad; order 1 first.
///
/// Order 1: the greatest that its coefficients and their U allow for. Higher orders: the amplitude of the estimated coefficients, whose
/// mean square is that of the encoder plus the variance of the coefficients, whether they are significant or not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct EncoderAmplitudes(pub(super) [f64; HIGHEST_ORDER]);

impl EncoderAmplitudes {
    /// Amplitude of all orders together, rad.
    pub(super) fn total_rad(&self) -> f64 {
        self.0.iter().map(|a| a * a).sum::<f64>().sqrt()
    }

    /// Standard deviation of the difference of two errors whose angles differ by this, at an unknown angle, rad: √(Σ (√2 aₙ sin(n Δθ/2))²).
    pub(super) fn difference_rad(&self, angle_rad: f64) -> f64 {
        let orders = self.0.iter().enumerate();
        orders.map(|(k, a)| 2.0 * (a * (0.5 * (k + 1) as f64 * angle_rad).sin()).powi(2)).sum::<f64>().sqrt()
    }
}

/// One order by both senses.
struct Order {
    /// Coefficients of cos nθ and sin nθ and their standard uncertainties, rad.
    coefficients: [(f64, f64); 2],
    /// Half the difference of both senses: lag of the device and what changes its output with the angle, rad.
    half_difference_rad: f64,
    dof: f64,
}

impl Order {
    fn new(senses: &[Vec<TurnError>; 2], order: usize) -> Self {
        let dof = senses.iter().map(Vec::len).sum::<usize>() as f64 - 2.0;
        let of = |k: usize| {
            let value = |turn: &TurnError| turn[order - 1][k];
            let means = senses.each_ref().map(|turns| turns.iter().map(value).sum::<f64>() / turns.len() as f64);
            let squares: f64 =
                senses.iter().zip(means).flat_map(|(turns, mean)| turns.iter().map(move |turn| (value(turn) - mean).powi(2))).sum();
            let u = 0.5 * (squares / dof * senses.iter().map(|turns| 1.0 / turns.len() as f64).sum::<f64>()).sqrt();
            (means, u)
        };
        let both = [of(0), of(1)];
        Self {
            coefficients: both.map(|(means, u)| (0.5 * (means[0] + means[1]), u)),
            half_difference_rad: both.iter().map(|(means, _)| (0.5 * (means[0] - means[1])).powi(2)).sum::<f64>().sqrt(),
            dof,
        }
    }

    fn amplitude_rad(&self) -> f64 {
        self.coefficients[0].0.hypot(self.coefficients[1].0)
    }

    /// Probability of these coefficients by noise: F distribution with 2 and ν degrees of freedom, (1 + 2 F/ν)^(−ν/2).
    fn probability_by_noise(&self) -> f64 {
        let f: f64 = self.coefficients.iter().map(|(value, u)| (value / u).powi(2)).sum::<f64>() / 2.0;
        (1.0 + 2.0 * f / self.dof).powf(-0.5 * self.dof)
    }

    /// Half-width of the error by the lag φ of the device, rad: the senses have the amplitudes a cos φ and ± a sin φ, so 1 − cos φ is half
    /// the square of their ratio.
    fn lag_rad(&self) -> f64 {
        0.5 * self.half_difference_rad * self.half_difference_rad / self.amplitude_rad()
    }
}

/// Adds the error of the encoder to the findings. Returns its amplitudes for the budgets.
pub(super) fn add(steps: &[&Step], settings: &GyroSettings, findings: &mut Findings) -> Option<EncoderAmplitudes> {
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
    let basis = Basis::Turns { count: senses.iter().map(Vec::len).sum() };
    let amplitudes = std::array::from_fn(|k| {
        let (order, found) = (k + 1, Order::new(&senses, k + 1));
        let is_first = order == 1;
        let threshold = FAMILYWISE_SIGNIFICANCE / (HIGHEST_ORDER - 1) as f64;
        let is_reported = is_first || found.probability_by_noise() < threshold;
        let quantities = ["cosine", "sine"].into_iter().zip(found.coefficients).map(|(name, (value, u))| {
            let mut contributions = vec![Contribution::type_a("noise", u, found.dof, basis.clone())];
            if !is_first {
                contributions.push(Contribution::rectangular("lag of the device", found.lag_rad(), "rad", 1.0, Basis::LagBySenses));
            }
            let name = if is_first { format!("encoder_{name}_rad") } else { format!("encoder_{name}_{order}_rad") };
            Quantity::new(&name, "rad", value, contributions).meaning(Meaning::EncoderHarmonic { harmonic_order: order })
        });
        let quantities: Vec<Quantity> = quantities.collect();
        let greatest = quantities.iter().map(|q| (q.value.abs() + q.expanded_u()).powi(2)).sum::<f64>().sqrt();
        if is_reported {
            findings.quantities.extend(quantities);
        }
        if is_first { greatest } else { found.amplitude_rad() }
    });
    Some(EncoderAmplitudes(amplitudes))
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
    let mut sums = [[0.0; 2]; HIGHEST_ORDER];
    for k in 0..last {
        let error = theta[k] - theta[0] - per_output * integral[k];
        for (order, [cosine, sine]) in (1..).zip(&mut sums) {
            let (s, c) = (f64::from(order) * theta[k]).sin_cos();
            *cosine += error * c;
            *sine += error * s;
        }
    }
    sums.map(|pair| pair.map(|sum| 2.0 * sum / last as f64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::Mounting;
    use hal_sim::peripherals::Noise;
    use identification::log::{Column, Note, Notes};

    /// Ten turns of a platform whose encoder shows θ + c cos θ + s sin θ + h sin 3θ, and whose device also sees a rate of the base of 1e-3
    /// rad/s.
    fn run(rate_rad_s: f64, error: [f64; 3], seed: u64) -> Step {
        let mut noise = Noise::new(seed, 0, 2e-3);
        let rows = 8000;
        let t_s: Vec<f64> = (0..rows).map(|k| f64::from(k) * 1e-3).collect();
        let angle = |t: f64| rate_rad_s * t + 0.4;
        let theta = t_s
            .iter()
            .map(|t| angle(*t) + error[0] * angle(*t).cos() + error[1] * angle(*t).sin() + error[2] * (3.0 * angle(*t)).sin())
            .collect();
        let output = t_s.iter().map(|t| 1.01 * (rate_rad_s + 1e-3 * angle(*t).cos()) + 0.02 + noise.draw()).collect();
        let setpoint = vec![rate_rad_s; t_s.len()];
        let columns = [("t_s", t_s), ("theta_rad", theta), ("gyro_rad_s", output), ("rate_cmd_rad_s", setpoint)];
        let columns = columns.into_iter().map(|(name, values)| Column { name: name.to_owned(), values }).collect();
        let notes = Notes::from_iter([Note::Profile("turns".to_owned())]);
        let log = Log::new("turns.csv", columns, notes).unwrap();
        Step { name: "turns".to_owned(), log, mounting: Mounting::default(), added_inertia_kg_m2: None }
    }

    fn findings(error: [f64; 3], seed: u64, rates: &[f64]) -> (Findings, Option<EncoderAmplitudes>) {
        let steps: Vec<Step> = rates.iter().enumerate().map(|(k, rate)| run(*rate, error, 10 * seed + k as u64)).collect();
        let mut findings = Findings::default();
        let amplitude = add(&steps.iter().collect::<Vec<_>>(), &GyroSettings::default(), &mut findings);
        (findings, amplitude)
    }

    /// The rate of the base alone would be an error of 1.2e-4 rad in one sense of rotation.
    #[test]
    fn both_senses_separate_the_encoder_from_the_base() {
        let truth = [1e-4, -2e-4, 0.0];
        let mut covered = 0;
        for seed in 0..40 {
            let (findings, amplitude) = findings(truth, seed, &[8.0, -8.0, -8.0, 8.0]);
            let quantities = ["encoder_cosine_rad", "encoder_sine_rad"].map(|name| findings.get(name).unwrap().clone());
            for (quantity, truth) in quantities.iter().zip(truth) {
                covered += u32::from((quantity.value - truth).abs() <= quantity.expanded_u());
                assert!(quantity.expanded_u() < 3e-5, "{quantity:?}");
            }
            let amplitude = amplitude.unwrap().0[0];
            assert!(amplitude > 2.236e-4 - 2e-5 && amplitude < 2.8e-4, "{amplitude}");
        }
        // 95 % of 80 less three standard errors.
        assert!(covered >= 70, "{covered}");
    }

    #[test]
    fn one_sense_of_rotation_does_not_suffice() {
        let (findings, amplitude) = findings([0.0; 3], 1, &[8.0, 8.0]);
        assert!(amplitude.is_none() && findings.get("encoder_sine_rad").is_none() && findings.absent.len() == 2);
    }

    #[test]
    fn a_higher_order_is_found_where_it_is_present_only() {
        let (mut covered, mut by_noise) = (0, 0);
        for seed in 0..60 {
            let (findings, amplitudes) = findings([0.0, 0.0, 1e-4], seed, &[8.0, -8.0, -8.0, 8.0]);
            let [cosine, sine] = ["encoder_cosine_3_rad", "encoder_sine_3_rad"].map(|name| findings.get(name).unwrap().clone());
            covered += u32::from(cosine.covers(0.0)) + u32::from(sine.covers(1e-4));
            by_noise += findings.quantities.len() - 4;
            let amplitudes = amplitudes.unwrap();
            assert!((amplitudes.0[2] - 1e-4).abs() < 6e-5, "{amplitudes:?}");
            // Two angles a third of a turn apart have the same error of order 3.
            assert!(amplitudes.difference_rad(TAU / 3.0) < 0.8 * amplitudes.difference_rad(TAU / 6.0), "{amplitudes:?}");
        }
        // 95 % of 120 less three standard errors; 1 % of 60 records with two quantities each.
        assert!(covered >= 106, "{covered}");
        assert!(by_noise <= 8, "{by_noise}");
    }
}
