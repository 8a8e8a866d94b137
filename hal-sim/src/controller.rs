//! The whole simulated controller: the firmware's app on the simulated board, with its serial line and its flash.
//!
//! Input: a setup, a plant, and a host (a future: a test script, or endless). Output: the result of the host. Time is virtual; `outside` is
//! called before each advance, so that a caller can synchronise with real time and transfer bytes to and from [`Controller::line`]. The
//! faults of [`crate::faults`] act here too, including the serial line and the supply: a power cut stops the program at any point, and it
//! restarts with the present contents of the flash.

use crate::board::{Bench, PlantPort, SimBoard};
use crate::clock::{self, SimClock, Stuck, VirtualClock};
use crate::faults::{ActiveFaults, FaultKind};
use crate::gyro::GyroPort;
use crate::peripherals::flash::SMALL_SECTOR_BYTES;
use crate::peripherals::serial::{DamageRates, SerialLine, USUAL_BAUD};
use crate::peripherals::{SimFlash, StallingFlash};
use crate::setup::StandSetup;
use embassy_futures::select::{Either, Either3, select, select3};
use stand_firmware::app::{Identity, Memory, assemble};
use stand_firmware::board::{Drive, EncoderCount, Sensed, TICKS_PER_CONTROL, TICKS_PER_ROW, TickIo, Ticks};
use stand_firmware::button::{self, DriveStatus, ReceiverWithButton, TypedLine};
use stand_firmware::config::ConfigError;
use stand_firmware::console::{Guard, StopLine};
use stand_firmware::reset_cause::ResetCause;
use stand_firmware::settings::{Kept, Store};
use std::cell::{Cell, RefCell};
use std::future::{Future, poll_fn};
use std::pin::{Pin, pin};
use std::task::Poll;

/// Sizes of the flash sectors that hold the settings.
const SECTORS_BYTES: [usize; 2] = [SMALL_SECTOR_BYTES; 2];

/// Erased flash for one controller.
pub fn flash(seed: u64) -> SimFlash {
    SimFlash::new(&SECTORS_BYTES, seed)
}

/// Why a controller cannot run, or stops.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ControllerError {
    /// A setting of the stand is invalid.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The firmware waits for ever.
    #[error(transparent)]
    Stuck(#[from] Stuck),
    /// The program of the firmware ended, which it must not.
    #[error("the firmware's program has ended")]
    Ended,
}

/// Active faults of the serial line.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct LineFaults {
    rates: DamageRates,
    is_off: bool,
    breaks: bool,
}

impl LineFaults {
    fn of(broken: &ActiveFaults) -> Self {
        let rates = DamageRates {
            flip: broken.magnitude(FaultKind::LineFlips),
            lose: broken.magnitude(FaultKind::LineLoses),
            insert: broken.magnitude(FaultKind::LineInserts),
        };
        Self { rates, is_off: broken.is_active(FaultKind::LineOff), breaks: broken.is_active(FaultKind::LineBreak) }
    }
}

/// The hardware of the interrupt, with its output for the button.
struct Watched<'a, T> {
    io: &'a mut T,
    drive: &'a Cell<DriveStatus>,
    /// The core was stalled until this tick.
    is_after_stall: bool,
}

impl<T: TickIo> TickIo for Watched<'_, T> {
    fn sense(&mut self) -> Sensed {
        Sensed { announced_stall: self.is_after_stall, ..self.io.sense() }
    }

    fn index(&mut self) -> Option<EncoderCount> {
        self.io.index()
    }

    fn drive(&mut self, out: Drive) {
        self.drive.set(DriveStatus { is_driven: out != Drive::Off, ..self.drive.get() });
        self.io.drive(out);
    }
}

/// One controller on its stand.
pub struct Controller<'c> {
    clock: &'c VirtualClock,
    line: SerialLine<'c>,
    bench: RefCell<Bench>,
    flash: RefCell<SimFlash>,
    defaults: Kept,
    serial: String,
    line_faults: Cell<LineFaults>,
    power_cuts: Cell<u32>,
    /// Cause of the next start.
    reset_cause: Cell<ResetCause>,
    /// A reset without a power cut is requested.
    is_reset: Cell<bool>,
    /// The button B1 is pressed.
    is_button_down: Cell<bool>,
    is_led_on: Cell<bool>,
    /// Compute time of each poll of the console's runner, board clock steps.
    console_poll_steps: Cell<u64>,
    rows_lost: Cell<u32>,
}

impl<'c> Controller<'c> {
    /// A controller of this stand, at rest and without supply.
    ///
    /// # Errors
    /// An invalid setting of the stand, by name.
    pub fn new(
        clock: &'c VirtualClock,
        stand: &StandSetup,
        plant: impl PlantPort + 'static,
        flash: SimFlash,
        seed: u64,
    ) -> Result<Self, ControllerError> {
        stand.sensors.check()?;
        let defaults = Kept { settings: stand.settings, hardware: stand.hardware };
        defaults.config()?;
        if let Some(sensor) = stand.imu {
            sensor.check()?;
        }
        Ok(Self {
            clock,
            line: SerialLine::new(clock, USUAL_BAUD, seed),
            bench: RefCell::new(Bench::of(stand, seed, Box::new(plant)).starting_at(clock.now())),
            flash: RefCell::new(flash),
            defaults,
            serial: format!("SIM-{seed}"),
            line_faults: Cell::default(),
            power_cuts: Cell::new(0),
            reset_cause: Cell::new(ResetCause::PowerOn),
            is_reset: Cell::new(false),
            is_button_down: Cell::new(false),
            is_led_on: Cell::new(false),
            console_poll_steps: Cell::new(0),
            rows_lost: Cell::new(0),
        })
    }

    /// The same controller with this gyroscope on torquer and angle sensor.
    pub fn with_gyro(mut self, gyro: Box<dyn GyroPort>, seed: u64) -> Self {
        let hardware = self.defaults.hardware;
        self.bench = RefCell::new(self.bench.into_inner().with_gyro(gyro, &hardware, seed));
        self
    }

    /// The serial line, from the side of the host.
    pub fn line(&self) -> &SerialLine<'c> {
        &self.line
    }

    /// The clock of the stand, for a host that waits.
    pub fn clock(&self) -> SimClock<'c> {
        SimClock(self.clock)
    }

    /// Plant and sensors, to observe them and to inject faults. Must not be borrowed across an await.
    pub fn bench(&self) -> &RefCell<Bench> {
        &self.bench
    }

    /// Presses or releases the button B1.
    pub fn press_button(&self, is_down: bool) {
        self.is_button_down.set(is_down);
    }

    /// Whether the LED is lit.
    pub fn is_led_on(&self) -> bool {
        self.is_led_on.get()
    }

    /// Makes each poll of the console's runner take this time, in board clock steps: with a positive time it never yields the processor.
    pub fn burden_console(&self, steps_per_poll: u64) {
        self.console_poll_steps.set(steps_per_poll);
    }

    /// Rows since power-on that the console's runner did not take in time, at the end of a run.
    pub fn rows_lost(&self) -> u32 {
        self.rows_lost.get()
    }

    /// Resets the controller with its supply on, as its watchdog does; the program starts again within a millisecond.
    pub fn reset(&self, cause: ResetCause) {
        self.reset_cause.set(cause);
        self.is_reset.set(true);
    }

    /// Number of power cuts so far.
    pub fn power_cuts(&self) -> u32 {
        self.power_cuts.get()
    }

    /// The flash, at the end of the simulation.
    pub fn into_flash(self) -> SimFlash {
        self.flash.into_inner()
    }

    /// Switches on and runs until `host` ends; `outside` gets each time before the advance to it.
    ///
    /// # Errors
    /// An invalid setting; a firmware that waits for ever or ends.
    pub fn run<T>(&self, host: impl Future<Output = T>, mut outside: impl FnMut(Ticks)) -> Result<T, ControllerError> {
        let mut result = None;
        self.run_host(pin!(async { result = Some(host.await) }), &mut outside)?;
        result.ok_or(ControllerError::Ended)
    }

    fn run_host(&self, mut host: Pin<&mut dyn Future<Output = ()>>, outside: &mut dyn FnMut(Ticks)) -> Result<(), ControllerError> {
        let mut flash = self.flash.borrow_mut();
        let [first, second] = SECTORS_BYTES;
        loop {
            flash.power_on();
            self.bench.borrow_mut().power_on();
            let store = Store::new(StallingFlash::new(&mut flash, self.clock), [0, first as u32], second as u32);
            let stop_line = StopLine::new();
            let mut guard = Guard::new(&stop_line);
            let mut memory = Box::new(Memory::new());
            let identity = Identity { model: "simulated", serial: &self.serial, baud: USUAL_BAUD, reset_cause: self.reset_cause.take() };
            let (mut interrupt, mut measurement, mut app) = assemble(&mut memory, store, self.defaults, identity, &stop_line)?;
            let mut board = SimBoard::new(&self.bench, self.clock);
            let (receive, transmit) = self.line.device();
            let clock = self.clock();
            let typed = TypedLine::new();
            let drive = Cell::new(DriveStatus::default());
            let button = button::run(
                &clock,
                || self.is_button_down.get(),
                |on| self.is_led_on.set(on),
                || drive.get(),
                &stop_line,
                &typed,
                |_, _| (),
            );
            let receive = ReceiverWithButton::new(receive, &typed);
            let mut console = pin!(select(app.run(&clock, receive, transmit), button));
            let console = poll_fn(|context| {
                self.clock.charge(self.console_poll_steps.get());
                console.as_mut().poll(context)
            });
            // In a block, so that its borrow of the measurement ends with the run.
            let on = {
                let mut measuring = pin!(measurement.run(&mut board));
                let measuring = poll_fn(|context| match self.clock.is_stalled_at(self.clock.now()) {
                    true => Poll::Pending,
                    false => measuring.as_mut().poll(context),
                });
                let high = select3(host.as_mut(), measuring, self.supply(false));
                clock::run_prioritised(self.clock, high, console, |to| {
                    outside(to);
                    self.break_line();
                    self.bench.borrow_mut().advance(to, |io| {
                        if self.clock.is_stalled_at(io.now()) {
                            return;
                        }
                        self.line.deliver(io.now(), |incoming| match incoming {
                            Ok(byte) => guard.byte(byte),
                            Err(_) => guard.line_break(),
                        });
                        io.request_stop(stop_line.is_stop_requested());
                        let is_after_stall = self.clock.is_stalled_at(Ticks(io.now().0.saturating_sub(TICKS_PER_CONTROL)));
                        interrupt.run(&mut Watched { io, drive: &drive, is_after_stall });
                        drive.set(DriveStatus { fault: interrupt.fault(), ..drive.get() });
                    });
                })?
            };
            self.rows_lost.set(measurement.rows_lost());
            match on {
                Either::First(Either3::First(())) => return Ok(()),
                Either::First(Either3::Second(())) | Either::Second(_) => return Err(ControllerError::Ended),
                Either::First(Either3::Third(())) => {}
            }
            if self.is_reset.take() {
                // The outputs of the chip float in a reset, and the bridge's inputs are pulled low.
                self.bench.borrow_mut().open_bridge();
                continue;
            }
            self.power_cuts.set(self.power_cuts.get() + 1);
            self.line.power(false);
            let off = clock::run(self.clock, select(host.as_mut(), self.supply(true)), |to| {
                outside(to);
                self.break_line();
                self.bench.borrow_mut().advance(to, |_| {});
                self.line.deliver(to, |_| {});
            })?;
            if let Either::First(()) = off {
                return Ok(());
            }
            self.line.power(true);
        }
    }

    /// Returns when the supply is present, or absent; a reset ends the wait for its absence.
    async fn supply(&self, is_there: bool) {
        poll_fn(|_| {
            let is_reset = !is_there && self.is_reset.get();
            if is_reset || self.bench.borrow_mut().active_faults().is_active(FaultKind::PowerCut) != is_there {
                return Poll::Ready(());
            }
            self.clock.wait_until(self.clock.now() + TICKS_PER_ROW);
            Poll::Pending
        })
        .await
    }

    /// Applies the active faults to the serial line.
    fn break_line(&self) {
        let mut bench = self.bench.borrow_mut();
        let before = self.line_faults.get();
        if !bench.active_faults().any() && before == LineFaults::default() {
            return;
        }
        let now = LineFaults::of(bench.active_faults());
        if now == before {
            return;
        }
        self.line_faults.set(now);
        self.line.damage(now.rates, now.rates);
        self.line.plug(!now.is_off);
        if now.breaks && !before.breaks {
            self.line.send_break();
        }
    }
}
