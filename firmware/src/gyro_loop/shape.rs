//! The reference pulses: equal and opposite, in whole steps of the torquer's converter.
//!
//! A step holds for one sample. The steps of the second pulse are those of the first with the other sign, in the same order or from the last to
//! the first, so that whatever the shape and its rounding, the sum over a cycle is zero exactly.

/// What a pulse looks like.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shape {
    /// The amplitude throughout.
    #[default]
    Rectangular,
    /// Up to the amplitude in the middle, and down.
    Triangular,
    /// Up to the amplitude at the end.
    Sawtooth,
}

impl Shape {
    /// All of them, in the order of the console's words.
    pub const ALL: [Self; 3] = [Self::Rectangular, Self::Triangular, Self::Sawtooth];

    /// Whether a pulse is the same backwards: then the reference cancels from (13), whatever its size.
    pub fn is_symmetric(self) -> bool {
        self != Self::Sawtooth
    }
}

/// A pair of pulses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pulse {
    /// What each looks like.
    pub shape: Shape,
    /// The second one runs backwards.
    pub reversed: bool,
    /// The greatest step of the first; negative for a cycle that begins with the negative pulse.
    pub amplitude: i16,
    /// N: samples in one pulse.
    pub samples: u32,
}

impl Pulse {
    /// The step in sample interval `n` of the 2 N; nothing after them.
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

    /// The mean of the shape over interval `n` of N, rounded to a step away from zero.
    fn single(&self, n: u32) -> i16 {
        // In (2 N)ths of the amplitude.
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
