//! The sensitive element of a gyrotheodolite, between its torquer and its angle sensor.
//!
//! Input: a moment about the vertical, disturbances, vibration of the base. Output: azimuth, tilt, roll, displacement. Three models:
//! linear with six states ([`SixState`]) or with four ([`FourState`]), both [`LinearElement`], and the rigid body without small-angle
//! approximation ([`RigidBody`]). [`WiredElement`] connects a model to the simulated board.

mod body;
mod linear;
mod parameters;
mod port;
mod runge_kutta;

pub use body::{Attitude, BaseVibration, RigidBody};
pub use linear::LinearElement;
pub use parameters::{EARTH_RATE_RAD_S, FourState, SixState};
pub use port::{ElementModel, WiredElement};
