//! Drift of a gyroscope by pulses of alternating sign (docs/theory.md §3): own drift, apparent drift and azimuth with uncertainties, from the angle sensor
//! and the current of the torquer.
//!
//! Input: cycles, from a log ([`compute`], [`detection`], [`integral`]) or from the firmware ([`crate::acquire::drift_session`]), as a [`Measurement`]. Output: a [`DriftResult`]
//! ([`evaluation`]). [`inequality`] separates unequal pulses from the drift by two amplitudes; [`separation`] has formulas (15) and (16) and the three axes
//! with their correction within a cycle; [`positions`] fits more than two positions with g-dependent drift; [`error_budget`] has the uncertainties.
//! [`pulse_advice`] recommends the duration of a pulse; [`platform`] is the same method for a rate gyro on the turning platform.
//!
//! Rates are in rad/s, angles in rad. *Own* drift is that of the gyroscope; *apparent* drift is minus the Earth's rotation along its axis.

pub mod compute;
pub mod cycle;
pub mod detection;
pub mod error;
pub mod error_budget;
pub mod estimate;
pub mod evaluation;
pub mod inequality;
pub mod integral;
pub mod measurement;
pub mod platform;
pub mod positions;
pub mod pulse_advice;
pub mod separation;

pub use cycle::Cycle;
pub use error::DriftError;
pub use evaluation::DriftResult;
pub use measurement::Measurement;

/// One degree per hour, rad/s; also one arcsecond, rad.
pub const DEG_H: f64 = std::f64::consts::PI / 180.0 / 3600.0;
