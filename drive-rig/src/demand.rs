//! The other way round: what a prescribed motion needs of the drive (`input = "theta_rad"`).

use crate::{Rig, Span};
use drive_model::Scalar;

/// What a prescribed motion needs.
#[derive(Debug, Clone, Copy)]
pub struct Demand<S> {
    /// Torque of the motor, N m.
    pub torque: S,
    /// Motor current, A.
    pub current: S,
    /// Voltage, V.
    pub voltage: S,
}

impl<S: Scalar> Rig<S> {
    /// Torque, current and voltage at rate `omega` (rad/s) and acceleration `alpha` (rad/s²).
    ///
    /// `direction` in [−1, 1] is the sign of the motion for dry friction, less than one where the measured rate cannot tell it.
    pub fn demand(&self, span: &Span, omega: f64, alpha: f64, direction: f64, current_A: f64) -> Demand<S> {
        let rate = S::from(omega);
        let theta = S::from(span.theta.map_or(0.0, |t| t.0));
        let x = self.point(span, 0.0, 0.0, theta, rate, S::from(current_A), S::zero());
        let acts = self.acts(&x);
        let motor_constant = self.base.motor_constant * acts.motor_factor;
        let torque = self.base.inertia * alpha + acts.viscous * acts.viscous_factor * omega + acts.dry * direction - acts.torque;
        let current = torque / motor_constant;
        let resistance = self.base.resistance * acts.resistance_factor + acts.series_ohm;
        let drop = if current > 0.0 { acts.drop_V } else { -acts.drop_V };
        let voltage = resistance * current + motor_constant * omega + drop - acts.voltage;
        Demand { torque, current, voltage }
    }
}
