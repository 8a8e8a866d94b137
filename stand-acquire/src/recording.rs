//! The recording routine: the stream of a stand into a log, for every [`StandConnection`].
//!
//! In: a connection, the channels, the profile. Out: rows in a [`Recorder`], and how the recording ended. `stand record` and the steps of a
//! calibration session use it.

use std::io::Write;

use stand_firmware::profile::{Parameter, ProfileConfig};
use stand_firmware::speed_loop::Mode;
use stand_firmware::telemetry::{Channels, RowFrame};

use super::connection::{ConnectionError, StandConnection};
use super::preparation::{is_rejected, latched_fault};
use super::record::{Recorder, RowOutcome};

/// Interval between reads of the stream, s.
const READ_INTERVAL_S: f64 = 0.1;
/// Interval between flushes of the log, s.
const FLUSH_INTERVAL_S: f64 = 1.0;
/// Time without rows after which the stand counts as silent, s.
const SILENCE_TIMEOUT_S: f64 = 3.0;
/// Duration of a row of the firmware, s.
const ROW_S: f64 = 1e-3;

/// What is recorded.
#[derive(Debug, Clone, Copy)]
pub struct RecordingRequest<'a> {
    /// Profile and control mode; `None`: the drive stays off.
    pub profile: Option<(Mode, &'a ProfileConfig)>,
    /// Time after which the stand ends the profile, s.
    pub profile_s: f64,
    /// Channels of the stream.
    pub channels: Channels,
    /// Rows of the firmware in one row of the log.
    pub decimation: u16,
    /// Duration of the log, s.
    pub seconds: f64,
    /// Rows with a missing value after which the recording ends; `None`: no limit.
    pub max_incomplete_rows: Option<u64>,
}

/// Progress of a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecordingProgress {
    /// Time of the last row, s.
    pub at_s: f64,
    /// Last rate, rad/s; NaN without a value.
    pub rate_rad_s: f64,
}

/// Decisions of the caller during a recording.
pub trait RecordingMonitor {
    /// Receives each row of the log with its time; `true` ends the recording as complete.
    fn row(&mut self, _t_s: f64, _row: &RowFrame) -> bool {
        false
    }
    /// Receives the progress ten times a second; `false` interrupts the recording.
    fn progress(&mut self, progress: RecordingProgress) -> bool;
}

/// How a recording ended.
#[derive(Debug)]
pub enum RecordingEnd {
    /// The log has its full duration, or the monitor ended it as complete.
    Complete,
    /// The monitor interrupted it.
    Interrupted,
    /// A fault switched the drive off; the stand's description of the fault.
    Fault(String),
    /// No rows came for 3 s.
    Silent,
    /// More rows than allowed lacked a value.
    IncompleteRows,
    /// The connection failed.
    Disconnected(ConnectionError),
}

/// Result of a recording.
#[derive(Debug)]
pub struct Recording {
    /// How it ended.
    pub end: RecordingEnd,
    /// Rows missing between the first and the last row of the log, by their sequence numbers.
    pub lost_rows: u64,
}

/// Why a recording did not start, or its log could not be written.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The stand rejected a command, or the connection failed before the first row.
    #[error(transparent)]
    Connection(#[from] ConnectionError),
    /// The log cannot be written.
    #[error(transparent)]
    Write(#[from] std::io::Error),
}

/// Starts stream and profile, writes the rows to `recorder` until the recording ends, then stops profile and stream if the stand still
/// answers.
///
/// # Errors
/// The stand rejected a command before the start, or the log cannot be written.
pub async fn record<W: Write>(
    stand: &mut impl StandConnection,
    request: &RecordingRequest<'_>,
    recorder: &mut Recorder<W>,
    monitor: &mut impl RecordingMonitor,
) -> Result<Recording, RecordingError> {
    for command in start_commands(request) {
        stand.command(&command).await?;
    }
    let mut sequence = None;
    let mut end = take_rows(stand, request, recorder, monitor, &mut sequence).await?;
    recorder.flush()?;
    if !matches!(end, RecordingEnd::Disconnected(_) | RecordingEnd::Silent)
        && let Err(error) = stop(stand, &mut end).await
    {
        end = RecordingEnd::Disconnected(error);
    }
    let expected =
        sequence.map_or(0, |(first, last): (u32, u32)| u64::from(last.wrapping_sub(first)) / u64::from(request.decimation.max(1)) + 1);
    Ok(Recording { end, lost_rows: expected.saturating_sub(recorder.rows() + recorder.left_out()) })
}

/// Commands that set profile and stream, and start them.
fn start_commands(request: &RecordingRequest) -> Vec<String> {
    let names: Vec<&str> = request.channels.iter().map(|channel| channel.name).collect();
    let mut commands = request.profile.map_or(Vec::new(), |(mode, config)| profile_commands(mode, config, request.profile_s));
    // Each command must fit the line with what was set before it; one channel does at every decimation.
    commands.extend(names.first().map(|name| format!("STReam:CHANnels {name}")));
    commands.push(format!("STReam:DECimation {}", request.decimation));
    commands.push(format!("STReam:CHANnels {}", names.join(",")));
    commands.push("STReam ON".to_owned());
    if request.profile.is_some() {
        commands.push("PROFile:STARt".to_owned());
    }
    commands
}

/// Commands that set a profile of duration `seconds`.
fn profile_commands(mode: Mode, config: &ProfileConfig, seconds: f64) -> Vec<String> {
    let mode = if mode == Mode::Voltage { "VOLTage" } else { "RATE" };
    let mut commands = vec![format!("PROFile:MODE {mode}"), format!("PROFile:TYPE {}", config.kind.name())];
    let parameters = config.kind.parameters().iter().filter_map(|name| Parameter::of_name(name));
    commands.extend(parameters.map(|p| format!("PROFile:{} {}", p.name, (p.read)(config))));
    commands.push(format!("PROFile:DURation {seconds}"));
    commands
}

/// Writes rows until the recording ends; `sequence` becomes the numbers of the first and the last row.
async fn take_rows<W: Write>(
    stand: &mut impl StandConnection,
    request: &RecordingRequest<'_>,
    recorder: &mut Recorder<W>,
    monitor: &mut impl RecordingMonitor,
    sequence: &mut Option<(u32, u32)>,
) -> Result<RecordingEnd, std::io::Error> {
    let row_s = ROW_S * f64::from(request.decimation);
    let (mut silent_s, mut since_flush_s) = (0.0, 0.0);
    let mut rate_rad_s = f64::NAN;
    loop {
        let rows = match stand.wait_s(READ_INTERVAL_S).await {
            Ok(rows) => rows,
            Err(ConnectionError::Interrupted) => return Ok(RecordingEnd::Interrupted),
            Err(error) => return Ok(RecordingEnd::Disconnected(error)),
        };
        since_flush_s += READ_INTERVAL_S;
        silent_s = if rows.is_empty() { silent_s + READ_INTERVAL_S } else { 0.0 };
        if silent_s > SILENCE_TIMEOUT_S {
            return Ok(RecordingEnd::Silent);
        }
        for row in &rows {
            match recorder.take(row)? {
                RowOutcome::NotYet => {}
                RowOutcome::Fault(_) => return Ok(RecordingEnd::Fault(String::new())),
                RowOutcome::Written | RowOutcome::LeftOut => {
                    *sequence = Some((sequence.map_or(row.sequence, |(first, _)| first), row.sequence));
                    let at_s = recorder.last_s();
                    if monitor.row(at_s, row) || at_s + 0.5 * row_s >= request.seconds - row_s {
                        return Ok(RecordingEnd::Complete);
                    }
                }
            }
        }
        if let Some(row) = rows.last() {
            rate_rad_s = row.value("omega_rad_s").unwrap_or(rate_rad_s);
        }
        if request.max_incomplete_rows.is_some_and(|limit| recorder.left_out() > limit) {
            return Ok(RecordingEnd::IncompleteRows);
        }
        if !monitor.progress(RecordingProgress { at_s: recorder.last_s(), rate_rad_s }) {
            return Ok(RecordingEnd::Interrupted);
        }
        if since_flush_s >= FLUSH_INTERVAL_S {
            since_flush_s = 0.0;
            recorder.flush()?;
        }
    }
}

/// Stops profile and stream; completes the description of a fault.
async fn stop(stand: &mut impl StandConnection, end: &mut RecordingEnd) -> Result<(), ConnectionError> {
    for command in ["PROFile:STOP", "STReam OFF"] {
        match stand.command(command).await {
            // A latched fault is reported as the error of the next command.
            Err(error) if is_rejected(&error) && matches!(end, RecordingEnd::Fault(_)) => {}
            result => result?,
        }
    }
    if let RecordingEnd::Fault(description) = end {
        *description = latched_fault(stand).await?.unwrap_or_else(|| "a fault that has been cleared since".to_owned());
    }
    Ok(())
}
