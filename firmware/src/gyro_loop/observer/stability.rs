//! Stability of an observer and of its closed loop: the largest pole of Φ − K C, or of Φ − Γ R, by repeated squaring of the matrix.
//!
//! The 2ᵏth root of the norm of the 2ᵏth power converges to the largest pole, for multiple poles, too; a characteristic polynomial with six
//! equal roots would lose all but a sixth of its digits. It takes some 30 matrix products in double precision, several milliseconds on the
//! chip, and is therefore done one row of a product at a time.

use crate::config::ConfigError;

/// Number of squarings. A transient that grows by 2²⁰⁰ first changes the pole's logarithm by 200 · 2⁻³².
const SQUARINGS: u8 = 32;
/// Required distance of the poles from the unit circle, −log₂ per step: a time constant below 2.5 hours at 1 ms. The method's error is
/// smaller.
const MIN_LOG2: f64 = 1.6e-7;

/// A running check.
#[derive(Clone, Debug)]
pub struct Stability<const N: usize> {
    power: [[f64; N]; N],
    square: [[f64; N]; N],
    row: usize,
    squarings: u8,
    /// Logarithm of the factors divided out of `power`, per step.
    log2: f64,
    /// 1 over the exponent of the power.
    share: f64,
}

impl<const N: usize> Stability<N> {
    /// A check of an observer that measures its first state.
    pub fn new(phi: &[[f64; N]; N], gain: &[f64; N]) -> Self {
        let mut power = *phi;
        for (row, gain) in power.iter_mut().zip(gain) {
            if let Some(first) = row.first_mut() {
                *first -= gain;
            }
        }
        Self::of_matrix(power)
    }

    /// A check of the loop of plant and regulator, u = −R x, over the first `states`: estimated and true states have the same poles, beside
    /// those of the observer.
    pub fn of_loop(phi: &[[f64; N]; N], gamma: &[f64; N], regulator: &[f64; N], states: usize) -> Self {
        let mut power = [[0.0; N]; N];
        for ((to, from), gamma) in power.iter_mut().zip(phi).zip(gamma).take(states) {
            for ((entry, phi), gain) in to.iter_mut().zip(from).zip(regulator).take(states) {
                *entry = phi - gamma * gain;
            }
        }
        Self::of_matrix(power)
    }

    fn of_matrix(power: [[f64; N]; N]) -> Self {
        let mut check = Self { power, square: [[0.0; N]; N], row: 0, squarings: 0, log2: 0.0, share: 1.0 };
        check.scale();
        check
    }

    /// Computes one row of a product. `None` until the check is complete.
    ///
    /// # Errors
    /// A pole lies on or outside the unit circle.
    pub fn step(&mut self) -> Option<Result<(), ConfigError>> {
        if self.share == 0.0 {
            return Some(Ok(()));
        }
        if self.squarings >= SQUARINGS {
            // An infinite entry or NaN has the exponent 1024, which makes the sum positive: not stable.
            let stable = self.log2 < -MIN_LOG2;
            let why = "leaves a pole on or outside the unit circle: the observer, or its loop, would not be stable at this step";
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
            self.squarings += 1;
            self.share *= 0.5;
            self.scale();
        }
        None
    }

    /// Divides the power by the power of two of its largest entry. A power of zero is stable: its share becomes 0.
    fn scale(&mut self) {
        let largest = self.power.as_flattened().iter().fold(0.0, |max: f64, entry| if entry.abs() <= max { max } else { entry.abs() });
        if largest == 0.0 {
            self.share = 0.0;
            return;
        }
        // The exponent in the number's bits; NaN has the largest.
        let exponent = (largest.to_bits() >> 52) as i32 - 1023;
        self.log2 += f64::from(exponent) * self.share;
        let factor = f64::from_bits(((1023 - exponent).clamp(1, 2046) as u64) << 52);
        for entry in self.power.as_flattened_mut() {
            *entry *= factor;
        }
    }
}
