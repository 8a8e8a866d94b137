//! The whole program on a serial line, as the STM32 and the simulated controller run it.
//!
//! In: a [`Board`], both halves of a serial line (embedded-io-async), a flash ([`Store`]), and the line's guard ([`StopLine`], fed by the
//! receive interrupt). Out: the part for the control interrupt ([`Interrupt`]) and [`App::run`], a future that never ends. It measures rows at
//! 1 kHz and passes them to telemetry, supervision and calibration; it passes setpoints to the speed loop, serves the console and transmits.
//! The caller owns all memory ([`Memory`]); nothing is static, so that a test can run many stands.
//!
//! The receive half reports a break by an error of the kind `Interrupted`, or the interrupt reports it to the guard; both end a stream.
//!
//! All parts run on one executor and one thread and share cells ([`state`]). Only the console waits for the line.

mod calibrate;
pub mod commands;
mod console;
mod out;
mod rows;
mod runner;
pub mod state;

pub use out::Out;
use state::Parts;
pub use state::{Identity, State};

use crate::board::{Board, Clock, TICKS_PER_ROW, Ticks};
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
use crate::session::next_start;
use crate::settings::{Kept, Saved, Store};
use crate::speed_loop::{Command, CompensationGains, Interrupt, Mailboxes, SpeedLoop};
use core::cell::Cell;
use core::future::poll_fn;
use core::pin::{Pin, pin};
use core::task::{Context, Poll};
use embassy_futures::join::{join, join5};
use embedded_io_async::{Read, Write};
use embedded_storage::nor_flash::NorFlash;

/// Samples of a recording before its trigger, of 2048: 0.15 s.
pub const CAPTURE_BEFORE: usize = 1536;

/// Memory of the app, except for its futures: 50 KiB, more than the stack has. A static is built in place by [`Memory::new`] at compile
/// time. An empty memory is all zeros, so that the image holds no copy of it.
pub struct Memory {
    map: Map,
    capture: capture::Memory,
    // Filled in by `assemble`.
    mailboxes: Option<Mailboxes>,
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
            mailboxes: None,
            instruments: None,
            dut: None,
            drift: None,
            observer: None,
        }
    }
}

/// The part of the program that runs in tasks.
pub struct App<'a, F> {
    state: State<'a>,
    store: Store<F>,
    measurement: MeasurementLoop<'a>,
    commands: &'a Mailbox<Command>,
    compensation: &'a Mailbox<CompensationGains>,
    map: &'a mut Map,
}

/// Assembles the program: the part for the control interrupt and the part for tasks. The settings come from the flash; `defaults` take their
/// place where there are none, or where they are invalid, which is reported as an error.
///
/// # Errors
/// A default setting is invalid.
pub fn assemble<'a, F: NorFlash>(
    memory: &'a mut Memory,
    mut store: Store<F>,
    defaults: Kept,
    identity: Identity<'a>,
    stop_line: &'a StopLine,
) -> Result<(Interrupt<'a>, App<'a, F>), ConfigError> {
    let default_config = defaults.config()?;
    let loaded = store.load::<Saved>(Kept::layout());
    let observer_numbers = loaded.ok().flatten().map(|saved| saved.observer).unwrap_or_default();
    let (kept, config, error) = match loaded {
        Ok(None) => (defaults, default_config, None),
        Ok(Some(Saved { kept, .. })) => match kept.config() {
            Ok(config) => (kept, config, None),
            Err(error) => (defaults, default_config, Some(ErrorEntry::with(Code::SETTING, error))),
        },
        Err(error) => (defaults, default_config, Some(ErrorEntry::with(Code::STORAGE, error))),
    };
    let mailboxes: &Mailboxes = memory.mailboxes.insert(Mailboxes::new());
    let interrupt = Interrupt::new(SpeedLoop::new(config), mailboxes).recording(memory.capture.recorder(CAPTURE_BEFORE));
    let instruments: &Instruments = memory.instruments.insert(Instruments::new(kept.hardware));
    let dut: &sensors::Shared = memory.dut.insert(sensors::Shared::default());
    let drift: &gyro_loop::DriftMeasurement =
        memory.drift.insert(gyro_loop::DriftMeasurement::new(gyro_loop::Scales::new(&kept.settings.gyro, &kept.hardware)));
    let observer: &observer::RunningObserver = memory.observer.insert(observer::RunningObserver::default());
    observer.set_parameters(&observer_numbers);
    observer.set_gyro_settings(kept.settings.gyro);
    let state = State::new(
        identity,
        stop_line,
        Parts { instruments, dut, drift, observer, config: &mailboxes.config, capture: &memory.capture },
        kept,
        defaults,
    );
    if let Some(error) = error {
        state.report(error);
    }
    let measurement =
        MeasurementLoop::new(kept.hardware, &mailboxes.reports).with_imu(dut).with_gyro(gyro_loop::GyroLoop::new(drift, observer));
    Ok((
        interrupt,
        App { state, store, measurement, commands: &mailboxes.commands, compensation: &mailboxes.compensation, map: &mut memory.map },
    ))
}

impl<F: NorFlash> App<'_, F> {
    /// Runs the tasks for ever. Borrows the app, so that the future stays small and its owner decides where the app is stored.
    pub async fn run<B: Board, R: Read, W: Write>(&mut self, board: &mut B, receive: R, transmit: W) {
        let Self { state, store, measurement, commands, compensation, map } = self;
        let state: &State<'_> = state;
        let clock = board.clock();
        let start = next_start(clock.now());
        let sensor_bus = board.sensor_bus();
        let measuring = Cell::new(None);
        let mut rows = rows::Rows::new(state, clock.clone(), &measuring);
        let sensor = pin!(async {
            if let Some(line) = sensor_bus {
                let sensor = sensors::DetectedSensor::new(line, clock.clone());
                sensors::Runner::new(sensor, clock.clone(), state.dut.shared).run().await;
            }
        });
        let measurement = pin!(async {
            // Without end, for practical purposes.
            measurement.run(board, start, u64::MAX, &mut rows).await;
        });
        let runner = pin!(runner::run(state, &clock, commands, start));
        let console = pin!(console::run(state, &clock, receive, store));
        let sending = pin!(send(state, &clock, transmit));
        let calibration = pin!(calibrate::run(state, &clock, map, &measuring, compensation));
        let parts = join5(separate(measurement), separate(runner), separate(console), separate(sending), separate(calibration));
        join(separate(sensor), parts).await;
    }
}

/// A future whose code stays a separate function, for a smaller stack frame of their common caller.
fn separate<F: Future>(mut future: Pin<&mut F>) -> impl Future<Output = F::Output> {
    #[inline(never)]
    fn poll<F: Future>(future: Pin<&mut F>, context: &mut Context<'_>) -> Poll<F::Output> {
        future.poll(context)
    }
    poll_fn(move |context| poll(future.as_mut(), context))
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
