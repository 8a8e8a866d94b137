//! A linear motor with an exact solution: the simplest plant, and the reference for timing.
//!
//! J ω' = K i − b ω + load, i = (u − K ω)/R: a first-order lag with time constant J/(b + K²/R), advanced by its
//! exponential at constant voltage. The optional Coulomb torque is applied by a soft threshold after the step: sufficient to test
//! a controller, not a reference for friction.

use super::PlantPort;

/// Constants and state; units in the field names.
#[derive(Clone, Debug)]
pub struct LinearMotor {
    /// Inertia.
    pub inertia_kg_m2: f64,
    /// Torque and back-EMF constant.
    pub motor_constant_N_m_A: f64,
    /// Terminal resistance.
    pub resistance_ohm: f64,
    /// Viscous friction.
    pub viscous_N_m_s: f64,
    /// Dry friction.
    pub coulomb_N_m: f64,
    /// A constant torque.
    pub load_N_m: f64,
    /// Angle.
    pub theta_rad: f64,
    /// Rate.
    pub omega_rad_s: f64,
    mean_A: f64,
    cached: (f64, f64, f64),
}

impl Default for LinearMotor {
    /// The default stand's nominal constants without dry friction: maxon RE 25 118752 and a platform.
    fn default() -> Self {
        Self {
            inertia_kg_m2: 2.5e-4,
            motor_constant_N_m_A: 23.4e-3,
            resistance_ohm: 2.32,
            viscous_N_m_s: 2e-5,
            coulomb_N_m: 0.0,
            load_N_m: 0.0,
            theta_rad: 0.0,
            omega_rad_s: 0.0,
            mean_A: 0.0,
            cached: (f64::NAN, 0.0, 0.0),
        }
    }
}

impl LinearMotor {
    /// Steady rate and time constant (rad/s, s) at a voltage, without dry friction.
    pub fn steady(&self, volts: f64) -> (f64, f64) {
        let (k, r) = (self.motor_constant_N_m_A, self.resistance_ohm);
        let damping = self.viscous_N_m_s + k * k / r;
        ((k / r * volts + self.load_N_m) / damping, self.inertia_kg_m2 / damping)
    }
}

impl PlantPort for LinearMotor {
    #[inline]
    fn advance(&mut self, command_V: f64, dt_s: f64) {
        let (k, r) = (self.motor_constant_N_m_A, self.resistance_ohm);
        let damping = self.viscous_N_m_s + k * k / r;
        let tau = self.inertia_kg_m2 / damping;
        if self.cached.0 != dt_s {
            let decay = libm::exp(-dt_s / tau);
            self.cached = (dt_s, decay, -tau * libm::expm1(-dt_s / tau));
        }
        let (_, decay, reach) = self.cached;
        let end = (k / r * command_V + self.load_N_m) / damping;
        let free = end + (self.omega_rad_s - end) * decay;
        let step = end * dt_s + (self.omega_rad_s - end) * reach;
        if self.coulomb_N_m == 0.0 {
            self.omega_rad_s = free;
            self.theta_rad += step;
            self.mean_A = (command_V - k * step / dt_s) / r;
        } else {
            let bite = dt_s * self.coulomb_N_m / self.inertia_kg_m2;
            let omega = free.signum() * (free.abs() - bite).max(0.0);
            let mean = 0.5 * (self.omega_rad_s + omega);
            self.theta_rad += mean * dt_s;
            self.omega_rad_s = omega;
            self.mean_A = (command_V - k * mean) / r;
        }
    }

    fn theta_rad(&self) -> f64 {
        self.theta_rad
    }

    fn rate_rad_s(&self) -> f64 {
        self.omega_rad_s
    }

    fn mean_current_A(&self) -> f64 {
        self.mean_A
    }

    fn supply_V(&self) -> f64 {
        12.0
    }

    fn temp_C(&self) -> f64 {
        25.0
    }

    fn true_theta_rad(&self) -> f64 {
        self.theta_rad
    }
}
