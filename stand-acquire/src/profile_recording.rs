//! A profile run on a stand, recorded into a log file: what `stand record` does on a serial port, and `stand sim --chip` on the emulated
//! chip.

use std::path::Path;
use std::time::Instant;

use stand_firmware::profile::ProfileConfig;
use stand_firmware::speed_loop::Mode;
use stand_firmware::telemetry::Channels;
use stand_firmware::telemetry::channel::{Sampling, Source};

use super::connection::{ConnectionError, StandConnection};
use super::link::LineLosses;
use super::preparation::{ColumnSettings, bring_to_rest, find_index, latched_fault};
use super::record::{LogFile, Recorder};
use super::recording::{RecordingEnd, RecordingError, RecordingMonitor, RecordingRequest, record};
use identification::log::{FaultNote, Log, LogError, Note, Notes, microseconds};

/// The profile lasts longer than the log by this time, so that the last row is part of it, s.
const PROFILE_MARGIN_S: f64 = 0.2;

/// What is recorded.
#[derive(Debug)]
pub struct ProfileRecordingRequest<'a> {
    /// Control mode.
    pub mode: Mode,
    /// Profile.
    pub profile: ProfileConfig,
    /// Duration of the log, s.
    pub seconds: f64,
    /// Rows of the firmware in one row of the log.
    pub decimation: u16,
    /// The platform turns to find its index first.
    pub find_index: bool,
    /// Channels beside the default ones.
    pub additional_channels: Channels,
    /// Notes of the user; they replace notes with the same key.
    pub notes: Notes,
    /// The log.
    pub path: &'a Path,
}

/// A recorded log.
#[derive(Debug)]
pub struct ProfileRecording {
    /// The log, as read back from its file.
    pub log: Log,
    /// How the recording ended.
    pub end: RecordingEnd,
    /// Rows missing in the log.
    pub lost_rows: u64,
    /// Losses on the serial line.
    pub line_losses: LineLosses,
    /// Rows left out because they lacked a value.
    pub incomplete_rows: u64,
    /// Columns left out because the stand has no values for them.
    pub absent_columns: Vec<&'static str>,
    /// Angles count from the index.
    pub has_index: bool,
    /// Time from the start of the profile to the end, s.
    pub elapsed_s: f64,
}

/// Why there is no log.
#[derive(Debug, thiserror::Error)]
pub enum ProfileRecordingError {
    /// The connection fails, or the stand rejects a command.
    #[error(transparent)]
    Connection(#[from] ConnectionError),
    /// The drive is off because of a fault.
    #[error("{port}: the drive is off because of a fault: {fault}; send FAULt:CLEar with `stand console` first")]
    Fault {
        /// The port.
        port: String,
        /// The stand's description of the fault.
        fault: String,
    },
    /// The index was not found.
    #[error("the platform turned but its index was not seen; check that the platform turns freely and that the index is wired")]
    NoIndex,
    /// The platform does not come to rest.
    #[error("the platform did not come to rest within 30 s after the search for the index; check its balance and the drive")]
    NotAtRest,
    /// The log cannot be written.
    #[error("{path}: cannot write: {source}")]
    Write {
        /// The file.
        path: std::path::PathBuf,
        /// Cause.
        source: std::io::Error,
    },
    /// The log cannot be read back or converted.
    #[error(transparent)]
    Log(#[from] LogError),
    /// No row was recorded.
    #[error("no row was recorded: {reason}")]
    NoRows {
        /// Reason.
        reason: String,
    },
}

/// Runs the profile on the stand and records it.
///
/// # Errors
/// The recording did not start, or no row was recorded. A recording that ends early is not an error: see [`ProfileRecording::end`].
pub async fn record_profile(
    stand: &mut impl StandConnection,
    request: &ProfileRecordingRequest<'_>,
    monitor: &mut impl RecordingMonitor,
) -> Result<ProfileRecording, ProfileRecordingError> {
    let file = LogFile::of(request.path)?;
    if let Some(fault) = latched_fault(stand).await? {
        return Err(ProfileRecordingError::Fault { port: stand.name(), fault });
    }
    stand.command("STReam OFF").await?;
    let has_index = find_index(stand, request.find_index).await?;
    if request.find_index {
        if !bring_to_rest(stand).await? {
            return Err(ProfileRecordingError::NotAtRest);
        }
        stand.command("OUTPut OFF").await?;
        if !has_index {
            return Err(ProfileRecordingError::NoIndex);
        }
    }
    let notes = notes(stand, request, has_index).await?;
    let write_error = |source| ProfileRecordingError::Write { path: file.partial_path().to_owned(), source };
    let channels = channels(request);
    let mut recorder = Recorder::new(file.create().map_err(write_error)?, channels, notes);
    let stream = RecordingRequest {
        profile: Some((request.mode, &request.profile)),
        profile_s: request.seconds + PROFILE_MARGIN_S,
        channels,
        decimation: request.decimation,
        seconds: request.seconds,
        max_incomplete_rows: None,
    };
    stand.reset_losses();
    let begun = Instant::now();
    let recording = match record(stand, &stream, &mut recorder, monitor).await {
        Ok(recording) => recording,
        Err(RecordingError::Connection(error)) => return Err(error.into()),
        Err(RecordingError::Write(source)) => {
            // A full disk leaves a partial row.
            drop(recorder);
            let _ = file.cut_to_whole_rows();
            return Err(write_error(source));
        }
    };
    let (rows, last_s, incomplete_rows) = (recorder.rows(), recorder.last_s(), recorder.left_out());
    let absent_columns = recorder.absent().to_vec();
    let line_losses = stand.losses();
    recorder.finish(&end_notes(&recording.end, last_s, recording.lost_rows, line_losses.damaged)).map_err(write_error)?;
    if rows == 0 {
        let _ = std::fs::remove_file(file.partial_path());
        return Err(match recording.end {
            RecordingEnd::Disconnected(error) => error.into(),
            end => ProfileRecordingError::NoRows { reason: early_end(&end).unwrap_or_else(|| "the stand sent none".to_owned()) },
        });
    }
    file.close()?;
    Ok(ProfileRecording {
        log: Log::read(request.path)?,
        end: recording.end,
        lost_rows: recording.lost_rows,
        line_losses,
        incomplete_rows,
        absent_columns,
        has_index,
        elapsed_s: begun.elapsed().as_secs_f64(),
    })
}

/// Channels of the log: the default ones, without setpoints in voltage mode, and the additional ones.
fn channels(request: &ProfileRecordingRequest) -> Channels {
    let setpoints = Channels::matching(|channel| channel.source == Source::Command && channel.sampling == Sampling::Instant);
    let default = if request.mode == Mode::Voltage { Channels::DEFAULT.without(setpoints) } else { Channels::DEFAULT };
    default.and(request.additional_channels)
}

/// Notes at the head of the log.
async fn notes(stand: &mut impl StandConnection, request: &ProfileRecordingRequest<'_>, has_index: bool) -> Result<Notes, ConnectionError> {
    let settings = ColumnSettings::query(stand).await?;
    let identity = stand.query("*IDN?").await?;
    let identity: Vec<&str> = identity.split(',').collect();
    let field = |k: usize| identity.get(k).copied().unwrap_or("").trim().to_owned();
    let (mode, unit) = if request.mode == Mode::Voltage { ("voltage", "V") } else { ("rate", "rad/s") };
    let mut notes = Notes::from_iter([
        Note::Stand(format!("{} {} {}", field(0), field(1), field(2))),
        Note::Text("firmware", field(3)),
        Note::Text("port", stand.name()),
        Note::Profile(request.profile.kind.name().to_owned()),
        Note::Text("amplitude", format!("{} {unit}", request.profile.amplitude)),
        Note::Mode(mode.to_owned()),
        Note::Text("profile_seed", request.profile.seed.to_string()),
    ]);
    notes.replace(settings.notes(has_index));
    notes.push(Note::Date);
    notes.replace(request.notes.clone());
    Ok(notes)
}

/// Notes at the end of the log.
fn end_notes(end: &RecordingEnd, last_s: f64, lost_rows: u64, damaged: u64) -> Notes {
    let mut notes = Notes::from_iter([Note::LostRows(lost_rows), Note::DamagedFrames(damaged)]);
    if let RecordingEnd::Fault(fault) = end {
        notes.push(Note::Fault(FaultNote { message: fault.clone(), at_s: microseconds(last_s).to_string() }));
    }
    notes.extend(early_end(end).map(|reason| Note::Ended(reason, last_s)));
    notes
}

/// Why a recording ended early; `None`: it is complete.
pub fn early_end(end: &RecordingEnd) -> Option<String> {
    match end {
        RecordingEnd::Complete => None,
        RecordingEnd::Interrupted => Some("by hand".to_owned()),
        RecordingEnd::Fault(fault) => Some(format!("fault {fault}")),
        RecordingEnd::Silent => Some("the stand was silent for 3 s".to_owned()),
        RecordingEnd::IncompleteRows => Some("too many rows lacked a value".to_owned()),
        RecordingEnd::Disconnected(error) => Some(error.to_string()),
    }
}
