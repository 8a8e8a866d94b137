//! The time by which an analysis has to end with its best answer so far.

use std::time::{Duration, Instant};

/// A point in time, or none. Minimisations and searches ask it before each step.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Deadline(Option<Instant>);

impl Deadline {
    /// The analysis may take as long as it needs.
    pub const NEVER: Deadline = Deadline(None);

    /// So many seconds from now on; `None`: never. A time beyond the clock's range is never, too.
    pub fn after_s(seconds: Option<f64>) -> Deadline {
        let length = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
        Deadline(length.and_then(|length| Instant::now().checked_add(length)))
    }

    /// It is over.
    pub fn has_passed(self) -> bool {
        self.0.is_some_and(|end| Instant::now() >= end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deadline_passes_and_never_does_not() {
        assert!(Deadline::after_s(Some(0.0)).has_passed());
        assert!(![None, Some(1e3), Some(1e300), Some(f64::INFINITY)].into_iter().any(|seconds| Deadline::after_s(seconds).has_passed()));
    }
}
