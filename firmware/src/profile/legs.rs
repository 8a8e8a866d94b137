//! A sequence of constant values, each with its own duration.

/// Number of values.
pub const LEGS: usize = 5;

#[derive(Clone, Debug)]
pub(super) struct Legs {
    legs: [(f64, u32); LEGS],
    leg: usize,
    done_ms: u32,
}

impl Legs {
    pub(super) fn new(legs: [(f64, u32); LEGS]) -> Self {
        Self { legs, leg: 0, done_ms: 0 }
    }

    pub(super) fn next_value(&mut self) -> f64 {
        loop {
            let Some(&(value, ms)) = self.legs.get(self.leg) else { return 0.0 };
            if self.done_ms < ms {
                self.done_ms += 1;
                return value;
            }
            self.leg += 1;
            self.done_ms = 0;
        }
    }
}
