//! Inverse dynamics: torque, current and voltage for a prescribed motion (`input = "theta_rad"`).

use crate::{Part, Rig, RowInput};
use drive_model::Scalar;

/// Torque, current and voltage that a prescribed motion requires.
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
    /// `direction` in [−1, 1] is the sign of the motion for Coulomb friction; its magnitude is below one where the measured rate does not
    /// determine the sign.
    pub fn demand(&self, row: &RowInput, omega: f64, alpha: f64, direction: f64, current_A: f64) -> Demand<S> {
        let rate = S::from(omega);
        let theta = S::from(row.theta.map_or(0.0, |t| t.0));
        let x = self.point(row, Part::BEGIN, theta, rate, S::from(current_A), S::zero());
        let total = self.contributions(&x, row, theta);
        let motor_constant = total.motor_factor.times(self.base.motor_constant);
        let (inertia, reaction) = self.varying_inertia(&total, self.base.inertia, rate);
        let sliding = inertia * alpha - reaction
            + total.viscous_N_m_s().map_or_else(S::zero, |viscous| viscous * omega)
            + total.coulomb_factor.times(total.coulomb_torque.value()) * direction
            - total.torque.value();
        // The motor also overcomes the friction that its own torque T causes: T = sliding + μ |T| direction.
        let share = total.coulomb_per_torque.value() * direction;
        let torque = sliding / (if sliding > 0.0 { -share } else { share } + 1.0);
        let current = torque / motor_constant;
        let resistance = total.resistance_of(self.base.resistance);
        let drop_V = total.drop_V.value();
        let drop = if current > 0.0 { drop_V } else { -drop_V };
        let voltage = resistance * current + (motor_constant * omega + drop) * row.connected - total.voltage.value();
        Demand { torque, current, voltage }
    }
}
