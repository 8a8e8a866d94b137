//! Gradient of the likelihood by a torque, or by an error of a reading, at each row.
//!
//! In: the row model, the filter and its innovations. Out: a [`Gradient`]: for each row the derivative of ln L by a torque over the row and
//! by an error of each reading. One recursion backwards in time gives all of them (the adjoint of the filter: Bryson and Ho, Applied
//! Optimal Control, 1975, chapter 2). Any effect that is linear in its amplitude has the score Σ gradient × signature. The torque's
//! gradient times its density is the smoothed estimate of the random torque.

use super::row_model::{RowModel, StateComponent};
use crate::recording::PreparedLog;
use crate::recording::predictor::Predictor;

/// Derivatives of ln L, by row of the log; 0 in rows that are not compared.
#[derive(Debug, Clone)]
pub struct Gradient {
    /// By a torque over the row, 1/(N m).
    pub torque: Vec<f64>,
    /// By an error of the reading of each channel, 1/unit.
    pub readings: Vec<Vec<f64>>,
}

/// States of the drive at most.
const MAX_STATES: usize = 4;

/// The gradient at these innovations (by channel and row). `rests` states whether the rotor rests throughout a row, where no torque moves
/// it.
pub fn gradient(
    model: &RowModel,
    predictor: &Predictor,
    data: &PreparedLog,
    innovations: &[&[f64]],
    rests: impl Fn(usize) -> bool,
) -> Gradient {
    let channels = innovations.len();
    let n = model.states.len();
    let gain = |c: usize, k: usize| {
        let g = &predictor.gains[c];
        match model.states[k] {
            StateComponent::Omega => g.omega,
            StateComponent::Theta => g.theta,
            StateComponent::MotorOmega => g.motor_omega,
            StateComponent::Twist => g.twist,
        }
    };
    let gains: Vec<[f64; MAX_STATES]> = (0..channels).map(|c| std::array::from_fn(|k| if k < n { gain(c, k) } else { 0.0 })).collect();
    let readings: Vec<[f64; MAX_STATES]> =
        (0..channels).map(|c| std::array::from_fn(|k| if k < n { model.readings[c][k] } else { 0.0 })).collect();
    let mut out = Gradient { torque: vec![0.0; data.len()], readings: vec![vec![0.0; data.len()]; channels] };
    for rows in &data.segments {
        let mut p = [0.0; MAX_STATES];
        for row in rows.clone().rev() {
            // Derivative by an innovation: its own square, and what it corrects.
            let by_innovation = |c: usize, p: &[f64; MAX_STATES]| {
                let e = innovations[c][row];
                let own = if e.is_finite() && !data.held_out(row) { -e / predictor.innovation_variances[c] } else { 0.0 };
                let corrected: f64 = if e.is_finite() { (0..n).map(|k| gains[c][k] * p[k]).sum() } else { 0.0 };
                own + corrected
            };
            let still = rests(row);
            out.torque[row] = if still { 0.0 } else { (0..n).map(|k| model.torque_response[k] * p[k]).sum() };
            // Means over the row correct the state at its end; they read the state at its begin.
            let mut before = [0.0; MAX_STATES];
            for (k, (before, state)) in before.iter_mut().zip(&model.states).enumerate() {
                let moves = |j: usize| if still && *state == StateComponent::Omega { 0.0 } else { model.transition[(j, k)] };
                *before = (0..n).map(|j| moves(j) * p[j]).sum();
            }
            for c in (0..channels).rev().filter(|&c| model.over_row[c]) {
                let d = by_innovation(c, &p);
                out.readings[c][row] = -d;
                for k in 0..n {
                    before[k] -= readings[c][k] * d;
                }
            }
            p = before;
            for c in (0..channels).rev().filter(|&c| !model.over_row[c]) {
                let d = by_innovation(c, &p);
                out.readings[c][row] = -d;
                for k in 0..n {
                    p[k] -= readings[c][k] * d;
                }
            }
        }
    }
    out
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::borrow::Cow;

    use super::*;
    use crate::identify::explain::fitted::test_rotor::with_fit;
    use crate::identify::fit::simulate::run;
    use crate::identify::predict::fit::Prediction;
    use crate::identify::predict::gain::stationary_filter;
    use crate::identify::predict::row_model::row_model;

    /// ln L of the innovations by finite differences of 1e-9 N m and 1e-6 rad/s; the rotor is linear, so that only rounding is left.
    #[test]
    fn gradient_is_that_of_finite_differences() {
        let error = |k: u32| 1e-3 * ((f64::from(k) * 12.989_8).sin() * 43_758.545_3).fract();
        with_fit((0..400).map(|k| (1e-5 * f64::from(k % 50), error(k))), |fitted| {
            let (system, parameters) = (&fitted.system, &fitted.fit.parameters);
            let model = row_model(system, parameters, &fitted.data).unwrap();
            let predictor = std::sync::Arc::new(stationary_filter(&model, 1e-9, &[1e-3]).unwrap());
            let data = Prediction::new(system, &fitted.data).following(&predictor);
            let rig = system.rig::<f64>(parameters, data.driven);
            let states = &fitted.fit.initial_states;
            let innovations = |data: &PreparedLog| {
                let mut innovations = vec![f64::NAN; data.len()];
                run(&rig, data, 0, (&states.kinds, &states.values[0]), 0, &mut |c, row, value: &f64| {
                    innovations[row] = data.target(c, row, 0).unwrap() - value;
                    true
                });
                innovations
            };
            let ln_likelihood = |data: &PreparedLog| -> f64 {
                let fitted = innovations(data).into_iter().enumerate().filter(|(row, _)| !data.held_out(*row));
                fitted.map(|(_, e)| -0.5 * e * e / predictor.innovation_variances[0]).sum()
            };
            let gradient = gradient(&model, &predictor, &data, &[&innovations(&data)], |_| false);
            for row in [3, 57, 199, 230, 398] {
                let with_torque = |torque: f64| {
                    let mut changed = data.clone();
                    let mut input = data.input.to_vec();
                    input[row] += torque;
                    changed.input = Cow::Owned(input);
                    ln_likelihood(&changed)
                };
                let with_error = |error: f64| {
                    let mut measured = data.channels[0].measured.to_vec();
                    measured[row] -= error;
                    let mut changed = PreparedLog { channels: Vec::new(), ..data.clone() };
                    changed.channels = vec![crate::recording::ComparedChannel { measured: &measured, ..data.channels[0].clone() }];
                    ln_likelihood(&changed)
                };
                let by_torque = (with_torque(1e-9) - with_torque(-1e-9)) / 2e-9;
                let by_error = (with_error(1e-6) - with_error(-1e-6)) / 2e-6;
                let (torque, reading) = (gradient.torque[row], gradient.readings[0][row]);
                // The row model lets a torque act at the begin of each of its parts: 3e-4 of this rotor's response.
                assert!((by_torque - torque).abs() < 1e-3 * torque.abs().max(1.0), "row {row}: {by_torque} {torque}");
                assert!((by_error - reading).abs() < 1e-4 * reading.abs().max(1.0), "row {row}: {by_error} {reading}");
            }
        });
    }
}
