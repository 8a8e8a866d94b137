//! Histogram and autocorrelation of a series.

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
