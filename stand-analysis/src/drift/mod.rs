//! Drift of a gyroscope by pulses of alternating sign (docs/theory.md §3): own drift, apparent drift and azimuth with uncertainties, from
//! the angle sensor and the current of the torquer.
//!
//! Input: cycles, from a log ([`compute`], [`detection`], [`integral`]) or from the firmware ([`stand_acquire::drift_session`]), as a
//! [`Measurement`]. Output: a [`DriftResult`] ([`evaluation`]). [`session_fit`] estimates the parameters of the positions beside a drift
//! that moves and unequal pulses ([`inequality`]); [`positions`] has the parameters, g-dependent drift included; [`separation`] has
//! formulas (15) and (16) and the three axes with their correction within a cycle; [`latitude`] compares the measured Earth rate with that
//! of the site; [`error_budget`] has the uncertainties; [`clipping`] finds clipped cycles. [`pulse_advice`] recommends the duration of a
//! pulse; [`platform`] is the same method for a rate gyro on the turning platform.
//!
//! Rates are in rad/s, angles in rad. *Own* drift is that of the gyroscope; *apparent* drift is minus the Earth's rotation along its axis.

pub mod clipping;
pub mod compute;
pub mod cycle;
pub mod detection;
pub mod disturbed_cycles;
pub mod error;
pub mod error_budget;
pub mod evaluation;
pub mod inequality;
pub mod integral;
pub mod latitude;
pub mod measurement;
pub mod platform;
pub mod positions;
pub mod pulse_advice;
pub mod separation;
pub mod session_fit;

pub use cycle::Cycle;
pub use error::DriftError;
pub use evaluation::DriftResult;
pub use measurement::Measurement;

/// One degree per hour, rad/s; also one arcsecond, rad.
pub const DEG_H: f64 = std::f64::consts::PI / 180.0 / 3600.0;
