//! External moment of a simulation: constant, harmonic and random parts.
//!
//! Input: amplitudes and times. Output: the moment in each step, taken as constant over the step at its value in the middle; the error of a
//! harmonic is (ω h)²/24 of its amplitude.

use hal_sim::peripherals::Noise;
use std::f64::consts::TAU;

/// A harmonic moment M sin(2π f t).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Harmonic {
    /// Amplitude, N m.
    pub amplitude_N_m: f64,
    /// Frequency, Hz.
    pub frequency_Hz: f64,
}

/// A random moment: normally distributed, with an exponential autocorrelation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Random {
    /// Standard deviation, N m.
    pub sigma_N_m: f64,
    /// Correlation time, s.
    pub correlation_s: f64,
    /// Seed.
    pub seed: u64,
}

/// A moment about the vertical from t = 0.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Moment {
    /// Constant part, N m.
    pub constant_N_m: f64,
    /// Harmonic part.
    pub harmonic: Option<Harmonic>,
    /// Random part.
    pub random: Option<Random>,
}

impl Moment {
    /// A constant moment, N m.
    pub fn constant(constant_N_m: f64) -> Self {
        Self { constant_N_m, ..Self::default() }
    }

    /// The moment is constant, so that a steady state exists.
    pub fn is_constant(&self) -> bool {
        self.harmonic.is_none() && self.random.is_none()
    }

    /// The moment in `count` steps of `step_s` from t = 0, N m.
    pub fn series(&self, count: usize, step_s: f64) -> Vec<f64> {
        let mut noise = Noise::new(self.random.map_or(0, |random| random.seed), 40, 1.0);
        let mut state = self.random.map_or(0.0, |random| random.sigma_N_m * noise.draw());
        (0..count)
            .map(|k| {
                let harmonic = self.harmonic.map_or(0.0, |h| h.amplitude_N_m * (TAU * h.frequency_Hz * (k as f64 + 0.5) * step_s).sin());
                let value = self.constant_N_m + harmonic + state;
                if let Some(random) = self.random {
                    let decay = (-step_s / random.correlation_s).exp();
                    state = decay * state + random.sigma_N_m * (1.0 - decay * decay).sqrt() * noise.draw();
                }
                value
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_add_up_and_the_random_part_has_its_variance_and_correlation() {
        let constant = Moment::constant(2.0);
        assert!(constant.is_constant() && constant.series(3, 0.1) == [2.0; 3]);
        let harmonic = Moment { harmonic: Some(Harmonic { amplitude_N_m: 1.0, frequency_Hz: 1.0 }), ..constant };
        assert!((harmonic.series(1, 0.5)[0] - 3.0).abs() < 1e-12 && !harmonic.is_constant());
        let random = Moment { random: Some(Random { sigma_N_m: 3.0, correlation_s: 0.2, seed: 5 }), ..Moment::default() };
        let series = random.series(200_000, 0.01);
        let mean = |lag: usize| series.iter().zip(&series[lag..]).map(|(a, b)| a * b).sum::<f64>() / (series.len() - lag) as f64;
        assert!((mean(0) / 9.0 - 1.0).abs() < 0.06, "{}", mean(0));
        // One correlation time later: 1/e.
        assert!((mean(20) / mean(0) - (-1_f64).exp()).abs() < 0.03, "{}", mean(20) / mean(0));
    }
}
