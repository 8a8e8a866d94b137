//! Compensation of a stand behind a serial port, by console commands that the stand checks.
//!
//! The settings of the stand are read first, because its firmware converts torque to voltage with them. Harmonics have phases from the
//! index, so a stand that has not seen its index is rejected. If the stand rejects a command, the previous compensation is restored.

use std::time::Duration;

use embassy_futures::block_on;
use stand_firmware::compensation::Compensation;
use stand_firmware::config::ConfigError;
use stand_firmware::settings::{FIELDS, Kept};

use super::{LearnError, NotCompensated, learn};
use crate::acquire::connection::ConnectionError;
use crate::acquire::link::{LinkError, SerialLink};
use crate::acquire::preparation::find_index;
use crate::log::Log;
use crate::model::Model;

/// Interval between queries of the state of a measurement.
const QUERY_INTERVAL: Duration = Duration::from_millis(500);

/// Why nothing was written.
#[derive(Debug, thiserror::Error)]
pub enum SerialCompensationError {
    /// The serial line fails, or the stand rejects a command.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The connection fails.
    #[error(transparent)]
    Connection(#[from] ConnectionError),
    /// The model gives no compensation.
    #[error(transparent)]
    Learn(#[from] LearnError),
    /// The firmware's limits exclude the compensation.
    #[error("{model}: {limit}")]
    Invalid {
        /// The model.
        model: String,
        /// The limit.
        limit: ConfigError,
    },
    /// The stand has not seen its index.
    #[error(
        "{port}: the stand has not seen its index, so the phases of the harmonics are undefined; turn the platform once, by hand or with SOURce:RATE"
    )]
    NoIndex {
        /// The port.
        port: String,
    },
    /// The stand rejected a command.
    #[error("{error}; the previous compensation was restored")]
    Restored {
        /// The stand's error.
        error: LinkError,
    },
    /// The stand's own measurement failed.
    #[error("{port}: {message}")]
    Measurement {
        /// The port.
        port: String,
        /// The stand's message.
        message: String,
    },
    /// A setting is not a number.
    #[error("SETTings:{name}? returned `{reply}` instead of a number")]
    Setting {
        /// The setting.
        name: &'static str,
        /// The reply.
        reply: String,
    },
}

/// The compensation that the stand has in force.
#[derive(Debug, Clone, PartialEq)]
pub struct InForce {
    /// Lines of `COMPensation:LIST?`.
    pub lines: Vec<String>,
    /// What is not compensated.
    pub not_compensated: Vec<NotCompensated>,
}

/// Writes the compensation from `model` (fitted to `log`) into the stand; with `save` also into its flash.
///
/// # Errors
/// As [`SerialCompensationError`]; the previous compensation is then in force.
pub fn write_model(link: &mut SerialLink, model: &Model, log: Option<&Log>, save: bool) -> Result<InForce, SerialCompensationError> {
    let settings = read_settings(link)?;
    let learnt = learn(model, log, &settings.settings)?;
    let compensation = learnt.compensation;
    // The firmware's own check, before anything is changed.
    let mut after = settings;
    after.settings.compensation = compensation;
    after.config().map_err(|limit| SerialCompensationError::Invalid { model: model.name().to_owned(), limit })?;
    if !compensation.harmonics.is_empty() && !block_on(find_index(link, false))? {
        return Err(SerialCompensationError::NoIndex { port: link.name() });
    }
    let before = settings.settings.compensation;
    if let Err(error) = commands(&compensation).iter().try_for_each(|command| link.command(command)) {
        for command in commands(&before) {
            link.command(&command)?;
        }
        return Err(SerialCompensationError::Restored { error });
    }
    finish(link, save, learnt.not_compensated)
}

/// Has the stand measure its cogging and friction; `progress` receives the stand's progress.
///
/// # Errors
/// The line fails, or the stand's measurement fails.
pub fn measure(link: &mut SerialLink, save: bool, mut progress: impl FnMut(&str)) -> Result<InForce, SerialCompensationError> {
    link.command("CALibration:COGGing:STARt")?;
    let state = loop {
        std::thread::sleep(QUERY_INTERVAL);
        let state = link.query("CALibration:COGGing?")?;
        if !state.starts_with("RUNNING") {
            break state;
        }
        progress(&link.query("CALibration:COGGing:PROGress?")?);
    };
    if !state.starts_with("DONE") {
        return Err(SerialCompensationError::Measurement { port: link.name(), message: state });
    }
    finish(link, save, Vec::new())
}

/// Saves to flash on request, and reads what is in force.
fn finish(link: &mut SerialLink, save: bool, not_compensated: Vec<NotCompensated>) -> Result<InForce, SerialCompensationError> {
    if save {
        link.command("SETTings:SAVE")?;
    }
    Ok(InForce { lines: link.query_lines("COMPensation:LIST?")?, not_compensated })
}

/// Commands that set a compensation. Numbers are written in the shortest form that reads back exactly.
fn commands(compensation: &Compensation) -> Vec<String> {
    let mut commands = vec![
        "COMPensation:CLEar".to_owned(),
        format!("COMPensation:COULomb {:e} N.M", compensation.coulomb_N_m),
        format!("COMPensation:VISCous {:e} N.M.S", compensation.viscous_N_m_s),
    ];
    let harmonics = compensation.harmonics.as_slice().iter();
    commands.extend(harmonics.map(|h| format!("COMPensation:HARMonic {},{:e} N.M,{:e} RAD", h.order, h.torque_N_m, h.phase_rad)));
    commands
}

/// All settings of the stand that this program knows.
fn read_settings(link: &mut SerialLink) -> Result<Kept, SerialCompensationError> {
    let mut settings = Kept::default();
    for field in FIELDS {
        match link.query(&format!("SETTings:{}?", field.name)) {
            Ok(reply) => {
                let number = reply.split_whitespace().next().and_then(|number| number.parse().ok());
                let number: f64 = number.ok_or(SerialCompensationError::Setting { name: field.name, reply })?;
                (field.write)(&mut settings, number);
            }
            // An older firmware.
            Err(LinkError::Rejected { .. }) => {}
            Err(error) => return Err(error.into()),
        }
    }
    Ok(settings)
}
