//! State of the parts of the app in thread mode: cells on one thread, grouped by topic, each set by one part and read by others.
//! [`DriveState`] alone is shared with the setpoint runner at a higher priority.
//!
//! The console sets requests; the setpoint runner and the rows take them and report. Errors and events from all parts are reported here, so
//! that they reach the error queue, the status registers and, in stream mode, the line.

use super::drive_test::DriveTest;
use super::out::Out;
use crate::board::{Hardware, TICKS_PER_S, Ticks};
use crate::calibration;
use crate::capture;
use crate::config::ConfigError;
use crate::console::errors::{Code, ErrorEntry, ErrorQueue};
use crate::console::guard::StopLine;
use crate::console::status::{OPERATION_COMPLETE, Status};
use crate::gyro_loop::{self, observer};
use crate::mailbox::{Mailbox, SharedCell};
use crate::measurement_loop::{Instruments, Row};
use crate::profile::{Profile, ProfileConfig};
use crate::reset_cause::ResetCause;
use crate::sensors;
use crate::settings::Kept;
use crate::speed_loop::{Config, Mode, Zero};
use crate::status::Fault;
use crate::telemetry::Channels;
use crate::telemetry::frame::MAX_TEXT;
use crate::text::WithUnit;
use core::cell::{Cell, RefCell};
use core::fmt::Write;
use heapless::String;

/// After this time without a check sum, a line without one is taken for a person's.
const CHECKED_LINE_TIMEOUT: u64 = 10 * TICKS_PER_S;
/// Longest silence of a program that streams and uses check sums; its lines may be empty.
const STREAM_TIMEOUT: u64 = 5 * TICKS_PER_S;

/// Identification of the stand.
#[derive(Clone, Copy, Debug)]
pub struct Identity<'a> {
    /// The board that it runs on.
    pub model: &'a str,
    /// Serial number.
    pub serial: &'a str,
    /// Rate of the serial line, bits per second.
    pub baud: u32,
    /// Why it has started.
    pub reset_cause: ResetCause,
}

/// Parts of the program that the app shares with others.
#[derive(Clone, Copy)]
pub struct Parts<'a> {
    /// Turns, stability, timing, drive and sensor, estimated from the rows.
    pub instruments: &'a Instruments,
    /// The sensor under test.
    pub dut: &'a sensors::Shared,
    /// The drift measurement of the gyroscope.
    pub drift: &'a gyro_loop::DriftMeasurement,
    /// The observer of the gyroscope.
    pub observer: &'a observer::RunningObserver,
    /// Passes settings to the speed loop.
    pub config: &'a Mailbox<Config>,
    /// The recording around a fault.
    pub capture: &'a capture::Memory,
    /// Commands to the drive.
    pub drive: &'a DriveState,
}

/// State of the app.
pub struct State<'a> {
    /// Identification of the stand.
    pub identity: Identity<'a>,
    /// Requests of the line's guard.
    pub stop_line: &'a StopLine,
    /// Output to the line.
    pub out: Out,
    /// Hardware scales in force. Changed scales act after saving and the next power-on.
    pub hardware: Hardware,
    /// Settings that are kept in flash.
    pub settings: SettingsState<'a>,
    /// Commands to the drive, shared with the setpoint runner.
    pub drive: &'a DriveState,
    /// The values that `SOURce` has set.
    pub source: SourceState,
    /// The profile that `PROFile:STARt` starts.
    pub profile: ProfileState,
    /// The stream of rows.
    pub stream: StreamState,
    /// Inputs of the slow supervision.
    pub supervision: SupervisionState,
    /// Errors and status registers.
    pub status: StatusState,
    /// The calibration of cogging and friction.
    pub calibration: CalibrationState,
    /// The recording around a fault.
    pub capture: CaptureState<'a>,
    /// The sensor under test.
    pub dut: DutState<'a>,
    /// Measured values.
    pub measured: MeasuredState<'a>,
    /// The self-test with motion.
    pub drive_test: DriveTest,
    /// The gyroscope.
    pub gyro: GyroState<'a>,
}

/// Settings that are kept in flash.
pub struct SettingsState<'a> {
    /// Their present values.
    pub kept: Cell<Kept>,
    /// The stand's defaults.
    pub defaults: Kept,
    /// Passes settings to the speed loop.
    config: &'a Mailbox<Config>,
}

/// Commands to the drive, exchanged between the console and the setpoint runner, which runs at a higher priority.
pub struct DriveState {
    /// The value that is held when nothing runs.
    pub setpoint: SharedCell<Setpoint>,
    /// The next activity; the setpoint runner takes it.
    pub request: Mailbox<Request>,
    /// The present activity.
    pub activity: SharedCell<Activity>,
    /// Time of the first row of the calibration's course, once the runner has begun it.
    pub course_from: SharedCell<Option<Ticks>>,
    /// The zero of held angles.
    pub zero: SharedCell<Zero>,
    /// Number of fault clearings; a change clears a latched fault.
    pub fault_clears: SharedCell<u16>,
    /// A fault that the tasks detect, while its cause is present.
    pub trip: SharedCell<Fault>,
}

impl Default for DriveState {
    fn default() -> Self {
        Self {
            setpoint: SharedCell::new(Setpoint::Off),
            request: Mailbox::new(),
            activity: SharedCell::new(Activity::None),
            course_from: SharedCell::new(None),
            zero: SharedCell::new(Zero::PowerOn),
            fault_clears: SharedCell::new(0),
            trip: SharedCell::new(Fault::None),
        }
    }
}

impl DriveState {
    /// Requests a run. Nothing is held after it.
    #[inline(never)] // for the size of the image
    pub fn start(&self, run: Run) {
        // In this sequence, so that the drive is not off between a held value and the run.
        self.request.post(Request::Run(run));
        self.setpoint.set(Setpoint::Off);
    }

    /// Requests the end of the activity.
    #[inline(never)] // for the size of the image
    pub fn end(&self) {
        self.request.post(Request::End);
    }
}

/// The values of `SOURce`, and a changed compensation.
pub struct SourceState {
    /// The values, one for each mode.
    pub targets: Cell<Targets>,
    /// The mode that `OUTPut ON` selects.
    pub mode: Cell<Mode>,
    /// The compensation has changed and must be passed to the speed loop.
    pub compensation_changed: Cell<bool>,
}

/// A held value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Setpoint {
    /// The drive is off.
    Off,
    /// Value in V, rad/s or rad, by the mode.
    Hold(Mode, f64),
}

/// An activity of limited duration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Activity {
    /// None: the setpoint is held.
    None,
    /// A profile runs.
    Profile,
    /// The calibration of cogging and friction runs.
    Calibration,
}

/// An activity of the setpoint runner.
#[derive(Clone, Debug)]
pub struct Run {
    /// The setpoints. The console makes the profile, since the sines of some kinds take longer than a row.
    pub profile: Profile,
    /// Mode of the drive.
    pub mode: Mode,
    /// Milliseconds left.
    pub rows_left: u64,
    /// Profile or calibration.
    pub activity: Activity,
}

/// A request to the setpoint runner.
#[allow(clippy::large_enum_variant, reason = "one value, in place; no allocator")]
#[derive(Clone, Debug)]
pub enum Request {
    /// Run this.
    Run(Run),
    /// End the activity; the setpoint is in force.
    End,
}

/// The values that `SOURce` has set, one for each mode.
#[derive(Clone, Copy, Debug, Default)]
pub struct Targets {
    /// V.
    pub voltage_V: f64,
    /// rad/s.
    pub rate_rad_s: f64,
    /// rad.
    pub position_rad: f64,
}

/// The profile that `PROFile:STARt` starts.
pub struct ProfileState {
    /// Kind and parameters.
    pub config: Cell<ProfileConfig>,
    /// Mode of the drive.
    pub mode: Cell<Mode>,
    /// Duration, s.
    pub duration_s: Cell<f64>,
}

/// The stream of rows.
pub struct StreamState {
    /// Channels and decimation.
    pub selection: Cell<Stream>,
    /// Offset from the stream's angles to angles from the index, rad; `None` if the index was not seen before the stream began.
    pub to_index_rad: Cell<Option<f64>>,
}

/// Content of a stream.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stream {
    /// The selected channels.
    pub channels: Channels,
    /// Number of measured rows per transmitted row.
    pub decimation: u32,
}

/// Inputs of the slow supervision.
#[derive(Default)]
pub struct SupervisionState {
    /// Thresholds or the host's timeout have changed.
    pub settings_changed: Cell<bool>,
    /// The sensor under test has started an operation during which it gives no samples.
    pub dut_busy: Cell<bool>,
    /// A command of the program that drives was executed since the last row; queries and the commands of a client that only measures do not
    /// count.
    pub host_heard: Cell<bool>,
    /// Until then the drive may be on without a sign of the host.
    pub unattended_until: Cell<Ticks>,
    /// Time of the last line with a check sum since the last 0x18, break or `*RST`.
    pub checked_line_at: Cell<Option<Ticks>>,
    /// Longest silence of the host, s; `None`: the default one, while the drive is on.
    pub host_timeout_s: Cell<Option<f64>>,
}

/// Errors and status registers.
#[derive(Default)]
pub struct StatusState {
    /// The status registers.
    pub registers: Status,
    /// `*OPC` waits for the end of the activity.
    pub completion_pending: Cell<bool>,
    /// Time at which the errors of a line typed by hand are shown, unless a line feed follows.
    pub show_errors_at: Cell<Option<Ticks>>,
    // Borrowed only within the functions of this file, which call nothing that borrows it.
    errors: RefCell<ErrorQueue>,
}

/// The calibration of cogging and friction.
pub struct CalibrationState {
    /// Its phase and result.
    pub phase: Cell<CalibrationPhase>,
    /// Progress and abort.
    pub watch: calibration::CalibrationProgress,
}

/// Phase of the calibration.
#[allow(clippy::large_enum_variant, reason = "one value, in place; no allocator")]
#[derive(Clone, Copy, Debug)]
pub enum CalibrationPhase {
    /// None was started.
    Idle,
    /// The console has requested it.
    Requested,
    /// The course was passed to the runner and has not begun.
    Starting,
    /// The rows are measured from this time on.
    CalibrationRun {
        /// Time of the first row of the course.
        from: Ticks,
    },
    /// The course is over; the result is computed.
    Evaluating,
    /// The result.
    Finished(Result<calibration::CalibrationResult, calibration::CalibrationError>),
}

/// The recording around a fault.
pub struct CaptureState<'a> {
    /// The recording.
    pub memory: &'a capture::Memory,
    /// The samples that a query lists: the first, and one past the last.
    pub selection: Cell<(usize, usize)>,
}

/// The sensor under test.
pub struct DutState<'a> {
    /// Samples and status of its task.
    pub shared: &'a sensors::Shared,
    /// The set-up that was requested last.
    pub requested_setup: Cell<Option<sensors::Setup>>,
}

/// Measured values.
pub struct MeasuredState<'a> {
    /// The newest row.
    pub row: Cell<Row>,
    /// Mean rate of the last rows, rad/s; `None` before there are enough.
    pub rate_rad_s: Cell<Option<f64>>,
    /// Turns, stability, timing, drive and sensor, estimated from the rows.
    pub instruments: &'a Instruments,
}

/// The gyroscope.
pub struct GyroState<'a> {
    /// The drift measurement.
    pub drift: &'a gyro_loop::DriftMeasurement,
    /// The session that `DRIFt:STARt` starts.
    pub session: gyro_loop::PlanSettings,
    /// The observer.
    pub observer: &'a observer::RunningObserver,
}

impl<'a> State<'a> {
    /// State of a stand at rest.
    pub fn new(identity: Identity<'a>, stop_line: &'a StopLine, parts: Parts<'a>, kept: Kept, defaults: Kept) -> Self {
        Self {
            identity,
            stop_line,
            out: Out::default(),
            hardware: kept.hardware,
            settings: SettingsState { kept: Cell::new(kept), defaults, config: parts.config },
            drive: parts.drive,
            source: SourceState {
                targets: Cell::new(Targets::default()),
                mode: Cell::new(Mode::Rate),
                compensation_changed: Cell::new(false),
            },
            profile: ProfileState { config: Cell::new(ProfileConfig::DEFAULT), mode: Cell::new(Mode::Rate), duration_s: Cell::new(30.0) },
            stream: StreamState {
                selection: Cell::new(Stream { channels: Channels::DEFAULT, decimation: 1 }),
                to_index_rad: Cell::new(None),
            },
            supervision: SupervisionState::default(),
            status: StatusState::default(),
            calibration: CalibrationState { phase: Cell::new(CalibrationPhase::Idle), watch: calibration::CalibrationProgress::default() },
            capture: CaptureState { memory: parts.capture, selection: Cell::new((0, 0)) },
            dut: DutState { shared: parts.dut, requested_setup: Cell::new(None) },
            drive_test: DriveTest::default(),
            measured: MeasuredState { row: Cell::new(Row::default()), rate_rad_s: Cell::new(None), instruments: parts.instruments },
            gyro: GyroState { drift: parts.drift, session: gyro_loop::PlanSettings::default(), observer: parts.observer },
        }
    }

    /// Puts other settings in force; the speed loop has them a millisecond later. The drive must be off. Hardware scales act from the next
    /// power-on on.
    ///
    /// # Errors
    /// A setting is invalid, with the scales in force or with its own.
    pub fn apply(&self, kept: Kept) -> Result<(), ConfigError> {
        kept.config()?;
        let config = Config::new(&kept.settings, &self.hardware)?;
        self.settings.kept.set(kept);
        self.supervision.settings_changed.set(true);
        self.gyro.observer.set_gyro_settings(kept.settings.gyro);
        self.gyro.drift.set_scales(gyro_loop::Scales::new(&kept.settings.gyro, &self.hardware));
        self.settings.config.post(config);
        Ok(())
    }

    /// Whether an activity runs or is requested.
    pub fn is_busy(&self) -> bool {
        self.drive.activity.get() != Activity::None
            || self.drive.request.has_new()
            || self.calibration.is_running()
            || self.gyro.drift.is_running()
    }

    /// Returns to text mode, for any user of the line.
    pub fn set_text_mode(&self) {
        self.out.set_streaming(false);
        self.supervision.checked_line_at.set(None);
    }

    /// Ends the stream of a program that uses check sums and is silent: the next program on the line finds text.
    pub fn end_stream_without_program(&self, now: Ticks) {
        if self.out.is_streaming() && self.supervision.checked_line_at.get().is_some_and(|at| now - at > STREAM_TIMEOUT) {
            self.set_text_mode();
        }
    }

    /// Whether lines without a check sum are accepted: no program has sent one with a check sum for ten seconds, and none streams.
    pub fn is_unchecked_line_allowed(&self, now: Ticks) -> bool {
        let has_expired = |at: Ticks| !self.out.is_streaming() && now - at > CHECKED_LINE_TIMEOUT;
        self.supervision.checked_line_at.get().is_none_or(has_expired)
    }

    /// A number for a reply: with 9 significant digits, and with its unit after `FORMat:UNITs ON`.
    pub fn with_unit(&self, value: f64, unit: &'static str) -> WithUnit<'static> {
        WithUnit(value, if self.out.has_units.get() { unit } else { "" })
    }

    /// Puts an error into the queue and its event into the registers; in a stream it is sent at once.
    pub fn report(&self, entry: ErrorEntry) {
        self.status.registers.set_event(entry.code.event_bit());
        if self.out.is_streaming() {
            self.show_error(&entry);
        }
        self.status.push_error(entry);
    }

    /// Sends an error without a query.
    pub fn show_error(&self, entry: &ErrorEntry) {
        let mut line = String::<MAX_TEXT>::new();
        if write!(line, "ERROR {entry}").is_ok() {
            self.out.try_line(&line);
        }
    }

    /// Whether the drive is on: a value is held or an activity runs, and no fault has switched it off.
    pub fn is_driving(&self) -> bool {
        (self.drive.setpoint.get() != Setpoint::Off || self.drive.activity.get() != Activity::None)
            && self.measured.row.get().fault == Fault::None
    }

    /// Switches everything off: ends the activity, holds nothing, sets the targets to zero.
    pub fn all_off(&self) {
        if self.drive.activity.get() == Activity::Calibration {
            self.calibration.watch.abort();
        }
        self.gyro.drift.abort();
        self.gyro.observer.end_feedback();
        self.drive.setpoint.set(Setpoint::Off);
        self.source.targets.set(Targets::default());
        self.drive.end();
    }

    /// Ends the activity and holds a setpoint.
    ///
    /// # Errors
    /// A fault is latched, and the setpoint is not [`Setpoint::Off`].
    pub fn hold(&self, setpoint: Setpoint) -> Result<(), ErrorEntry> {
        if setpoint != Setpoint::Off {
            self.require_no_fault()?;
        }
        match self.drive.activity.get() {
            Activity::Calibration => self.calibration.watch.abort(),
            // The runner ends it with the next row; a query in the same line already finds it ended.
            Activity::Profile => self.drive.activity.set(Activity::None),
            Activity::None => {}
        }
        self.drive.setpoint.set(setpoint);
        self.drive.end();
        Ok(())
    }

    /// Checks that no fault is latched.
    ///
    /// # Errors
    /// A fault is latched.
    pub fn require_no_fault(&self) -> Result<(), ErrorEntry> {
        match self.measured.row.get().fault {
            Fault::None => Ok(()),
            fault => {
                let detail = format_args!("a fault has switched the drive off ({}): FAULt:CLEar first", fault.name());
                Err(ErrorEntry::with(Code::SETTINGS_CONFLICT, detail))
            }
        }
    }

    /// Checks that settings may change and flash may be written: the drive is off and no drift is measured.
    ///
    /// # Errors
    /// The drive is on, or the drift is measured.
    pub fn require_at_rest(&self) -> Result<(), ErrorEntry> {
        if self.is_driving() {
            return Err(ErrorEntry::with(Code::SETTINGS_CONFLICT, "the drive is on: OUTPut OFF first"));
        }
        self.require_no_drift_session()
    }

    /// Checks that no drift is measured.
    ///
    /// # Errors
    /// A drift session runs.
    pub fn require_no_drift_session(&self) -> Result<(), ErrorEntry> {
        if self.gyro.drift.is_running() {
            return Err(ErrorEntry::with(Code::SETTINGS_CONFLICT, "a drift measurement runs: DRIFt:ABORt first"));
        }
        Ok(())
    }
}

impl StatusState {
    fn push_error(&self, entry: ErrorEntry) {
        if let Ok(mut errors) = self.errors.try_borrow_mut() {
            errors.push(entry);
        }
    }

    /// Takes the oldest error; [`Code::NONE`] if there is none.
    pub fn next_error(&self) -> ErrorEntry {
        let oldest = self.errors.try_borrow_mut().ok().and_then(|mut errors| errors.pop());
        oldest.unwrap_or(ErrorEntry::new(Code::NONE))
    }

    /// Number of errors in the queue.
    pub fn error_count(&self) -> usize {
        self.errors.try_borrow().map_or(0, |errors| errors.count())
    }

    /// Clears errors and events.
    pub fn clear(&self) {
        if let Ok(mut errors) = self.errors.try_borrow_mut() {
            errors.clear();
        }
        self.registers.clear();
        self.completion_pending.set(false);
    }

    /// Sets the event "operation complete" if `*OPC` waits for it.
    pub fn complete_operation(&self) {
        if self.completion_pending.replace(false) {
            self.registers.set_event(OPERATION_COMPLETE);
        }
    }
}

impl CalibrationState {
    /// Whether a calibration is requested or runs, its evaluation included.
    pub fn is_running(&self) -> bool {
        !matches!(self.phase.get(), CalibrationPhase::Idle | CalibrationPhase::Finished(_))
    }
}
