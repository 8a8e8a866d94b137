//! History of a signal at rows and between them.
//!
//! Stored are the values at rows and the integral, which the model gives exactly. Between two rows a continuous signal (rate, angle) is the
//! parabola with both values and the integral: the derivative of the cubic Hermite interpolation of the integral. A current is
//! discontinuous at rows; it is linear within the row, with the slope at the start of the row.

use std::collections::VecDeque;

use drive_model::Scalar;

/// Tolerance of time comparisons, s.
pub(super) const TIME_TOLERANCE_S: f64 = 1e-9;

/// The signal at a row.
#[derive(Debug, Clone, Copy)]
struct Knot<S> {
    t_s: f64,
    /// Integral up to the row.
    sum: S,
    /// Value; of a discontinuous signal just after the row.
    value: S,
    /// Slope of a discontinuous signal within the row; otherwise unused.
    slope: S,
}

/// The signal at an instant: integral, value, slope.
#[derive(Debug, Clone, Copy)]
pub(super) struct SignalValue<S> {
    pub(super) sum: S,
    pub(super) value: S,
    pub(super) slope: S,
}

/// The last rows of a signal. Before the first row the signal is constant.
pub(super) struct SignalHistory<S> {
    knots: VecDeque<Knot<S>>,
    reach_s: f64,
    discontinuous: bool,
    /// Rows since the integral was reset.
    since_reset: usize,
}

/// Rows between resets of the integral, which would lose resolution over an hour of an angle.
const RESET_ROWS: usize = 1000;

impl<S: Scalar> SignalHistory<S> {
    pub(super) fn new(reach_s: f64, discontinuous: bool) -> Self {
        SignalHistory { knots: VecDeque::new(), reach_s, discontinuous, since_reset: 0 }
    }

    /// Adds a row; `integral` is the integral since the last row. For a discontinuous signal, `value` and `slope` are those of the row that
    /// begins, and the integral is computed from them.
    pub(super) fn push(&mut self, t_s: f64, integral: S, value: S, slope: S) {
        let sum = match self.knots.back() {
            Some(last) if self.discontinuous => last.sum + (last.value + last.slope * (0.5 * (t_s - last.t_s))) * (t_s - last.t_s),
            Some(last) => last.sum + integral,
            None => S::zero(),
        };
        self.knots.push_back(Knot { t_s, sum, value, slope });
        while self.knots.len() > 2 && self.knots[1].t_s < t_s - self.reach_s {
            self.knots.pop_front();
        }
        self.since_reset += 1;
        if self.since_reset == RESET_ROWS {
            self.since_reset = 0;
            let begin = self.knots[0].sum;
            self.knots.iter_mut().for_each(|k| k.sum -= begin);
        }
    }

    /// The value at the last row was corrected.
    pub(super) fn correct(&mut self, value: S) {
        if let Some(knot) = self.knots.back_mut() {
            knot.value = value;
        }
    }

    /// Time of the oldest row.
    pub(super) fn begin_s(&self) -> Option<f64> {
        self.knots.front().map(|k| k.t_s)
    }

    /// The integral at `wanted_s`.
    pub(super) fn sum(&self, wanted_s: f64) -> Option<S> {
        let k = self.knots.partition_point(|k| k.t_s < wanted_s - TIME_TOLERANCE_S);
        match self.knots.get(k) {
            Some(knot) if knot.t_s - wanted_s < TIME_TOLERANCE_S => Some(knot.sum),
            _ => self.at(wanted_s).map(|p| p.sum),
        }
    }

    /// Integral, value and slope at `wanted_s`. The slope at a row is that after the row, at the last row that before. `None` without rows.
    pub(super) fn at(&self, wanted_s: f64) -> Option<SignalValue<S>> {
        let after = self.knots.partition_point(|k| k.t_s <= wanted_s + TIME_TOLERANCE_S);
        let Some(before) = after.checked_sub(1) else {
            let first = self.knots.front()?;
            return Some(SignalValue { sum: first.sum + first.value * (wanted_s - first.t_s), value: first.value, slope: S::zero() });
        };
        if self.discontinuous {
            let knot = self.knots.get(before)?;
            let s = wanted_s - knot.t_s;
            let rise = knot.slope * s;
            return Some(SignalValue { sum: knot.sum + (knot.value + rise * 0.5) * s, value: knot.value + rise, slope: knot.slope });
        }
        let before = before.min(self.knots.len().saturating_sub(2));
        let a = self.knots.get(before)?;
        let Some(b) = self.knots.get(before + 1) else {
            return Some(SignalValue { sum: a.sum + a.value * (wanted_s - a.t_s), value: a.value, slope: S::zero() });
        };
        let h = b.t_s - a.t_s;
        let x = (wanted_s - a.t_s) / h;
        let rise = b.value - a.value;
        let curvature = ((b.sum - a.sum) / h - (a.value + b.value) * 0.5) * 6.0;
        Some(SignalValue {
            sum: a.sum + (a.value * x + rise * (0.5 * x * x) + curvature * (x * x * (0.5 - x / 3.0))) * h,
            value: a.value + rise * x + curvature * (x * (1.0 - x)),
            slope: (rise + curvature * (1.0 - 2.0 * x)) / h,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn past(discontinuous: bool, knots: &[(f64, f64, f64, f64)]) -> SignalHistory<f64> {
        let mut past = SignalHistory::new(1.0, discontinuous);
        let mut last = 0.0;
        for &(t_s, sum, value, slope) in knots {
            past.push(t_s, sum - last, value, slope);
            last = sum;
        }
        past
    }

    /// ω = 1 + 2 t − 3 t², whose integral is a cubic.
    #[test]
    fn parabola_between_rows_is_exact() {
        let value = |t: f64| 1.0 + 2.0 * t - 3.0 * t * t;
        let sum = |t: f64| t + t * t - t * t * t;
        let knots: Vec<_> = [0.0, 0.3, 0.5].map(|t| (t, sum(t), value(t), 0.0)).to_vec();
        let past = past(false, &knots);
        for t in [0.0, 0.1, 0.3, 0.37, 0.5] {
            let p = past.at(t).unwrap();
            assert!((p.sum - sum(t)).abs() < 1e-15 && (past.sum(t).unwrap() - sum(t)).abs() < 1e-15, "{t}");
            assert!((p.value - value(t)).abs() < 1e-15 && (p.slope - (2.0 - 6.0 * t)).abs() < 1e-14, "{t}");
        }
    }

    /// A rate that halves in a row of 20 ms, h/τ = 0.69. Error of the parabola: at most (h/τ)³ √3/216 = 2.7e-3 of the first rate; of a
    /// straight line: (h/τ)²/8 of the mean rate, 4e-2.
    #[test]
    fn decay_within_a_long_row_is_interpolated() {
        let (tau, h): (f64, f64) = (0.029, 0.02);
        let value = |t: f64| (-t / tau).exp();
        let sum = |t: f64| tau * (1.0 - (-t / tau).exp());
        let past = past(false, &[(0.0, 0.0, value(0.0), 0.0), (h, sum(h), value(h), 0.0)]);
        let worst = |of: &dyn Fn(f64) -> f64| (1..20).map(|k| f64::from(k) * 1e-3).fold(0.0, |w: f64, t| w.max((of(t) - value(t)).abs()));
        let parabola = worst(&|t| past.at(t).unwrap().value);
        assert!(parabola < 2.7e-3, "{parabola}");
        let line = worst(&|t| 1.0 + (value(h) - 1.0) * t / h);
        assert!(line > 10.0 * parabola, "{line} {parabola}");
    }

    /// 1 A, then 3 A: the discontinuity is at the row.
    #[test]
    fn current_changes_at_the_row() {
        let past = past(true, &[(0.0, 0.0, 1.0, 0.0), (0.02, 0.02, 3.0, 0.0)]);
        assert_eq!(past.at(0.0199).unwrap().value, 1.0);
        assert_eq!(past.at(0.02).unwrap().value, 3.0);
        assert!((past.at(0.03).unwrap().sum - 0.05).abs() < 1e-15, "integral within the last row");
    }

    /// An angle after an hour at 100 rad/s: 3.6e5 rad, integral 6e8 rad s. Differences of such integrals over 1 ms resolve 1e-4 rad; with a
    /// reset every 1000 rows they resolve 1e-7 rad.
    #[test]
    fn resolution_is_kept_over_an_hour() {
        let mut past: SignalHistory<f64> = SignalHistory::new(0.01, false);
        let mut last = 0.0;
        for k in 0..3_600_000 {
            let t = f64::from(k) * 1e-3;
            past.push(t, (t - last) * 50.0 * (t + last), 100.0 * t, 0.0);
            last = t;
        }
        let t = last - 0.0045;
        assert!((past.at(t).unwrap().value - 100.0 * t).abs() < 1e-6, "{}", past.at(t).unwrap().value - 100.0 * t);
    }

    #[test]
    fn signal_is_constant_before_the_first_row() {
        let past = past(false, &[(1.0, 0.0, 2.0, 0.0), (1.5, 1.5, 4.0, 0.0)]);
        let p = past.at(0.75).unwrap();
        assert_eq!((p.sum, p.value, p.slope), (-0.5, 2.0, 0.0));
    }
}
