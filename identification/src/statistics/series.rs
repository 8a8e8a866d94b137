//! Histogram and autocorrelation of a series.

use super::fourier::Transforms;

/// A histogram with density on its vertical axis.
pub struct Histogram {
    /// Left edge of the first bin.
    pub from: f64,
    /// Width of a bin.
    pub width: f64,
    /// Density in each bin, 1/unit.
    pub density: Vec<f64>,
}

/// Distribution of the finite values between ± `reach`; values beyond are counted in the outermost bins.
pub fn histogram(values: &[f64], reach: f64, bins: usize) -> Histogram {
    let width = 2.0 * reach / bins.max(1) as f64;
    let mut counts = vec![0usize; bins];
    let mut n = 0usize;
    for v in values.iter().filter(|v| v.is_finite()) {
        let bin = (((v + reach) / width).max(0.0) as usize).min(bins.saturating_sub(1));
        if let Some(count) = counts.get_mut(bin) {
            *count += 1;
            n += 1;
        }
    }
    let unit = (n.max(1) as f64 * width).max(f64::MIN_POSITIVE);
    Histogram { from: -reach, width, density: counts.into_iter().map(|c| c as f64 / unit).collect() }
}

/// Sample autocorrelation of a series.
pub struct Autocorrelation {
    /// Correlation at the lags 1, 2, … rows
    pub correlation: Vec<f64>,
    /// Half-width of the band that holds 95 % of the values for white noise: 1.96/√n.
    pub band: f64,
}

/// Autocorrelation up to `lags` rows; values that are not finite are ignored.
pub fn autocorrelation(values: &[f64], lags: usize) -> Autocorrelation {
    let (sum, n) = values.iter().filter(|v| v.is_finite()).fold((0.0, 0usize), |(s, n), v| (s + v, n + 1));
    let mean = sum / n.max(1) as f64;
    let power: f64 = values.iter().filter(|v| v.is_finite()).map(|v| (v - mean).powi(2)).sum();
    let lags = lags.min(n / 4);
    let correlation = (1..=lags)
        .map(|lag| {
            let later = values.get(lag..).unwrap_or(&[]);
            let products = values.iter().zip(later).map(|(a, b)| (a - mean) * (b - mean));
            products.filter(|p| p.is_finite()).sum::<f64>() / power.max(f64::MIN_POSITIVE)
        })
        .collect();
    Autocorrelation { correlation, band: 1.96 / (n.max(1) as f64).sqrt() }
}

/// Σ vₖ vₖ₊ₛ of a series for the shifts s from 0 to `shifts`, by Fourier transforms of blocks that overlap by the largest shift; `None`
/// where the series has a value that is not finite.
pub fn products_by_shift(series: &[f64], shifts: usize) -> Option<Vec<f64>> {
    if !series.iter().all(|v| v.is_finite()) {
        return None;
    }
    let length = (4 * shifts).min(series.len() + shifts).next_power_of_two().max(2);
    let block = length - shifts;
    let transforms = Transforms::of_length(length);
    let mut padded = vec![0.0; length];
    let mut sum = transforms.forward(&mut padded);
    for from in (0..series.len()).step_by(block) {
        let mut lines_of = |count: usize| {
            let values = &series[from..(from + count).min(series.len())];
            padded.fill(0.0);
            padded[..values.len()].copy_from_slice(values);
            transforms.forward(&mut padded)
        };
        let (of_block, with_next) = (lines_of(block), lines_of(length));
        for ((sum, a), b) in sum.iter_mut().zip(&of_block).zip(&with_next) {
            *sum += a.conj() * b;
        }
    }
    let products: Vec<f64> = transforms.inverse(&mut sum).iter().take(shifts + 1).map(|v| v / length as f64).collect();
    products.iter().all(|p| p.is_finite()).then_some(products)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_are_those_of_the_sums() {
        let series: Vec<f64> = (0..1003u32).map(|k| f64::from(k.wrapping_mul(2_654_435_761) >> 16) / 65536.0 - 0.4).collect();
        // One block, and several of which the last is short.
        for shifts in [1000, 40] {
            let products = products_by_shift(&series, shifts).unwrap();
            for (shift, product) in products.iter().enumerate() {
                let expected: f64 = series.iter().zip(&series[shift..]).map(|(a, b)| a * b).sum();
                assert!((product - expected).abs() < 1e-9, "{shift} of {shifts}: {product}, {expected}");
            }
            assert_eq!(products.len(), shifts + 1);
        }
        assert_eq!(products_by_shift(&[1.0, f64::NAN], 1), None);
        assert_eq!(products_by_shift(&[], 0), Some(vec![0.0]));
    }
}
