//! Correction of a simulation by its innovations: the prediction-error form of the model.
//!
//! The simulated state is corrected after each compared value by a gain times the innovation (measured − predicted). The channels of a row
//! are used one after the other, so that their innovations are independent (sequential form of the Kalman filter: Anderson and Moore,
//! Optimal Filtering, 1979, section 6.4). Without gains the simulation runs freely. The gains are constant and come from
//! [`crate::identify::predict`].

use drive_model::Scalar;
use drive_rig::DriveState;

/// Correction of the state by one innovation, per unit of the innovation.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Gain {
    /// Of the platform's rate.
    pub omega: f64,
    /// Of the platform's angle.
    pub theta: f64,
    /// Of the motor's rate (with a shaft).
    pub motor_omega: f64,
    /// Of the twist (with a shaft).
    pub twist: f64,
}

/// How the state follows the measurement.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Predictor {
    /// Gains by the innovation of each channel.
    pub gains: Vec<Gain>,
    /// Variance of the innovations of each channel, in the unit of the channel squared.
    pub innovation_variances: Vec<f64>,
}

impl Predictor {
    /// Corrects the state of the drive by the innovation of a channel.
    #[inline]
    pub fn correct<S: Scalar>(&self, channel: usize, innovation: S, state: &mut DriveState<S>) {
        let gain = &self.gains[channel];
        state.omega += innovation * gain.omega;
        state.theta += innovation * gain.theta;
        state.motor_omega += innovation * gain.motor_omega;
        state.twist += innovation * gain.twist;
    }
}
