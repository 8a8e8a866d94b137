//! An element on the board whose true states are recorded beside what the board sees.

use std::sync::{Arc, Mutex, PoisonError};

use super::{ElementModel, WiredElement};
use crate::gyro::GyroPort;

/// Interval of the recorded states, s: that of the rows.
const INTERVAL_S: f64 = 1e-3;

/// True states at one time: seven numbers behind the time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TrueStates {
    /// Time since the start of the simulation, s.
    pub t_s: f64,
    /// α without the azimuth of the case, rad.
    pub alpha_rad: f64,
    /// α′, rad/s.
    pub alpha_rate_rad_s: f64,
    /// β, rad.
    pub beta_rad: f64,
    /// β′, rad/s.
    pub beta_rate_rad_s: f64,
    /// y, m (six states), or γ, rad (four).
    pub fifth: f64,
    /// y′, m/s (six states), or γ′, rad/s (four).
    pub sixth: f64,
}

/// The recorded states, shared with the caller.
pub type StateRecord = Arc<Mutex<Vec<TrueStates>>>;

/// An element with its record.
#[derive(Clone, Debug)]
pub struct RecordedElement {
    element: WiredElement,
    /// Voltage of the angle sensor by the azimuth of the case, V: the sensor shows α plus this azimuth.
    case_V: f64,
    t_s: f64,
    next: u64,
    record: StateRecord,
}

impl RecordedElement {
    /// An element whose angle sensor has this gain, V/rad, in a case at this azimuth, rad.
    pub fn new(element: WiredElement, angle_gain_V_rad: f64, case_azimuth_rad: f64) -> Self {
        Self { element, case_V: angle_gain_V_rad * case_azimuth_rad, t_s: 0.0, next: 0, record: StateRecord::default() }
    }

    /// The record, which grows while the element moves.
    pub fn record(&self) -> StateRecord {
        Arc::clone(&self.record)
    }

    fn states(&self) -> TrueStates {
        let [alpha_rad, alpha_rate_rad_s, beta_rad, beta_rate_rad_s, fifth, sixth] = match self.element.model() {
            ElementModel::Linear(element) => *element.state(),
            ElementModel::Rigid(body) => {
                let a = body.attitude();
                [a.alpha_rad, a.alpha_rate_rad_s, a.beta_rad, a.beta_rate_rad_s, a.gamma_rad, a.gamma_rate_rad_s]
            }
        };
        TrueStates { t_s: self.t_s, alpha_rad, alpha_rate_rad_s, beta_rad, beta_rate_rad_s, fifth, sixth }
    }
}

impl GyroPort for RecordedElement {
    fn advance(&mut self, command_A: f64, platform_rad: f64, dt_s: f64) {
        if self.t_s + 0.5 * dt_s >= self.next as f64 * INTERVAL_S {
            self.record.lock().unwrap_or_else(PoisonError::into_inner).push(self.states());
            self.next += 1;
        }
        self.element.advance(command_A, platform_rad, dt_s);
        self.t_s += dt_s;
    }

    fn sensor_V(&mut self) -> f64 {
        self.element.sensor_V() + self.case_V
    }

    fn torquer_A(&self) -> f64 {
        self.element.torquer_A()
    }

    fn roll_rad(&self) -> Option<f64> {
        self.element.roll_rad()
    }

    fn limit(&mut self, limit_A: Option<f64>) {
        self.element.limit(limit_A);
    }
}
