//! Correction of a simulation by its innovations: the prediction-error form of the model.
//!
//! The simulated state is corrected after each compared value by a gain times the innovation (measured − predicted). The channels of a row are used
//! one after the other, so that their innovations are independent (sequential form of the Kalman filter: Anderson and Moore, Optimal Filtering, 1979,
//! section 6.4). Without gains the simulation runs freely. The gains are constant and come from [`crate::identify::predict`].
//!
//! A channel may have coloured noise: a first-order Gauss–Markov process beside the white noise, whose state is predicted and corrected like
//! those of the drive.

use drive_model::Scalar;
use drive_rig::State;

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
    /// Of the coloured noise of each channel.
    pub noise: Vec<f64>,
}

/// How the state follows the measurement.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Predictor {
    /// Gains by the innovation of each channel.
    pub gains: Vec<Gain>,
    /// Variance of the innovations of each channel, in the unit of the channel squared.
    pub innovation_variances: Vec<f64>,
    /// Factor by which the coloured noise of each channel decays from row to row; 0 without.
    pub noise_decay: Vec<f64>,
}

impl Predictor {
    /// Corrects the state of the drive and of the noise by the innovation of a channel.
    #[inline]
    pub fn correct<S: Scalar>(&self, channel: usize, innovation: S, state: &mut State<S>, noise: &mut [S]) {
        let gain = &self.gains[channel];
        state.omega += innovation * gain.omega;
        state.theta += innovation * gain.theta;
        state.motor_omega += innovation * gain.motor_omega;
        state.twist += innovation * gain.twist;
        for (state, gain) in noise.iter_mut().zip(&gain.noise) {
            if *gain != 0.0 {
                *state += innovation * *gain;
            }
        }
    }

    /// The coloured noise one row later.
    #[inline]
    pub fn advance<S: Scalar>(&self, noise: &mut [S]) {
        for (state, decay) in noise.iter_mut().zip(&self.noise_decay) {
            *state *= *decay;
        }
    }
}
