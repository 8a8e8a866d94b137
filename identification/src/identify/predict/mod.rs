//! Prediction-error form of a model: a Kalman filter follows the measurement, and the likelihood of its innovations judges the model.
//!
//! In: a prepared log, a system with parameters. Out: the parameters, the intensity of a random torque, the noise of each channel, the
//! innovations and their likelihood ([`PredictionFit`]).
//!
//! The drive is a state-space model with a random torque of intensity q on the rotor and noise on each channel (innovation form: Ljung,
//! System Identification, 1999, sections 4.3 and 7.2). q = 0 is the free run (output error); a large q is regression from row to row. The
//! stages:
//!
//! * [`row_model`]: one row of the drive, linearised: transition, random torque, readings;
//! * [`gain`]: the stationary Kalman filter of that row model;
//! * [`adjoint`]: gradient of the likelihood by a torque or by an error of a reading at each row;
//! * [`fit`]: parameters, q and noise of largest likelihood, from a free run (q near 0) upwards;
//! * [`refine`]: final parameters and standard errors of a fit; by prediction errors, where the input was made from a compared channel;
//! * [`course`]: uncertainty of the parameters by the unknown course of the input within the rows.

pub mod adjoint;
pub mod course;
pub mod fit;
pub mod gain;
pub mod refine;
pub mod row_model;

pub use course::{by_course, covariance_of, drawn_courses, with_course};
pub use fit::PredictionFit;
pub use refine::refined;
