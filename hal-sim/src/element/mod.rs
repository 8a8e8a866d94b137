//! The gyrotheodolite's sensitive element: what hangs between its torquer and its angle sensor.
//!
//! In: a moment about the vertical, disturbances, vibration of the base. Out: azimuth, tilt, roll, displacement. Three models:
//! linear with six states ([`SixState`]) or with four ([`FourState`]), both [`LinearElement`], and the rigid body without small angles
//! ([`RigidBody`]). On the simulated board's wires they are a [`WiredElement`].

mod body;
mod linear;
mod parameters;
mod port;

pub use body::{Attitude, BaseVibration, RigidBody};
pub use linear::LinearElement;
pub use parameters::{EARTH_RATE_RAD_S, FourState, SixState};
pub use port::{Moving, WiredElement};
