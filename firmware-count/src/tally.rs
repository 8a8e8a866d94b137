//! How often each number of instructions came.

/// Counts from here on are one bucket.
const BUCKETS: usize = 4096;

/// A histogram with one bucket per instruction.
pub struct Tally {
    buckets: [u32; BUCKETS],
    ticks: u32,
    greatest: u32,
}

impl Tally {
    /// Nothing yet.
    pub const fn new() -> Self {
        Self { buckets: [0; BUCKETS], ticks: 0, greatest: 0 }
    }

    /// One more tick.
    pub fn add(&mut self, instructions: u32) {
        self.buckets[(instructions as usize).min(BUCKETS - 1)] += 1;
        self.ticks += 1;
        self.greatest = self.greatest.max(instructions);
    }

    /// How many ticks there were.
    pub fn ticks(&self) -> u32 {
        self.ticks
    }

    /// Half of the ticks took no more.
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

    /// No tick took more.
    pub fn greatest(&self) -> u32 {
        self.greatest
    }
}
