//! Parameters of the sensitive element of a gyrotheodolite, read from TOML, with the named sets of the literature.

use serde::{Deserialize, Serialize};
use stand_firmware::config::{ConfigError, within};

/// The Earth's rate, rad/s.
pub const EARTH_RATE_RAD_S: f64 = 7.292_115_9e-5;

/// The element on an elastic suspension: six states α, α′, β, β′, y, y′.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SixState {
    /// The rotor's angular momentum H, N m s.
    pub rotor_N_m_s: f64,
    /// Mass m, kg.
    pub mass_kg: f64,
    /// Distance l from the suspension point to the centre of mass, m.
    pub arm_m: f64,
    /// Inertia about the horizontal axis across the rotor Jx, kg m².
    pub inertia_x_kg_m2: f64,
    /// Inertia about the vertical Jz, kg m².
    pub inertia_z_kg_m2: f64,
    /// Stiffness of the suspension along the rotor C_y, N/m.
    pub suspension_N_per_m: f64,
    /// Stiffness of the suspension in azimuth C_α, N m/rad.
    pub torsion_N_m_rad: f64,
    /// Latitude, degrees.
    pub latitude_deg: f64,
    /// Gravity g, m/s².
    pub gravity_m_s2: f64,
}

impl SixState {
    /// Table 1 of the paper as printed, with rounded numbers: set T.
    pub const PRINTED: Self = Self {
        rotor_N_m_s: 0.4,
        mass_kg: 1.0,
        arm_m: 0.1,
        inertia_x_kg_m2: 13e-4,
        inertia_z_kg_m2: 4e-4,
        suspension_N_per_m: 150.0,
        torsion_N_m_rad: 5e-5,
        latitude_deg: 50.0,
        gravity_m_s2: 9.81,
    };
    /// Table 1 before rounding, recovered from the printed gains: set R.
    pub const RECOVERED: Self = Self {
        mass_kg: 0.92,
        arm_m: 0.084,
        inertia_x_kg_m2: 12.6e-4,
        inertia_z_kg_m2: 3.8e-4,
        suspension_N_per_m: 152.2,
        gravity_m_s2: 9.80,
        ..Self::PRINTED
    };

    /// Stiffness in azimuth, k_α = H ω₃ cos φ + C_α, N m/rad.
    pub fn azimuth_stiffness_N_m_rad(&self) -> f64 {
        self.rotor_N_m_s * EARTH_RATE_RAD_S * libm::cos(self.latitude_deg.to_radians()) + self.torsion_N_m_rad
    }

    /// Checks the values of a file.
    ///
    /// # Errors
    /// The name of the first invalid number.
    pub fn check(&self) -> Result<(), ConfigError> {
        for (name, value) in [
            ("rotor_N_m_s", self.rotor_N_m_s),
            ("mass_kg", self.mass_kg),
            ("arm_m", self.arm_m),
            ("inertia_x_kg_m2", self.inertia_x_kg_m2),
            ("inertia_z_kg_m2", self.inertia_z_kg_m2),
            ("suspension_N_per_m", self.suspension_N_per_m),
            ("gravity_m_s2", self.gravity_m_s2),
        ] {
            within(name, value, 1e-9, 1e9)?;
        }
        within("torsion_N_m_rad", self.torsion_N_m_rad, 0.0, 1e6)?;
        latitude(self.latitude_deg)
    }
}

/// The element on a stiff suspension under vibration: four states α, α′, β, β′ and the roll γ.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FourState {
    /// The rotor's angular momentum H, N m s.
    pub rotor_N_m_s: f64,
    /// Inertia about the rotor's axis Jx, kg m².
    pub inertia_x_kg_m2: f64,
    /// Inertia about the vertical Jy, kg m².
    pub inertia_y_kg_m2: f64,
    /// Inertia about the horizontal axis across the rotor Jz, kg m².
    pub inertia_z_kg_m2: f64,
    /// Moment of the pendulum per radian mgl, N m.
    pub pendulum_N_m: f64,
    /// Damping of the compensating link F_KC, N m s.
    pub link_damping_N_m_s: f64,
    /// Friction about the vertical f_α, N m s.
    pub alpha_damping_N_m_s: f64,
    /// Friction about the horizontal axis f_β, N m s.
    pub beta_damping_N_m_s: f64,
    /// Friction about the rotor's axis f_γ, N m s.
    pub gamma_damping_N_m_s: f64,
    /// The compensating link's stiffness over H k_KC, rad/s.
    pub link_rad_s: f64,
    /// Latitude, degrees.
    pub latitude_deg: f64,
}

impl FourState {
    /// Set B: chosen for this project; the numbers of the paper are lost.
    pub const SET_B: Self = Self {
        rotor_N_m_s: 0.4,
        inertia_x_kg_m2: 2e-2,
        inertia_y_kg_m2: 8e-3,
        inertia_z_kg_m2: 2e-2,
        pendulum_N_m: 1.0,
        link_damping_N_m_s: 2.4e-3,
        alpha_damping_N_m_s: 0.0,
        beta_damping_N_m_s: 1e-3,
        gamma_damping_N_m_s: 2e-3,
        link_rad_s: 0.0,
        latitude_deg: 50.0,
    };

    /// The Earth's horizontal rate, rad/s.
    pub fn horizontal_rad_s(&self) -> f64 {
        EARTH_RATE_RAD_S * libm::cos(self.latitude_deg.to_radians())
    }

    /// Stiffness in azimuth, k_α = H (ω₃ cos φ + k_KC), N m/rad.
    pub fn azimuth_stiffness_N_m_rad(&self) -> f64 {
        self.rotor_N_m_s * (self.horizontal_rad_s() + self.link_rad_s)
    }

    /// Nutation H/√(Jy Jz), rad/s.
    pub fn nutation_rad_s(&self) -> f64 {
        self.rotor_N_m_s / (self.inertia_y_kg_m2 * self.inertia_z_kg_m2).sqrt()
    }

    /// Checks the values of a file.
    ///
    /// # Errors
    /// The name of the first invalid number.
    pub fn check(&self) -> Result<(), ConfigError> {
        for (name, value) in [
            ("rotor_N_m_s", self.rotor_N_m_s),
            ("inertia_x_kg_m2", self.inertia_x_kg_m2),
            ("inertia_y_kg_m2", self.inertia_y_kg_m2),
            ("inertia_z_kg_m2", self.inertia_z_kg_m2),
            ("pendulum_N_m", self.pendulum_N_m),
        ] {
            within(name, value, 1e-9, 1e9)?;
        }
        for (name, value) in [
            ("link_damping_N_m_s", self.link_damping_N_m_s),
            ("alpha_damping_N_m_s", self.alpha_damping_N_m_s),
            ("beta_damping_N_m_s", self.beta_damping_N_m_s),
            ("gamma_damping_N_m_s", self.gamma_damping_N_m_s),
            ("link_rad_s", self.link_rad_s),
        ] {
            within(name, value, 0.0, 1e6)?;
        }
        latitude(self.latitude_deg)
    }
}

/// At a pole the Earth rate has no horizontal component.
fn latitude(latitude_deg: f64) -> Result<(), ConfigError> {
    within("latitude_deg", latitude_deg, -90.0, 90.0)?;
    if latitude_deg.abs() > 89.99 {
        return Err(ConfigError::Unfit(
            "latitude_deg",
            "is at a pole: the Earth rate has no horizontal component there, and the gyro finds no north",
        ));
    }
    Ok(())
}
