//! Fourth-order Runge-Kutta for six state variables.

/// The state at `t_s + h_s`, from the state at `t_s` and its derivative as a function of time and state.
pub(super) fn step(t_s: f64, state: &[f64; 6], h_s: f64, derivative: impl Fn(f64, &[f64; 6]) -> [f64; 6]) -> [f64; 6] {
    let half_s = 0.5 * h_s;
    let moved = |slope: &[f64; 6], by_s: f64| -> [f64; 6] { std::array::from_fn(|k| state[k] + by_s * slope[k]) };
    let k1 = derivative(t_s, state);
    let k2 = derivative(t_s + half_s, &moved(&k1, half_s));
    let k3 = derivative(t_s + half_s, &moved(&k2, half_s));
    let k4 = derivative(t_s + h_s, &moved(&k3, h_s));
    std::array::from_fn(|k| state[k] + h_s / 6.0 * (k1[k] + 2.0 * (k2[k] + k3[k]) + k4[k]))
}
