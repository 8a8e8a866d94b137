//! The element as a linear plant: x′ = A x + B (M_K + M_L); the first state is the measured angle.

use std::path::Path;

use hal_sim::element::{FourState, SixState};

use super::ObserverError;
use identification::statistics::Extremes;

/// Names of the built-in parameter sets.
pub const PRESETS: [&str; 3] = ["astatic-identifier", "astatic-identifier-recovered", "rate-observer"];

/// The sensitive element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Element {
    /// On an elastic suspension, six states (docs/theory.md §1.1).
    Six(SixState),
    /// On a stiff suspension, four states (docs/theory.md §2.1).
    Four(FourState),
}

/// An element with its name.
#[derive(Debug, Clone, PartialEq)]
pub struct Plant {
    /// Name of the preset or of the file.
    pub name: String,
    /// Parameters.
    pub element: Element,
}

/// An element file: exactly one of the two tables.
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    six_state: Option<SixState>,
    four_state: Option<FourState>,
}

impl Plant {
    /// Default ω₀ of an observer with all poles at −ω₀, 1/s: more than three times the nutation frequency of the preset.
    pub fn default_omega_1_s(&self) -> f64 {
        match self.element {
            Element::Six(_) => 50.0,
            Element::Four(_) => 100.0,
        }
    }

    /// A preset by name, or a file with a table `[six_state]` or `[four_state]`.
    ///
    /// # Errors
    /// Unknown preset; unreadable file or unknown key; parameter out of range.
    pub fn named(name: &str) -> Result<Self, ObserverError> {
        let element = match name {
            "astatic-identifier" => Element::Six(SixState::PRINTED),
            "astatic-identifier-recovered" => Element::Six(SixState::RECOVERED),
            "rate-observer" => Element::Four(FourState::SET_B),
            file if Path::new(file).extension().is_some_and(|e| e == "toml") => return Self::read(file),
            other => return Err(ObserverError::Unknown(other.to_owned())),
        };
        Self::new(name, element)
    }

    /// An element with checked parameters.
    ///
    /// # Errors
    /// The first parameter that is out of range.
    pub fn new(name: &str, element: Element) -> Result<Self, ObserverError> {
        match &element {
            Element::Six(p) => p.check()?,
            Element::Four(p) => p.check()?,
        }
        Ok(Self { name: name.to_owned(), element })
    }

    fn read(file: &str) -> Result<Self, ObserverError> {
        let fail = |message: String| ObserverError::File(file.to_owned(), message);
        let text = std::fs::read_to_string(file).map_err(|e| fail(format!("cannot read: {e}")))?;
        let read: File = toml::from_str(&text).map_err(|e| fail(one_line(e.message())))?;
        let element = match (read.six_state, read.four_state) {
            (Some(p), None) => Element::Six(p),
            (None, Some(p)) => Element::Four(p),
            _ => return Err(fail("exactly one of the tables [six_state] and [four_state] is required".to_owned())),
        };
        Self::new(file, element).map_err(|e| fail(e.to_string()))
    }

    /// Names of the states, with units.
    pub fn states(&self) -> &'static [&'static str] {
        match self.element {
            Element::Six(_) => &["alpha_rad", "alpha_rate_rad_s", "beta_rad", "beta_rate_rad_s", "y_m", "y_rate_m_s"],
            Element::Four(_) => &["alpha_rad", "alpha_rate_rad_s", "beta_rad", "beta_rate_rad_s"],
        }
    }

    /// Moment of inertia about the vertical, kg m², and angular momentum H of the rotor, N m s.
    pub fn vertical_inertia_and_rotor(&self) -> (f64, f64) {
        match self.element {
            Element::Six(p) => (p.inertia_z_kg_m2, p.rotor_N_m_s),
            Element::Four(p) => (p.inertia_y_kg_m2, p.rotor_N_m_s),
        }
    }

    /// Azimuth stiffness k_α, N m/rad.
    pub fn azimuth_stiffness_N_m_rad(&self) -> f64 {
        match self.element {
            Element::Six(p) => p.azimuth_stiffness_N_m_rad(),
            Element::Four(p) => p.azimuth_stiffness_N_m_rad(),
        }
    }

    /// System matrix A, n × n (docs/theory.md §1.1 and §2.1).
    pub fn a(&self) -> Vec<Vec<f64>> {
        match self.element {
            Element::Six(p) => {
                let (a, b) = (p.azimuth_stiffness_N_m_rad() / p.inertia_z_kg_m2, p.rotor_N_m_s / p.inertia_z_kg_m2);
                let (c, d) = (p.rotor_N_m_s / p.inertia_x_kg_m2, p.mass_kg * p.gravity_m_s2 * p.arm_m / p.inertia_x_kg_m2);
                let (e, f) = (p.suspension_N_per_m * p.arm_m / p.inertia_x_kg_m2, p.suspension_N_per_m / p.mass_kg);
                let l = p.arm_m;
                vec![
                    vec![0.0, 1.0, 0.0, 0.0, 0.0, 0.0],
                    vec![-a, 0.0, 0.0, -b, 0.0, 0.0],
                    vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
                    vec![0.0, c, -d, 0.0, e, 0.0],
                    vec![0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
                    vec![0.0, -l * c, l * d, 0.0, -(f + l * e), 0.0],
                ]
            }
            Element::Four(p) => {
                let r = (p.link_damping_N_m_s + p.alpha_damping_N_m_s) / p.inertia_y_kg_m2;
                let (q, d) = (p.beta_damping_N_m_s / p.inertia_z_kg_m2, p.pendulum_N_m / p.inertia_z_kg_m2);
                let a = p.azimuth_stiffness_N_m_rad() / p.inertia_y_kg_m2;
                let (b, c) = (p.rotor_N_m_s / p.inertia_y_kg_m2, p.rotor_N_m_s / p.inertia_z_kg_m2);
                vec![vec![0.0, 1.0, 0.0, 0.0], vec![-a, -r, 0.0, -b], vec![0.0, 0.0, 0.0, 1.0], vec![0.0, c, -d, -q]]
            }
        }
    }

    /// Input column B of the control moment and of an external moment, length n.
    pub fn b(&self) -> Vec<f64> {
        let mut b = vec![0.0; self.states().len()];
        b[1] = 1.0 / self.vertical_inertia_and_rotor().0;
        b
    }

    /// Magnitude of the slowest mode, rad/s: precession.
    pub fn slowest_rad_s(&self) -> f64 {
        let a = self.a();
        let n = a.len();
        let eigenvalues = nalgebra::DMatrix::from_fn(n, n, |i, j| a[i][j]).complex_eigenvalues();
        eigenvalues.iter().map(|z| z.norm()).min_or_infinity()
    }

    /// Magnitude of the fastest mode, rad/s: nutation.
    pub fn fastest_rad_s(&self) -> f64 {
        let a = self.a();
        let n = a.len();
        let eigenvalues = nalgebra::DMatrix::from_fn(n, n, |i, j| a[i][j]).complex_eigenvalues();
        eigenvalues.iter().map(|z| z.norm()).max_or_zero()
    }
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
