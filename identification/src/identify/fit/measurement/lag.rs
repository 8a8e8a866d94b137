//! First-order lag, exact for an input that is linear or a parabola within the row.

use drive_model::Scalar;

/// τ y' = u − y.
pub(super) struct Lag<S> {
    time_constant_s: S,
    state: Option<(f64, S, S)>,
}

impl<S: Scalar> Lag<S> {
    pub(super) fn new(time_constant_s: S) -> Self {
        Lag { time_constant_s, state: None }
    }

    /// Output at `t_s`, the first row, from the input there, which was a straight line of this slope before.
    pub(super) fn begin(&mut self, t_s: f64, input: S, slope: S) -> S {
        let output = input - slope * self.time_constant_s;
        self.state = Some((t_s, input, output));
        output
    }

    /// Output at `t_s` from the input there. With `integral`, the integral of the input over the row, the input is the parabola with this
    /// integral and the two values; without it a straight line. Before the first row the input is constant.
    #[inline]
    pub(super) fn push(&mut self, t_s: f64, input: S, integral: Option<S>) -> S {
        let Some((last_s, last_in, last_out)) = self.state else {
            self.state = Some((t_s, input, input));
            return input;
        };
        let h = t_s - last_s;
        let tau = self.time_constant_s;
        let slope = (input - last_in) / h;
        // Particular solution u − τ u' + τ² u'' at the start and the end of the row.
        let (begin, end) = match integral {
            None => (last_in - slope * tau, input - slope * tau),
            Some(integral) => {
                let curvature = (integral / h - (input + last_in) * 0.5) * (6.0 / h);
                let bent = curvature * tau * tau * (-2.0 / h);
                (last_in - (slope + curvature) * tau + bent, input - (slope - curvature) * tau + bent)
            }
        };
        // For τ below 1/100 of the row the initial value has decayed; no division by τ.
        let output = if tau.re() < 0.01 * h { end } else { end + (last_out - begin) * (-(tau.recip() * h)).exp() };
        self.state = Some((t_s, input, output));
        output
    }

    /// Integral of the output over the row, from the integral of the input and the outputs at both ends.
    #[inline]
    pub(super) fn output_integral(&self, integral: S, before: S, after: S) -> S {
        integral - self.time_constant_s * (after - before)
    }

    /// The input at the last row was corrected.
    pub(super) fn correct_input(&mut self, input: S) {
        if let Some((_, last_in, _)) = &mut self.state {
            *last_in = input;
        }
    }

    /// The last output.
    pub(super) fn output(&self) -> Option<S> {
        self.state.map(|(_, _, output)| output)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// τ y' = u − y with u = 1 + 3 t − 5 t² from y = 2, in closed form.
    #[test]
    fn parabola_within_a_row_is_exact() {
        let (tau, h): (f64, f64) = (0.03, 0.02);
        let u = |t: f64| 1.0 + 3.0 * t - 5.0 * t * t;
        let mut lag = Lag { time_constant_s: tau, state: Some((0.0, u(0.0), 2.0)) };
        let integral = h + 1.5 * h * h - 5.0 / 3.0 * h * h * h;
        let output = lag.push(h, u(h), Some(integral));
        let settled = |t: f64| u(t) - tau * (3.0 - 10.0 * t) + tau * tau * -10.0;
        let expected = settled(h) + (2.0 - settled(0.0)) * (-h / tau).exp();
        assert!((output - expected).abs() < 1e-14, "{output} {expected}");
    }

    /// On both sides of the limit τ = row/100, where the exponential is e^−100.
    #[test]
    fn output_is_continuous_at_small_time_constants() {
        let after = |tau: f64| {
            let mut lag = Lag::new(tau);
            lag.push(0.0, 1.0, None);
            lag.push(0.02, 3.0, Some(0.045))
        };
        assert!((after(0.000_199_999) - after(0.000_200_001)).abs() < 1e-6);
        assert!((after(0.0) - 3.0).abs() < 1e-15);
    }
}
