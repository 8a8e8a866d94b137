//! Options that describe a stand: the simulated stand's file, the gyroscope's file, the drive mode, a missing port.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use hal_sim::gyro::SingleAxis;
use hal_sim::plant::Stand;
use stand_firmware::speed_loop::Mode;

use super::error::CliError;
use stand_acquire::hidden::{HiddenEffect, hide};
use stand_acquire::link::ports;
use stand_acquire::simulation::described_stand;

/// Control of the drive during a profile.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum DriveMode {
    /// The profile is the rate setpoint of the speed loop
    Rate,
    /// The profile is the voltage, without the speed loop
    Voltage,
}

impl DriveMode {
    /// The mode of the firmware.
    pub(super) fn firmware_mode(self) -> Mode {
        match self {
            DriveMode::Rate => Mode::Rate,
            DriveMode::Voltage => Mode::Voltage,
        }
    }
}

/// The simulated stand described by the file at `path`, with valid firmware settings; without a path the default stand.
pub(super) fn read_stand(path: Option<&Path>) -> Result<Stand, CliError> {
    let Some(path) = path else { return Ok(Stand::default()) };
    let text = std::fs::read_to_string(path).map_err(|e| CliError::file(path, "read", &e))?;
    parse_stand(&text, path)
}

/// The stand described by `text`, with valid firmware settings; errors name the file `path`.
pub(super) fn parse_stand(text: &str, path: &Path) -> Result<Stand, CliError> {
    // The session checks these too, but its errors do not name the file.
    described_stand(text).map_err(|e| CliError::in_file(path, e))
}

/// The simulated gyroscope described by the file at `path`; without a path the default gyroscope.
pub(super) fn read_gyroscope(path: Option<&Path>) -> Result<SingleAxis, CliError> {
    let Some(path) = path else { return Ok(SingleAxis::default()) };
    let text = std::fs::read_to_string(path).map_err(|e| CliError::file(path, "read", &e))?;
    hal_sim::gyro::read(&text).map_err(|e| CliError::in_file(path, e))
}

/// Adds the effect of the option `--hidden` to the stand.
pub(super) fn hide_effect(argument: Option<&str>, stand: &mut Stand) -> Result<Option<HiddenEffect>, CliError> {
    argument.map(|argument| hide(argument, stand)).transpose().map_err(|e| CliError::Input(format!("--hidden: {e}")))
}

/// The port of the option `--port`.
pub(super) fn required_port(port: Option<PathBuf>) -> Result<PathBuf, CliError> {
    port.ok_or_else(|| {
        CliError::Input(format!("--port is missing: give the serial port of the stand ({}; `stand sim --serve pty` creates one)", ports()))
    })
}
