//! Amplitudes of the harmonic orders of a ripple, and whether a compensation has made them larger.

use stand_firmware::compensation::MAX_HARMONIC_ORDER;

use identification::statistics::robust::median;

/// Orders on each side whose median amplitude is the noise floor of an order.
const NEIGHBOURS: u16 = 8;
/// Growth, in noise floors, that noise alone exceeds once in a thousand comparisons. Noise with the standard deviation σ in each quadrature
/// has the median amplitude √(2 ln 2) σ (Rayleigh); the difference of two amplitudes scatters by √2 σ, and 3.09 of these is its one-sided
/// limit of 0.1 %.
const GROWTH_FLOORS: f64 = 3.09 * std::f64::consts::SQRT_2 / 1.177_41;

/// Amplitudes of the harmonic orders 1, 2, … of a rate over whole turns, rad/s.
#[derive(Debug, Clone, PartialEq)]
pub struct OrderSpectrum {
    amplitudes_rad_s: Vec<f64>,
}

/// The amplitude of an order before and after a compensation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrderChange {
    /// Harmonic order.
    pub order: u16,
    /// Amplitude before, rad/s.
    pub before_rad_s: f64,
    /// Amplitude after, rad/s.
    pub after_rad_s: f64,
}

impl OrderSpectrum {
    /// Fourier sums over whole turns. Each sample is the angle, rad, the rate's deviation from its mean, rad/s, and its weight.
    pub fn of(samples: impl Iterator<Item = (f64, f64, f64)>) -> Self {
        let mut sums = vec![[0.0; 2]; usize::from(MAX_HARMONIC_ORDER + NEIGHBOURS)];
        let mut weights = 0.0;
        for (theta_rad, rate_rad_s, weight) in samples {
            let (sine, cosine) = theta_rad.sin_cos();
            let [mut re, mut im] = [weight * rate_rad_s, 0.0];
            for sum in &mut sums {
                [re, im] = [re * cosine - im * sine, re * sine + im * cosine];
                *sum = [sum[0] + re, sum[1] + im];
            }
            weights += weight;
        }
        Self { amplitudes_rad_s: sums.into_iter().map(|[re, im]| 2.0 * re.hypot(im) / weights).collect() }
    }

    /// The spectrum of the rate whose integral has the amplitudes of `self`, at the mean rate `rate_rad_s`: order n of an angle, rad, times
    /// n · rate.
    #[must_use]
    pub fn of_angle_to_rate(mut self, rate_rad_s: f64) -> Self {
        let orders = (1..).map(|order: u16| f64::from(order));
        self.amplitudes_rad_s.iter_mut().zip(orders).for_each(|(amplitude, order)| *amplitude *= order * rate_rad_s.abs());
        self
    }

    /// Amplitude of `order`, rad/s; 0 for an order that the firmware cannot compensate.
    pub fn amplitude(&self, order: u16) -> f64 {
        usize::from(order).checked_sub(1).and_then(|k| self.amplitudes_rad_s.get(k)).copied().unwrap_or(0.0)
    }

    /// The order with the largest amplitude, up to order 64.
    pub fn largest(&self) -> Option<u16> {
        (1..=64).max_by(|a, b| self.amplitude(*a).total_cmp(&self.amplitude(*b)))
    }

    /// Noise floor at `order`, rad/s: the median amplitude of its neighbours that are not in `orders`.
    fn floor(&self, order: u16, orders: &[u16]) -> f64 {
        let neighbours = order.saturating_sub(NEIGHBOURS).max(1)..=order + NEIGHBOURS;
        median(neighbours.filter(|n| *n != order && !orders.contains(n)).map(|n| self.amplitude(n))).unwrap_or(0.0)
    }

    /// The orders that are larger in `self` than in `before`, if the compensation of `orders` has made the ripple larger: the root sum of
    /// squares of these orders has grown by more than noise explains.
    pub fn grown_from(&self, before: &OrderSpectrum, orders: &[u16]) -> Option<Vec<OrderChange>> {
        let total = |spectrum: &Self| orders.iter().map(|order| spectrum.amplitude(*order).powi(2)).sum::<f64>().sqrt();
        let floor = |order: u16| self.floor(order, orders).max(before.floor(order, orders));
        let largest_floor = orders.iter().map(|order| floor(*order)).fold(0.0, f64::max);
        if total(self) <= total(before) + GROWTH_FLOORS * largest_floor {
            return None;
        }
        let change = |&order: &u16| OrderChange { order, before_rad_s: before.amplitude(order), after_rad_s: self.amplitude(order) };
        let mut grown: Vec<OrderChange> = orders.iter().map(change).filter(|change| change.after_rad_s > change.before_rad_s).collect();
        grown.sort_by(|a, b| (b.after_rad_s - b.before_rad_s).total_cmp(&(a.after_rad_s - a.before_rad_s)));
        Some(grown)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::f64::consts::TAU;

    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::{Rng, SeedableRng};

    use super::*;

    /// A sum of twelve uniform numbers, nearly normal, of standard deviation 1.
    fn normal(random: &mut Xoshiro256PlusPlus) -> f64 {
        (0..12).map(|_| random.next_u64() as f64 / u64::MAX as f64).sum::<f64>() - 6.0
    }

    /// Four turns with these orders and white noise of standard deviation `noise_rad_s`.
    fn spectrum(orders: &[(u16, f64)], noise_rad_s: f64, seed: u64) -> OrderSpectrum {
        let count = 1600;
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        OrderSpectrum::of((0..count).map(|k| {
            let theta_rad = 4.0 * TAU * k as f64 / count as f64;
            let ripple: f64 = orders.iter().map(|(order, a)| a * (f64::from(*order) * theta_rad + 0.3).sin()).sum();
            (theta_rad, ripple + noise_rad_s * normal(&mut random), 1.0)
        }))
    }

    #[test]
    fn amplitudes_are_those_of_the_orders() {
        let one = spectrum(&[(1, 0.5), (7, 0.02), (150, 0.003)], 0.0, 1);
        for (order, amplitude) in [(1, 0.5), (7, 0.02), (150, 0.003), (14, 0.0)] {
            assert!((one.amplitude(order) - amplitude).abs() < 1e-12, "order {order}: {}", one.amplitude(order));
        }
        assert_eq!((one.largest(), one.amplitude(0), one.amplitude(5000)), (Some(1), 0.0, 0.0));
        let rate = one.of_angle_to_rate(-2.0);
        assert!((rate.amplitude(7) - 0.02 * 14.0).abs() < 1e-12);
    }

    #[test]
    fn noise_alone_is_no_growth_and_a_new_order_is() {
        let orders = [7, 14];
        let grown = |seed: u64| spectrum(&[], 1e-3, 2 * seed).grown_from(&spectrum(&[], 1e-3, 2 * seed + 1), &orders).is_some();
        assert!((0..200).filter(|seed| grown(*seed)).count() <= 2);
        // A known order with other noise.
        let known = |seed: u64| spectrum(&[(14, 0.01)], 1e-3, seed);
        assert!((0..200).filter(|seed| known(2 * seed).grown_from(&known(2 * seed + 1), &orders).is_some()).count() <= 2);
        let learnt_elsewhere = spectrum(&[(14, 0.01), (7, 0.008)], 1e-3, 5);
        let changes = learnt_elsewhere.grown_from(&known(6), &orders).unwrap();
        assert_eq!(changes[0].order, 7);
        assert!((changes[0].after_rad_s - 0.008).abs() < 3e-4, "{changes:?}");
        // One order falls by more than the other grows.
        let better = spectrum(&[(14, 1e-4), (7, 0.003)], 1e-3, 7);
        assert_eq!(better.grown_from(&known(8), &orders), None);
    }
}
