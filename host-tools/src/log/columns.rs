//! The columns that a log may have (interfaces.md, "Logs").

/// A column whose meaning is fixed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct KnownColumn {
    /// Name in the file.
    pub name: &'static str,
    /// Unit for a person.
    pub unit: &'static str,
    /// What it is.
    pub says: &'static str,
    /// By convention a mean over [t_k, t_k+1); otherwise taken at t_k.
    pub mean_over_row: bool,
}

const fn at_instant(name: &'static str, unit: &'static str, says: &'static str) -> KnownColumn {
    KnownColumn { name, unit, says, mean_over_row: false }
}

const fn mean_over_row(name: &'static str, unit: &'static str, says: &'static str) -> KnownColumn {
    KnownColumn { name, unit, says, mean_over_row: true }
}

/// All of them.
pub const KNOWN: &[KnownColumn] = &[
    at_instant("t_s", "s", "time"),
    mean_over_row("u_V", "V", "voltage"),
    at_instant("supply_V", "V", "supply of the bridge"),
    mean_over_row("i_A", "A", "motor current"),
    mean_over_row("torque_N_m", "N m", "drive torque"),
    at_instant("theta_rad", "rad", "platform angle"),
    at_instant("omega_rad_s", "rad/s", "platform rate"),
    at_instant("rate_cmd_rad_s", "rad/s", "rate asked for"),
    at_instant("theta_cmd_rad", "rad", "angle asked for"),
    at_instant("turn_s", "s", "duration of the last whole turn"),
    at_instant("temp_C", "°C", "winding temperature"),
    at_instant("gyro_rad_s", "rad/s", "gyro under test"),
    at_instant("accel_x_m_s2", "m/s²", "accelerometer, outward"),
    at_instant("accel_y_m_s2", "m/s²", "accelerometer, along the motion"),
    at_instant("sensor_C", "°C", "temperature of the sensor under test"),
    at_instant("sensor_age_s", "s", "how long before t_k the sensor under test was sampled"),
    at_instant("angle_sensor_V", "V", "the gyro's angle sensor"),
    mean_over_row("torquer_A", "A", "the gyro's torquer"),
    at_instant("gamma_rad", "rad", "the gyro's roll"),
    at_instant("alpha_hat_rad", "rad", "azimuth, estimated by the observer"),
    at_instant("alpha_rate_hat_rad_s", "rad/s", "its rate, estimated"),
    at_instant("beta_rate_hat_rad_s", "rad/s", "rate of the tilt, estimated"),
    at_instant("moment_hat_N_m", "N m", "moment about the vertical, estimated"),
];

/// The known column of that name.
pub fn known(name: &str) -> Option<&'static KnownColumn> {
    KNOWN.iter().find(|c| c.name == name)
}
