//! Lock-in: complex response of a column to the rate of the platform at one frequency, with uncertainty and coherence.
//!
//! Input: row times, s; encoder angle, rad; samples of the sensor and their age, s. Output: sensor over rate as gain and phase. Angle and
//! sensor are fitted by a sine over whole periods and a polynomial; the rate is the derivative of the angle, jω θ.

use identification::statistics::least_squares;
use std::f64::consts::TAU;

/// Sensor over rate at one frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response {
    /// Frequency, Hz.
    pub frequency_Hz: f64,
    /// Real part.
    pub re: f64,
    /// Imaginary part.
    pub im: f64,
    /// Standard uncertainty of each part, by noise.
    pub sigma: f64,
    /// Standard uncertainty of the time of the samples against that of the angle, constant during the measurement, s: it turns the response
    /// and leaves its gain.
    pub timing_s: f64,
    /// Coherence: fraction of the sensor's power at the frequency that correlates with the motion of the platform; the noise is that of
    /// neighbouring frequencies.
    pub coherence: f64,
    /// Rate amplitude of the platform, rad/s.
    pub rate_rad_s: f64,
    /// Mean rate of the platform, rad/s.
    pub mean_rad_s: f64,
}

impl Response {
    /// Gain.
    pub fn gain(&self) -> f64 {
        self.re.hypot(self.im)
    }

    /// Phase, rad; negative for a delayed sensor.
    pub fn phase_rad(&self) -> f64 {
        self.im.atan2(self.re)
    }

    /// Standard uncertainty across the direction of the response, by noise and by the time of the samples.
    pub fn sigma_across(&self) -> f64 {
        self.sigma.hypot(self.gain() * TAU * self.frequency_Hz * self.timing_s)
    }
}

/// Least-squares sine: complex amplitude, its standard uncertainty, and the fraction of the variance that it explains.
struct Sine {
    re: f64,
    im: f64,
    sigma: f64,
    explained: f64,
}

/// Degree of the polynomial fitted with the sine; it takes up spin-up and drift. Degree 4 left an error of 1e-4 of the gain at 5 Hz, and
/// with it of 1e-3 of the damping.
const POLYNOMIAL_DEGREE: i32 = 8;
/// Frequencies at which the noise is evaluated, in units of 1/length: outside the main lobe of the window.
const NOISE_BINS: std::ops::RangeInclusive<i32> = 3..=12;

fn sine(t_s: &[f64], y: &[f64], frequency_Hz: f64) -> Option<Sine> {
    let (first, last) = (*t_s.first()?, *t_s.last()?);
    let (middle, half) = (0.5 * (first + last), 0.5 * (last - first));
    // Hann weights keep slow motion that is no polynomial from leaking to the frequency of the sine.
    let weight = |t: f64| (std::f64::consts::FRAC_PI_2 * ((t - middle) / half).clamp(-1.0, 1.0)).cos();
    let rows: Vec<Vec<f64>> = t_s
        .iter()
        .map(|t| {
            let (sin, cos) = (TAU * frequency_Hz * t).sin_cos();
            let slow = (0..=POLYNOMIAL_DEGREE).map(|k| ((t - middle) / half).powi(k));
            [cos, sin].into_iter().chain(slow).map(|x| x * weight(*t)).collect()
        })
        .collect();
    let weighted: Vec<f64> = t_s.iter().zip(y).map(|(t, y)| y * weight(*t)).collect();
    let fit = least_squares(&rows, &weighted)?;
    // The noise is the residual at neighbouring frequencies; slow motion does not count.
    let total: f64 = t_s.iter().map(|t| weight(*t).powi(2)).sum();
    let residual_power = |f: f64| {
        let (mut re, mut im) = (0.0, 0.0);
        for (t, r) in t_s.iter().zip(&fit.residuals) {
            let (sin, cos) = (TAU * f * t).sin_cos();
            (re, im) = (re + weight(*t) * r * cos, im + weight(*t) * r * sin);
        }
        4.0 * (re * re + im * im) / (total * total)
    };
    let steps =
        NOISE_BINS.flat_map(|k| [-k, k]).map(|k| frequency_Hz + f64::from(k) / (last - first)).filter(|f| *f > 3.0 / (last - first));
    let neighbours: Vec<f64> = steps.map(residual_power).collect();
    let noise_2 = neighbours.iter().sum::<f64>() / neighbours.len().max(1) as f64;
    let [a, b] = [fit.coefficients[0], fit.coefficients[1]];
    // a cos + b sin = Re (a − jb) e^{jωt}; each part has half of the noise power.
    let size_2 = a * a + b * b;
    Some(Sine { re: a, im: -b, sigma: (0.5 * noise_2).sqrt(), explained: size_2 / (size_2 + noise_2).max(f64::MIN_POSITIVE) })
}

/// Mean rate over a stretch, with the weights of the fitted sine.
pub fn mean_rate(t_s: &[f64], theta: &[f64]) -> f64 {
    let (Some(first), Some(last)) = (t_s.first(), t_s.last()) else { return f64::NAN };
    let (mut sum, mut total) = (0.0, 0.0);
    for (t, angle) in t_s.windows(2).zip(theta.windows(2)) {
        let weight = (std::f64::consts::PI * (t[0] - first) / (last - first)).sin().powi(2);
        sum += weight * (angle[1] - angle[0]);
        total += weight * (t[1] - t[0]);
    }
    sum / total
}

/// Response at one frequency. `t_s`: row times, s; `age_s`: time from the sensor's sample to the row, s. `None` for less than two periods,
/// and without motion.
pub fn lock_in(t_s: &[f64], theta: &[f64], sensor: &[f64], age_s: Option<&[f64]>, frequency_Hz: f64) -> Option<Response> {
    let length_s = t_s.last()? - t_s.first()?;
    let periods = (length_s * frequency_Hz).floor();
    if periods < 2.0 {
        return None;
    }
    let until = t_s.first()? + periods / frequency_Hz;
    let rows = t_s.iter().take_while(|t| **t < until).count();
    let taken: Vec<f64> = match age_s {
        Some(age) => t_s.iter().zip(age).take(rows).map(|(t, age)| t - age).collect(),
        None => t_s[..rows].to_vec(),
    };
    let angle = sine(&t_s[..rows], &theta[..rows], frequency_Hz)?;
    let output = sine(&taken, &sensor[..rows], frequency_Hz)?;
    let omega = TAU * frequency_Hz;
    // jω θ.
    let (rate_re, rate_im) = (-omega * angle.im, omega * angle.re);
    let rate_2 = rate_re * rate_re + rate_im * rate_im;
    if rate_2.is_nan() || rate_2 <= 0.0 {
        return None;
    }
    let re = (output.re * rate_re + output.im * rate_im) / rate_2;
    let im = (output.im * rate_re - output.re * rate_im) / rate_2;
    let gain_2 = re * re + im * im;
    let sigma = ((output.sigma.powi(2) + gain_2 * (omega * angle.sigma).powi(2)) / rate_2).sqrt();
    Some(Response {
        frequency_Hz,
        re,
        im,
        sigma,
        timing_s: 0.0,
        coherence: output.explained,
        rate_rad_s: rate_2.sqrt(),
        mean_rad_s: mean_rate(&t_s[..rows], &theta[..rows]),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gain_phase_and_sample_age_are_found() {
        let t_s: Vec<f64> = (0..4000).map(|k| f64::from(k) * 1e-3).collect();
        let f = 17.3;
        // Sampled up to 0.6 ms before the row, unevenly.
        let age_s: Vec<f64> = (0..4000).map(|k| 6e-4 * ((f64::from(k) * 0.618).fract())).collect();
        let theta: Vec<f64> = t_s.iter().map(|t| 3.0 * t + 0.02 * (TAU * f * t).sin()).collect();
        let rate = 0.02 * TAU * f;
        let shown: Vec<f64> =
            t_s.iter().zip(&age_s).map(|(t, age)| 0.8 * rate * (TAU * f * (t - age) - 0.3).cos() + 3.0 + 0.01 * t).collect();
        let found = lock_in(&t_s, &theta, &shown, Some(&age_s), f).unwrap();
        assert!((found.gain() - 0.8).abs() < 1e-9 && (found.phase_rad() + 0.3).abs() < 1e-9, "{found:?}");
        assert!(found.coherence > 0.999_999 && (found.rate_rad_s - rate).abs() < 1e-9);
        let early = lock_in(&t_s, &theta, &shown, None, f).unwrap();
        assert!((early.phase_rad() + 0.3 + TAU * f * 3e-4).abs() < 2e-3, "without the ages, the mean age appears as a delay");
    }

    #[test]
    fn no_response_without_motion_or_in_short_logs() {
        let t_s: Vec<f64> = (0..1000).map(|k| f64::from(k) * 1e-3).collect();
        let still = vec![0.0; 1000];
        assert!(lock_in(&t_s, &still, &still, None, 10.0).is_none_or(|r| r.rate_rad_s == 0.0));
        assert!(lock_in(&t_s, &t_s, &t_s, None, 1.0).is_none());
    }
}
