//! All parts as one program, over a serial line: what the STM32 runs, and the simulated controller.
//!
//! In: a [`Board`], the two halves of a serial line (embedded-io-async), a flash ([`Store`]), the line's guard ([`StopLine`], fed by the receive
//! interrupt). Out: the interrupt's half ([`Interrupt`]), which the caller puts above all, and [`App::run`], a future that never ends: rows at
//! 1 kHz for ever, fanned out to telemetry, supervision and calibration; the runner that hands the speed loop what is asked for; the
//! console; the transmit side. All memory is [`Memory`], the caller's; nothing here is static, so that a test holds many.
//!
//! A receive half says that there was a break by an error of the kind `Interrupted`, or the interrupt tells the guard; both end a stream.
//!
//! One executor, one thread: the parts share cells ([`state`]). No part waits for the line but those that write replies to it.

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
use crate::imu;
use crate::measurement_loop::{Instruments, MeasurementLoop};
use crate::session::next_start;
use crate::settings::{Kept, Saved, Store};
use crate::speed_loop::{Interrupt, LessonWriter, Lessons, OrderWriter, Orders, Reports, SpeedLoop, Tuning};
use core::cell::Cell;
use core::future::poll_fn;
use core::pin::{Pin, pin};
use core::task::{Context, Poll};
use embassy_futures::join::{join, join5};
use embedded_io_async::{Read, Write};
use embedded_storage::nor_flash::NorFlash;

/// Samples of a record that lie before its trigger, of 2048: 0.15 s.
pub const CAPTURE_BEFORE: usize = 1536;

/// All memory of the app but what its futures hold: 50 KiB, more than a stack takes. A static of it is built in place, by [`Memory::new`] at
/// compile time; empty it is all zeros, so that the image holds no copy of it.
pub struct Memory {
    orders: Orders,
    reports: Reports,
    lessons: Lessons,
    map: Map,
    tuning: Tuning,
    capture: capture::Memory,
    // Filled in by `assemble`.
    instruments: Option<Instruments>,
    imu: Option<imu::Shared>,
    pulse: Option<gyro_loop::Shared>,
    observer: Option<observer::Shared>,
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
            orders: Orders::new(),
            reports: Reports::new(),
            lessons: Lessons::new(),
            map: Map::new(),
            tuning: Tuning::new(),
            capture: capture::Memory::new(),
            instruments: None,
            imu: None,
            pulse: None,
            observer: None,
        }
    }
}

/// The tasks' half of the program.
pub struct App<'a, F> {
    state: State<'a>,
    store: Store<F>,
    measurement: MeasurementLoop<'a>,
    orders: OrderWriter<'a>,
    lessons: LessonWriter<'a>,
    map: &'a mut Map,
}

/// Puts the program together: the interrupt's half and the tasks'. Settings come from the flash; where there are none that can be used, the
/// stand's own (`defaults`), and an error says so.
///
/// # Errors
/// The stand's own settings cannot be used: which, by name.
pub fn assemble<'a, F: NorFlash>(
    memory: &'a mut Memory,
    mut store: Store<F>,
    defaults: Kept,
    identity: Identity<'a>,
    stop_line: &'a StopLine,
) -> Result<(Interrupt<'a>, App<'a, F>), ConfigError> {
    let usual = defaults.config()?;
    let (loaded, numbers) = match store.load::<Saved>(Kept::layout()) {
        Ok(saved) => (Ok(saved.map(|saved| saved.kept)), saved.map(|saved| saved.observer)),
        Err(why) => (Err(why), None),
    };
    let (kept, config, wrong) = match loaded {
        Ok(None) => (defaults, usual, None),
        Ok(Some(kept)) => match kept.config() {
            Ok(config) => (kept, config, None),
            Err(wrong) => {
                let mut entry = ErrorEntry::new(Code::SETTING);
                commands::say_wrong(&wrong, &mut entry.detail.writer());
                (defaults, usual, Some(entry))
            }
        },
        Err(why) => (defaults, usual, Some(ErrorEntry::saying(Code::STORAGE, why.says()))),
    };
    let (order_writer, order_reader) = memory.orders.split();
    let (report_writer, report_reader) = memory.reports.split();
    let (lessons, lesson_reader) = memory.lessons.split();
    let interrupt = Interrupt::new(SpeedLoop::new(config), order_reader, report_writer)
        .listening(lesson_reader)
        .tuned_by(&memory.tuning)
        .recording(memory.capture.recorder(CAPTURE_BEFORE));
    let instruments: &Instruments = memory.instruments.insert(Instruments::new(kept.hardware));
    let imu: &imu::Shared = memory.imu.insert(imu::Shared::default());
    let pulse: &gyro_loop::Shared =
        memory.pulse.insert(gyro_loop::Shared::new(gyro_loop::Scales::new(&kept.settings.gyro, &kept.hardware)));
    let observer: &observer::Shared = memory.observer.insert(observer::Shared::default());
    observer.set(&numbers.unwrap_or_default());
    observer.scale(kept.settings.gyro);
    let state = State::new(
        identity,
        stop_line,
        Parts { instruments, imu, pulse, observer, tuning: &memory.tuning, capture: &memory.capture },
        kept,
        defaults,
    );
    if let Some(entry) = wrong {
        state.report(entry);
    }
    let measurement = MeasurementLoop::new(kept.hardware, report_reader).with_imu(imu).with_pulse(pulse).with_observer(observer);
    Ok((interrupt, App { state, store, measurement, orders: order_writer, lessons, map: &mut memory.map }))
}

impl<F: NorFlash> App<'_, F> {
    /// Runs the tasks, for ever. Borrows the app, so that the future stays small and its owner decides where the app lies.
    pub async fn run<B: Board, R: Read, W: Write>(&mut self, board: &mut B, receive: R, transmit: W) {
        let Self { state, store, measurement, orders, lessons, map } = self;
        let state: &State<'_> = state;
        let clock = board.clock();
        let start = next_start(clock.now());
        let sensor_bus = board.sensor_bus();
        let measuring = Cell::new(None);
        let mut rows = rows::Rows::new(state, clock.clone(), &measuring);
        let sensor = pin!(async {
            if let Some(line) = sensor_bus {
                let sensor = imu::Ism330dhcx::new(line, clock.clone());
                imu::Runner::new(sensor, clock.clone(), state.imu).run().await;
            }
        });
        let measurement = pin!(async {
            // So many that a stand is worn out first.
            measurement.run(board, start, u64::MAX, &mut rows).await;
        });
        let runner = pin!(runner::run(state, &clock, orders, start));
        let console = pin!(console::run(state, &clock, receive, store));
        let sending = pin!(send(state, &clock, transmit));
        let calibration = pin!(calibrate::run(state, &clock, map, &measuring, lessons));
        let parts = join5(apart(measurement), apart(runner), apart(console), apart(sending), apart(calibration));
        join(apart(sensor), parts).await;
    }
}

/// A future whose code stays a function of its own: written out in one they make 1.7 kB more, for what each keeps lies far from the others.
fn apart<F: Future>(mut future: Pin<&mut F>) -> impl Future<Output = F::Output> {
    #[inline(never)]
    fn poll<F: Future>(future: Pin<&mut F>, context: &mut Context<'_>) -> Poll<F::Output> {
        future.poll(context)
    }
    poll_fn(move |context| poll(future.as_mut(), context))
}

/// Empties the ring into the line, for ever.
async fn send<C: Clock, W: Write>(state: &State<'_>, clock: &C, mut transmit: W) -> ! {
    let mut bytes = [0; 256];
    loop {
        let count = state.out.take(&mut bytes).await;
        if transmit.write_all(bytes.get(..count).unwrap_or_default()).await.is_err() {
            // Unplugged: what was in hand is lost, which the frames' numbers show; the line may come back.
            clock.until(Ticks(clock.now().0.saturating_add(TICKS_PER_ROW))).await;
        }
    }
}
