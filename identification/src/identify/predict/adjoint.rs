//! Gradient of the likelihood by a torque, or by an error of a reading, at each row.
//!
//! In: the row model, the filter and its innovations. Out: a [`Gradient`]: for each row the derivative of ln L by a torque over the row and by an error of
//! each reading. One recursion backwards in time gives all of them (the adjoint of the filter: Bryson and Ho, Applied Optimal Control, 1975, chapter 2).
//! Any effect that is linear in its amplitude has the score Σ gradient × signature. The torque's gradient times its density is the smoothed estimate of
//! the random torque.

use super::row_model::{DriveState, RowModel};
use crate::identify::fit::PreparedLog;
use crate::identify::fit::predictor::Predictor;

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

/// The gradient at these innovations (by channel and row). `rests` states whether the rotor rests throughout a row, where no torque moves it.
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
            DriveState::Omega => g.omega,
            DriveState::Theta => g.theta,
            DriveState::MotorOmega => g.motor_omega,
            DriveState::Twist => g.twist,
        }
    };
    let gains: Vec<[f64; MAX_STATES]> = (0..channels).map(|c| std::array::from_fn(|k| if k < n { gain(c, k) } else { 0.0 })).collect();
    let readings: Vec<[f64; MAX_STATES]> =
        (0..channels).map(|c| std::array::from_fn(|k| if k < n { model.readings[c][k] } else { 0.0 })).collect();
    let mut out = Gradient { torque: vec![0.0; data.len()], readings: vec![vec![0.0; data.len()]; channels] };
    for rows in &data.segments {
        let mut p = [0.0; MAX_STATES];
        let mut by_noise = vec![0.0; channels];
        for row in rows.clone().rev() {
            // Derivative by an innovation: its own square, and what it corrects.
            let by_innovation = |c: usize, p: &[f64; MAX_STATES], by_noise: &[f64]| {
                let e = innovations[c][row];
                let own = if e.is_finite() && !data.held_out(row) { -e / predictor.innovation_variances[c] } else { 0.0 };
                let corrected: f64 = if e.is_finite() { (0..n).map(|k| gains[c][k] * p[k]).sum() } else { 0.0 };
                let noise: f64 = if e.is_finite() { predictor.gains[c].noise.iter().zip(by_noise).map(|(g, b)| g * b).sum() } else { 0.0 };
                own + corrected + noise
            };
            for (b, decay) in by_noise.iter_mut().zip(&predictor.noise_decay) {
                *b *= decay;
            }
            let still = rests(row);
            out.torque[row] = if still { 0.0 } else { (0..n).map(|k| model.torque_response[k] * p[k]).sum() };
            // Means over the row correct the state at its end; they read the state at its begin.
            let mut before = [0.0; MAX_STATES];
            for (k, (before, state)) in before.iter_mut().zip(&model.states).enumerate() {
                let moves = |j: usize| if still && *state == DriveState::Omega { 0.0 } else { model.transition[(j, k)] };
                *before = (0..n).map(|j| moves(j) * p[j]).sum();
            }
            for c in (0..channels).rev().filter(|&c| model.over_row[c]) {
                let d = by_innovation(c, &p, &by_noise);
                out.readings[c][row] = -d;
                by_noise[c] -= d;
                for k in 0..n {
                    before[k] -= readings[c][k] * d;
                }
            }
            p = before;
            for c in (0..channels).rev().filter(|&c| !model.over_row[c]) {
                let d = by_innovation(c, &p, &by_noise);
                out.readings[c][row] = -d;
                by_noise[c] -= d;
                for k in 0..n {
                    p[k] -= readings[c][k] * d;
                }
            }
        }
    }
    out
}
