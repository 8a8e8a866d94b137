//! The serial line: DMA both ways, and a stop that acts in the receive interrupt.
//!
//! What is received goes by DMA into a ring that never stops. The interrupt comes when the line falls idle (one byte's time after the last,
//! 11 µs) and besides each tick, which pends it: so every byte passes the console's guard at most 0.1 ms after it came, whatever the tasks do and
//! however long the flood is, and the tick after that switches the drive off. The interrupt is below the tick and above all else.
//!
//! The HAL's ring is not used: after each error and each idle line its interrupt is off until a task looks, and then a stop would wait for it.

use core::cell::RefCell;
use core::future::poll_fn;
use core::sync::atomic::{AtomicBool, AtomicU8, AtomicU32, Ordering};
use core::task::Poll;
use cortex_m::peripheral::DWT;
use embassy_stm32::gpio::{AfType, Flex, Pull};
use embassy_stm32::interrupt::typelevel::{self, Handler, Interrupt};
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::mode::Async;
use embassy_stm32::pac::dma::vals::{Dir, Pl, Size};
use embassy_stm32::pac::gpio::vals::Idr;
use embassy_stm32::pac::{DMA1, GPIOA, RCC, USART2};
use embassy_stm32::usart::UartTx;
use embassy_stm32::{Peri, interrupt, peripherals};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::waitqueue::AtomicWaker;
use stand_firmware::console::{Guard, StopLine};

/// 45 MHz / 921 600 is 48.83: 0.02 % off. The ST-Link carries it.
pub const BAUD: u32 = 921_600;
/// Bytes in the ring: 11 ms at full rate, more than a task is ever away.
const LENGTH: usize = 1024;
/// USART2_RX is request 4 of DMA1's stream 5 (RM0390, table 28).
const STREAM: usize = 5;
const REQUEST: u8 = 4;
/// The alternate function of USART2 (DS10693, table 11) and its receiving pin, PA3.
const AF_USART2: u8 = 7;
const PIN: usize = 3;
/// Longer than this without a look, and the ring may have gone round: 8 ms of core cycles.
const TOO_LONG: u32 = crate::clocks::CORE_HZ / 125;
/// Bytes that pass the guard in one go with interrupts off.
const GO: usize = 32;

/// What the line has asked for: read by the tick, cleared by the app.
pub static STOP: StopLine = StopLine::new();

static RING: [AtomicU8; LENGTH] = [const { AtomicU8::new(0) }; LENGTH];
/// Bytes received since power-on, wrapping.
static RECEIVED: AtomicU32 = AtomicU32::new(0);
static LOST: AtomicBool = AtomicBool::new(false);
static READER: AtomicWaker = AtomicWaker::new();
static GUARD: Mutex<CriticalSectionRawMutex, RefCell<Guard<'static>>> = Mutex::new(RefCell::new(Guard::new(&STOP)));
static LOOKED: AtomicU32 = AtomicU32::new(0);

/// The receive interrupt; bound before the HAL's own on the same vector, which then finds no flag of the receiver.
pub struct Watch;

impl Handler<typelevel::USART2> for Watch {
    unsafe fn on_interrupt() {
        let status = USART2.sr().read();
        if status.idle() || status.fe() || status.ne() || status.ore() {
            // Reading the status and then the data clears the flags; DMA has taken the data long ago.
            USART2.dr().read();
        }
        // A break: no stop bit, and the line is low still.
        if status.fe() && GPIOA.idr().read().idr(PIN) == Idr::LOW {
            GUARD.lock(|guard| guard.borrow_mut().line_break());
        }
        watch();
    }
}

/// Passes what has come to the guard and wakes the reader.
fn watch() {
    let cycles = DWT::cycle_count();
    if cycles.wrapping_sub(LOOKED.swap(cycles, Ordering::Relaxed)) > TOO_LONG {
        LOST.store(true, Ordering::Relaxed);
    }
    let before = RECEIVED.load(Ordering::Relaxed);
    let at = before as usize % LENGTH;
    let written = LENGTH.saturating_sub(usize::from(DMA1.st(STREAM).ndtr().read().ndt())) % LENGTH;
    let new = (written + LENGTH - at) % LENGTH;
    if new == 0 {
        return;
    }
    let mut done = 0;
    while done < new {
        GUARD.lock(|guard| {
            let mut guard = guard.borrow_mut();
            for place in done..new.min(done + GO) {
                guard.byte(byte(at + place));
            }
        });
        done += GO;
    }
    RECEIVED.store(before.wrapping_add(new as u32), Ordering::Release);
    READER.wake();
}

#[inline]
fn byte(place: usize) -> u8 {
    RING.get(place % LENGTH).map_or(0, |byte| byte.load(Ordering::Relaxed))
}

/// Lets the guard look now. For the tick.
#[inline]
pub fn look() {
    interrupt::USART2.pend();
}

/// The receiving half.
pub struct Receiver {
    taken: u32,
    _pin: Flex<'static>,
}

impl Receiver {
    /// Begins to receive on the line that `sender` has set up.
    pub fn new(
        _sender: &UartTx<'static, Async>,
        pin: Peri<'static, peripherals::PA3>,
        _stream: Peri<'static, peripherals::DMA1_CH5>,
    ) -> Self {
        let mut pin = Flex::new(pin);
        pin.set_as_af_unchecked(AF_USART2, AfType::input(Pull::Up));
        RCC.ahb1enr().modify(|w| w.set_dma1en(true));
        let stream = DMA1.st(STREAM);
        stream.par().write_value(USART2.dr().as_ptr() as u32);
        stream.m0ar().write_value(RING.as_ptr() as u32);
        stream.ndtr().write(|w| w.set_ndt(LENGTH as u16));
        stream.cr().write(|w| {
            w.set_chsel(REQUEST);
            w.set_dir(Dir::PERIPHERAL_TO_MEMORY);
            w.set_circ(true);
            w.set_minc(true);
            w.set_psize(Size::BITS8);
            w.set_msize(Size::BITS8);
            w.set_pl(Pl::HIGH);
            w.set_en(true);
        });
        USART2.cr3().modify(|w| w.set_dmar(true));
        USART2.cr1().modify(|w| {
            w.set_re(true);
            w.set_idleie(true);
        });
        LOOKED.store(DWT::cycle_count(), Ordering::Relaxed);
        interrupt::USART2.set_priority(Priority::P1);
        typelevel::USART2::unpend();
        // SAFETY: the handler needs nothing that is not in its place by now.
        unsafe { typelevel::USART2::enable() };
        Self { taken: 0, _pin: pin }
    }
}

/// Bytes came faster than they were taken, and some are gone.
#[derive(Clone, Copy, Debug, defmt::Format)]
pub struct Overrun;

impl core::fmt::Display for Overrun {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("received bytes were lost: they came faster than they were taken")
    }
}

impl core::error::Error for Overrun {}

impl embedded_io_async::Error for Overrun {
    fn kind(&self) -> embedded_io_async::ErrorKind {
        embedded_io_async::ErrorKind::Other
    }
}

impl embedded_io_async::ErrorType for Receiver {
    type Error = Overrun;
}

impl embedded_io_async::Read for Receiver {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Overrun> {
        let received = poll_fn(|context| {
            READER.register(context.waker());
            match RECEIVED.load(Ordering::Acquire) {
                received if received == self.taken && !buffer.is_empty() => Poll::Pending,
                received => Poll::Ready(received),
            }
        })
        .await;
        let waiting = received.wrapping_sub(self.taken) as usize;
        if LOST.swap(false, Ordering::Relaxed) || waiting > LENGTH {
            self.taken = received;
            return Err(Overrun);
        }
        let count = waiting.min(buffer.len());
        for (place, slot) in buffer.iter_mut().take(count).enumerate() {
            *slot = byte(self.taken as usize + place);
        }
        self.taken = self.taken.wrapping_add(count as u32);
        Ok(count)
    }
}
