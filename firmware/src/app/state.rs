//! What the app's parts share: cells, each set by one and read by others, all on one thread.
//!
//! The console sets what is asked for, the runner takes it; the rows say what is so. Errors and events from wherever they come are reported
//! here, so that they are in the queue and the registers, and on the line where a stream is on.

use super::out::Out;
use crate::board::{Hardware, TICKS_PER_S, Ticks};
use crate::calibration;
use crate::capture;
use crate::config::ConfigError;
use crate::console::errors::{Code, ErrorEntry, ErrorQueue};
use crate::console::guard::StopLine;
use crate::console::status::Status;
use crate::console::text::Text;
use crate::gyro_loop;
use crate::gyro_loop::observer;
use crate::imu;
use crate::measurement_loop::{Instruments, Row};
use crate::profile::{ProfileConfig, ProfileKind};
use crate::settings::Kept;
use crate::speed_loop::{Config, Mode, Tuning, Zero};
use crate::status::Fault;
use crate::telemetry::Channels;
use crate::words::words;
use core::cell::{Cell, RefCell};

/// What the drive is to do when nothing runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Demand {
    /// Nothing.
    Off,
    /// Hold a value: V, rad/s or rad.
    Hold(Mode, f64),
}

/// What runs for a time of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Running {
    /// Nothing.
    None,
    /// A profile.
    Profile,
    /// The calibration of cogging and friction.
    Calibration,
}

/// What the runner shall begin.
#[derive(Clone, Copy, Debug)]
pub enum Request {
    /// A profile in a mode, for so many milliseconds.
    Profile(ProfileConfig, Mode, u64),
    /// The calibration's course.
    Calibration(calibration::Course),
    /// End what runs; the demand is in force.
    End,
}

/// The values that `SOURce` holds, one for each mode.
#[derive(Clone, Copy, Debug, Default)]
pub struct Targets {
    /// V.
    pub voltage_V: f64,
    /// rad/s.
    pub rate_rad_s: f64,
    /// rad.
    pub position_rad: f64,
}

/// What a stream sends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stream {
    /// Its channels.
    pub channels: Channels,
    /// Rows of the loop in one of the line.
    pub decimation: u32,
}

/// What is told of the stand itself.
#[derive(Clone, Copy, Debug)]
pub struct Identity<'a> {
    /// What it is built on.
    pub model: &'a str,
    /// Its own number.
    pub serial: &'a str,
    /// The line's rate, bits per second.
    pub baud: u32,
}

/// What others of the program hold an end of.
#[derive(Clone, Copy)]
pub struct Parts<'a> {
    /// What the rows say of drive, sensor and rate.
    pub instruments: &'a Instruments,
    /// The sensor under test.
    pub imu: &'a imu::Shared,
    /// The drift measurement.
    pub pulse: &'a gyro_loop::Shared,
    /// The observer of the gyro.
    pub observer: &'a observer::Shared,
    /// The way of settings to the speed loop.
    pub tuning: &'a Tuning,
    /// The record around a fault.
    pub capture: &'a capture::Memory,
}

/// All of it.
pub struct State<'a> {
    /// Who it is.
    pub identity: Identity<'a>,
    /// What the line's guard asks for.
    pub stop_line: &'a StopLine,
    /// The way to the line.
    pub out: Out,
    /// The scales in force; others act from the next power-on on, when they are kept.
    pub hardware: Hardware,
    /// What is kept in flash, as it is now.
    pub kept: Cell<Kept>,
    /// What it is by default: the stand's own.
    pub defaults: Kept,
    /// What is held.
    pub demand: Cell<Demand>,
    /// What is to begin.
    pub request: Cell<Option<Request>>,
    /// What runs.
    pub running: Cell<Running>,
    /// What `SOURce` would hold.
    pub targets: Cell<Targets>,
    /// What held angles are counted from.
    pub zero: Cell<Zero>,
    /// The record around a fault, or a moment that was asked for.
    pub capture: &'a capture::Memory,
    /// Which of its samples are asked for: the first, and the one behind the last.
    pub capture_lines: Cell<(usize, usize)>,
    /// The mode that `OUTPut ON` takes.
    pub mode: Cell<Mode>,
    /// The profile that `PROFile:STARt` begins.
    pub profile: Cell<ProfileConfig>,
    /// Its mode.
    pub profile_mode: Cell<Mode>,
    /// How long it runs, s.
    pub profile_s: Cell<f64>,
    /// A number that clears a latched fault when it changes.
    pub clear: Cell<u16>,
    /// A cause that the tasks see, for as long as it is there.
    pub trip: Cell<Fault>,
    /// The newest row.
    pub row: Cell<Row>,
    /// The mean rate of the last rows, rad/s; `None` before there are enough.
    pub rate_rad_s: Cell<Option<f64>>,
    /// What the rows say of drive, sensor and rate.
    pub instruments: &'a Instruments,
    /// The set-up of the sensor that was asked for last.
    pub imu_setup: Cell<Option<imu::Setup>>,
    /// The sensor under test.
    pub imu: &'a imu::Shared,
    /// The drift measurement.
    pub pulse: &'a gyro_loop::Shared,
    /// The observer of the gyro.
    pub observer: &'a observer::Shared,
    /// The session of it that `DRIFt:STARt` begins.
    pub drift: gyro_loop::Asked,
    /// What is added to the stream's angles so that they are from the index, rad; `None` where it was not seen before the stream began.
    pub to_index_rad: Cell<Option<f64>>,
    /// What the stream sends.
    pub stream: Cell<Stream>,
    /// The slow supervision's thresholds are others, or the host's watch.
    pub watch_anew: Cell<bool>,
    /// The sensor under test was told to do something that keeps it from giving samples.
    pub imu_busy: Cell<bool>,
    /// A line of the host was heard since the last row.
    pub heard: Cell<bool>,
    /// When the last line with a check came, since the last 0x18, break or `*RST`.
    pub checked: Cell<Option<Ticks>>,
    /// For how long the host may be silent, s; `None`: not watched.
    pub host_silence_s: Cell<Option<f64>>,
    /// The registers.
    pub status: Status,
    /// `*OPC` waits for the end of what runs.
    pub completes: Cell<bool>,
    /// The moment at which errors of a line typed by hand are shown, unless the line's end goes on.
    pub show_errors_at: Cell<Option<Ticks>>,
    /// A calibration is asked for.
    pub calibrate: Cell<bool>,
    /// One is under way, its answer included.
    pub calibrating: Cell<bool>,
    /// The compensation is another one: the speed loop shall have it.
    pub learn: Cell<bool>,
    /// The way of other settings to the speed loop.
    pub tuning: &'a Tuning,
    /// How the calibration goes.
    pub calibration: calibration::Watch,
    /// How the last calibration ended.
    pub calibrated: Cell<Option<Result<calibration::Found, calibration::Refused>>>,
    /// Its course begins with the row of this moment.
    pub calibration_from: Cell<Option<Ticks>>,
    // Borrowed only within the functions of this file, which call nothing that borrows it.
    errors: RefCell<ErrorQueue>,
}

impl<'a> State<'a> {
    /// A stand at rest.
    pub fn new(identity: Identity<'a>, stop_line: &'a StopLine, parts: Parts<'a>, kept: Kept, defaults: Kept) -> Self {
        Self {
            identity,
            stop_line,
            out: Out::default(),
            hardware: kept.hardware,
            kept: Cell::new(kept),
            defaults,
            demand: Cell::new(Demand::Off),
            request: Cell::new(None),
            running: Cell::new(Running::None),
            targets: Cell::new(Targets::default()),
            zero: Cell::new(Zero::PowerOn),
            capture: parts.capture,
            capture_lines: Cell::new((0, 0)),
            mode: Cell::new(Mode::Rate),
            profile: Cell::new(ProfileConfig::new(ProfileKind::Sine, 5.0, 1)),
            profile_mode: Cell::new(Mode::Rate),
            profile_s: Cell::new(30.0),
            clear: Cell::new(0),
            trip: Cell::new(Fault::None),
            row: Cell::new(Row::default()),
            rate_rad_s: Cell::new(None),
            instruments: parts.instruments,
            imu_setup: Cell::new(None),
            imu: parts.imu,
            pulse: parts.pulse,
            observer: parts.observer,
            drift: gyro_loop::Asked::default(),
            to_index_rad: Cell::new(None),
            stream: Cell::new(Stream { channels: Channels::USUAL, decimation: 1 }),
            watch_anew: Cell::new(false),
            imu_busy: Cell::new(false),
            heard: Cell::new(false),
            checked: Cell::new(None),
            host_silence_s: Cell::new(None),
            status: Status::default(),
            completes: Cell::new(false),
            show_errors_at: Cell::new(None),
            calibrate: Cell::new(false),
            calibrating: Cell::new(false),
            learn: Cell::new(false),
            tuning: parts.tuning,
            calibration: calibration::Watch::default(),
            calibrated: Cell::new(None),
            calibration_from: Cell::new(None),
            errors: RefCell::new(ErrorQueue::default()),
        }
    }

    /// Takes other settings; the speed loop has them a millisecond later. The drive must be off. Scales act from the next power-on on.
    ///
    /// # Errors
    /// One of them makes no sense, with the scales in force or with its own.
    pub fn tune(&self, kept: Kept) -> Result<(), ConfigError> {
        kept.config()?;
        let config = Config::new(&kept.settings, &self.hardware)?;
        self.kept.set(kept);
        self.watch_anew.set(true);
        self.observer.scale(kept.settings.gyro);
        self.pulse.scale(gyro_loop::Scales::new(&kept.settings.gyro, &self.hardware));
        self.tuning.post(config);
        Ok(())
    }

    /// Whether something runs for a time of its own, or is about to.
    pub fn is_busy(&self) -> bool {
        self.running.get() != Running::None || self.request.get().is_some() || self.calibrating.get() || self.pulse.is_running()
    }

    /// Text mode, for whoever speaks next.
    pub fn to_text(&self) {
        self.out.set_streaming(false);
        self.checked.set(None);
    }

    /// Whether a line without a check is taken for a person's: no tool has been heard for ten seconds, and none has a stream.
    pub fn is_plain_allowed(&self, now: Ticks) -> bool {
        let is_past = |at: Ticks| !self.out.is_streaming() && now - at > 10 * TICKS_PER_S;
        self.checked.get().is_none_or(is_past)
    }

    /// Keeps an error for who asks; in a stream it is told at once.
    pub fn report(&self, entry: ErrorEntry) {
        self.status.happened(entry.code.event_bit());
        if let Ok(mut errors) = self.errors.try_borrow_mut() {
            errors.push(entry);
        }
        if self.out.is_streaming() {
            self.tell(&entry);
        }
    }

    /// The oldest error that nobody has asked for.
    pub fn next_error(&self) -> ErrorEntry {
        let oldest = self.errors.try_borrow_mut().ok().and_then(|mut errors| errors.pop());
        oldest.unwrap_or(ErrorEntry::new(Code(0)))
    }

    /// How many there are.
    pub fn error_count(&self) -> usize {
        self.errors.try_borrow().map_or(0, |errors| errors.count())
    }

    /// Forgets errors and events.
    pub fn clear_status(&self) {
        if let Ok(mut errors) = self.errors.try_borrow_mut() {
            errors.clear();
        }
        self.status.clear();
        self.completes.set(false);
    }

    /// Shows an error on the line, unasked.
    pub fn tell(&self, entry: &ErrorEntry) {
        let mut line = Text::<160>::default();
        line.writer().text("ERROR ");
        entry.write(&mut line.writer());
        self.out.try_line(line.as_str());
    }

    /// Whether the drive is on: something is held or runs, and no fault holds it off.
    pub fn is_driving(&self) -> bool {
        (self.demand.get() != Demand::Off || self.running.get() != Running::None) && self.row.get().fault == Fault::None
    }

    /// Everything off: what runs ends, nothing is held, the targets are zero.
    pub fn all_off(&self) {
        if self.running.get() == Running::Calibration {
            self.calibration.abort();
        }
        self.pulse.abort();
        self.observer.feed_back(false);
        self.demand.set(Demand::Off);
        self.targets.set(Targets::default());
        self.request.set(Some(Request::End));
    }
}

/// Asks the runner for a demand that is allowed now.
///
/// # Errors
/// A fault is latched.
pub fn hold(state: &State<'_>, demand: Demand) -> Result<(), ErrorEntry> {
    if demand != Demand::Off {
        no_fault(state)?;
    }
    if state.running.get() == Running::Calibration {
        state.calibration.abort();
    }
    state.demand.set(demand);
    state.request.set(Some(Request::End));
    Ok(())
}

/// Nothing may begin while a fault is latched.
///
/// # Errors
/// One is.
pub fn no_fault(state: &State<'_>) -> Result<(), ErrorEntry> {
    match state.row.get().fault {
        Fault::None => Ok(()),
        fault => {
            let mut entry = ErrorEntry::saying(Code::SETTINGS_CONFLICT, words!("the drive is off: "));
            entry.detail.writer().text(fault.name()).words(words!("; FAULt:CLEar first"));
            Err(entry)
        }
    }
}
