//! The drift of a gyro by pulses of alternating sign (theory.md §3): from the angle and the torquer's current to own drift, apparent drift and
//! azimuth, each with its uncertainty.
//!
//! In: cycles, from a log ([`find`], [`integral`]) or as the firmware has added them up ([`session`]). Out: an [`Answer`]. [`amplitudes`] tells unequal pulses
//! from the drift by two amplitudes; [`separate`] has formulas (15) and (16), the three axes with their mid-cycle correction, and more than two positions with what gravity does; [`advise`] says how long a
//! pulse should be; [`platform`] is the same method on the turning platform with a rate gyro.
//!
//! Rates are in rad/s, angles in rad; answers for a person in °/h and degrees. *Own* drift is the gyro's, *apparent* drift is minus the Earth's rotation
//! along its axis.

pub mod advise;
pub mod amplitudes;
pub mod answer;
pub mod compute;
pub mod error;
pub mod find;
pub mod integral;

pub mod places;
pub mod platform;
pub mod separate;
pub mod session;
pub mod uncertainty;

pub use answer::{Answer, CycleLine, Measured};
pub use error::DriftError;

/// One degree per hour, rad/s; also one arcsecond, rad.
pub const DEG_H: f64 = std::f64::consts::PI / 180.0 / 3600.0;
