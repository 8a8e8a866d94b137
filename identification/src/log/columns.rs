//! Columns with a fixed meaning: the time, the channels of the stand, and the drive torque of external records.

use std::sync::LazyLock;

use stand_firmware::telemetry::CHANNELS;
use stand_firmware::telemetry::channel::{Channel, Sampling, Source};

/// A column with a fixed meaning.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct KnownColumn {
    /// Name in the file.
    pub name: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// Description.
    pub description: &'static str,
    /// Mean over [t_k, t_k+1) by convention; otherwise the value at t_k.
    pub mean_over_row: bool,
    /// Quantity of the drive, which a model may use: a note about the column must be understood.
    pub of_drive: bool,
}

/// All columns with a fixed meaning. Those of the stand come from its table of channels.
pub static KNOWN: LazyLock<Vec<KnownColumn>> = LazyLock::new(|| {
    let time = KnownColumn { name: "t_s", unit: "s", description: "time", mean_over_row: false, of_drive: true };
    let torque = KnownColumn { name: "torque_N_m", unit: "N m", description: "drive torque", mean_over_row: true, of_drive: true };
    let open = KnownColumn {
        name: "open_circuit",
        unit: "1",
        description: "1 while the motor is disconnected",
        mean_over_row: false,
        of_drive: true,
    };
    let sensor_angle = KnownColumn {
        name: "theta_sensor_rad",
        unit: "rad",
        description: "angle of a sensor under test",
        mean_over_row: false,
        of_drive: true,
    };
    let age = KnownColumn {
        name: "rate_age_s",
        unit: "s",
        description: "age of the reading of the rate at t_k",
        mean_over_row: false,
        of_drive: true,
    };
    let channels = CHANNELS.iter().filter(|channel| channel.is_column()).map(|channel| KnownColumn {
        name: channel.name,
        unit: channel.unit,
        description: channel.description,
        mean_over_row: channel.sampling == Sampling::Mean,
        of_drive: is_of_drive(channel),
    });
    [time, torque, open, sensor_angle, age].into_iter().chain(channels).collect()
});

/// The channel is a command to the drive or a reading of it, once per row. The others belong to the device under test and the gyroscope, or
/// summarise whole turns.
fn is_of_drive(channel: &Channel) -> bool {
    let drive = matches!(channel.source, Source::Command | Source::Drive | Source::Encoder | Source::RateSensor);
    drive && channel.sampling != Sampling::PerTurn
}

/// The column of this name, if its meaning is fixed.
pub fn known(name: &str) -> Option<&'static KnownColumn> {
    KNOWN.iter().find(|column| column.name == name)
}
