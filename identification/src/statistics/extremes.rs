//! Smallest and largest values of a series.

/// Extremes of an iterator of values. NaN is ignored.
pub trait Extremes: Iterator<Item = f64> + Sized {
    /// Smallest and largest value; (∞, −∞) for an empty series.
    fn min_max(self) -> (f64, f64) {
        self.fold((f64::INFINITY, f64::NEG_INFINITY), |(min, max), value| (min.min(value), max.max(value)))
    }

    /// Largest value, and at least 0.
    fn max_or_zero(self) -> f64 {
        self.fold(0.0, f64::max)
    }

    /// Smallest value; ∞ for an empty series.
    fn min_or_infinity(self) -> f64 {
        self.fold(f64::INFINITY, f64::min)
    }

    /// Largest magnitude; 0 for an empty series.
    fn max_abs(self) -> f64 {
        self.fold(0.0, |max, value| max.max(value.abs()))
    }
}

impl<I: Iterator<Item = f64>> Extremes for I {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extremes_of_a_series() {
        let values = [3.0, f64::NAN, -5.0, 1.0];
        assert_eq!(values.into_iter().min_max(), (-5.0, 3.0));
        assert_eq!(
            (values.into_iter().max_or_zero(), values.into_iter().min_or_infinity(), values.into_iter().max_abs()),
            (3.0, -5.0, 5.0)
        );
    }

    #[test]
    fn extremes_of_an_empty_series() {
        let none = || std::iter::empty::<f64>();
        assert_eq!(none().min_max(), (f64::INFINITY, f64::NEG_INFINITY));
        assert_eq!((none().max_or_zero(), none().min_or_infinity(), none().max_abs()), (0.0, f64::INFINITY, 0.0));
    }
}
