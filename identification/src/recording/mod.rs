//! How a log was recorded, and what the input did within its rows.
//!
//! In: a log with its notes, and the model that says which columns are used. Out: a [`PreparedLog`], built once by [`prepare()`] and then
//! read only: input, compared channels, segments without gaps, and the quantities that a simulation takes from the log. What a computation
//! varies (the rows that it uses, the course of the voltage, a predictor) is a copy by one of the methods of [`PreparedLog`]; a copy shares
//! all columns.
//!
//! * [`prepare`]: columns, provenance and notes as compared channels;
//! * [`voltage`]: when the input had the values of its column, and its course within a row;
//! * [`convention`]: what is assumed where no note states it;
//! * [`known_motion`], [`angle_jumps`]: the motion that a sensor is compared with; jumps of a measured angle;
//! * [`predictor`]: how a simulated state follows the measurement.

pub(crate) mod angle_jumps;
pub(crate) mod convention;
pub(crate) mod known_motion;
pub(crate) mod predictor;
pub mod prepare;
pub mod prepared_log;
pub mod voltage;

pub use convention::Convention;
pub use prepare::prepare;
pub use prepared_log::{ComparedChannel, Preparation, PreparedLog};
