//! The regulator of a position servo.

use drive_model::Scalar;

/// A proportional regulator with damping by the rate and a limit: u = kp (setpoint − angle) − kd rate, within ± limit.
///
/// The firmware of hobby and smart servos is of this kind, with the supply as the limit; an integral part is not modelled.
#[derive(Debug, Clone, Copy)]
pub struct Servo<S> {
    /// Gain kp, V/rad.
    pub gain_V_rad: S,
    /// Damping kd, V s/rad.
    pub damping_V_s_rad: S,
    /// Greatest voltage, V.
    pub limit_V: S,
}

impl<S: Scalar> Servo<S> {
    /// Voltage for a setpoint (rad) at an angle (rad) and a rate (rad/s), V.
    #[inline]
    pub fn voltage_V(&self, setpoint_rad: f64, theta_rad: S, omega_rad_s: S) -> S {
        let u = self.gain_V_rad * (-theta_rad + setpoint_rad) - self.damping_V_s_rad * omega_rad_s;
        if u > self.limit_V {
            self.limit_V
        } else if -u > self.limit_V {
            -self.limit_V
        } else {
            u
        }
    }
}
