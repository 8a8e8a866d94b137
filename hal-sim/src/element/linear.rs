//! The sensitive element for small angles, with six states or four, from its moment equations.
//!
//! The moment equations themselves are integrated, not the state matrices of the observer design: an error in those matrices shows as a
//! difference. α turns about the vertical in both models. The axes follow the two papers: the vertical is z with six states and y with
//! four.

use super::body::GRAVITY_M_S2;
use super::{BaseVibration, FourState, SixState, runge_kutta};

/// Longest integration step, s. The nutation of [`SixState::RECOVERED`] (579 rad/s) is the fastest mode: in one second its amplitude is off
/// by 3·10⁻⁹ of itself ((ωh)⁶/144 a step) and its phase by 2·10⁻⁷ rad ((ωh)⁵/120 a step).
const MAX_STEP_S: f64 = 25e-6;

/// The model, with its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Equations {
    Six(SixState),
    Four(FourState, BaseVibration),
}

/// A linear model in motion: its time, its state and a constant external moment.
#[derive(Clone, Debug)]
pub struct LinearElement {
    equations: Equations,
    t_s: f64,
    state: [f64; 6],
    /// About the vertical.
    external_moment_N_m: f64,
}

impl LinearElement {
    /// Six states, at this azimuth and at rest, with a constant external moment about the vertical.
    pub fn six(element: SixState, alpha_rad: f64, external_moment_N_m: f64) -> Self {
        Self::at_rest(Equations::Six(element), alpha_rad, external_moment_N_m)
    }

    /// Four states and the roll, on a vibrating base, at this azimuth and at rest, with a constant external moment about the vertical.
    pub fn four(element: FourState, vibration: BaseVibration, alpha_rad: f64, external_moment_N_m: f64) -> Self {
        Self::at_rest(Equations::Four(element, vibration), alpha_rad, external_moment_N_m)
    }

    fn at_rest(equations: Equations, alpha_rad: f64, external_moment_N_m: f64) -> Self {
        Self { equations, t_s: 0.0, state: [alpha_rad, 0.0, 0.0, 0.0, 0.0, 0.0], external_moment_N_m }
    }

    /// α, α′, β, β′ in rad and rad/s; then y, y′ in m and m/s (six states), or the roll γ, γ′ in rad and rad/s (four states).
    pub fn state(&self) -> &[f64; 6] {
        &self.state
    }

    /// The roll γ, rad; `None` with six states, which do not contain it.
    pub fn roll_rad(&self) -> Option<f64> {
        matches!(self.equations, Equations::Four(..)).then_some(self.state[4])
    }

    /// Advances by `dt_s` with this control moment about the vertical.
    pub fn advance(&mut self, moment_N_m: f64, dt_s: f64) {
        let steps = (dt_s / MAX_STEP_S).ceil().max(1.0);
        let h_s = dt_s / steps;
        let moment_N_m = moment_N_m + self.external_moment_N_m;
        for _ in 0..steps as u64 {
            self.state = runge_kutta::step(self.t_s, &self.state, h_s, |t_s, state| match &self.equations {
                Equations::Six(element) => six_state_derivative(element, state, moment_N_m),
                Equations::Four(element, vibration) => four_state_derivative(element, vibration.acceleration_m_s2(t_s), state, moment_N_m),
            });
            self.t_s += h_s;
        }
    }
}

/// Derivative of α, α′, β, β′, y, y′ under a moment about the vertical.
fn six_state_derivative(p: &SixState, state: &[f64; 6], moment_N_m: f64) -> [f64; 6] {
    let [alpha, alpha_rate, beta, beta_rate, y_m, y_rate_m_s] = *state;
    let (m, l) = (p.mass_kg, p.arm_m);
    let alpha_ddot = (moment_N_m - p.azimuth_stiffness_N_m_rad() * alpha - p.rotor_N_m_s * beta_rate) / p.inertia_z_kg_m2;
    // (Jx + m l²) β″ + m l y″ = M_β and m l β″ + m y″ = F_y.
    let beta_moment_N_m = p.rotor_N_m_s * alpha_rate - m * p.gravity_m_s2 * l * beta;
    let y_force_N = -p.suspension_N_per_m * y_m;
    let beta_ddot = (beta_moment_N_m - l * y_force_N) / p.inertia_x_kg_m2;
    let y_ddot = y_force_N / m - l * beta_ddot;
    [alpha_rate, alpha_ddot, beta_rate, beta_ddot, y_rate_m_s, y_ddot]
}

/// Derivative of α, α′, β, β′, γ, γ′ under a moment about the vertical, with the base accelerated along the rotor and across it, m/s².
fn four_state_derivative(p: &FourState, (along, across): (f64, f64), state: &[f64; 6], moment_N_m: f64) -> [f64; 6] {
    let [alpha, alpha_rate, beta, beta_rate, gamma, gamma_rate] = *state;
    let first_moment_kg_m = p.pendulum_N_m / GRAVITY_M_S2;
    let alpha_damping = p.link_damping_N_m_s + p.alpha_damping_N_m_s;
    // The inertia force on the tilted pendulum has a moment about the vertical. It is of second order, and the only one with a mean value.
    let vibration_moment_N_m = first_moment_kg_m * (gamma * along + beta * across);
    let alpha_moment_N_m = moment_N_m + vibration_moment_N_m;
    let alpha_ddot = (alpha_moment_N_m - alpha_damping * alpha_rate - p.azimuth_stiffness_N_m_rad() * alpha - p.rotor_N_m_s * beta_rate)
        / p.inertia_y_kg_m2;
    let beta_ddot = (p.rotor_N_m_s * alpha_rate - p.pendulum_N_m * beta - p.beta_damping_N_m_s * beta_rate - first_moment_kg_m * along)
        / p.inertia_z_kg_m2;
    let gamma_ddot = (first_moment_kg_m * across - p.pendulum_N_m * gamma - p.gamma_damping_N_m_s * gamma_rate) / p.inertia_x_kg_m2;
    [alpha_rate, alpha_ddot, beta_rate, beta_ddot, gamma_rate, gamma_ddot]
}
