//! The sensitive element on the simulated board: behind its torquer and its angle sensor.

use super::{LinearElement, RigidBody};
use crate::gyro::GyroPort;

/// The model that moves.
#[derive(Clone, Debug)]
pub enum ElementModel {
    /// For small angles.
    Linear(LinearElement),
    /// Without small-angle approximation.
    Rigid(RigidBody),
}

/// An element with its torquer and its sensors.
#[derive(Clone, Debug)]
pub struct WiredElement {
    model: ElementModel,
    /// Gain of the angle sensor, V/rad.
    angle_gain_V_rad: f64,
    /// Moment of the torquer per current, N m/A.
    torquer_N_m_A: f64,
    current_A: f64,
    limit_A: f64,
}

impl WiredElement {
    /// An element with sensors of these gains.
    pub fn new(model: ElementModel, angle_gain_V_rad: f64, torquer_N_m_A: f64) -> Self {
        Self { model, angle_gain_V_rad, torquer_N_m_A, current_A: 0.0, limit_A: f64::INFINITY }
    }

    /// The model.
    pub fn model(&self) -> &ElementModel {
        &self.model
    }

    fn alpha_rad(&self) -> f64 {
        match &self.model {
            ElementModel::Linear(element) => element.state()[0],
            ElementModel::Rigid(body) => body.attitude().alpha_rad,
        }
    }
}

impl GyroPort for WiredElement {
    fn advance(&mut self, command_A: f64, _platform_rad: f64, dt_s: f64) {
        self.current_A = command_A.clamp(-self.limit_A, self.limit_A);
        let moment_N_m = self.torquer_N_m_A * self.current_A;
        match &mut self.model {
            ElementModel::Linear(element) => element.advance(moment_N_m, dt_s),
            ElementModel::Rigid(body) => body.advance(moment_N_m, dt_s),
        }
    }

    fn sensor_V(&mut self) -> f64 {
        self.angle_gain_V_rad * self.alpha_rad()
    }

    fn torquer_A(&self) -> f64 {
        self.current_A
    }

    fn roll_rad(&self) -> Option<f64> {
        match &self.model {
            ElementModel::Linear(element) => element.roll_rad(),
            ElementModel::Rigid(body) => Some(body.attitude().gamma_rad),
        }
    }

    fn limit(&mut self, limit_A: Option<f64>) {
        self.limit_A = limit_A.unwrap_or(f64::INFINITY);
    }
}
