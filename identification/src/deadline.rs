//! The time by which a computation or a wait has to end, an analysis with its best answer so far, and a switch that ends it at once.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// A point in time, or none, and a switch. Minimisations and searches ask it before each step.
#[derive(Debug, Clone, Copy, Default)]
pub struct Deadline {
    end: Option<Instant>,
    /// True ends the analysis. Static, because the deadline is copied into everything that an analysis builds.
    cancelled: Option<&'static AtomicBool>,
}

impl Deadline {
    /// It may take as long as it needs.
    pub const NEVER: Deadline = Deadline { end: None, cancelled: None };

    /// So many seconds from now on; `None`: never. A time beyond the clock's range is never, too.
    pub fn after_s(seconds: Option<f64>) -> Deadline {
        let length = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
        Deadline { end: length.and_then(|length| Instant::now().checked_add(length)), cancelled: None }
    }

    /// The same, or earlier: when `cancelled` becomes true.
    pub fn or_when(self, cancelled: &'static AtomicBool) -> Deadline {
        Deadline { cancelled: Some(cancelled), ..self }
    }

    /// It is over.
    pub fn has_passed(self) -> bool {
        self.end.is_some_and(|end| Instant::now() >= end) || self.cancelled.is_some_and(|cancelled| cancelled.load(Ordering::Relaxed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn switch_ends_a_deadline_that_never_passes() {
        static CANCELLED: AtomicBool = AtomicBool::new(false);
        let deadline = Deadline::NEVER.or_when(&CANCELLED);
        assert!(!deadline.has_passed());
        CANCELLED.store(true, Ordering::Relaxed);
        assert!(deadline.has_passed());
    }

    #[test]
    fn deadline_passes_and_never_does_not() {
        assert!(Deadline::after_s(Some(0.0)).has_passed());
        assert!(![None, Some(1e3), Some(1e300), Some(f64::INFINITY)].into_iter().any(|seconds| Deadline::after_s(seconds).has_passed()));
    }
}
