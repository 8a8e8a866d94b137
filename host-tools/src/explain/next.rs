//! What to measure next.

use super::{Candidate, NextExperiment, Verdict};
use crate::log::Log;
use crate::model::Model;

/// What to measure next; `None` where nothing is open.
pub fn next(_model: &Model, _candidates: &[Candidate], _missing: &[String], _verdict: Verdict, _log: &Log) -> Option<NextExperiment> {
    None
}
