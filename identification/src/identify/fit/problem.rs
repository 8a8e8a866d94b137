//! A weighted least-squares problem.

use super::prepared_log::PreparedLog;
use super::system::System;

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
