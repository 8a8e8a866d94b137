//! The sensitive element for small angles, with six states or four, from its moment equations.
//!
//! Fourth-order Runge-Kutta of the equations with their masses, in steps of at most 25 µs; the matrices of the observer design
//! are not used, so that an error in them is visible here.

use super::{BaseVibration, FourState, SixState};

/// Longest step, s: at the 579 rad/s of the nutation of set R an error of 10⁻⁹ of the amplitude per second.
const LONGEST_S: f64 = 25e-6;

/// The equations.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Equations {
    Six(SixState),
    Four(FourState, BaseVibration),
}

/// A moving element.
#[derive(Clone, Debug)]
pub struct LinearElement {
    equations: Equations,
    t_s: f64,
    /// α, α′, β, β′, then y, y′ or γ, γ′.
    state: [f64; 6],
    /// External moment about the vertical, N m.
    outside_N_m: f64,
}

impl LinearElement {
    /// Six states, at this azimuth and at rest, with a constant external moment.
    pub fn six(element: SixState, alpha_rad: f64, outside_N_m: f64) -> Self {
        Self { equations: Equations::Six(element), t_s: 0.0, state: [alpha_rad, 0.0, 0.0, 0.0, 0.0, 0.0], outside_N_m }
    }

    /// Four states and the roll, on a vibrating base.
    pub fn four(element: FourState, vibration: BaseVibration, alpha_rad: f64, outside_N_m: f64) -> Self {
        let equations = Equations::Four(element, vibration);
        Self { equations, t_s: 0.0, state: [alpha_rad, 0.0, 0.0, 0.0, 0.0, 0.0], outside_N_m }
    }

    /// α, α′, β, β′, then y, y′ of six states, or γ, γ′ in addition to four.
    pub fn state(&self) -> &[f64; 6] {
        &self.state
    }

    /// The roll γ of four states.
    pub fn roll_rad(&self) -> Option<f64> {
        matches!(self.equations, Equations::Four(..)).then_some(self.state[4])
    }

    /// Advances by `dt_s` with this control moment, N m.
    pub fn advance(&mut self, moment_N_m: f64, dt_s: f64) {
        let steps = (dt_s / LONGEST_S).ceil().max(1.0);
        let h = dt_s / steps;
        for _ in 0..steps as u64 {
            self.step(moment_N_m + self.outside_N_m, h);
        }
    }

    fn step(&mut self, moment_N_m: f64, h: f64) {
        let at = |state: &[f64; 6], slope: &[f64; 6], h: f64| -> [f64; 6] { std::array::from_fn(|k| state[k] + h * slope[k]) };
        let (t, half) = (self.t_s, 0.5 * h);
        let k1 = self.slope(t, &self.state, moment_N_m);
        let k2 = self.slope(t + half, &at(&self.state, &k1, half), moment_N_m);
        let k3 = self.slope(t + half, &at(&self.state, &k2, half), moment_N_m);
        let k4 = self.slope(t + h, &at(&self.state, &k3, h), moment_N_m);
        for k in 0..6 {
            self.state[k] += h / 6.0 * (k1[k] + 2.0 * (k2[k] + k3[k]) + k4[k]);
        }
        self.t_s += h;
    }

    fn slope(&self, t_s: f64, state: &[f64; 6], moment_N_m: f64) -> [f64; 6] {
        let [alpha, alpha_rate, beta, beta_rate, last, last_rate] = *state;
        match &self.equations {
            Equations::Six(p) => {
                let alpha_2 = (moment_N_m - p.azimuth_N_m_rad() * alpha - p.rotor_N_m_s * beta_rate) / p.inertia_z_kg_m2;
                // (Jx + m l²) β″ + m l y″ = M_β and m l β″ + m y″ = F_y.
                let (m, l) = (p.mass_kg, p.arm_m);
                let tilting = p.rotor_N_m_s * alpha_rate - m * p.gravity_m_s2 * l * beta;
                let pulling = -p.suspension_N_per_m * last;
                let beta_2 = (tilting - l * pulling) / p.inertia_x_kg_m2;
                let y_2 = pulling / m - l * beta_2;
                [alpha_rate, alpha_2, beta_rate, beta_2, last_rate, y_2]
            }
            Equations::Four(p, vibration) => {
                let (north, east) = vibration.acceleration_m_s2(t_s);
                let arm = p.pendulum_N_m / 9.81;
                let damping = p.link_damping_N_m_s + p.alpha_damping_N_m_s;
                // The inertia force on the tilted pendulum causes a moment about the vertical: of second order, and the only mean effect of vibration.
                let turning = arm * (last * north + beta * east);
                let moment_N_m = moment_N_m + turning;
                let alpha_2 =
                    (moment_N_m - damping * alpha_rate - p.azimuth_N_m_rad() * alpha - p.rotor_N_m_s * beta_rate) / p.inertia_y_kg_m2;
                let beta_2 = (p.rotor_N_m_s * alpha_rate - p.pendulum_N_m * beta - p.beta_damping_N_m_s * beta_rate - arm * north)
                    / p.inertia_z_kg_m2;
                let gamma_2 = (arm * east - p.pendulum_N_m * last - p.gamma_damping_N_m_s * last_rate) / p.inertia_x_kg_m2;
                [alpha_rate, alpha_2, beta_rate, beta_2, last_rate, gamma_2]
            }
        }
    }
}
