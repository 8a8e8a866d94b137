//! The plant: the true drive of the simulated stand.
//!
//! The effects of [`drive_model`] are integrated independently of the model that users fit: fourth-order Runge-Kutta with located stop
//! times, sticking as a constraint, and shorter steps for winding, shaft and bristle. Nothing of `drive-rig` is used here, so that
//! an error in one implementation is visible against the other. The plant may also have disturbances that no effect of the
//! catalogue describes ([`outsiders`]).
//!
//! Input: the commanded voltage, tick by tick. Output: [`PlantPort`], the readings of the sensor elements. [`crate::peripherals`] adds
//! noise, quantisation and filters.

mod error;
mod events;
mod motion;
pub mod outsiders;
mod sensing;
pub mod stand;

use crate::board::PlantPort;
use drive_model::{Structure, T0_C, Thermal};
pub use error::StandError;
use motion::{BRISTLE, CHARGE, CURRENT, FLUID, FULL, MOTOR, OMEGA, PLAIN, StateVector, THETA, TWIST, past_gap};
use outsiders::{Outsiders, Running};
use sensing::{LawParameters, Sensing};
pub use stand::Stand;

/// A drive with its effects.
pub struct Plant {
    inertia: f64,
    /// Inertia of the body on the platform.
    added: f64,
    motor_constant: f64,
    resistance: f64,
    /// Laws with contributions, and laws that only change readings.
    laws: Vec<LawParameters>,
    seen: Vec<LawParameters>,
    structure: Structure<f64>,
    thermal: Thermal<f64>,
    /// Disturbances outside the catalogue.
    outsiders: Outsiders,
    running: Running,
    /// Some effect causes a voltage drop.
    drops: bool,
    nominal_V: f64,
    supply_V: f64,
    /// Ambient temperature above the reference temperature of the laws, K.
    ambient_K: f64,
    t_s: f64,
    state: StateVector,
    heat_K: f64,
    mean_current_A: f64,
    sensing: Sensing,
}

impl Plant {
    /// The plant of a stand, at rest and at ambient temperature, with its index at `theta_rad` before the encoder's zero.
    ///
    /// # Errors
    /// An effect or parameter that the catalogue lacks, a value out of range, or two couplings in one drive.
    pub fn new(stand: &Stand, theta_rad: f64) -> Result<Self, StandError> {
        stand.check_outside()?;
        let placed = stand.effect_parameters()?;
        let mut structure = Structure::default();
        let (mut laws, mut seen) = (Vec::new(), Vec::new());
        for (id, parameters) in placed {
            let Some(law) = drive_model::law::<f64>(id) else { continue };
            law.configure(&parameters, &mut structure);
            if law.has_no_contribution() { seen.push((law, parameters)) } else { laws.push((law, parameters)) }
        }
        let thermal = structure.thermal.unwrap_or(Thermal { J_K: stand.drive.thermal_J_K, K_W: stand.drive.thermal_K_W });
        let mut state = [0.0; FULL];
        state[THETA] = theta_rad;
        let sensing = Sensing::new(&structure, &stand.outsiders);
        let mut plant = Plant {
            inertia: stand.drive.inertia_kg_m2,
            added: 0.0,
            motor_constant: stand.drive.motor_constant_N_m_A,
            resistance: stand.drive.resistance_ohm,
            laws,
            seen,
            structure,
            thermal,
            outsiders: stand.outsiders,
            running: Running::new(&stand.outsiders),
            drops: false,
            nominal_V: stand.drive.supply_V,
            supply_V: stand.drive.supply_V,
            ambient_K: stand.drive.ambient_C - T0_C,
            t_s: 0.0,
            state,
            heat_K: stand.drive.ambient_C - T0_C,
            mean_current_A: 0.0,
            sensing,
        };
        plant.drops = plant.contributions(&plant.state, 0.0, 0.0, 0.0).drop_V.value() > 0.0;
        plant.sense(0.0);
        Ok(plant)
    }

    /// Energy of rotor, shaft and bristle, J; friction can only reduce it.
    pub fn mechanical_energy_J(&self) -> f64 {
        let s = &self.state;
        let bristle = self.structure.bristle_N_m_rad.map_or(0.0, |stiffness| 0.5 * stiffness * s[BRISTLE] * s[BRISTLE]);
        let varying = self.varying_inertia(s, &self.contributions(s, s[CURRENT], 0.0, self.t_s)).0;
        let fluid = self.outsiders.fluid_rotor.map_or(0.0, |rotor| 0.5 * rotor.fluid_kg_m2 * s[FLUID] * s[FLUID]);
        bristle
            + fluid
            + 0.5 * varying * s[OMEGA] * s[OMEGA]
            + match &self.structure.shaft {
                None => {
                    let share = self.outsiders.slipping_clutch.map_or(0.0, |clutch| clutch.motor_inertia_share);
                    0.5 * self.inertia * (share * s[MOTOR] * s[MOTOR] + (1.0 - share) * s[OMEGA] * s[OMEGA])
                }
                Some(shaft) => {
                    let wound = past_gap(s[TWIST], shaft.gap);
                    0.5 * self.inertia
                        * (shaft.motor_inertia_fraction * s[MOTOR] * s[MOTOR] + (1.0 - shaft.motor_inertia_fraction) * s[OMEGA] * s[OMEGA])
                        + 0.5 * shaft.stiffness * wound * wound
                }
            }
    }

    /// Sets the rate of all rotating parts, rad/s.
    pub fn spin(&mut self, omega_rad_s: f64) {
        self.state[OMEGA] = omega_rad_s;
        self.state[MOTOR] = omega_rad_s;
        self.state[FLUID] = omega_rad_s;
        self.sense(0.0);
    }

    fn sense(&mut self, dt_s: f64) {
        let x = self.point(&self.state, self.mean_current_A, 0.0, self.t_s);
        self.sensing.take(&self.seen, &x, self.state[OMEGA], self.state[THETA], self.mean_current_A, dt_s);
    }
}

impl PlantPort for Plant {
    fn advance(&mut self, command_V: f64, dt_s: f64) {
        self.state[CHARGE] = 0.0;
        // Duty times the present supply.
        let command_V = command_V * (self.supply_V / self.nominal_V);
        self.running.tick(command_V, self.t_s, dt_s);
        let steps = self.steps(dt_s);
        let h = dt_s / steps;
        let mut state = self.state;
        if self.structure.shaft.is_some() || self.structure.bristle_N_m_rad.is_some() || self.outsiders.any() {
            for k in 0..steps as u32 {
                self.step(&mut state, command_V, self.t_s + f64::from(k) * h, h);
            }
        } else {
            let [omega, current, theta, charge, ..] = state;
            let mut plain: [f64; PLAIN] = [omega, current, theta, charge];
            for k in 0..steps as u32 {
                self.step(&mut plain, command_V, self.t_s + f64::from(k) * h, h);
            }
            state[..PLAIN].copy_from_slice(&plain);
        }
        self.state = state;
        if self.structure.inductance_H.is_none() {
            // Start value of the search, for laws that depend on the current.
            self.state[CURRENT] = self.at(&self.state, false, self.bridge_V::<FULL>(command_V, self.t_s + dt_s), self.t_s + dt_s).1;
        }
        self.mean_current_A = self.state[CHARGE] / dt_s;
        // Where a law makes the resistance depend on the temperature, the hot resistance heats.
        let factor = match self.structure.thermal {
            Some(_) => self.contributions(&self.state, self.mean_current_A, command_V, self.t_s).resistance_factor.times(1.0),
            None => 1.0,
        };
        let loss_W = self.resistance * factor * self.mean_current_A * self.mean_current_A;
        self.heat_K += (loss_W - (self.heat_K - self.ambient_K) / self.thermal.K_W) / self.thermal.J_K * dt_s;
        self.t_s += dt_s;
        self.sense(dt_s);
    }

    fn theta_rad(&self) -> f64 {
        self.sensing.theta_rad
    }

    fn rate_rad_s(&self) -> f64 {
        self.sensing.rate_rad_s
    }

    fn mean_current_A(&self) -> f64 {
        self.sensing.current_A
    }

    fn supply_V(&self) -> f64 {
        self.supply_V
    }

    fn temp_C(&self) -> f64 {
        self.heat_K + T0_C
    }

    fn set_supply(&mut self, volts: Option<f64>) {
        self.supply_V = volts.unwrap_or(self.nominal_V);
    }

    fn set_winding_temperature(&mut self, temp_C: f64) {
        self.heat_K = temp_C - T0_C;
    }

    fn set_load_inertia(&mut self, added_kg_m2: f64) {
        let before = self.inertia;
        self.inertia += added_kg_m2 - self.added;
        self.added = added_kg_m2;
        // The body is on the platform: the motor side keeps its inertia, its fraction falls.
        let share = before / self.inertia;
        if let Some(shaft) = &mut self.structure.shaft {
            shaft.motor_inertia_fraction *= share;
        }
        if let Some(clutch) = &mut self.outsiders.slipping_clutch {
            clutch.motor_inertia_share *= share;
        }
    }

    fn true_theta_rad(&self) -> f64 {
        self.state[THETA]
    }

    fn true_rate_rad_s(&self) -> f64 {
        self.state[OMEGA]
    }
}
