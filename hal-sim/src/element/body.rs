//! The sensitive element as a rigid body with a rotor, without small-angle approximation, on a vibrating base.
//!
//! Axes: N along the rotor, U up, E across; attitude R_U(α) R_E(β) R_N(γ). The state is α, β, γ and the inertial rates of the body. Pivot
//! and centre of mass are on the vertical axis of the body. The base accelerates with a_N = g n cos ε sin ωt, a_E = g n sin ε sin(ωt + ψ).
//! Integration: fourth-order Runge-Kutta in steps of the caller.

use super::parameters::EARTH_RATE_RAD_S;
use super::{FourState, runge_kutta};

/// Gravity in the overloads of the base and in the pendulum moment mgl, m/s².
pub(super) const GRAVITY_M_S2: f64 = 9.81;

/// Vibration of the base.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BaseVibration {
    /// Amplitude n, in g.
    pub overload_g: f64,
    /// Direction ε from the rotor's axis, rad.
    pub direction_rad: f64,
    /// Frequency ω, rad/s.
    pub rate_rad_s: f64,
    /// Phase ψ of the part across the rotor, rad.
    pub phase_rad: f64,
}

impl BaseVibration {
    /// No vibration.
    pub const NONE: Self = Self { overload_g: 0.0, direction_rad: 0.0, rate_rad_s: 1.0, phase_rad: 0.0 };

    /// Accelerations of the pivot along the rotor and across, m/s².
    pub fn acceleration_m_s2(&self, t_s: f64) -> (f64, f64) {
        let size = GRAVITY_M_S2 * self.overload_g;
        let along = libm::sin(self.rate_rad_s * t_s);
        let across = libm::sin(self.rate_rad_s * t_s + self.phase_rad);
        (size * libm::cos(self.direction_rad) * along, size * libm::sin(self.direction_rad) * across)
    }
}

/// Azimuth, tilt, roll and their rates.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Attitude {
    /// α, rad.
    pub alpha_rad: f64,
    /// β, rad.
    pub beta_rad: f64,
    /// γ, rad.
    pub gamma_rad: f64,
    /// α′, rad/s.
    pub alpha_rate_rad_s: f64,
    /// β′, rad/s.
    pub beta_rate_rad_s: f64,
    /// γ′, rad/s.
    pub gamma_rate_rad_s: f64,
}

/// The moving body.
#[derive(Clone, Debug)]
pub struct RigidBody {
    element: FourState,
    vibration: BaseVibration,
    t_s: f64,
    /// α, β, γ, then rates about the body's axes: rotor, vertical, across.
    state: [f64; 6],
}

impl RigidBody {
    /// A body at this azimuth, otherwise level and at rest.
    pub fn new(element: FourState, vibration: BaseVibration, alpha_rad: f64) -> Self {
        Self { element, vibration, t_s: 0.0, state: [alpha_rad, 0.0, 0.0, 0.0, 0.0, 0.0] }
    }

    /// A step of `dt_s` with this moment about the vertical, N m.
    pub fn advance(&mut self, moment_N_m: f64, dt_s: f64) {
        self.state = runge_kutta::step(self.t_s, &self.state, dt_s, |t_s, state| self.slope(t_s, state, moment_N_m));
        self.t_s += dt_s;
    }

    /// Time since the start, s.
    pub fn t_s(&self) -> f64 {
        self.t_s
    }

    /// Attitude and rates.
    pub fn attitude(&self) -> Attitude {
        let [alpha_rad, beta_rad, gamma_rad, ..] = self.state;
        let (rates, _) = self.kinematics(&self.state);
        let [alpha_rate_rad_s, beta_rate_rad_s, gamma_rate_rad_s] = rates;
        Attitude { alpha_rad, beta_rad, gamma_rad, alpha_rate_rad_s, beta_rate_rad_s, gamma_rate_rad_s }
    }

    /// Rates of the angles, and the body axes in north, up, east.
    fn kinematics(&self, state: &[f64; 6]) -> ([f64; 3], [[f64; 3]; 3]) {
        let [alpha, beta, gamma, wx, wy, wz] = *state;
        let ((sa, ca), (sb, cb), (sc, cc)) = (libm::sincos(alpha), libm::sincos(beta), libm::sincos(gamma));
        let axes = [
            [ca * cb, sb, -sa * cb],
            [-ca * sb * cc + sa * sc, cb * cc, sa * sb * cc + ca * sc],
            [ca * sb * sc + sa * cc, -cb * sc, -sa * sb * sc + ca * cc],
        ];
        let horizontal = self.element.horizontal_rad_s();
        let vertical = EARTH_RATE_RAD_S * libm::sin(self.element.latitude_deg.to_radians());
        let relative = |axis: &[f64; 3], rate: f64| rate - axis[0] * horizontal - axis[1] * vertical;
        let (rx, ry, rz) = (relative(&axes[0], wx), relative(&axes[1], wy), relative(&axes[2], wz));
        let alpha_rate = (ry * cc - rz * sc) / cb;
        ([alpha_rate, ry * sc + rz * cc, rx - alpha_rate * sb], axes)
    }

    fn slope(&self, t_s: f64, state: &[f64; 6], moment_N_m: f64) -> [f64; 6] {
        let e = &self.element;
        let ([alpha_rate, beta_rate, gamma_rate], axes) = self.kinematics(state);
        let [alpha, _, _, wx, wy, wz] = *state;
        let (north, east) = self.vibration.acceleration_m_s2(t_s);
        let first_moment_kg_m = e.pendulum_N_m / GRAVITY_M_S2;
        let force = |axis: &[f64; 3]| -(axis[0] * north + axis[1] * GRAVITY_M_S2 + axis[2] * east);
        let (jx, jy, jz, h) = (e.inertia_x_kg_m2, e.inertia_y_kg_m2, e.inertia_z_kg_m2, e.rotor_N_m_s);
        [
            alpha_rate,
            beta_rate,
            gamma_rate,
            (-first_moment_kg_m * force(&axes[2]) - e.gamma_damping_N_m_s * gamma_rate - (jz - jy) * wy * wz) / jx,
            (moment_N_m
                - (e.alpha_damping_N_m_s + e.link_damping_N_m_s) * alpha_rate
                - h * e.link_rad_s * alpha
                - (jx - jz) * wz * wx
                - h * wz)
                / jy,
            (first_moment_kg_m * force(&axes[0]) - e.beta_damping_N_m_s * beta_rate - (jy - jx) * wx * wy + h * wy) / jz,
        ]
    }
}
