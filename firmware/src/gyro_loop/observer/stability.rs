//! Whether an observer's error dies away: the greatest pole of Φ − K C, by squaring the matrix over and over.
//!
//! The 2ᵏth root of the norm of the 2ᵏth power goes to the greatest pole, however many poles lie together, where a characteristic polynomial of
//! six equal ones would be off by its rounding's sixth root. It takes some 30 products of matrices in double precision, several milliseconds on the chip:
//! so one row of a product at a time.

use crate::config::ConfigError;

/// Squarings. A transient that grows by 2²⁰⁰ before it falls moves the logarithm of the pole by 200 · 2⁻³².
const SQUARINGS: u8 = 32;
/// A pole must be this far inside, log₂ per step: at 1 ms a time constant below 2.4 hours. The method errs by less.
const LEAST_LOG2: f64 = 1.6e-7;

/// A check under way.
#[derive(Clone, Debug)]
pub struct Stability<const N: usize> {
    power: [[f64; N]; N],
    square: [[f64; N]; N],
    row: usize,
    squared: u8,
    /// Logarithm of what was divided out of `power`, over the exponent of the power: per step.
    log2: f64,
    /// 1 over the exponent of the power.
    share: f64,
}

impl<const N: usize> Stability<N> {
    /// Begins the check of an observer that sees its first state.
    pub fn new(phi: &[[f64; N]; N], gain: &[f64; N]) -> Self {
        let mut power = *phi;
        for (row, gain) in power.iter_mut().zip(gain) {
            if let Some(first) = row.first_mut() {
                *first -= gain;
            }
        }
        let mut begun = Self { power, square: [[0.0; N]; N], row: 0, squared: 0, log2: 0.0, share: 1.0 };
        begun.scale();
        begun
    }

    /// Does a piece of the work: one row of a product. `None` while there is more.
    pub fn work(&mut self) -> Option<Result<(), ConfigError>> {
        if self.share == 0.0 {
            return Some(Ok(()));
        }
        if self.squared >= SQUARINGS {
            // NaN is not stable either.
            let stable = self.log2 < -LEAST_LOG2;
            let why = "leaves a pole on or outside the unit circle: the observer would not be stable at this step";
            return Some(if stable { Ok(()) } else { Err(ConfigError::Unfit("gain", why)) });
        }
        let Self { power, square, row, .. } = self;
        if let (Some(to), Some(from)) = (square.get_mut(*row), power.get(*row)) {
            *to = [0.0; N];
            for (factor, other) in from.iter().zip(power.iter()) {
                for (sum, value) in to.iter_mut().zip(other) {
                    *sum += factor * value;
                }
            }
        }
        *row += 1;
        if *row >= N {
            *row = 0;
            self.power = self.square;
            self.squared += 1;
            self.share *= 0.5;
            self.scale();
        }
        None
    }

    /// Divides the power by its greatest entry's power of two. What has become nothing is stable for sure: its share is 0.
    fn scale(&mut self) {
        let greatest = self.power.as_flattened().iter().fold(0.0, |most: f64, entry| if entry.abs() <= most { most } else { entry.abs() });
        if greatest == 0.0 {
            self.share = 0.0;
            return;
        }
        // The exponent as it is written in the number; of no number it is the greatest.
        let exponent = (greatest.to_bits() >> 52) as i32 - 1023;
        self.log2 += f64::from(exponent) * self.share;
        let factor = f64::from_bits(((1023 - exponent).clamp(1, 2046) as u64) << 52);
        for entry in self.power.as_flattened_mut() {
            *entry *= factor;
        }
    }
}
