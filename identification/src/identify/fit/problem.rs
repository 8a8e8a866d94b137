//! A weighted least-squares problem.

use super::system::System;
use crate::recording::prepared_log::PreparedLog;

/// A weighted least-squares problem.
#[derive(Clone, Copy)]
pub struct Problem<'a> {
    /// The model.
    pub system: &'a System,
    /// The measured data.
    pub data: &'a PreparedLog<'a>,
    /// 1/σ² of each channel.
    pub weights: &'a [f64],
}
