//! The control interrupt, and the time that comes from it.
//!
//! TIM1's update each 100 µs runs the library's interrupt and counts ticks; the core's cycle counter tells the time
//! between two ticks. Tasks wait by a deadline and one waker: all that waits is one task (the session), which is polled
//! again after each wake and says its deadlines anew.

use crate::bridge::Bridge;
use crate::index::Index;
use core::cell::{Cell, RefCell};
use core::future::poll_fn;
use core::sync::atomic::{AtomicU32, Ordering};
use core::task::Poll;
use cortex_m::peripheral::DWT;
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::pac::ADC2;
use embassy_stm32::peripherals;
use embassy_stm32::timer::qei::Qei;
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::waitqueue::AtomicWaker;
use stand_firmware::board::{
    Clock, CurrentCode, CurrentSum, Drive, EncoderCount, Sensed, Stamped, SupplyCode, TICKS_PER_CONTROL, TickIo, Ticks,
};
use stand_firmware::speed_loop::Interrupt;

/// Core cycles in one step of the board clock.
const CYCLES_PER_STEP: u32 = crate::clocks::CORE_HZ / 10_000_000;

/// Steps of the edge timer in a tick: 90 MHz ([`stand_firmware::board::Hardware::edge_timer_Hz`]), half the core's.
const EDGE_STEPS_PER_TICK: u32 = crate::clocks::CORE_HZ / 2 / 10_000;

/// The newest conversion of the supply, which the tasks make.
pub static SUPPLY: AtomicU32 = AtomicU32::new(0);

/// What interrupt and tasks share beside the mailboxes; touched for a few cycles with interrupts off.
#[derive(Clone, Copy)]
struct Shared {
    tick: u64,
    /// The cycle counter at the beginning of that tick.
    cycles: u32,
    /// The earliest moment that a task waits for.
    deadline: Ticks,
    current: CurrentSum,
}

static SHARED: Mutex<CriticalSectionRawMutex, Cell<Shared>> =
    Mutex::new(Cell::new(Shared { tick: 0, cycles: 0, deadline: Ticks(u64::MAX), current: CurrentSum { codes: 0, count: 0 } }));
static TICK: Mutex<CriticalSectionRawMutex, RefCell<Option<Tick>>> = Mutex::new(RefCell::new(None));
static WAKER: AtomicWaker = AtomicWaker::new();

/// All that the interrupt owns.
pub struct Tick {
    interrupt: Interrupt<'static>,
    hardware: TickHardware,
}

struct TickHardware {
    tick: u64,
    qei: Qei<'static, peripherals::TIM3>,
    index: Index,
    bridge: Bridge,
    _current: crate::sensors::Current,
    current: CurrentCode,
    /// The counter at the last tick, and the ticks since it changed.
    last: EncoderCount,
    still_ticks: u32,
}

impl Tick {
    /// The library's interrupt on this hardware.
    pub fn new(
        interrupt: Interrupt<'static>,
        qei: Qei<'static, peripherals::TIM3>,
        index: Index,
        bridge: Bridge,
        current: crate::sensors::Current,
    ) -> Self {
        let hardware = TickHardware {
            tick: 0,
            qei,
            index,
            bridge,
            _current: current,
            current: CurrentCode::default(),
            last: EncoderCount::default(),
            still_ticks: u32::MAX,
        };
        Self { interrupt, hardware }
    }
}

impl TickIo for TickHardware {
    #[inline]
    fn sense(&mut self) -> Sensed {
        let encoder = EncoderCount(self.qei.count());
        // No timer captures the edges: an edge is as old as the tick that first saw its count.
        self.still_ticks = if encoder == self.last { self.still_ticks.saturating_add(1) } else { 0 };
        self.last = encoder;
        Sensed {
            tick: self.tick,
            encoder,
            edge_age: self.still_ticks.saturating_mul(EDGE_STEPS_PER_TICK),
            current: self.current,
            supply: SupplyCode(SUPPLY.load(Ordering::Relaxed)),
            stop: false,
        }
    }

    #[inline]
    fn index(&mut self) -> Option<EncoderCount> {
        self.index.take()
    }

    #[inline]
    fn drive(&mut self, out: Drive) {
        self.bridge.drive(out);
    }
}

/// Hands everything to the interrupt and lets it begin.
pub fn start(mut tick: Tick) {
    if let Some(mut core) = cortex_m::Peripherals::take() {
        core.DCB.enable_trace();
        core.DWT.enable_cycle_counter();
    }
    tick.hardware.bridge.interrupt_each_tick();
    TICK.lock(|cell| cell.replace(Some(tick)));
    interrupt::TIM1_UP_TIM10.set_priority(Priority::P0);
    // SAFETY: nothing else uses this vector, and what its handler needs is in its place.
    unsafe { interrupt::TIM1_UP_TIM10.enable() };
}

/// TIM1's update: each 100 µs, above all other interrupts.
#[embassy_stm32::interrupt]
fn TIM1_UP_TIM10() {
    TICK.lock(|cell| {
        if let Ok(mut held) = cell.try_borrow_mut()
            && let Some(tick) = held.as_mut()
        {
            on_tick(tick);
        }
    });
}

#[inline]
fn on_tick(tick: &mut Tick) {
    let cycles = DWT::cycle_count();
    let io = &mut tick.hardware;
    io.bridge.acknowledge();
    // The conversion that was started a tick ago; then the next, in the middle of a bridge period.
    let code = ADC2.jdr(0).read().jdata();
    ADC2.cr2().modify(|w| w.set_jswstart(true));
    io.current = CurrentCode(i32::from(code));
    tick.interrupt.run(io);
    let now = Ticks::of_control(io.tick);
    let due = SHARED.lock(|cell| {
        let mut shared = cell.get();
        shared.tick = io.tick;
        shared.cycles = cycles;
        // What was started at tick 0 is the first there is.
        if io.tick > 0 {
            shared.current.codes += i64::from(code);
            shared.current.count += 1;
        }
        let due = shared.deadline <= now;
        if due {
            shared.deadline = Ticks(u64::MAX);
        }
        cell.set(shared);
        due
    });
    io.tick += 1;
    if due {
        WAKER.wake();
    }
}

/// The current's conversions since the last call.
pub fn take_current() -> Stamped<CurrentSum> {
    SHARED.lock(|cell| {
        let mut shared = cell.get();
        let value = core::mem::take(&mut shared.current);
        cell.set(shared);
        Stamped { value, at: Ticks::of_control(shared.tick) }
    })
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
