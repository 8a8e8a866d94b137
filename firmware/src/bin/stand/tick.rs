//! The control interrupt, and the time that comes from it.
//!
//! TIM1's update each 100 µs runs the library's interrupt and counts ticks; the core's cycle counter tells the time between two ticks, and how
//! many were lost if the core stood still (an erase of the flash). Tasks wait by a deadline and one waker: all that waits is one task, which is
//! polled again after each wake and says its deadlines anew.

use crate::analog;
use crate::bridge::Bridge;
use crate::encoder::Encoder;
use crate::serial;
use core::cell::Cell;
use core::future::poll_fn;
use core::sync::atomic::{AtomicBool, Ordering};
use core::task::Poll;
use cortex_m::peripheral::DWT;
use embassy_stm32::gpio::Input;
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::waitqueue::AtomicWaker;
use stand_firmware::board::{CONTROL_HZ, Clock, Drive, EncoderCount, Sensed, SupplyCode, TICKS_PER_CONTROL, TickIo, Ticks};
use stand_firmware::speed_loop::Interrupt;
use static_cell::StaticCell;

/// Core cycles in one step of the board clock.
const CYCLES_PER_STEP: u32 = crate::clocks::CORE_HZ / 10_000_000;
/// Core cycles in one tick.
const CYCLES_PER_TICK: u32 = crate::clocks::CORE_HZ / CONTROL_HZ as u32;
/// An edge this many ticks ago is for ever ago: 40 s, before the edge timer has gone round.
const FOR_EVER: u32 = 400_000;
/// Ticks for which the emergency stop's contact must be open to be believed: 0.5 ms, longer than a spark's noise.
const OPEN: u8 = 5;

/// What interrupt and tasks share beside the mailboxes; touched for a few cycles with interrupts off.
#[derive(Clone, Copy)]
struct Shared {
    tick: u64,
    /// The cycle counter at the beginning of that tick.
    cycles: u32,
    /// The earliest moment that a task waits for.
    deadline: Ticks,
}

static SHARED: Mutex<CriticalSectionRawMutex, Cell<Shared>> =
    Mutex::new(Cell::new(Shared { tick: 0, cycles: 0, deadline: Ticks(u64::MAX) }));
/// Its memory, and who has it: `None` before it is there, and while the interrupt runs. The reference is what makes "none" all zeros, so that
/// the flash holds no picture of it.
static TICK_MEMORY: StaticCell<Tick> = StaticCell::new();
static TICK: Mutex<CriticalSectionRawMutex, Cell<Option<&'static mut Tick>>> = Mutex::new(Cell::new(None));
static WAKER: AtomicWaker = AtomicWaker::new();
/// Whether the last tick has asked for a voltage, zero included.
static DRIVEN: AtomicBool = AtomicBool::new(false);

/// Whether the stand is driven now.
pub fn is_driven() -> bool {
    DRIVEN.load(Ordering::Relaxed)
}

/// All that the interrupt owns.
pub struct Tick {
    interrupt: Interrupt<'static>,
    hardware: TickHardware,
}

struct TickHardware {
    tick: u64,
    cycles: u32,
    encoder: Encoder,
    bridge: Bridge,
    /// The emergency stop's contact: closed to ground while all is well.
    contact: Input<'static>,
    open_ticks: u8,
    /// The last edge that was caught, and the ticks since then.
    edge: Option<u32>,
    still_ticks: u32,
}

impl Tick {
    /// The library's interrupt on this hardware.
    pub fn new(interrupt: Interrupt<'static>, encoder: Encoder, bridge: Bridge, contact: Input<'static>) -> Self {
        let hardware = TickHardware { tick: 0, cycles: 0, encoder, bridge, contact, open_ticks: 0, edge: None, still_ticks: FOR_EVER };
        Self { interrupt, hardware }
    }
}

impl TickHardware {
    /// Counts the tick that begins at `cycles`, and those that were lost before it.
    #[inline]
    fn count(&mut self, cycles: u32) {
        let since = cycles.wrapping_sub(self.cycles);
        self.cycles = cycles;
        self.tick += match since {
            0..CYCLES_PER_TICK => 1,
            _ => u64::from((since + CYCLES_PER_TICK / 2) / CYCLES_PER_TICK),
        };
    }
}

impl TickIo for TickHardware {
    #[inline]
    fn sense(&mut self) -> Sensed {
        let look = self.encoder.look();
        self.still_ticks = if look.edge == self.edge { self.still_ticks.saturating_add(1) } else { 0 };
        self.edge = look.edge;
        let edge_age = match look.edge {
            Some(edge) if self.still_ticks < FOR_EVER => look.now.wrapping_sub(edge),
            _ => u32::MAX,
        };
        let (current, supply) = analog::newest();
        self.open_ticks = if self.contact.is_high() { self.open_ticks.saturating_add(1) } else { 0 };
        let stop = self.open_ticks >= OPEN || serial::STOP.is_stop_asked();
        Sensed { tick: self.tick, encoder: look.count, edge_age, current, supply: SupplyCode(supply), stop }
    }

    #[inline]
    fn index(&mut self) -> Option<EncoderCount> {
        self.encoder.index()
    }

    #[inline]
    fn drive(&mut self, out: Drive) {
        DRIVEN.store(out != Drive::Off, Ordering::Relaxed);
        self.bridge.drive(out);
    }
}

/// Hands everything to the interrupt and lets it begin.
pub fn start(tick: Tick) {
    let tick = TICK_MEMORY.init(tick);
    tick.hardware.cycles = DWT::cycle_count();
    tick.hardware.bridge.interrupt_each_tick();
    TICK.lock(|cell| cell.set(Some(tick)));
    interrupt::TIM1_UP_TIM10.set_priority(Priority::P0);
    // SAFETY: nothing else uses this vector, and what its handler needs is in its place.
    unsafe { interrupt::TIM1_UP_TIM10.enable() };
}

/// Lets the core count its cycles; before all that tells time by it.
pub fn count_cycles() {
    if let Some(mut core) = cortex_m::Peripherals::take() {
        core.DCB.enable_trace();
        core.DWT.enable_cycle_counter();
    }
}

/// TIM1's update: each 100 µs, above all other interrupts.
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
    io.count(cycles);
    // First: edge and sample come at the same place of each tick.
    crate::torquer::on_tick(io.tick as u32);
    tick.interrupt.run(io);
    let now = Ticks::of_control(io.tick);
    let due = SHARED.lock(|cell| {
        let mut shared = cell.get();
        shared.tick = io.tick;
        shared.cycles = cycles;
        let due = shared.deadline <= now;
        if due {
            shared.deadline = Ticks(u64::MAX);
        }
        cell.set(shared);
        due
    });
    serial::look();
    if due {
        WAKER.wake();
    }
}

/// The board's time for the tasks.
#[derive(Clone, Copy)]
pub struct BoardClock;

impl Clock for BoardClock {
    fn now(&self) -> Ticks {
        let (tick, since) = SHARED.lock(|cell| {
            let shared = cell.get();
            (shared.tick, DWT::cycle_count().wrapping_sub(shared.cycles))
        });
        // Late interrupts must not make time step back when they come.
        let within = u64::from(since / CYCLES_PER_STEP).min(TICKS_PER_CONTROL - 1);
        Ticks::of_control(tick) + within
    }

    async fn until(&self, t: Ticks) {
        poll_fn(|context| {
            WAKER.register(context.waker());
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
