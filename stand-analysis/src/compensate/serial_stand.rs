//! Compensation of a stand behind a connection, by console commands that the stand checks.
//!
//! The settings of the stand are read first, because its firmware converts torque to voltage with them. Harmonics have phases from the
//! index, so a stand that has not seen its index is rejected. The platform turns before and after the change ([`super::trial`]). If the
//! ripple is larger after, if the stand rejects a command, or if the second run fails, the previous compensation is restored.

use identification::parameters::NamesParameters;
use stand_firmware::compensation::Compensation;
use stand_firmware::config::ConfigError;
use stand_firmware::settings::Kept;
use stand_firmware::speed_loop::Settings;

use super::trial::{Trial, TrialError, measured_ripple, orders_of, trial_rate_rad_s};
use super::{LearnError, NotCompensated, OrderChange, OrderSpectrum, learn};
use identification::log::Log;
use identification::model::Model;
use stand_acquire::connection::{ConnectionError, StandConnection};
use stand_acquire::preparation::find_index;
use stand_acquire::settings::{self, SettingsError};

/// Interval between queries of the state of a measurement, s.
const QUERY_INTERVAL_S: f64 = 0.5;

/// Why nothing was written.
#[derive(Debug, thiserror::Error)]
pub enum SerialCompensationError {
    /// The connection fails, or the stand rejects a command.
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
        error: ConnectionError,
    },
    /// The stand's own measurement failed.
    #[error("{port}: {message}")]
    Measurement {
        /// The port.
        port: String,
        /// The stand's message.
        message: String,
    },
    /// The settings cannot be read.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// The user interrupted the stand's own measurement.
    #[error("interrupted; the compensation was not changed")]
    Interrupted,
    /// The test run before the change failed.
    #[error("{0}; the compensation was not changed")]
    Trial(#[from] TrialError),
    /// The test run after the change failed.
    #[error("{0}; the previous compensation was restored")]
    TrialAfter(TrialError),
}

impl NamesParameters for SerialCompensationError {
    fn parameters(&self) -> Vec<&str> {
        match self {
            SerialCompensationError::Learn(error) => error.parameters(),
            _ => Vec::new(),
        }
    }
}

/// How a compensation is written.
#[derive(Debug, Clone, Copy)]
pub struct Writing {
    /// Save it in the stand's flash, too.
    pub save: bool,
    /// Turn the platform before and after, and withdraw a compensation that makes the ripple larger.
    pub trial: bool,
    /// Returns false to interrupt a test run.
    pub goes_on: fn() -> bool,
}

/// The compensation that the stand has in force.
#[derive(Debug, Clone, PartialEq)]
pub struct InForce {
    /// Lines of `COMPensation:LIST?`.
    pub lines: Vec<String>,
    /// What is not compensated.
    pub not_compensated: Vec<NotCompensated>,
    /// The test runs; `None`: there were none, because none was wanted or there is no harmonic.
    pub trial: Option<Trial>,
    /// The new compensation made these orders larger and was withdrawn.
    pub withdrawn: Option<Vec<OrderChange>>,
}

/// Writes the compensation from `model` (fitted to `log`) into the stand.
///
/// # Errors
/// As [`SerialCompensationError`]; the previous compensation is then in force.
pub async fn write_model(
    stand: &mut impl StandConnection,
    model: &Model,
    log: Option<&Log>,
    writing: Writing,
) -> Result<InForce, SerialCompensationError> {
    let kept = settings_of(stand).await?;
    let before = kept.settings;
    let learnt = learn(model, log, &before)?;
    let compensation = learnt.compensation;
    // The firmware's own check, before anything is changed.
    let mut after = kept;
    after.settings.compensation = compensation;
    after.config().map_err(|limit| SerialCompensationError::Invalid { model: model.name().to_owned(), limit })?;
    if !compensation.harmonics.is_empty() && !find_index(stand, false).await? {
        return Err(SerialCompensationError::NoIndex { port: stand.name() });
    }
    let orders = orders_of(&before.compensation, &compensation);
    let ripple = if writing.trial && !orders.is_empty() { Some(ripple(stand, &before, writing).await?) } else { None };
    if let Err(error) = write(stand, &compensation).await {
        write(stand, &before.compensation).await?;
        return Err(SerialCompensationError::Restored { error });
    }
    finish(stand, &before, ripple.map(|ripple| (orders, ripple)), writing, learnt.not_compensated).await
}

/// What the stand keeps: its settings with the compensation in force.
///
/// # Errors
/// The connection fails, or the reply is not understood.
pub async fn settings_of(stand: &mut impl StandConnection) -> Result<Kept, SerialCompensationError> {
    Ok(settings::of_reply(stand.query_lines("*LRN?").await?)?.kept())
}

/// Has the stand measure its cogging and friction; `progress` receives the stand's progress.
///
/// # Errors
/// The line fails, or the stand's measurement fails.
pub async fn measure(
    stand: &mut impl StandConnection,
    writing: Writing,
    mut progress: impl FnMut(&str),
) -> Result<InForce, SerialCompensationError> {
    let before = settings_of(stand).await?.settings;
    // The routine turns the platform anyway; the old harmonics act in the first run only if the index is known.
    let index = writing.trial && find_index(stand, true).await?;
    let ripple = if index { Some(ripple(stand, &before, writing).await?) } else { None };
    stand.command("CALibration:COGGing:STARt").await?;
    let state = loop {
        match stand.wait_s(QUERY_INTERVAL_S).await {
            // Asked again below: the measurement of the stand is aborted before this ends.
            Ok(_) | Err(ConnectionError::Interrupted) => {}
            Err(error) => return Err(error.into()),
        }
        let state = stand.query("CALibration:COGGing?").await?;
        if !state.starts_with("RUNNING") {
            break state;
        }
        if !(writing.goes_on)() {
            stand.command("CALibration:COGGing:ABORt").await?;
            return Err(SerialCompensationError::Interrupted);
        }
        progress(&stand.query("CALibration:COGGing:PROGress?").await?);
    };
    if !state.starts_with("DONE") {
        return Err(SerialCompensationError::Measurement { port: stand.name(), message: state });
    }
    let orders = orders_of(&before.compensation, &settings_of(stand).await?.settings.compensation);
    let ripple = ripple.filter(|_| !orders.is_empty());
    finish(stand, &before, ripple.map(|ripple| (orders, ripple)), writing, Vec::new()).await
}

async fn ripple(stand: &mut impl StandConnection, settings: &Settings, writing: Writing) -> Result<OrderSpectrum, TrialError> {
    let rate_rad_s = trial_rate_rad_s(settings.overspeed_rad_s);
    measured_ripple(stand, rate_rad_s, settings.acceleration_rad_s2, writing.goes_on).await
}

/// Compares with the ripple before, restores the previous compensation if it was smaller, saves to flash on request, and reads what is in
/// force.
async fn finish(
    stand: &mut impl StandConnection,
    before: &Settings,
    ripple_before: Option<(Vec<u16>, OrderSpectrum)>,
    writing: Writing,
    not_compensated: Vec<NotCompensated>,
) -> Result<InForce, SerialCompensationError> {
    let mut trial = None;
    if let Some((orders, ripple_before)) = ripple_before {
        let after = match ripple(stand, before, writing).await {
            Ok(after) => after,
            Err(error) => {
                write(stand, &before.compensation).await?;
                return Err(SerialCompensationError::TrialAfter(error));
            }
        };
        trial = Some(Trial { rate_rad_s: trial_rate_rad_s(before.overspeed_rad_s), orders, before: ripple_before, after });
    }
    let withdrawn = trial.as_ref().and_then(Trial::grown);
    if withdrawn.is_some() {
        write(stand, &before.compensation).await?;
    } else if writing.save {
        stand.command("SETTings:SAVE").await?;
    }
    stand.command("FORMat:UNITs ON").await?;
    let lines = stand.query_lines("COMPensation:LIST?").await;
    stand.command("FORMat:UNITs OFF").await?;
    Ok(InForce { lines: lines?, not_compensated, trial, withdrawn })
}

/// Sets a compensation.
async fn write(stand: &mut impl StandConnection, compensation: &Compensation) -> Result<(), ConnectionError> {
    for command in commands(compensation) {
        stand.command(&command).await?;
    }
    Ok(())
}

/// Commands that set a compensation. Numbers are written in the shortest form that reads back exactly.
pub fn commands(compensation: &Compensation) -> Vec<String> {
    let mut commands = vec![
        "COMPensation:CLEar".to_owned(),
        format!("COMPensation:COULomb {:e} N.M", compensation.coulomb_N_m),
        format!("COMPensation:VISCous {:e} N.M.S", compensation.viscous_N_m_s),
    ];
    let harmonics = compensation.harmonics.as_slice().iter();
    commands.extend(harmonics.map(|h| format!("COMPensation:HARMonic {},{:e} N.M,{:e} RAD", h.order, h.torque_N_m, h.phase_rad)));
    commands
}
