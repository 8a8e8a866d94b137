//! Slow noise of an inertial sensor: flicker noise (bias instability) and rate random walk.
//!
//! Input: bias instability B and random walk K with the definitions of IEEE Std 952, annex C. Output: the deviation from the nominal bias
//! over time, 0 at power-on. The Allan deviation is √(2 ln 2/π) B = 0.664 B for the flicker noise and K √(τ/3) for the random walk.
//!
//! The flicker noise is a sum of first-order Gauss–Markov processes, whose time constants have the ratio 4. Each has the variance B² ln
//! 4/π: their one-sided densities add up to B²/(π f). The density ripples by 2/cosh(π²/ln 4) = 0.3 %. Between averaging times of 0.2 s and
//! 4000 s the Allan deviation is within 2 % of 0.664 B (test below); outside it is lower. White noise of a sensor of this class exceeds the
//! flicker noise by far below 0.2 s.

use super::Noise;
use std::f64::consts::PI;

/// Ratio of two neighbouring time constants.
const RATIO: f64 = 4.0;
/// Number of Gauss–Markov processes: time constants from 10 ms to 11.7 h.
const PROCESSES: usize = 12;
/// Shortest time constant, s.
const SHORTEST_S: f64 = 0.01;
/// Interval between two values, s; the value is constant in between.
const INTERVAL_S: f64 = 0.01;

/// A Gauss–Markov process: factor of its state per interval, and standard deviation added per interval.
#[derive(Clone, Copy, Debug, Default)]
struct Process {
    decay: f64,
    sigma: f64,
}

/// Flicker noise and random walk of one axis.
#[derive(Clone, Debug)]
pub struct SlowNoise {
    noise: Noise,
    processes: [Process; PROCESSES],
    states: [f64; PROCESSES],
    walk_per_interval: f64,
    walk: f64,
    has_flicker: bool,
    intervals: u64,
    value: f64,
}

impl SlowNoise {
    /// Stream `stream` of `seed`. `bias_instability` B has the unit of the reading, `random_walk` K this unit per √s.
    pub fn new(seed: u64, stream: u32, bias_instability: f64, random_walk: f64) -> Self {
        let sigma = bias_instability * (libm::log(RATIO) / PI).sqrt();
        let mut time_constant_s = SHORTEST_S;
        let processes = std::array::from_fn(|_| {
            let decay = libm::exp(-INTERVAL_S / time_constant_s);
            time_constant_s *= RATIO;
            Process { decay, sigma: sigma * (1.0 - decay * decay).sqrt() }
        });
        Self {
            noise: Noise::new(seed, stream, 1.0),
            processes,
            states: [0.0; PROCESSES],
            walk_per_interval: random_walk * INTERVAL_S.sqrt(),
            walk: 0.0,
            has_flicker: bias_instability != 0.0,
            intervals: 0,
            value: 0.0,
        }
    }

    /// The deviation at `t_s` after power-on; `t_s` must not decrease.
    #[inline]
    pub fn at(&mut self, t_s: f64) -> f64 {
        if !self.has_flicker && self.walk_per_interval == 0.0 {
            return 0.0;
        }
        while (self.intervals + 1) as f64 * INTERVAL_S <= t_s {
            self.step();
        }
        self.value
    }

    fn step(&mut self) {
        self.intervals += 1;
        if self.has_flicker {
            for (state, process) in self.states.iter_mut().zip(&self.processes) {
                *state = *state * process.decay + process.sigma * self.noise.draw();
            }
        }
        if self.walk_per_interval != 0.0 {
            self.walk += self.walk_per_interval * self.noise.draw();
        }
        self.value = self.states.iter().sum::<f64>() + self.walk;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Allan variance of a Gauss–Markov process of variance 1 (IEEE Std 952, annex C, exponentially correlated noise).
    fn markov_variance(tau_s: f64, time_constant_s: f64) -> f64 {
        let x = tau_s / time_constant_s;
        2.0 / x * (1.0 - (3.0 - 4.0 * (-x).exp() + (-2.0 * x).exp()) / (2.0 * x))
    }

    #[test]
    fn the_processes_have_the_floor_of_flicker_noise_from_a_fifth_of_a_second_to_an_hour() {
        let floor = (2.0 * 2_f64.ln() / PI).sqrt();
        let noise = SlowNoise::new(1, 0, 1.0, 0.0);
        for k in 0..=20 {
            let tau_s = 0.2 * (4000.0_f64 / 0.2).powf(f64::from(k) / 20.0);
            let variance: f64 = noise
                .processes
                .iter()
                .map(|p| p.sigma * p.sigma / (1.0 - p.decay * p.decay) * markov_variance(tau_s, -INTERVAL_S / p.decay.ln()))
                .sum();
            assert!((variance.sqrt() / floor - 1.0).abs() < 0.02, "{tau_s} s: {}", variance.sqrt() / floor);
        }
    }

    #[test]
    fn no_slow_noise_draws_nothing() {
        let mut noise = SlowNoise::new(1, 0, 0.0, 0.0);
        assert_eq!((noise.at(1e6), noise.intervals), (0.0, 0));
    }
}
