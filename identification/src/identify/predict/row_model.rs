//! One row of the drive, linearised about a sliding rotor: transition of the state, covariance by a random torque, readings of the
//! channels.
//!
//! In: a system with its parameters, a prepared log. Out: a [`RowModel`]. The derivatives come from the rig itself, in dual numbers, at a
//! row whose rate is near the usual one of the log: friction is sliding there. States without influence on the compared channels are left
//! out.

use drive_model::Dual;
use drive_rig::{DriveState, Rig};
use nalgebra::{DMatrix, DVector};

use crate::identify::fit::parameters::DerivativeScalar;
use crate::identify::fit::{Parameters, System};
use crate::model::Channel;
use crate::recording::PreparedLog;

/// A state of the drive that the filter corrects.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StateComponent {
    /// Rate of the platform.
    Omega,
    /// Angle of the platform.
    Theta,
    /// Rate of the motor.
    MotorOmega,
    /// Twist of the shaft.
    Twist,
}

/// The linear model of a row.
#[derive(Debug, Clone)]
pub struct RowModel {
    /// The states, in the order of the matrices.
    pub states: Vec<StateComponent>,
    /// State at the end of a row by the state at its begin.
    pub transition: DMatrix<f64>,
    /// Covariance that a random torque of density 1 (N m)²/Hz (two-sided) adds within a row.
    pub by_torque: DMatrix<f64>,
    /// State at the end of a row by a torque of 1 N m over it.
    pub torque_response: DVector<f64>,
    /// Reading of each channel by the state at the begin of the row.
    pub readings: Vec<DVector<f64>>,
    /// The reading is known at the end of the row only: a mean over it.
    pub over_row: Vec<bool>,
}

/// Parts of a row over which the random torque is integrated.
const PARTS: usize = 8;
/// Twist at which a shaft is in contact, half gaps.
const IN_CONTACT: f64 = 1.01;
/// Derivatives that are computed at once: of all states.
const LANES: usize = 8;

/// The row model of a system at these parameters; `None` where it is not finite there.
pub fn row_model(system: &System, parameters: &Parameters, data: &PreparedLog) -> Option<RowModel> {
    let mut fixed = parameters.clone();
    fixed.list.iter_mut().for_each(|p| p.fixed = true);
    let rig: Rig<Dual<LANES>> = system.rig(&fixed, data.driven);
    if !rig.resolves(data.dt_s) {
        return None;
    }
    let compared = |channel: Channel| data.channels.iter().any(|c| c.channel == channel);
    let mut states = vec![StateComponent::Omega];
    if compared(Channel::Angle) {
        states.push(StateComponent::Theta);
    }
    if rig.structure().shaft.is_some() {
        states.extend([StateComponent::MotorOmega, StateComponent::Twist]);
    }
    let (row, omega) = usual_row(data);
    let n = states.len();
    // Transition over a part of the row, and over the whole row.
    let over = |part: f64| -> (DMatrix<f64>, DVector<f64>) {
        let mut span = data.row_input(row, row + 2);
        span.dt_s = data.dt_s * part;
        let mut state = DriveState::turning(Dual::<LANES>::from(omega), Dual::from(data.theta.map_or(0.0, |theta| theta[row])));
        if let Some(shaft) = &rig.structure().shaft {
            // A shaft with play is in contact at most times.
            state.twist = Dual::from(0.5 * shaft.gap.re * IN_CONTACT);
        }
        for (k, s) in states.iter().enumerate() {
            let value = component(&mut state, *s);
            *value = value.with(k, 1.0);
        }
        let current = rig.advance(&mut state, &span);
        let mut matrix = DMatrix::zeros(n, n);
        for (i, s) in states.iter().enumerate() {
            let value = *component(&mut state, *s);
            for j in 0..n {
                matrix[(i, j)] = value.slope(j);
            }
        }
        (matrix, DVector::from_fn(n, |j, _| current.slope(j)))
    };
    let (transition, current) = over(1.0);
    let (part, _) = over(1.0 / PARTS as f64);
    let (by_torque, torque_response) = covariance_by_torque(&states, &part, &rig, parameters, system, data.dt_s);
    let unit = |s: StateComponent| DVector::from_fn(n, |k, _| f64::from(u8::from(states[k] == s)));
    let readings: Vec<DVector<f64>> = data
        .channels
        .iter()
        .map(|c| match c.channel {
            Channel::Rate => unit(StateComponent::Omega),
            Channel::Angle => unit(StateComponent::Theta),
            Channel::Current => current.clone(),
            Channel::Voltage | Channel::Torque => DVector::zeros(n),
        })
        .collect();
    let over_row = data.channels.iter().map(|c| !matches!(c.channel, Channel::Rate | Channel::Angle)).collect();
    let finite = transition.iter().chain(by_torque.iter()).chain(current.iter()).all(|v| v.is_finite());
    finite.then_some(RowModel { states, transition, by_torque, torque_response, readings, over_row })
}

/// Covariance by a random torque, and response to a constant one, that act on the motor's side, as the friction does; by the midpoint rule
/// over the parts of a row.
fn covariance_by_torque(
    states: &[StateComponent],
    part: &DMatrix<f64>,
    rig: &Rig<Dual<LANES>>,
    parameters: &Parameters,
    system: &System,
    dt_s: f64,
) -> (DMatrix<f64>, DVector<f64>) {
    let n = states.len();
    let inertia = system.inertia.map_or(f64::NAN, |k| parameters.list[k].value);
    let (on, moved) = match &rig.structure().shaft {
        Some(shaft) => (StateComponent::MotorOmega, inertia * shaft.motor_inertia_fraction.re),
        None => (StateComponent::Omega, inertia),
    };
    let part_s = dt_s / PARTS as f64;
    // The rate begins in the middle of its part; the angle then turns over half a part.
    let mut impulse = DVector::from_fn(n, |k, _| match states[k] {
        s if s == on => 1.0 / moved,
        StateComponent::Theta if on == StateComponent::Omega => 0.5 * part_s / moved,
        StateComponent::Twist => 0.5 * part_s / moved,
        _ => 0.0,
    });
    let (mut covariance, mut response) = (DMatrix::zeros(n, n), DVector::zeros(n));
    for _ in 0..PARTS {
        covariance += &impulse * impulse.transpose() * part_s;
        response += &impulse * part_s;
        impulse = part * impulse;
    }
    (covariance, response)
}

fn component<S>(state: &mut DriveState<S>, which: StateComponent) -> &mut S {
    match which {
        StateComponent::Omega => &mut state.omega,
        StateComponent::Theta => &mut state.theta,
        StateComponent::MotorOmega => &mut state.motor_omega,
        StateComponent::Twist => &mut state.twist,
    }
}

/// A row whose rate is nearest to the root mean square rate of the log, with this rate. Without a rate or an angle: the first row, turning.
fn usual_row(data: &PreparedLog) -> (usize, f64) {
    let rates: Vec<f64> = match (data.channels.iter().find(|c| c.channel == Channel::Rate), data.theta) {
        (Some(c), _) => c.measured.to_vec(),
        (None, Some(theta)) => {
            let lag = data.angle_lag();
            (0..theta.len()).map(|k| (theta[(k + lag).min(theta.len() - 1)] - theta[k]) / (lag as f64 * data.dt_s)).collect()
        }
        _ => return (0, 1.0),
    };
    let rms = (rates.iter().map(|r| r * r).sum::<f64>() / rates.len().max(1) as f64).sqrt();
    let inner = data.segments.iter().flat_map(|rows| rows.start..rows.end.saturating_sub(1));
    let row = inner.min_by(|&a, &b| (rates[a] - rms).abs().total_cmp(&(rates[b] - rms).abs())).unwrap_or(0);
    (row, if rms > 0.0 { rms } else { 1.0 })
}
