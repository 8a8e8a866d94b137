//! Where a model fails: the residual looked at over every coordinate.
//!
//! In: a log, its record, and the model held against it. Out: [`Misfit`]s, most telling first. Nothing is simulated again: what a missing
//! torque or voltage leaves in every channel follows from inertia, motor constant and resistance ([`rows`]); a few shapes over every
//! coordinate ([`shapes`]), orders of the angle and lines in time ([`orders`]) are sought in all channels together ([`search`]) and tested
//! against the colour of what remains ([`test`]). [`says`] puts it in words.

pub mod harmonics;
pub mod plot_data;
mod rows;
mod says;
mod search;
mod shapes;
mod significance;

use drive_model::Coordinate;

use crate::identify::fit::{FitResult, PreparedLog};
use crate::log::Log;
use crate::model::Channel;

/// One coordinate over which a residual is not noise (interfaces.md, `failures`).
#[derive(Debug, Clone, PartialEq)]
pub struct Misfit {
    /// The channel that fails.
    pub output: Channel,
    /// Over what.
    pub coordinate: Coordinate,
    /// Part of the residual's variance that this accounts for, 0 to 1, beyond what the coordinates before it do.
    pub share: f64,
    /// Periods per turn, where the coordinate is the angle and one order stands out.
    pub order: Option<u32>,
    /// Probability of as much by chance, over all channels and coordinates.
    pub p_value: f64,
    /// Its decimal logarithm, which lasts where the probability is too small for a number.
    pub log10_p: f64,
    /// A sentence for the person.
    pub says: String,
}

/// Coordinates over which the residuals of `held` are not noise, most telling first.
///
/// A failure is listed if it is seen at one in a thousand over all that was tried.
pub fn misfits(log: &Log, record: &PreparedLog, held: &FitResult) -> Vec<Misfit> {
    let Some(full) = rows::Rows::of(log, record, held) else { return Vec::new() };
    let found = search::search(full, held);
    says::misfits(found)
}

#[cfg(test)]
mod tests;
