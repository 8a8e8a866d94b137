//! The control interrupt and the clock derived from it.
//!
//! The update event of TIM1 runs the library's interrupt each 100 µs and counts ticks. The core's cycle counter gives the time within a
//! tick, and the number of lost ticks after the core was stalled (flash erase; `TickCounter`). The clock keeps the earliest deadline and a
//! waker for each waiting task; after a wake each task registers its deadline again.

use crate::analog;
use crate::bridge::Bridge;
use crate::encoder::Encoder;
use crate::output_timeout;
use crate::serial;
use core::cell::{Cell, RefCell};
use core::future::poll_fn;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use core::task::Poll;
use cortex_m::peripheral::DWT;
use embassy_stm32::gpio::Input;
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::waitqueue::MultiWakerRegistration;
use stand_firmware::board::{CONTROL_HZ, Clock, Drive, EncoderCount, Sensed, SupplyCode, TICKS_PER_CONTROL, TickCounter, TickIo, Ticks};
use stand_firmware::button::DriveStatus;
use stand_firmware::speed_loop::Interrupt;
use stand_firmware::status::Fault;
use static_cell::StaticCell;

/// Core cycles in one step of the board clock.
const CYCLES_PER_STEP: u32 = crate::clocks::CORE_HZ / 10_000_000;
/// Core cycles in one tick.
const CYCLES_PER_TICK: u32 = crate::clocks::CORE_HZ / CONTROL_HZ as u32;
/// Ticks without an edge after which its age is unknown: 40 s, before the edge timer wraps.
const MAX_EDGE_AGE_TICKS: u32 = 400_000;
/// Debounce of the emergency stop: ticks for which its contact must be open, 0.5 ms, longer than a spark's interference.
const STOP_DEBOUNCE_TICKS: u8 = 5;

/// Time base shared by interrupt and tasks; accessed in short critical sections.
#[derive(Clone, Copy)]
struct Shared {
    tick: u64,
    /// Cycle counter at the beginning of that tick.
    cycles: u32,
    /// Earliest deadline of all waiting tasks.
    deadline: Ticks,
}

static SHARED: Mutex<CriticalSectionRawMutex, Cell<Shared>> =
    Mutex::new(Cell::new(Shared { tick: 0, cycles: 0, deadline: Ticks(u64::MAX) }));
/// Memory of the interrupt's state.
static TICK_MEMORY: StaticCell<Tick> = StaticCell::new();
/// The interrupt's state: `None` before [`start`] and while the interrupt runs. A reference, so that the initial value is zero (.bss).
static TICK: Mutex<CriticalSectionRawMutex, Cell<Option<&'static mut Tick>>> = Mutex::new(Cell::new(None));
/// Tasks that wait for a deadline: measurement, app, button, watchdog.
static WAKERS: Mutex<CriticalSectionRawMutex, RefCell<MultiWakerRegistration<WAITING_TASKS>>> =
    Mutex::new(RefCell::new(MultiWakerRegistration::new()));
const WAITING_TASKS: usize = 4;
/// Whether the bridge is driven; a commanded voltage of zero counts as driven.
static DRIVEN: AtomicBool = AtomicBool::new(false);
/// Code of the latched fault.
static FAULT: AtomicU32 = AtomicU32::new(0);

/// What the drive does.
pub fn drive_status() -> DriveStatus {
    DriveStatus { is_driven: DRIVEN.load(Ordering::Relaxed), fault: Fault::of_code(FAULT.load(Ordering::Relaxed)) }
}

/// State of the control interrupt.
pub struct Tick {
    interrupt: Interrupt<'static>,
    hardware: TickHardware,
}

struct TickHardware {
    counter: TickCounter,
    encoder: Encoder,
    bridge: Bridge,
    /// Contact of the emergency stop: closed to ground unless pressed.
    stop_contact: Input<'static>,
    open_ticks: u8,
    /// The last captured edge, and ticks since its capture.
    edge: Option<u32>,
    ticks_since_edge: u32,
    /// ADC sweep in progress at the last tick.
    sweep: usize,
}

impl Tick {
    /// The library's interrupt on this hardware.
    pub fn new(interrupt: Interrupt<'static>, encoder: Encoder, bridge: Bridge, stop_contact: Input<'static>) -> Self {
        let hardware = TickHardware {
            counter: TickCounter::default(),
            encoder,
            bridge,
            stop_contact,
            open_ticks: 0,
            edge: None,
            ticks_since_edge: MAX_EDGE_AGE_TICKS,
            sweep: usize::MAX,
        };
        Self { interrupt, hardware }
    }
}

impl TickIo for TickHardware {
    #[inline]
    fn sense(&mut self) -> Sensed {
        let reading = self.encoder.read();
        self.ticks_since_edge = if reading.edge == self.edge { self.ticks_since_edge.saturating_add(1) } else { 0 };
        self.edge = reading.edge;
        let edge_age = match reading.edge {
            Some(edge) if self.ticks_since_edge < MAX_EDGE_AGE_TICKS => reading.now.wrapping_sub(edge),
            _ => u32::MAX,
        };
        let (current, supply) = analog::newest_current_and_supply();
        // Two sweeps end in each tick. An unchanged position means that converter or DMA have stopped.
        let sweep = analog::sweep_in_progress();
        let is_stale = sweep == self.sweep;
        self.sweep = sweep;
        self.open_ticks = if self.stop_contact.is_high() { self.open_ticks.saturating_add(1) } else { 0 };
        let stop = self.open_ticks >= STOP_DEBOUNCE_TICKS || serial::STOP.is_stop_requested();
        let announced_stall = crate::flash::is_erasing();
        Sensed {
            tick: self.counter.tick,
            encoder: reading.count,
            edge_age,
            current,
            supply: SupplyCode(supply),
            is_stale,
            stop,
            announced_stall,
        }
    }

    #[inline]
    fn index(&mut self) -> Option<EncoderCount> {
        self.encoder.index()
    }

    #[inline]
    fn drive(&mut self, drive: Drive) {
        DRIVEN.store(drive != Drive::Off, Ordering::Relaxed);
        self.bridge.drive(drive);
        // Here, at the end of the law: a tick that hangs before does not count.
        output_timeout::restart();
    }
}

/// Enables the control interrupt, which owns `tick` from then on.
pub fn start(tick: Tick) {
    let tick = TICK_MEMORY.init(tick);
    tick.hardware.counter = TickCounter::start(DWT::cycle_count());
    tick.hardware.bridge.enable_interrupt();
    TICK.lock(|cell| cell.set(Some(tick)));
    interrupt::TIM1_UP_TIM10.set_priority(Priority::P0);
    // SAFETY: nothing else uses this vector, and the state of its handler is initialised.
    unsafe { interrupt::TIM1_UP_TIM10.enable() };
}

/// Enables the core's cycle counter; call before anything that measures time by it.
pub fn count_cycles() {
    if let Some(mut core) = cortex_m::Peripherals::take() {
        core.DCB.enable_trace();
        core.DWT.enable_cycle_counter();
    }
}

/// Update event of TIM1: each 100 µs, highest priority.
#[embassy_stm32::interrupt]
fn TIM1_UP_TIM10() {
    TICK.lock(|cell| {
        if let Some(tick) = cell.take() {
            on_tick(tick);
            cell.set(Some(tick));
        }
    });
}

#[inline]
fn on_tick(tick: &mut Tick) {
    let cycles = DWT::cycle_count();
    let io = &mut tick.hardware;
    io.bridge.acknowledge();
    io.counter.advance(cycles, CYCLES_PER_TICK);
    // First, so that torquer output and angle sample have a constant delay from the start of the tick.
    crate::torquer::on_tick(io.counter.tick as u32);
    tick.interrupt.run(io);
    FAULT.store(tick.interrupt.fault().code(), Ordering::Relaxed);
    let now = Ticks::of_control(io.counter.tick);
    let due = SHARED.lock(|cell| {
        let mut shared = cell.get();
        shared.tick = io.counter.tick;
        shared.cycles = cycles;
        let due = shared.deadline <= now;
        if due {
            shared.deadline = Ticks(u64::MAX);
        }
        cell.set(shared);
        due
    });
    serial::pend_guard();
    if due {
        wake_tasks();
    }
}

/// Wakes all tasks that wait. `try_borrow_mut` cannot fail here; unlike `borrow_mut` it has no panic.
fn wake_tasks() {
    WAKERS.lock(|wakers| {
        if let Ok(mut wakers) = wakers.try_borrow_mut() {
            wakers.wake();
        }
    });
}

/// The board's clock for the tasks.
#[derive(Clone, Copy)]
pub struct BoardClock;

impl Clock for BoardClock {
    fn now(&self) -> Ticks {
        let (tick, since) = SHARED.lock(|cell| {
            let shared = cell.get();
            (shared.tick, DWT::cycle_count().wrapping_sub(shared.cycles))
        });
        // Limited to the tick, so that a late interrupt does not make time step back.
        let within = u64::from(since / CYCLES_PER_STEP).min(TICKS_PER_CONTROL - 1);
        Ticks::of_control(tick) + within
    }

    async fn until(&self, t: Ticks) {
        poll_fn(|context| {
            WAKERS.lock(|wakers| {
                if let Ok(mut wakers) = wakers.try_borrow_mut() {
                    wakers.register(context.waker());
                }
            });
            SHARED.lock(|cell| {
                let mut shared = cell.get();
                if Ticks::of_control(shared.tick) >= t {
                    return Poll::Ready(());
                }
                shared.deadline = shared.deadline.min(t);
                cell.set(shared);
                Poll::Pending
            })
        })
        .await;
    }
}
