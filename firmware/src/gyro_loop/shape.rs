//! Reference pulses: equal and opposite, in whole steps of the torquer's converter.
//!
//! A step lasts one sample. The second pulse has the steps of the first with opposite sign, in the same sequence or reversed, so that the
//! sum over a cycle is exactly zero, rounding included.

/// Shape of a pulse.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shape {
    /// Constant amplitude.
    #[default]
    Rectangular,
    /// Rising to the amplitude in the middle, then falling.
    Triangular,
    /// Rising to the amplitude at the end.
    Sawtooth,
}

impl Shape {
    /// All shapes, in the sequence of the console's choices.
    pub const ALL: [Self; 3] = [Self::Rectangular, Self::Triangular, Self::Sawtooth];

    /// Whether the pulse is symmetric in time: then the reference cancels from (13) for any amplitude.
    pub fn is_symmetric(self) -> bool {
        self != Self::Sawtooth
    }
}

/// A pair of pulses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pulse {
    /// Shape of each pulse.
    pub shape: Shape,
    /// The second pulse is reversed in time.
    pub reversed: bool,
    /// Largest step of the first pulse; negative for a cycle that begins with the negative pulse.
    pub amplitude: i16,
    /// N: samples in one pulse.
    pub samples: u32,
}

impl Pulse {
    /// The step in sample interval `n` of 2 N; 0 after them.
    pub fn step(&self, n: u32) -> i16 {
        let count = self.samples;
        if n < count {
            return self.single(n);
        }
        let m = n - count;
        match (m < count, self.reversed) {
            (false, _) => 0,
            (_, false) => -self.single(m),
            (_, true) => -self.single(count - 1 - m),
        }
    }

    /// Mean of the shape over interval `n` of N, rounded to a step (half away from zero).
    fn single(&self, n: u32) -> i16 {
        // In units of amplitude / 2 N.
        let height = match self.shape {
            Shape::Rectangular => 2 * self.samples,
            Shape::Triangular => 4 * n.min(self.samples - 1 - n) + 2,
            Shape::Sawtooth => 2 * n + 1,
        };
        let size = u64::from(self.amplitude.unsigned_abs()) * u64::from(height) + u64::from(self.samples);
        let step = size.checked_div(2 * u64::from(self.samples)).unwrap_or(0).min(i16::MAX as u64) as i16;
        if self.amplitude < 0 { -step } else { step }
    }
}
