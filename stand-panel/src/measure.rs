//! The other measurements from the page: Allan deviation, drift session, calibration session, each by the library's own functions, with the
//! files that the command line writes.
//!
//! A drift and a calibration session run on the stand of the panel, or on the simulated stand in virtual time, as the commands do without
//! `--port`.

use std::path::Path;
use std::time::Instant;

use embassy_futures::block_on;
use hal_sim::gyro::{Orientation, SingleAxis};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::analysis::write_json;
use super::connection::PanelConnection;
use super::control::ClientId;
use super::jobs::{CANCELLED, Job, JobError, message};
use super::line::Line;
use super::parts::Panel;
use super::session::{Session, quoted};
use super::stage::{Request, Stage};
use identification::deadline::Deadline;
use identification::files;
use stand_acquire::calibration_session::error::RunError;
use stand_acquire::calibration_session::journal::{JOURNAL_FILE, write_atomically};
use stand_acquire::calibration_session::run::{Operator, Progress, run_session};
use stand_acquire::calibration_session::simulated::{simulate, stand_with_dut};
use stand_acquire::calibration_session::{DutKind, Instruction, Mounting, PreparedSession, SessionChanges};
use stand_acquire::connection::StandConnection;
use stand_acquire::drift_session::{self, CyclePlan, DriftSessionError, DriftSessionProgress, DriftSessionRequest, VisitOrder};
use stand_analysis::allan::{AllanError, Request as AllanDeviation, Taus};
use stand_analysis::calibrate::CalibrateError;
use stand_analysis::drift::error::{DriftError, within};
use stand_analysis::drift::inequality::check_amplitudes;
use stand_analysis::drift::measurement::{Measurement, SetupUncertainties};
use stand_records::record::{self, RecordError};
use stand_records::stored_record::RECORD_FILE;
use stand_report::json::value;
use stand_report::units::Units;
use stand_report::{allan as allan_report, calibration as calibration_report, drift as drift_report};

/// Most positions of a drift session.
const MAX_POSITIONS: usize = 24;
/// Longest serial number or name of an operator, characters.
const MAX_TEXT: usize = 100;
/// Ends a computation when its job is cancelled.
fn cancelled() -> Deadline {
    Deadline::NEVER.or_when(&CANCELLED)
}

/// Writes the answer and its report as `NAME.json` and `NAME.html`; the name of the first.
fn write_answer(panel: &Panel, name: &str, answer: &Value, html: &str) -> Result<String, JobError> {
    let json = format!("{name}.json");
    let page = panel.session.new_file(&format!("{name}.html")).map_err(message)?;
    files::replace_text(&page, html).map_err(|error| format!("{}: {error}", page.display()))?;
    write_json(&panel.session.new_file(&json).map_err(message)?, answer)?;
    Ok(json)
}

/// Where a session runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Place {
    /// On a simulated stand of its own, in virtual time.
    Simulated,
    /// On the stand of the panel, which the page drives.
    Stand,
}

impl Place {
    /// The page has to drive the stand that it uses.
    fn check(self, panel: &Panel, client: ClientId) -> Result<(), String> {
        match self {
            Place::Simulated => Ok(()),
            Place::Stand => panel.line.control().check(client, Instant::now()).map_err(message),
        }
    }

    /// The option of the command.
    fn option(self, panel: &Panel) -> String {
        match self {
            Place::Simulated => String::new(),
            Place::Stand => format!(" --port {}", panel.line.name()),
        }
    }
}

/// The Allan deviation of a column of a log.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AllanRequest {
    log: String,
    column: String,
    from_s: Option<f64>,
    to_s: Option<f64>,
}

/// A job that is ready to run: its command and the name of its answer.
pub struct Prepared<T> {
    /// The command that does the same in a shell.
    pub command: String,
    /// It uses the stand of the panel.
    pub uses_stand: bool,
    name: String,
    work: T,
}

impl AllanRequest {
    /// Checks the request.
    ///
    /// # Errors
    /// In words.
    pub fn prepare(self, panel: &Panel) -> Result<Prepared<AllanDeviation>, String> {
        let log = panel.session.existing(&self.log).map_err(message)?;
        let name = panel.session.free_folder("allan");
        let mut command = format!("stand allan {} --column {}", self.log, quoted(&self.column));
        for (option, value) in [("from", self.from_s), ("to", self.to_s)] {
            command += &value.map_or(String::new(), |value| format!(" --{option} {value}"));
        }
        command += &format!(" --json {name}.json --html {name}.html");
        let work =
            AllanDeviation { log, column: self.column, from_s: self.from_s, to_s: self.to_s, taus: Taus::Octave, interpretation: None };
        Ok(Prepared { command, uses_stand: false, name, work })
    }
}

/// Computes the deviation; the name of the answer.
///
/// # Errors
/// In words.
pub fn allan(panel: &Panel, prepared: Prepared<AllanDeviation>, job: &Job) -> Result<String, JobError> {
    job.stage(Stage::Reading, None);
    let request = prepared.work.clone();
    let recorded = job.while_reading(move || request.read())?.map_err(message)?;
    job.stage(Stage::Deviations, None);
    let answer = prepared.work.analyse(recorded, cancelled()).map_err(|e| JobError::of(e, |e| matches!(e, AllanError::Interrupted)))?;
    let display = allan_report::Display::new(&answer, Units::default());
    let mut json = allan_report::json(&answer, &display);
    json["text"] = allan_report::text(&answer, &display).into();
    write_answer(panel, &prepared.name, &json, &allan_report::html(&answer, &display))
}

/// A drift session.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DriftRequest {
    client: ClientId,
    place: Place,
    /// Cycles in each position at each rate.
    cycles: u32,
    /// Duration of a pulse, s.
    pulse_s: f64,
    /// Time with closed correction loop before each cycle, s.
    rest_s: f64,
    /// Largest rates of the pulses, °/s.
    rates_deg_s: Vec<f64>,
    /// Positions: degrees turned.
    positions_deg: Vec<f64>,
    /// Latitude, degrees; of a simulated gyroscope it is known.
    latitude_deg: Option<f64>,
    #[serde(default)]
    seed: u64,
}

/// A checked drift session.
pub struct PreparedDrift {
    client: ClientId,
    place: Place,
    request: DriftSessionRequest,
    latitude_deg: Option<f64>,
    seed: u64,
}

impl DriftRequest {
    /// Checks the request.
    ///
    /// # Errors
    /// In words.
    pub fn prepare(self, panel: &Panel) -> Result<Prepared<PreparedDrift>, String> {
        self.place.check(panel, self.client)?;
        within("cycles", self.cycles.into(), 1.0, 1000.0).map_err(message)?;
        within("pulse_s", self.pulse_s, 1e-3, 60.0).map_err(message)?;
        within("rest_s", self.rest_s, 1e-3, 1e5).map_err(message)?;
        within("number of rates", self.rates_deg_s.len() as f64, 1.0, 4.0).map_err(message)?;
        for rate in &self.rates_deg_s {
            within("rates_deg_s", *rate, 1e-6, 100.0).map_err(message)?;
        }
        check_amplitudes(&self.rates_deg_s).map_err(message)?;
        within("number of positions", self.positions_deg.len() as f64, 1.0, MAX_POSITIONS as f64).map_err(message)?;
        for position in &self.positions_deg {
            within("positions_deg", *position, -360.0, 360.0).map_err(message)?;
        }
        if let Some(latitude) = self.latitude_deg {
            within("latitude_deg", latitude, -90.0, 90.0).map_err(message)?;
        }
        let name = panel.session.free_folder("drift");
        let list = |values: &[f64]| values.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
        let mut command = format!(
            "stand drift run{} --cycles {} --pulse {} --rest {} --rate {} --positions {} --seed {}",
            self.place.option(panel),
            self.cycles,
            self.pulse_s,
            self.rest_s,
            list(&self.rates_deg_s),
            list(&self.positions_deg),
            self.seed
        );
        command += &self.latitude_deg.map_or(String::new(), |latitude| format!(" --latitude {latitude}"));
        command += &format!(" --out {name}.parquet --json {name}.json --html {name}.html");
        let request = DriftSessionRequest {
            plan: CyclePlan {
                shape: "RECTangular",
                reversed: false,
                sequence: "BOTH",
                pulse_s: self.pulse_s,
                period_s: 0.02,
                rest_s: self.rest_s,
                cycles: self.cycles,
            },
            rates_rad_s: self.rates_deg_s.iter().map(|rate| rate.to_radians()).collect(),
            positions: self
                .positions_deg
                .iter()
                .map(|deg| Orientation { turned_rad: deg.to_radians(), ..Orientation::default() })
                .collect(),
            order: VisitOrder::Abba,
            rounds: 2,
            turn_by_drive: false,
            keep_rows: true,
        };
        let Self { client, place, latitude_deg, seed, .. } = self;
        let uses_stand = place == Place::Stand;
        Ok(Prepared { command, uses_stand, name, work: PreparedDrift { client, place, request, latitude_deg, seed } })
    }
}

/// Runs the session; the name of the answer.
///
/// # Errors
/// In words.
pub fn drift(panel: &Panel, prepared: &Prepared<PreparedDrift>, job: &Job) -> Result<String, JobError> {
    let PreparedDrift { client, place, request, latitude_deg, seed } = &prepared.work;
    let show = |DriftSessionProgress { visit, visits, position, state }: DriftSessionProgress| {
        let stage = Stage::Visit { visit, visits, position, state: state.to_owned() };
        job.stage(stage, Some((visit - 1) as f64 / visits as f64));
        !job.is_cancelled()
    };
    let (recording, source, latitude_deg) = match place {
        Place::Simulated => {
            let gyroscope = SingleAxis::default();
            let latitude_deg = latitude_deg.unwrap_or(gyroscope.site.latitude_rad.to_degrees());
            (drift_session::simulate(gyroscope, *seed, request, show), "simulated".to_owned(), Some(latitude_deg))
        }
        Place::Stand => {
            let mut stand = PanelConnection::new(panel.line.clone(), *client);
            let stops = panel.line.stops();
            let turn = async |place: &Orientation, stand: &mut PanelConnection| {
                let turned = stand_report::plain(place.turned_rad.to_degrees(), 6);
                // Rows of the turning belong to no position.
                stand.command("STReam OFF").await?;
                let asked =
                    job.ask(vec![Request::TurnGyroscope { turned_deg: place.turned_rad.to_degrees() }], || panel.line.stops() != stops);
                asked.ok_or_else(|| DriftSessionError::NotTurned(format!("the position {turned}° was not confirmed")))?;
                stand.reset_losses();
                Ok(stand.command("STReam ON").await?)
            };
            (block_on(drift_session::measure(&mut stand, request, turn, show)), panel.line.name().to_owned(), *latitude_deg)
        }
    };
    let recording = recording.map_err(|e| JobError::of(e, |e| matches!(e, DriftSessionError::Interrupted)))?;
    job.stage(Stage::Drift, None);
    let path = panel.session.new_file(&format!("{}.parquet", prepared.name)).map_err(message)?;
    // The rows are kept also where no drift can be computed from them; that reason is the first to be shown.
    let kept = recording.log(&path, &request.plan, latitude_deg).and_then(|log| log.write(&path));
    let measurement = Measurement::of_recording(source, &recording, latitude_deg, SetupUncertainties::default()).map_err(message)?;
    let result = measurement.evaluate_until(cancelled()).map_err(|e| JobError::of(e, |e| matches!(e, DriftError::Interrupted)))?;
    kept.map_err(message)?;
    let mut json = drift_report::json(&result, Units::default());
    json["text"] = drift_report::text(&result, Units::default()).into();
    write_answer(panel, &prepared.name, &json, &drift_report::html(&result, Units::default()))
}

/// A calibration session: the default session of a kind of device.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CalibrateRequest {
    client: ClientId,
    place: Place,
    kind: DutKind,
    #[serde(default)]
    serial: String,
    #[serde(default)]
    operator: String,
    #[serde(default)]
    seed: u64,
}

/// A checked calibration session.
pub struct PreparedCalibration {
    client: ClientId,
    place: Place,
    session: PreparedSession,
    seed: u64,
}

impl CalibrateRequest {
    /// Checks the request.
    ///
    /// # Errors
    /// In words.
    pub fn prepare(self, panel: &Panel) -> Result<Prepared<PreparedCalibration>, String> {
        self.place.check(panel, self.client)?;
        let name = panel.session.free_folder("calibrate");
        let mut command = format!("stand calibrate {}{} --out {name} --seed {}", self.kind.name(), self.place.option(panel), self.seed);
        for (option, text) in [("serial", &self.serial), ("operator", &self.operator)] {
            if text.chars().count() > MAX_TEXT || text.chars().any(char::is_control) {
                return Err(format!("{option}: one line of at most {MAX_TEXT} characters"));
            }
            command += &if text.is_empty() { String::new() } else { format!(" --{option} {}", quoted(text)) };
        }
        command += &format!(" --json {name}.json --html {name}.html");
        let [serial, operator] = [&self.serial, &self.operator].map(|text| Some(text.as_str()).filter(|text| !text.is_empty()));
        let changes = SessionChanges { serial, operator };
        let session = PreparedSession::new(None, self.kind, changes).map_err(message)?;
        let Self { client, place, seed, .. } = self;
        Ok(Prepared { command, uses_stand: place == Place::Stand, name, work: PreparedCalibration { client, place, session, seed } })
    }
}

/// An interrupted calibration session.
#[derive(Debug, Clone, Serialize)]
pub struct InterruptedSession {
    /// Its folder.
    name: String,
    kind: DutKind,
    serial: String,
    /// Steps that are done.
    done: usize,
    /// Names and durations of all steps, s.
    steps: Vec<(String, f64)>,
    /// Seed of the simulated stand on which it was begun; `None`: a real one.
    simulated_seed: Option<u64>,
}

/// The calibration sessions of the folder that can be continued: steps or the record are missing.
pub fn interrupted(session: &Session) -> Vec<InterruptedSession> {
    let of = |name: String| {
        let folder = session.folder().join(&name);
        let PreparedSession { session, begun, .. } = PreparedSession::resume(&folder).ok()?;
        let journal = begun?;
        let has_record = folder.join(RECORD_FILE).is_file();
        let steps: Vec<(String, f64)> = session.steps.iter().map(|step| (step.name.clone(), step.seconds)).collect();
        (journal.steps.len() < steps.len() || !has_record).then_some(InterruptedSession {
            name,
            kind: session.dut_kind,
            serial: session.serial,
            done: journal.steps.len(),
            steps,
            simulated_seed: journal.simulated_seed,
        })
    };
    session.folders().into_iter().filter_map(of).collect()
}

/// An interrupted calibration session to be continued.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ResumeRequest {
    client: ClientId,
    /// Its folder.
    name: String,
}

impl ResumeRequest {
    /// Checks the request. A session goes on where it was begun: on the stand of the panel, or on the simulated one of its seed.
    ///
    /// # Errors
    /// In words.
    pub fn prepare(self, panel: &Panel) -> Result<Prepared<PreparedCalibration>, String> {
        let Self { client, name } = self;
        let found = interrupted(&panel.session).into_iter().find(|interrupted| interrupted.name == name);
        let found = found.ok_or_else(|| format!("`{}`: no interrupted calibration session of this folder", name.escape_default()))?;
        let session = PreparedSession::resume(&panel.session.folder().join(&name)).map_err(message)?;
        let seed = found.simulated_seed;
        let place = if seed.is_some() { Place::Simulated } else { Place::Stand };
        place.check(panel, client)?;
        let of_seed = seed.map_or(String::new(), |seed| format!(" --seed {seed}"));
        let command = format!(
            "stand calibrate {}{} --out {name} --resume{of_seed} --json {name}.json --html {name}.html",
            found.kind.name(),
            place.option(panel)
        );
        let work = PreparedCalibration { client, place, session, seed: seed.unwrap_or_default() };
        Ok(Prepared { command, uses_stand: place == Place::Stand, name, work })
    }
}

/// The person at the page mounts the device.
struct PageOperator<'a> {
    job: &'a Job,
    line: &'a Line,
    /// Stops of the drive before the session.
    stops: u64,
}

impl Operator for PageOperator<'_> {
    fn perform(&mut self, instruction: &Instruction, _: &Mounting, _: f64) -> Option<String> {
        self.job.ask(instruction.0.iter().cloned().map(Request::Session).collect(), || self.line.stops() != self.stops)
    }
}

/// Runs the session and computes its record, in a folder as `stand calibrate --out` makes it; the name of the answer.
///
/// # Errors
/// In words.
pub fn calibrate(panel: &Panel, prepared: &Prepared<PreparedCalibration>, job: &Job) -> Result<String, JobError> {
    let PreparedCalibration { client, place, session, seed } = &prepared.work;
    let folder = panel.session.folder().join(&prepared.name);
    let seconds = session.session.seconds();
    let on_progress = |p: Progress| {
        let (minutes, rest) = ((p.left_s / 60.0) as u64, p.left_s as u64 % 60);
        let (step, left) = (p.step.to_owned(), format!("{minutes}:{rest:02}"));
        let stage = Stage::Step { number: p.number, of: p.of, step, left, rate_rad_s: p.rate_rad_s };
        job.stage(stage, Some((1.0 - p.left_s / seconds).clamp(0.0, 1.0)));
        !job.is_cancelled()
    };
    let done = match place {
        Place::Simulated => simulate(&stand_with_dut(None, *seed, &session.session), *seed, session, &folder, cancelled(), on_progress),
        Place::Stand => {
            let mut stand = PanelConnection::new(panel.line.clone(), *client);
            block_on(run_session(
                &mut stand,
                session,
                &folder,
                &mut PageOperator { job, line: &panel.line, stops: panel.line.stops() },
                on_progress,
            ))
        }
    };
    done.map_err(|error| ended_early(&folder, &prepared.name, error))?;
    job.stage(Stage::Record, None);
    let record = record::compute_until(&folder, cancelled()).map_err(|error| match error {
        RecordError::Calibrate(CalibrateError::Interrupted) => JobError::Cancelled,
        RecordError::Calibrate(error) => JobError::Failed(calibration_report::calibrate_error(&error)),
        other => JobError::Failed(other.to_string()),
    })?;
    let stored = calibration_report::stored(&record);
    let html = calibration_report::html(&record);
    let mut json = value(&stored);
    let text = serde_json::to_string_pretty(&json).map_err(message)?;
    write_atomically(&folder.join(RECORD_FILE), &format!("{text}\n")).map_err(message)?;
    write_atomically(&folder.join("record.html"), &html).map_err(message)?;
    json["text"] = calibration_report::text(&calibration_report::displayed_record(&stored, &Units::default())).into();
    json["folder"] = prepared.name.clone().into();
    json["absent"] = value(&record.findings.absent);
    json["remarks"] = value(&record.findings.remarks);
    write_answer(panel, &prepared.name, &json, &html)
}

/// Why a session did not reach its end.
fn ended_early(folder: &Path, name: &str, error: RunError) -> JobError {
    if folder.join(JOURNAL_FILE).exists() {
        JobError::Failed(format!(
            "{error}; the recorded rows are in {name}, `stand calibrate … --out {name} --resume` continues the session"
        ))
    } else {
        JobError::of(error, |error| matches!(error, RunError::Interrupted))
    }
}

/// Names and durations of the steps of the default session of a kind of device, s.
///
/// # Errors
/// In words.
pub fn steps(kind: DutKind) -> Result<Vec<(String, f64)>, String> {
    let prepared = PreparedSession::new(None, kind, SessionChanges::default()).map_err(message)?;
    Ok(prepared.session.steps.into_iter().map(|step| (step.name, step.seconds)).collect())
}
