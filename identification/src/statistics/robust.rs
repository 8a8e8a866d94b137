//! Robust location and scale: quantiles, median, median absolute value.
//!
//! Quantiles are order statistics without interpolation: the value at index ⌊fraction · n⌋ of the sorted series. The median of an even
//! number of values is therefore the upper one of the two in the middle.

/// Median of the magnitude of a normal deviate of standard deviation 1.
pub const MEDIAN_ABS_PER_SIGMA: f64 = 0.6745;

/// Quantile of `values`, which are reordered; `None` for an empty series. `fraction` is between 0 and 1.
pub fn quantile_in_place(values: &mut [f64], fraction: f64) -> Option<f64> {
    let last = values.len().checked_sub(1)?;
    let index = ((fraction * values.len() as f64) as usize).min(last);
    Some(*values.select_nth_unstable_by(index, f64::total_cmp).1)
}

/// Quantile of a series; `None` for an empty one.
pub fn quantile(values: impl IntoIterator<Item = f64>, fraction: f64) -> Option<f64> {
    quantile_in_place(&mut values.into_iter().collect::<Vec<_>>(), fraction)
}

/// Median of `values`, which are reordered; `None` for an empty series.
pub fn median_in_place(values: &mut [f64]) -> Option<f64> {
    quantile_in_place(values, 0.5)
}

/// Median of a series; `None` for an empty one.
pub fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    quantile(values, 0.5)
}

/// Median of the magnitudes; `None` for an empty series. Over [`MEDIAN_ABS_PER_SIGMA`] it estimates the standard deviation of values about
/// zero.
pub fn median_abs(values: &[f64]) -> Option<f64> {
    median(values.iter().map(|value| value.abs()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_order_statistics() {
        let values = [4.0, -1.0, 3.0, 2.0];
        assert_eq!(median(values), Some(3.0));
        assert_eq!(median(values[..3].iter().copied()), Some(3.0));
        assert_eq!(quantile(values, 0.25), Some(2.0));
        assert_eq!((quantile(values, 0.0), quantile(values, 1.0)), (Some(-1.0), Some(4.0)));
        assert_eq!(median_abs(&[-7.0, 1.0, -2.0]), Some(2.0));
    }

    #[test]
    fn an_empty_series_has_no_median() {
        assert_eq!((median([]), median_in_place(&mut []), median_abs(&[])), (None, None, None));
    }
}
