//! How much an analysis may compute: a counted effort, which is the same on every machine, and a deadline.
//!
//! The effort is the number of simulated rows × lanes; a lane is the value or one derivative. Simulations that run side by side add to one
//! count, in any order. The limit is therefore judged at checkpoints alone, where nothing else of the same analysis computes: the answer
//! does not depend on the number of threads. A deadline ends a computation at once.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use crate::deadline::Deadline;

/// What an analysis may spend and has spent. Copies share one count.
#[derive(Debug, Clone, Default)]
pub struct Budget {
    deadline: Deadline,
    effort: Arc<Effort>,
}

#[derive(Debug, Default)]
struct Effort {
    /// Rows × lanes so far.
    spent: AtomicU64,
    /// Rows × lanes; `None`: any.
    limit: Option<u64>,
    is_exhausted: AtomicBool,
}

impl Budget {
    /// A limit in rows × lanes (`None`: any effort), and a deadline.
    pub fn new(limit: Option<u64>, deadline: Deadline) -> Budget {
        Budget { deadline, effort: Arc::new(Effort { limit, ..Effort::default() }) }
    }

    /// Counts a simulation.
    pub fn spend(&self, rows: usize, lanes: usize) {
        self.effort.spent.fetch_add(rows as u64 * lanes as u64, Ordering::Relaxed);
    }

    /// Rows × lanes so far.
    pub fn spent(&self) -> u64 {
        self.effort.spent.load(Ordering::Relaxed)
    }

    /// Judges the effort so far, and returns [`Budget::is_exhausted`]. To be called where no other thread computes for this analysis.
    pub fn checkpoint(&self) -> bool {
        if self.effort.limit.is_some_and(|limit| self.spent() > limit) {
            self.effort.is_exhausted.store(true, Ordering::Relaxed);
        }
        self.is_exhausted()
    }

    /// The effort was above the limit at a checkpoint, or the deadline has passed.
    pub fn is_exhausted(&self) -> bool {
        self.effort.is_exhausted.load(Ordering::Relaxed) || self.deadline.has_passed()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn effort_is_judged_at_checkpoints_alone() {
        let budget = Budget::new(Some(100), Deadline::NEVER);
        budget.clone().spend(30, 4);
        assert!(budget.spent() == 120 && !budget.is_exhausted());
        assert!(budget.checkpoint() && budget.clone().is_exhausted());
    }

    #[test]
    fn deadline_counts_at_once_and_no_limit_never() {
        assert!(Budget::new(None, Deadline::after_s(Some(0.0))).is_exhausted());
        let unlimited = Budget::default();
        unlimited.spend(usize::MAX, 1);
        assert!(!unlimited.checkpoint());
    }
}
