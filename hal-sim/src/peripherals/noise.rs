//! White noise by seed: one stream for each sensor.

use super::normal::standard_normal;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// A stream of normal deviates with a given standard deviation.
#[derive(Clone, Debug)]
pub struct Noise {
    generator: Xoshiro256PlusPlus,
    sigma: f64,
}

impl Noise {
    /// Stream `stream` of `seed`; 2¹²⁸ deviates separate two streams.
    pub fn new(seed: u64, stream: u32, sigma: f64) -> Self {
        let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed);
        for _ in 0..stream {
            generator.jump();
        }
        Self { generator, sigma }
    }

    /// The next deviate; draws nothing where the noise is zero.
    #[inline]
    pub fn draw(&mut self) -> f64 {
        if self.sigma == 0.0 {
            return 0.0;
        }
        self.sigma * standard_normal(&mut self.generator)
    }

    /// Uniform in ±`most`, independent of the standard deviation of the stream.
    pub fn uniform(&mut self, most: f64) -> f64 {
        let whole = (self.generator.next_u64() >> 11) as f64 / (1_u64 << 52) as f64;
        (whole - 1.0) * most
    }
}
