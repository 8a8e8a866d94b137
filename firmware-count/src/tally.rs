//! Histogram of instruction counts.

/// Larger counts share the last bucket.
const BUCKETS: usize = 4096;

/// A histogram with one bucket per instruction.
pub struct Tally {
    buckets: [u32; BUCKETS],
    ticks: u32,
    greatest: u32,
}

impl Tally {
    /// An empty histogram.
    pub const fn new() -> Self {
        Self { buckets: [0; BUCKETS], ticks: 0, greatest: 0 }
    }

    /// Adds one tick.
    pub fn add(&mut self, instructions: u32) {
        self.buckets[(instructions as usize).min(BUCKETS - 1)] += 1;
        self.ticks += 1;
        self.greatest = self.greatest.max(instructions);
    }

    /// Number of ticks.
    pub fn ticks(&self) -> u32 {
        self.ticks
    }

    /// Median of the instructions per tick.
    pub fn median(&self) -> usize {
        let mut below = 0;
        self.buckets
            .iter()
            .position(|n| {
                below += n;
                2 * below >= self.ticks
            })
            .unwrap_or(0)
    }

    /// Greatest number of instructions of a tick.
    pub fn greatest(&self) -> u32 {
        self.greatest
    }
}
