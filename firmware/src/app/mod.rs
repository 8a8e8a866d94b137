//! The whole program on a serial line, as the STM32 and the simulated controller run it.
//!
//! In: a [`Board`], both halves of a serial line (embedded-io-async), a flash ([`Store`]), and the line's guard ([`StopLine`], fed by the
//! receive interrupt). Out: three parts, each with its own priority. [`Interrupt`] is for the control interrupt. [`Measurement::run`] makes
//! rows at 1 kHz, reads the sensor under test and passes setpoints to the speed loop; its priority is next. [`App::run`] takes the rows and
//! passes them to telemetry, supervision, calibration and instruments; it serves the console and transmits, in thread mode. The caller owns
//! all memory ([`Memory`]); nothing is static, so that a test can run many stands.
//!
//! The receive half reports a break by an error of the kind `Interrupted`, or the interrupt reports it to the guard; both end a stream.
//!
//! The parts of the app share cells ([`state`]), because they run on one executor. What crosses priorities is `Sync`: the queue of rows,
//! mailboxes, and shared cells whose critical sections copy one value. Only the console waits for the line.

mod calibrate;
pub mod commands;
mod console;
pub mod drive_test;
mod measurement;
mod out;
mod rows;
pub mod self_test;
mod setpoints;
pub mod state;

pub use measurement::{Measurement, QUEUED_ROWS};
use measurement::{RowQueue, RowReceiver, RowSignals, separate};
pub use out::Out;
use state::{DriveState, Parts};
pub use state::{Identity, State};

#[cfg(doc)]
use crate::board::Board;
use crate::board::{Clock, TICKS_PER_ROW, Ticks};
use crate::calibration::Map;
use crate::capture;
use crate::config::ConfigError;
use crate::console::errors::{Code, ErrorEntry};
use crate::console::guard::StopLine;
use crate::gyro_loop;
use crate::gyro_loop::observer;
use crate::mailbox::Mailbox;
use crate::measurement_loop::{Instruments, MeasurementLoop};
use crate::sensors;
use crate::settings::{Kept, Saved, Store};
use crate::speed_loop::{CompensationGains, Interrupt, Mailboxes, SpeedLoop};
use core::cell::Cell;
use core::pin::pin;
use embassy_futures::join::join4;
use embedded_io_async::{Read, Write};
use embedded_storage::nor_flash::NorFlash;

/// Samples of a recording before its trigger, of 2048: 0.15 s.
pub const CAPTURE_BEFORE: usize = 1536;

/// Memory of the program, except for its futures: 60 KiB, more than the stack has. A static is built in place by [`Memory::new`] at compile
/// time. An empty memory is all zeros, so that the image holds no copy of it.
pub struct Memory {
    map: Map,
    capture: capture::Memory,
    rows: RowQueue,
    // Filled in by `assemble`.
    mailboxes: Option<Mailboxes>,
    row_signals: Option<RowSignals>,
    drive: Option<DriveState>,
    instruments: Option<Instruments>,
    dut: Option<sensors::Shared>,
    drift: Option<gyro_loop::DriftMeasurement>,
    observer: Option<observer::RunningObserver>,
}

impl Default for Memory {
    fn default() -> Self {
        Self::new()
    }
}

impl Memory {
    /// An empty memory.
    pub const fn new() -> Self {
        Self {
            map: Map::new(),
            capture: capture::Memory::new(),
            rows: RowQueue::new(),
            mailboxes: None,
            row_signals: None,
            drive: None,
            instruments: None,
            dut: None,
            drift: None,
            observer: None,
        }
    }
}

/// The part of the program that runs in thread mode: console, telemetry, settings, supervision, calibration, instruments.
pub struct App<'a, F> {
    state: State<'a>,
    store: Store<F>,
    rows: RowReceiver<'a>,
    compensation: &'a Mailbox<CompensationGains>,
    map: &'a mut Map,
}

/// Assembles the program: the parts for the control interrupt, for the measurement's priority and for thread mode. The settings come from
/// the flash; `defaults` take their place where there are none, or where they are invalid, which is reported as an error.
///
/// # Errors
/// A default setting is invalid.
pub fn assemble<'a, F: NorFlash>(
    memory: &'a mut Memory,
    mut store: Store<F>,
    defaults: Kept,
    identity: Identity<'a>,
    stop_line: &'a StopLine,
) -> Result<(Interrupt<'a>, Measurement<'a>, App<'a, F>), ConfigError> {
    let default_config = defaults.config()?;
    let loaded = store.load::<Saved>(Kept::layout());
    let (kept, config, error) = match &loaded {
        Ok(None) => (defaults, default_config, None),
        Ok(Some(Saved { kept, .. })) => match kept.config() {
            Ok(config) => (*kept, config, None),
            Err(error) => (defaults, default_config, Some(ErrorEntry::with(Code::SETTING, error))),
        },
        Err(error) => (defaults, default_config, Some(ErrorEntry::with(Code::STORAGE, *error))),
    };
    let mailboxes: &Mailboxes = memory.mailboxes.insert(Mailboxes::new());
    let interrupt = Interrupt::new(SpeedLoop::new(config), mailboxes).recording(memory.capture.recorder(CAPTURE_BEFORE));
    let instruments: &Instruments = memory.instruments.insert(Instruments::new(kept.hardware));
    let drive: &DriveState = memory.drive.insert(DriveState::default());
    let row_signals: &RowSignals = memory.row_signals.insert(RowSignals::default());
    let dut: &sensors::Shared = memory.dut.insert(sensors::Shared::default());
    let drift: &gyro_loop::DriftMeasurement =
        memory.drift.insert(gyro_loop::DriftMeasurement::new(gyro_loop::Scales::new(&kept.settings.gyro, &kept.hardware)));
    let observer: &observer::RunningObserver = memory.observer.insert(observer::RunningObserver::default());
    if let Ok(Some(saved)) = &loaded {
        observer.set_parameters(&saved.observer);
    }
    observer.set_gyro_settings(kept.settings.gyro);
    let state = State::new(
        identity,
        stop_line,
        Parts { instruments, dut, drift, observer, config: &mailboxes.config, capture: &memory.capture, drive },
        kept,
        defaults,
    );
    if let Some(error) = error {
        state.report(error);
    }
    let measurement =
        MeasurementLoop::new(kept.hardware, &mailboxes.reports).with_imu(dut).with_gyro(gyro_loop::GyroLoop::new(drift, observer));
    let (measurement, rows) = Measurement::new(measurement, &mut memory.rows, row_signals, dut, drive, &mailboxes.commands);
    Ok((interrupt, measurement, App { state, store, rows, compensation: &mailboxes.compensation, map: &mut memory.map }))
}

impl<F: NorFlash> App<'_, F> {
    /// Runs for ever. Borrows the app, so that the future stays small and its owner decides where the app is stored.
    pub async fn run<C: Clock + Clone, R: Read, W: Write>(&mut self, clock: &C, receive: R, transmit: W) {
        let Self { state, store, rows, compensation, map } = self;
        let state: &State<'_> = state;
        let measuring = Cell::new(None);
        let mut sink = rows::Rows::new(state, clock.clone(), &measuring);
        let rows = pin!(rows.run(&mut sink));
        let console = pin!(console::run(state, clock, receive, store));
        let sending = pin!(send(state, clock, transmit));
        let calibration = pin!(calibrate::run(state, clock, map, &measuring, compensation));
        join4(separate(rows), separate(console), separate(sending), separate(calibration)).await;
    }
}

/// Transmits the bytes of the output ring, for ever.
async fn send<C: Clock, W: Write>(state: &State<'_>, clock: &C, mut transmit: W) -> ! {
    let mut bytes = [0; 256];
    loop {
        let count = state.out.take(&mut bytes).await;
        if transmit.write_all(bytes.get(..count).unwrap_or_default()).await.is_err() {
            // The line is unplugged and may come back. The gap in the frame numbers shows the loss.
            clock.until(Ticks(clock.now().0.saturating_add(TICKS_PER_ROW))).await;
        }
    }
}
