//! A session on the simulated stand: the firmware library runs unchanged, in virtual time, on a plant.
//!
//! Input: a setup ([`StandSetup`]), a plant ([`PlantPort`]), a request ([`SessionRequest`]). Output: a [`Record`] with columns and
//! notes for a log, and the true motion. The same seed gives the same record, bit for bit, independent of other threads of the
//! process.

use crate::board::{Bench, PlantPort, SimBoard, Truth};
use crate::clock::{self, SimClock, Stuck, VirtualClock};
use crate::faults::FaultKind;
pub use crate::setup::StandSetup;
use embassy_futures::select::select;
use stand_firmware::board::{Board, Clock, ROW_HZ, TICKS_PER_ROW};
use stand_firmware::calibration::{self, CalibrationError, CalibrationProgress, CalibrationResult, Map};
use stand_firmware::config::ConfigError;
use stand_firmware::measurement_loop::{MeasurementLoop, Pace, Row, RowSink};
use stand_firmware::profile::{PARAMETERS, Profile, ProfileConfig, ProfileKind, ProfileRunner};
use stand_firmware::sensors;
use stand_firmware::session::rows_in;
use stand_firmware::speed_loop::{Compensating, CompensationGains, Config, Fault, Interrupt, Limits, Mailboxes, Mode, Settings, SpeedLoop};
use stand_firmware::telemetry::Channel;
use std::cell::{Cell, RefCell};
use std::future::poll_fn;
use std::task::Poll;

/// The requested session.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SessionRequest {
    /// Voltage or rate.
    pub mode: Mode,
    /// The profile, with its own seed.
    pub profile: ProfileConfig,
    /// Duration, s; one row per millisecond.
    pub seconds: f64,
    /// Seed of the sensors' noise.
    pub seed: u64,
}

impl SessionRequest {
    /// Amplitude for the default stand: V in voltage mode (about 22 rad/s), rad/s in rate mode.
    pub fn usual_amplitude(mode: Mode) -> f64 {
        match mode {
            Mode::Rate => 15.0,
            Mode::Position => 3.0,
            Mode::Voltage | Mode::Off => 0.7,
        }
    }

    /// A profile with default parameters and one seed for profile and noise.
    pub fn new(mode: Mode, kind: ProfileKind, seconds: f64, seed: u64) -> Self {
        Self { mode, profile: Self::usual_profile(mode, kind, Self::usual_amplitude(mode), seed), seconds, seed }
    }

    /// A profile for the mode: commanded rates stay within what the drive can follow under its acceleration limit.
    pub fn usual_profile(mode: Mode, kind: ProfileKind, amplitude: f64, seed: u64) -> ProfileConfig {
        let usual = ProfileConfig::new(kind, amplitude, seed);
        match mode {
            Mode::Rate => ProfileConfig { to_Hz: 1.0, bit_s: 0.5, ..usual },
            Mode::Voltage | Mode::Position | Mode::Off => ProfileConfig { acceleration: 2.0, jerk: 20.0, ..usual },
        }
    }
}

/// Why there is no record.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SessionError {
    /// A parameter of the profile or the settings is invalid.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The firmware waits for ever.
    #[error(transparent)]
    Stuck(#[from] Stuck),
}

/// Columns of equal length, named as in a log, and the notes of a log.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Record {
    /// `# key: value` notes, in order.
    pub notes: Vec<(String, String)>,
    /// Names and values; a column that a sensor does not deliver is absent.
    pub columns: Vec<(&'static str, Vec<f64>)>,
    /// True angle at t_k, rad.
    pub true_theta_rad: Vec<f64>,
    /// True rate at t_k, rad/s.
    pub true_omega_rad_s: Vec<f64>,
    /// Limits in force within each row.
    pub limits: Vec<Limits>,
    /// The parts of the learnt compensation in force at t_k.
    pub compensating: Vec<Compensating>,
    /// The fault that ended the rows early, if there was one.
    pub fault: Fault,
    /// Spacing of the rows, board clock steps.
    pub pace: Pace,
}

impl Record {
    /// A column by its name.
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        self.columns.iter().find(|(n, _)| *n == name).map(|(_, values)| values.as_slice())
    }

    /// A note by its key.
    pub fn note(&self, key: &str) -> Option<&str> {
        self.notes.iter().find(|(k, _)| k == key).map(|(_, value)| value.as_str())
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.limits.len()
    }
}

/// Runs a session to its end.
///
/// # Errors
/// An invalid parameter, by name; or a firmware that waits for ever.
pub fn run(stand: StandSetup, plant: impl PlantPort + 'static, request: SessionRequest) -> Result<Record, SessionError> {
    let mut columns = Columns::new(&stand);
    let mut truths = Truths::default();
    let (pace, sensor) = run_session(stand, Box::new(plant), request, &mut |row, truth, _| {
        if columns.take(row) {
            truths.take(row, truth);
        }
        true
    })?;
    let notes = [first_notes(&stand, &request, &sensor), last_notes(&stand, &request, &columns.summary)].concat();
    let fault = columns.summary.fault.map_or(Fault::None, |(fault, _)| fault);
    let Truths { theta_rad, omega_rad_s, limits, compensating } = truths;
    let columns = columns.drain();
    Ok(Record { notes, columns, true_theta_rad: theta_rad, true_omega_rad_s: omega_rad_s, limits, compensating, fault, pace })
}

/// Consecutive rows of a session, and the notes that are known after them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Block {
    /// Notes in addition to those of earlier blocks.
    pub notes: Vec<(String, String)>,
    /// Names and values, the same names in each block; a column that the first row lacks is absent, and `turn_s` where the first block has
    /// no whole turn.
    pub columns: Vec<(&'static str, Vec<f64>)>,
}

/// Runs a session and passes its rows to `take` in blocks of `block_rows`, for logs longer than the memory. A session of at most
/// `block_rows` rows is one block, equal to the record of [`run`]. The session ends early once `take` or, asked with each row, `goes_on`
/// returns false. At least one block is passed, the last one with the notes on the whole session.
///
/// # Errors
/// As [`run`].
pub fn run_blocks(
    stand: StandSetup,
    plant: impl PlantPort + 'static,
    request: SessionRequest,
    block_rows: usize,
    mut goes_on: impl FnMut(f64) -> bool,
    mut take: impl FnMut(Block) -> bool,
) -> Result<(), SessionError> {
    let mut columns = Columns::new(&stand);
    let mut is_first = true;
    let mut is_wanted = true;
    let (_, sensor) = run_session(stand, Box::new(plant), request, &mut |row, _, sensor| {
        if columns.rows_in_block >= block_rows {
            let notes = if is_first { first_notes(&stand, &request, &sensor.status()) } else { Vec::new() };
            is_first = false;
            is_wanted = take(Block { notes, columns: columns.drain() });
        }
        columns.take(row);
        is_wanted && goes_on(row.t_s)
    })?;
    if is_wanted {
        let first = if is_first { first_notes(&stand, &request, &sensor) } else { Vec::new() };
        let notes = [first, last_notes(&stand, &request, &columns.summary)].concat();
        take(Block { notes, columns: columns.drain() });
    }
    Ok(())
}

/// Runs a session and passes each row to `take` with the truth at its t_k: for logs longer than the memory,
/// and to display rows while they are made.
///
/// # Errors
/// As [`run`].
pub fn run_rows(
    stand: StandSetup,
    plant: impl PlantPort + 'static,
    request: SessionRequest,
    mut take: impl FnMut(&Row, &Truth),
) -> Result<Pace, SessionError> {
    run_session(stand, Box::new(plant), request, &mut |row, truth, _| (take(row, truth), true).1).map(|(pace, _)| pace)
}

/// As [`run_rows`], with the sensor under test; the session ends early once `take` returns false. Also returns the status of the sensor.
fn run_session(
    stand: StandSetup,
    plant: Box<dyn PlantPort>,
    request: SessionRequest,
    take: &mut dyn FnMut(&Row, &Truth, &sensors::Shared) -> bool,
) -> Result<(Pace, sensors::Status), SessionError> {
    let seconds = stand_firmware::config::within("seconds", request.seconds, 1e-3, 1e6)?;
    stand.sensors.check()?;
    if let Some(sensor) = &stand.imu {
        sensor.check()?;
    }
    let config = Config::new(&stand.settings, &stand.hardware)?;
    let profile = Profile::for_mode(&request.profile, request.mode)?;

    let clock = VirtualClock::default();
    let bench = RefCell::new(Bench::of(&stand, request.seed, plant));
    let mailboxes = Mailboxes::new();
    let mut interrupt = Interrupt::new(SpeedLoop::new(config), &mailboxes);
    let mut runner = ProfileRunner::new(profile, request.mode, stand.hardware, &mailboxes.commands);
    let sensor = sensors::Shared::default();
    let mut measurement = MeasurementLoop::new(stand.hardware, &mailboxes.reports).with_imu(&sensor);
    let goes_on = Cell::new(true);
    let mut sink = WithTruth { bench: &bench, sensor: &sensor, goes_on: &goes_on, take };

    let mut board = SimBoard::new(&bench, &clock);
    let line = board.sensor_bus().filter(|_| stand.imu.is_some());
    let carries = line.is_some();
    let session = async {
        if carries {
            await_first_sample(&SimClock(&clock), &sensor).await;
        }
        let rows = stand_firmware::session::run(&mut board, &mut runner, &mut measurement, rows_in(seconds), &mut sink);
        // Polled whenever the session is.
        select(rows, poll_fn(|_| if goes_on.get() { Poll::Pending } else { Poll::Ready(()) })).await;
    };
    let both = async {
        match line {
            Some(line) => {
                let chip = sensors::DetectedSensor::new(line, SimClock(&clock));
                select(session, sensors::Runner::new(chip, SimClock(&clock), &sensor).run()).await;
            }
            None => session.await,
        }
    };
    clock::run(&clock, both, |to| bench.borrow_mut().advance(to, |io| interrupt.run(io)))?;
    Ok((measurement.pace(), sensor.status()))
}

/// Returns when the sensor under test has delivered a sample, at the latest after 1/20 s; then the rows are without it.
async fn await_first_sample(clock: &SimClock<'_>, sensor: &sensors::Shared) {
    for _ in 0..50 {
        if sensor.newest().is_some() {
            return;
        }
        clock.until(clock.now() + 6 * TICKS_PER_ROW).await;
    }
}

/// Result of a self-calibration on the simulated stand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibrated {
    /// The calibration, or the reason for its refusal.
    pub outcome: Result<CalibrationResult, CalibrationError>,
    /// The compensation that the speed loop holds afterwards, in its units.
    pub in_force: CompensationGains,
}

/// Lets the stand measure its own cogging and friction ([`calibration`]). `watching` gets the progress each millisecond and may abort.
/// A result is in force afterwards; a refused or aborted calibration leaves the compensation unchanged.
///
/// # Errors
/// As [`run`].
pub fn calibrate(
    stand: StandSetup,
    plant: Box<dyn PlantPort>,
    seed: u64,
    watching: &dyn Fn(&CalibrationProgress),
) -> Result<Calibrated, SessionError> {
    stand.sensors.check()?;
    let config = Config::new(&stand.settings, &stand.hardware)?;
    // The runner needs a profile until the calibration sets its own.
    let still = Profile::legs(Default::default());

    let clock = VirtualClock::default();
    let bench = RefCell::new(Bench::of(&stand, seed, plant));
    let mailboxes = Mailboxes::new();
    let mut interrupt = Interrupt::new(SpeedLoop::new(config), &mailboxes);
    let mut runner = ProfileRunner::new(still, Mode::Off, stand.hardware, &mailboxes.commands);
    let mut measurement = MeasurementLoop::new(stand.hardware, &mailboxes.reports);
    let mut map = Box::new(Map::new());
    let watch = CalibrationProgress::default();

    let mut board = SimBoard::new(&bench, &clock);
    let calibration = async {
        let outcome = calibration::run(&mut board, &mut runner, &mut measurement, &stand.settings, &mut map, &watch).await;
        if let Ok(found) = &outcome {
            let settings = Settings { compensation: found.compensation, ..stand.settings };
            // The calibration has checked it.
            if let Ok(config) = Config::new(&settings, &stand.hardware) {
                mailboxes.compensation.post(config.compensation());
            }
        }
        // Some milliseconds more: the drive goes off, and the interrupt takes the compensation.
        let clock = SimClock(&clock);
        clock.until(clock.now() + 6 * TICKS_PER_ROW).await;
        outcome
    };
    let outcome = clock::run(&clock, calibration, |to| {
        watching(&watch);
        bench.borrow_mut().advance(to, |io| interrupt.run(io));
    })?;
    Ok(Calibrated { outcome, in_force: interrupt.compensation() })
}

/// Passes each row on with the truth at its time.
struct WithTruth<'a> {
    bench: &'a RefCell<Bench>,
    sensor: &'a sensors::Shared,
    goes_on: &'a Cell<bool>,
    take: &'a mut dyn FnMut(&Row, &Truth, &sensors::Shared) -> bool,
}

impl RowSink for WithTruth<'_> {
    fn row(&mut self, row: &Row) {
        // Row k arrives at t_{k+1}: the truth of t_k is one millisecond old.
        let [_, before] = self.bench.borrow().truth();
        self.goes_on.set((self.take)(row, &before, self.sensor));
    }
}

/// The columns of a session's log, in order: the time and channels of the stand.
const COLUMNS: [&str; 15] = [
    "t_s",
    "u_V",
    "u_slope_V",
    "supply_V",
    "i_A",
    "theta_rad",
    "omega_rad_s",
    "rate_cmd_rad_s",
    "theta_cmd_rad",
    "turn_s",
    "temp_C",
    "gyro_rad_s",
    "accel_x_m_s2",
    "accel_y_m_s2",
    "sensor_age_s",
];

/// The value of a column in a row; `turn_s` is 0 before the first whole turn.
fn value(column: &str, row: &Row) -> Option<f64> {
    match column {
        "t_s" => Some(row.t_s),
        "turn_s" => Some(row.turn_s().unwrap_or(0.0)),
        name => Channel::named(name).and_then(|channel| (channel.read)(row)),
    }
}

/// What a record has of each row besides its columns.
#[derive(Default)]
struct Truths {
    theta_rad: Vec<f64>,
    omega_rad_s: Vec<f64>,
    limits: Vec<Limits>,
    compensating: Vec<Compensating>,
}

impl Truths {
    fn take(&mut self, row: &Row, truth: &Truth) {
        self.theta_rad.push(truth.theta_rad);
        self.omega_rad_s.push(truth.omega_rad_s);
        self.limits.push(row.limits);
        self.compensating.push(row.compensating);
    }
}

/// Rows as columns, up to the first fault.
#[derive(Default)]
struct Columns {
    /// The columns that the first row has, and the values since the last [`Columns::drain`].
    values: Vec<(&'static str, Vec<f64>)>,
    rows_in_block: usize,
    summary: Summary,
}

/// What the notes say about all rows.
#[derive(Default)]
struct Summary {
    rows: u64,
    /// Rows in which each limit was in force.
    limited: [u64; Limits::COUNT],
    /// The first row with each part of the compensation, in the order of [`PARTS`].
    first: [Option<u64>; PARTS.len()],
    fault: Option<(Fault, f64)>,
    /// When the controller loses its supply, s from power-on.
    cut_s: Option<f64>,
}

/// Parts of the compensation that the notes name.
const PARTS: [Compensating; 3] = [Compensating::FRICTION, Compensating::HARMONICS, Compensating::WAITS_FOR_INDEX];

impl Summary {
    fn take(&mut self, row: &Row) {
        for (bit, rows) in self.limited.iter_mut().enumerate() {
            *rows += u64::from(row.limits.contains(Limits(1 << bit)));
        }
        for (part, first) in PARTS.into_iter().zip(&mut self.first) {
            if first.is_none() && row.compensating.contains(part) {
                *first = Some(self.rows);
            }
        }
        self.rows += 1;
    }
}

/// Time of row 0 after power-on, s: the log counts time from there.
pub const FIRST_ROW_S: f64 = 1e-3;
/// Interval of the rows, s.
const ROW_S: f64 = 1e-3;

impl Columns {
    fn new(stand: &StandSetup) -> Self {
        let cut_s = stand.faults.first(FaultKind::PowerCut).map(|cut| cut.from_s);
        Self { summary: Summary { cut_s, ..Summary::default() }, ..Self::default() }
    }

    /// Takes a row; false after the end of the rows.
    fn take(&mut self, row: &Row) -> bool {
        let Summary { rows, fault, cut_s, .. } = &mut self.summary;
        if cut_s.is_some_and(|cut_s| row.t_s + FIRST_ROW_S + ROW_S > cut_s) {
            return false;
        }
        if row.fault != Fault::None && fault.is_none() {
            *fault = Some((row.fault, row.t_s));
        }
        if *rows == 0 {
            self.values = COLUMNS.into_iter().filter(|name| value(name, row).is_some()).map(|name| (name, Vec::new())).collect();
        }
        // A column has no gaps: a value that ceases ends the rows.
        if fault.is_none() && self.values.iter().any(|(name, _)| value(name, row).is_none()) {
            *fault = Some((Fault::SensorSilent, row.t_s));
        }
        if fault.is_some() {
            return false;
        }
        for (name, column) in &mut self.values {
            column.extend(value(name, row));
        }
        self.rows_in_block += 1;
        self.summary.take(row);
        true
    }

    /// The values since the last call. At the first call, `turn_s` is left out where it has no whole turn.
    fn drain(&mut self) -> Vec<(&'static str, Vec<f64>)> {
        if self.summary.rows == 0 {
            return Vec::new();
        }
        if self.summary.rows == self.rows_in_block as u64 {
            self.values.retain(|(name, values)| !(*name == "turn_s" && no_turn(values)));
        }
        self.rows_in_block = 0;
        self.values.iter_mut().map(|(name, values)| (*name, std::mem::take(values))).collect()
    }
}

/// The column is 0 before the first whole turn; a column without a whole turn is left out.
fn no_turn(turn_s: &[f64]) -> bool {
    turn_s.last().is_none_or(|last| *last == 0.0)
}

/// Notes that are known when the sensor under test has started.
fn first_notes(stand: &StandSetup, request: &SessionRequest, sensor: &sensors::Status) -> Vec<(String, String)> {
    let profile = &request.profile;
    let (mode, unit) = match request.mode {
        Mode::Off => ("off", ""),
        Mode::Voltage => ("voltage", " V"),
        Mode::Rate => ("rate", " rad/s"),
        Mode::Position => ("position", " rad"),
    };
    let cutoff = stand.sensors.rate_cutoff_Hz;
    let omega = if cutoff.is_finite() { format!("gyro, filter {cutoff} Hz") } else { "gyro".to_string() };
    let mut notes = vec![
        ("firmware".to_string(), stand_firmware::VERSION.to_string()),
        ("profile".to_string(), profile.kind.name().to_string()),
        ("amplitude".to_string(), format!("{}{unit}", profile.amplitude)),
        ("offset".to_string(), format!("{}{unit}", profile.offset)),
        ("mode".to_string(), mode.to_string()),
        ("seed".to_string(), request.seed.to_string()),
        ("profile_seed".to_string(), profile.seed.to_string()),
        ("u_V".to_string(), "asked".to_string()),
        ("i_A".to_string(), "mean over [t_k, t_k+1)".to_string()),
        ("omega_rad_s".to_string(), omega),
        ("encoder".to_string(), format!("{} counts per turn", stand.hardware.counts_per_turn)),
        ("theta_zero".to_string(), "index".to_string()),
        ("theta_lsb_rad".to_string(), format!("{:e}", stand.hardware.rad_per_count())),
        ("omega_lsb_rad_s".to_string(), format!("{:e}", stand.hardware.rate_rad_s_per_code)),
    ];
    let already_noted = ["amplitude", "offset", "seed"];
    for parameter in PARAMETERS.iter().filter(|p| profile.kind.parameters().contains(&p.name) && !already_noted.contains(&p.name)) {
        notes.push((format!("profile_{}", parameter.name), (parameter.read)(profile).to_string()));
    }
    let timer_MHz = stand.hardware.edge_timer_Hz * 1e-6;
    notes.push(("turn_s".to_string(), format!("index to index, captured at {timer_MHz} MHz; 0 before the first whole turn")));
    notes.extend(sensor_notes(sensor));
    notes
}

/// Notes on the whole session.
fn last_notes(stand: &StandSetup, request: &SessionRequest, summary: &Summary) -> Vec<(String, String)> {
    let mut notes: Vec<_> = compensation_note(stand, summary).map(|text| ("compensation".to_string(), text)).into_iter().collect();
    for (name, limited) in Limits::NAMES.iter().zip(summary.limited) {
        if limited > 0 {
            notes.push((format!("limited_{name}"), format!("{limited} rows")));
        }
    }
    if let Some((fault, at_s)) = summary.fault {
        // Rounded to microseconds: the time is a sum of intervals.
        let at_s = (at_s * 1e6).round() / 1e6;
        notes.push(("fault".to_string(), format!("{} at {at_s} s; the rows end there", fault.name())));
    } else if let Some(cut_s) = summary.cut_s.filter(|cut_s| *cut_s - FIRST_ROW_S < request.seconds) {
        notes.push(("fault".to_string(), format!("power-cut at {:.4} s; the rows end there", cut_s - FIRST_ROW_S)));
    }
    notes
}

/// Notes on the columns of the sensor under test.
fn sensor_notes(sensor: &sensors::Status) -> Vec<(String, String)> {
    let Some(in_force) = sensor.in_force else { return Vec::new() };
    let setup = in_force.setup;
    let made = |what: &str, cutoff_Hz: f32, range: String| {
        let (name, rate_Hz) = (sensor.name, setup.data_rate_Hz);
        format!("{name}, {what}, filter {cutoff_Hz} Hz, ±{range}, newest sample of {rate_Hz} Hz before t")
    };
    let range_g = format!("{:.0} g", setup.accel_range_m_s2 / sensors::STANDARD_GRAVITY_M_S2);
    let accel = made("accelerometer", in_force.accel_cutoff_Hz, range_g);
    let accels = [("accel_x_m_s2", accel.clone()), ("accel_y_m_s2", accel)];
    let gyro = made("gyro", in_force.rate_cutoff_Hz, format!("{:.0} °/s", setup.rate_range_rad_s.to_degrees()));
    // A part without a gyro has no range of the rate, and no column.
    let gyros = (!setup.rate_range_rad_s.is_nan()).then_some(("gyro_rad_s", gyro));
    gyros.into_iter().chain(accels).map(|(key, text)| (key.to_string(), text)).collect()
}

/// Which compensation was in force, and from when; `None` where there is none.
fn compensation_note(stand: &StandSetup, summary: &Summary) -> Option<String> {
    let compensation = &stand.settings.compensation;
    let [friction_s, harmonics_s, waits_s] = summary.first.map(|row| row.map(|row| row as f64 / ROW_HZ as f64));
    let mut text = Vec::new();
    if compensation.has_friction() {
        let when = if friction_s.is_some() { "" } else { " (not in this mode)" };
        text.push(format!("friction{when}"));
    }
    if !compensation.harmonics.is_empty() {
        let orders: Vec<String> = compensation.harmonics.as_slice().iter().map(|h| h.order.to_string()).collect();
        let when = match (harmonics_s, waits_s) {
            (Some(from_s), _) => format!("from {from_s} s"),
            (None, Some(_)) => "not at work, the index was not seen".to_string(),
            (None, None) => "not in this mode".to_string(),
        };
        text.push(format!("orders {} ({when})", orders.join(" ")));
    }
    (!text.is_empty()).then(|| text.join(", "))
}
