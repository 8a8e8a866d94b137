//! A recording from the page: the profile of `stand record`, with the same routine.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use embassy_futures::block_on;
use hal_sim::session::SessionRequest;
use serde::Deserialize;
use stand_firmware::profile::{Parameter, Profile, ProfileConfig, ProfileKind};
use stand_firmware::speed_loop::Mode;
use stand_firmware::telemetry::Channels;

use super::connection::PanelConnection;
use super::control::ClientId;
use super::jobs::{Job, JobError};
use super::parts::Panel;
use super::stage::Stage;
use identification::log::Notes;
use stand_acquire::connection::ConnectionError;
use stand_acquire::profile_recording::{ProfileRecordingError, ProfileRecordingRequest, early_end, record_profile};
use stand_acquire::recording::{RecordingMonitor, RecordingProgress};

/// Longest recording, s.
const MAX_SECONDS: f64 = 3000.0;
/// Time that an unattended recording may take beyond its log: index, rest, start.
const UNATTENDED_MARGIN: Duration = Duration::from_secs(60);

/// What the page asks for.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordRequest {
    client: ClientId,
    profile: String,
    /// `rate` or `voltage`.
    mode: String,
    amplitude: Option<f64>,
    #[serde(default)]
    parameters: BTreeMap<String, f64>,
    seconds: f64,
    #[serde(default)]
    seed: u64,
    #[serde(default)]
    find_index: bool,
    /// The page may be closed or hidden meanwhile: confirmed by the user.
    #[serde(default)]
    unattended: bool,
}

/// A checked request.
pub struct PreparedRecording {
    client: ClientId,
    mode: Mode,
    profile: ProfileConfig,
    seconds: f64,
    find_index: bool,
    /// Time for which the page may be closed or hidden.
    unattended: Option<Duration>,
    /// Name of the log.
    log: String,
    /// The command that does the same in a shell.
    pub command: String,
}

impl RecordRequest {
    /// Checks the request.
    ///
    /// # Errors
    /// In words.
    pub fn prepare(self, panel: &Panel) -> Result<PreparedRecording, String> {
        let mode = match self.mode.as_str() {
            "rate" => Mode::Rate,
            "voltage" => Mode::Voltage,
            other => return Err(format!("mode `{}`: must be rate or voltage", other.escape_default())),
        };
        if !(0.5..=MAX_SECONDS).contains(&self.seconds) {
            return Err(format!("seconds: {} is outside 0.5 … {MAX_SECONDS}", self.seconds));
        }
        let kind: ProfileKind = self.profile.parse().map_err(|error| format!("profile: {error}"))?;
        let amplitude = self.amplitude.unwrap_or_else(|| SessionRequest::usual_amplitude(mode));
        let mut profile = SessionRequest::usual_profile(mode, kind, amplitude, self.seed);
        let log = panel.session.free_name("run", "parquet");
        let mut command =
            format!("stand record --port {} --out {log} --profile {kind} --mode {} --amplitude {amplitude}", panel.line.name(), self.mode);
        for (name, value) in &self.parameters {
            let parameter = Parameter::of_name(name).filter(|_| kind.parameters().contains(&name.as_str()));
            let parameter = parameter.ok_or_else(|| format!("{}: not a parameter of profile {kind}", name.escape_default()))?;
            parameter.set(&mut profile, *value).map_err(|error| error.to_string())?;
            command += &format!(" --{} {value}", name.to_lowercase().replace('_', "-"));
        }
        Profile::for_mode(&profile, mode).map_err(|error| error.to_string())?;
        command += &format!(" --seconds {} --seed {}{}", self.seconds, self.seed, if self.find_index { " --find-index" } else { "" });
        panel.line.control().check(self.client, Instant::now()).map_err(|error| error.to_string())?;
        let unattended = self.unattended.then(|| Duration::from_secs_f64(self.seconds) + UNATTENDED_MARGIN);
        Ok(PreparedRecording {
            client: self.client,
            mode,
            profile,
            seconds: self.seconds,
            find_index: self.find_index,
            unattended,
            log,
            command,
        })
    }
}

struct Monitor<'a> {
    job: &'a Job,
    seconds: f64,
}

impl RecordingMonitor for Monitor<'_> {
    fn progress(&mut self, progress: RecordingProgress) -> bool {
        let stage = Stage::Recording { at_s: progress.at_s, seconds: self.seconds, rate_rad_s: progress.rate_rad_s };
        self.job.stage(stage, Some((progress.at_s / self.seconds).clamp(0.0, 1.0)));
        !self.job.is_cancelled()
    }
}

/// Lets an unattended recording run without its page, which may close as soon as the request is answered.
///
/// # Errors
/// The page does not drive, in words.
pub fn claim(panel: &Panel, prepared: &PreparedRecording) -> Result<(), String> {
    let Some(duration) = prepared.unattended else { return Ok(()) };
    panel.line.control().run_unattended(prepared.client, duration, Instant::now()).map_err(|error| error.to_string())
}

/// Records, after [`claim`]; the name of the log. A recording that ended early is an error that names the log with the rows until then.
///
/// # Errors
/// In words.
pub fn run(panel: &Arc<Panel>, prepared: &PreparedRecording, job: &Job) -> Result<String, JobError> {
    let result = record(panel, prepared, job);
    panel.line.control().end_unattended(Instant::now());
    result
}

fn record(panel: &Arc<Panel>, prepared: &PreparedRecording, job: &Job) -> Result<String, JobError> {
    job.stage(Stage::Preparing, None);
    let path = panel.session.new_file(&prepared.log).map_err(|error| error.to_string())?;
    let request = ProfileRecordingRequest {
        mode: prepared.mode,
        profile: prepared.profile,
        seconds: prepared.seconds,
        decimation: 1,
        find_index: prepared.find_index,
        additional_channels: Channels::default(),
        notes: Notes::default(),
        path: &path,
    };
    let mut stand = PanelConnection::new(panel.line.clone(), prepared.client);
    let mut monitor = Monitor { job, seconds: prepared.seconds };
    let recording = block_on(record_profile(&mut stand, &request, &mut monitor));
    let recording =
        recording.map_err(|e| JobError::of(e, |e| matches!(e, ProfileRecordingError::Connection(ConnectionError::Interrupted))))?;
    let lost = recording.lost_rows;
    match early_end(&recording.end) {
        None if lost == 0 => Ok(prepared.log.clone()),
        None => Err(format!("{lost} rows were lost; the log is {}", prepared.log).into()),
        Some(reason) => Err(format!("ended early: {reason}; the rows until then are in {}", prepared.log).into()),
    }
}
