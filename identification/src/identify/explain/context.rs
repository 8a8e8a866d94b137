//! What all stages of an explanation share.

use std::ops::Range;

use super::criteria::Criteria;
use crate::log::Log;

/// What all stages share.
#[derive(Clone, Copy)]
pub struct Context<'a> {
    /// All logs as one.
    pub log: &'a Log,
    /// Rows of each log in it.
    pub log_rows: &'a [Range<usize>],
    /// The thresholds.
    pub criteria: &'a Criteria,
}
