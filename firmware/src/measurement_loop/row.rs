//! A row: one sample of all quantities.

use super::turn::Turn;
use crate::board::{EdgeTime, Ticks};
use crate::gyro_loop::observer::ObservedState;
use crate::speed_loop::{Compensating, Fault, Limits, Mode};
use crate::supervision::RowState;

/// One sample of all quantities.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Row {
    /// Sequence number; a gap is a loss.
    pub sequence: u32,
    /// t_k by the board's clock: the time of the readings.
    pub at: Ticks,
    /// t_k in seconds since the start of the session.
    pub t_s: f64,
    /// Commanded voltage at nominal supply, mean over [t_k, t_{k+1}), V.
    pub u_V: f64,
    /// First moment of that voltage: u(t) ≈ `u_V` + `u_slope_V` (2 (t − t_k)/(t_{k+1} − t_k) − 1), V.
    pub u_slope_V: f64,
    /// Supply at t_k, V.
    pub supply_V: Option<f64>,
    /// Motor current, mean over [t_k, t_{k+1}), A.
    pub i_A: Option<f64>,
    /// Platform angle at t_k from the measurement's counter, unwrapped, rad; its zero is fixed for a session
    /// ([`zero_is_index`](super::MeasurementLoop::zero_is_index)).
    pub theta_rad: f64,
    /// Platform angle at t_k from the last index, rad: the middle of the count, half a count added; `None` before the first index.
    pub from_index_rad: Option<f64>,
    /// An index pulse started within the millisecond before t_k.
    pub has_passed_index: bool,
    /// The newest edge before t_k: the counter right after it, unwrapped, and its captured time.
    pub edge: Option<(i64, EdgeTime)>,
    /// The last whole turn before t_k, by the index.
    pub turn: Option<Turn>,
    /// The last edge on the input of the clock reference within the millisecond before t_k.
    pub reference_pulse: Option<EdgeTime>,
    /// The stand's rate sensor at t_k, rad/s.
    pub omega_rad_s: Option<f64>,
    /// Rate of the sensor under test about the platform's axis, newest sample at t_k, rad/s.
    pub gyro_rad_s: Option<f64>,
    /// Outward acceleration of the sensor under test, same sample, m/s².
    pub accel_x_m_s2: Option<f64>,
    /// Tangential acceleration of the sensor under test, m/s².
    pub accel_y_m_s2: Option<f64>,
    /// Age of that sample at t_k, board clock steps; 0 without one.
    pub imu_age: u64,
    /// Temperature of the sensor under test, last reading, °C.
    pub sensor_C: Option<f64>,
    /// Angle sensor of the gyroscope at t_k, V.
    pub angle_sensor_V: Option<f64>,
    /// Current of its torquer, mean over [t_k, t_{k+1}), A.
    pub torquer_A: Option<f64>,
    /// Phase of the drift measurement at t_k: [`Commutator::mark`](crate::gyro_loop::Commutator::mark).
    pub drift_mark: u32,
    /// Rate command at t_k, rad/s; rate and position mode only.
    pub rate_cmd_rad_s: Option<f64>,
    /// Position command at t_k, rad; rate and position mode only.
    pub theta_cmd_rad: Option<f64>,
    /// Winding temperature at t_k, °C.
    pub temp_C: Option<f64>,
    /// Estimates of the observer for t_k, while it is on.
    pub observed: Option<ObservedState>,
    /// Roll of the gyroscope at t_k, rad.
    pub roll_rad: Option<f64>,
    /// The speed loop's rate by the encoder's edges at t_k, rad/s: a status of the loop, not a measurement.
    pub loop_rate_rad_s: f64,
    /// Age of that rate, s; at most 2³⁰ steps of the edge timer (12 s).
    pub loop_rate_age_s: f64,
    /// The limits that were in force at some time within the row.
    pub limits: Limits,
    /// Active parts of the compensation at t_k.
    pub compensating: Compensating,
    /// The latched fault at the row's end.
    pub fault: Fault,
    /// Mode of the speed loop at the row's end; off: the bridge brakes.
    pub mode: Mode,
    /// Age of the oldest reading at t_k, board clock steps, without the sensor under test ([`Row::imu_age`]).
    pub age: u64,
}

impl Row {
    /// The supervised quantities.
    pub fn supervised(&self) -> RowState {
        RowState {
            t_s: self.t_s,
            theta_rad: self.theta_rad,
            from_index_rad: self.from_index_rad,
            has_passed_index: self.has_passed_index,
            is_driven: self.mode != Mode::Off && self.fault == Fault::None,
            temp_C: self.temp_C,
            has_rate: self.omega_rad_s.is_some(),
            has_dut: self.accel_x_m_s2.is_some(),
        }
    }

    /// Duration of the last whole turn, s.
    pub fn turn_s(&self) -> Option<f64> {
        self.turn.map(|turn| turn.seconds)
    }
}

/// A receiver of rows.
pub trait RowSink {
    /// Receives a row; must not wait.
    fn row(&mut self, row: &Row);
}
