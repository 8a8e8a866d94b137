//! One sample of everything, and where it goes.

use super::turn::Turn;
use crate::board::{EdgeTime, Ticks};
use crate::gyro_loop::observer::Observed;
use crate::speed_loop::{Compensating, Fault, Limits};

/// One sample of everything.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Row {
    /// Number of the row since the loop was made; a gap is a loss.
    pub sequence: u32,
    /// t_k by the board's clock: when everything was looked at.
    pub at: Ticks,
    /// t_k in seconds since the start of the session.
    pub t_s: f64,
    /// Asked voltage at nominal supply, mean over [t_k, t_{k+1}), V.
    pub u_V: f64,
    /// Supply at t_k, V.
    pub supply_V: Option<f64>,
    /// Motor current, mean over [t_k, t_{k+1}), A.
    pub i_A: Option<f64>,
    /// Platform angle at t_k from the own counter, unwrapped, rad; its zero is the session's
    /// ([`zero_is_index`](super::MeasurementLoop::zero_is_index)).
    pub theta_rad: f64,
    /// Platform angle at t_k from the index as it was last seen, half a count added: the middle of the count; `None` before it was seen, rad.
    pub from_index_rad: Option<f64>,
    /// The own counter's newest edge before t_k: the counter right after it, unwrapped, and its time by the hardware.
    pub edge: Option<(i64, EdgeTime)>,
    /// The last whole turn before t_k, by the index.
    pub turn: Option<Turn>,
    /// The rate sensor at t_k, rad/s.
    pub omega_rad_s: Option<f64>,
    /// The gyro under test: its newest sample at t_k, about the platform's axis, rad/s.
    pub gyro_rad_s: Option<f64>,
    /// The accelerometer under test, outward, m/s²; of the same sample.
    pub accel_x_m_s2: Option<f64>,
    /// The accelerometer under test, along the motion, m/s².
    pub accel_y_m_s2: Option<f64>,
    /// Age of that sample at t_k, board clock steps; 0 where there is none.
    pub imu_age: u64,
    /// Temperature of the chip under test, the last that it told, °C.
    pub sensor_C: Option<f64>,
    /// The gyro's angle sensor at t_k, V.
    pub angle_sensor_V: Option<f64>,
    /// The current of its torquer, mean over [t_k, t_{k+1}), A.
    pub torquer_A: Option<f64>,
    /// Where the drift measurement is at t_k: [`Commutator::mark`](crate::gyro_loop::Commutator::mark).
    pub drift_mark: u32,
    /// Rate command at t_k, rad/s; rate and position mode only.
    pub rate_cmd_rad_s: Option<f64>,
    /// Position command at t_k, rad; rate and position mode only.
    pub theta_cmd_rad: Option<f64>,
    /// Winding temperature at t_k, °C.
    pub temp_C: Option<f64>,
    /// What the observer had estimated for t_k, while it is on.
    pub observed: Option<Observed>,
    /// The gyro's roll at t_k, rad.
    pub roll_rad: Option<f64>,
    /// The speed loop's own rate by the encoder's edges at t_k, rad/s, and the time since the last of them, s: what it regulates by, not a
    /// measurement.
    pub loop_rate_rad_s: f64,
    /// Age of that rate, s; ends at 2³⁰ steps of the edge timer (12 s).
    pub loop_rate_age_s: f64,
    /// The limits that were in force at some time within the row.
    pub limits: Limits,
    /// What of the learnt compensation was at work at t_k.
    pub compensating: Compensating,
    /// The latched fault at the row's end.
    pub fault: Fault,
    /// Age of the oldest reading of the row at its t_k, board clock steps; that of the sensor under test is [`Row::imu_age`].
    pub age: u64,
}

impl Row {
    /// Duration of the last whole turn, s.
    pub fn turn_s(&self) -> Option<f64> {
        self.turn.map(|turn| turn.seconds)
    }
}

/// Where rows go.
pub trait RowSink {
    /// Takes a row; must not wait.
    fn row(&mut self, row: &Row);
}
