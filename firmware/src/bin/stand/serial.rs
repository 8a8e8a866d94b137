//! Serial line on USART2: DMA in both directions; the receive interrupt detects stop requests.
//!
//! DMA writes received bytes into a circular buffer without end. Each tick pends the interrupt. Every byte therefore passes the console's
//! guard at most 0.1 ms after its reception, independent of the tasks and of the load of the line, and the next tick switches the drive
//! off. The interrupt's priority is below the tick's and above all others.
//!
//! The receiver itself raises no interrupt, and DMA alone reads the data register. An interrupt of the idle line would have to read the
//! data register to clear its flag (RM0390 §25.6.1), which takes a byte that is complete between the reads of status and data from DMA; and
//! where the line becomes idle between this handler and the HAL's on the same vector, the HAL's clears IDLEIE for good.
//!
//! The HAL's ring buffer is not used: after an error or an idle line its interrupt stays disabled until a task reads, which would delay a
//! stop.

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
use stand_firmware::console::{Guard, LineErrors, StopLine};

/// 45 MHz / 921 600 = 48.83; the divider's rounding error is 0.02 %. The ST-Link supports this rate.
pub const BAUD: u32 = 921_600;
/// Bytes in the ring: 11 ms at full rate, longer than any task runs without a pause.
const LENGTH: usize = 1024;
/// USART2_RX is request 4 of DMA1's stream 5 (RM0390, table 28).
const STREAM: usize = 5;
const REQUEST: u8 = 4;
/// The alternate function of USART2 (DS10693, table 11) and its receiving pin, PA3.
const AF_USART2: u8 = 7;
const PIN: usize = 3;
/// Longest time between two passes in which the ring cannot have wrapped: 8 ms, core cycles. An erase of the flash takes longer.
const MAX_PASS_INTERVAL_CYCLES: u32 = crate::clocks::CORE_HZ / 125;
/// Bytes that pass the guard in one critical section.
const CHUNK_BYTES: usize = 32;

/// Stop requests: set by guard and button, read by the tick, cleared by the app.
pub static STOP: StopLine = StopLine::new();

static RING: [AtomicU8; LENGTH] = [const { AtomicU8::new(0) }; LENGTH];
/// Bytes received since power-on, wrapping.
static RECEIVED: AtomicU32 = AtomicU32::new(0);
static LOST: AtomicBool = AtomicBool::new(false);
static READER: AtomicWaker = AtomicWaker::new();
static GUARD: Mutex<CriticalSectionRawMutex, RefCell<(Guard<'static>, LineErrors)>> =
    Mutex::new(RefCell::new((Guard::new(&STOP), LineErrors::new())));
static LAST_PASS_CYCLES: AtomicU32 = AtomicU32::new(0);

/// Handler of the receive interrupt. It shares the vector with the HAL's handler, which serves the transmitter.
pub struct ReceiveInterrupt;

impl Handler<typelevel::USART2> for ReceiveInterrupt {
    unsafe fn on_interrupt() {
        let status = USART2.sr().read();
        let is_low = GPIOA.idr().read().idr(PIN) == Idr::LOW;
        with_guard(|guard, errors| {
            let events = errors.update(status.fe(), status.ore(), is_low);
            if events.is_break {
                guard.line_break();
            }
            if events.is_overrun {
                LOST.store(true, Ordering::Relaxed);
            }
        });
        pass_to_guard();
    }
}

/// Calls `action` with the guard and the flags of the line. `try_borrow_mut` cannot fail here; unlike `borrow_mut` it has no panic.
fn with_guard(action: impl FnOnce(&mut Guard<'static>, &mut LineErrors)) {
    GUARD.lock(|both| {
        if let Ok(mut both) = both.try_borrow_mut() {
            let (guard, errors) = &mut *both;
            action(guard, errors);
        }
    });
}

/// Passes newly received bytes to the guard and wakes the reader.
fn pass_to_guard() {
    let cycles = DWT::cycle_count();
    let is_late = cycles.wrapping_sub(LAST_PASS_CYCLES.swap(cycles, Ordering::Relaxed)) > MAX_PASS_INTERVAL_CYCLES;
    let flags = DMA1.isr(STREAM / 4).read();
    DMA1.ifcr(STREAM / 4).write(|w| {
        w.set_htif(STREAM % 4, true);
        w.set_tcif(STREAM % 4, true);
    });
    // After a stall of the core the ring may have wrapped. It has not where its writing position has not passed both the middle and the
    // end.
    if is_late && flags.htif(STREAM % 4) && flags.tcif(STREAM % 4) {
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
        with_guard(|guard, _| (done..new.min(done + CHUNK_BYTES)).for_each(|offset| guard.byte(byte(at + offset))));
        done += CHUNK_BYTES;
    }
    RECEIVED.store(before.wrapping_add(new as u32), Ordering::Release);
    READER.wake();
}

#[inline]
fn byte(position: usize) -> u8 {
    RING.get(position % LENGTH).map_or(0, |byte| byte.load(Ordering::Relaxed))
}

/// Pends the receive interrupt, which passes received bytes to the guard. Called in each tick.
#[inline]
pub fn pend_guard() {
    interrupt::USART2.pend();
}

/// The receiving half.
pub struct Receiver {
    taken: u32,
    _pin: Flex<'static>,
}

impl Receiver {
    /// Starts reception on the USART that `_sender` has configured.
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
        USART2.cr1().modify(|w| w.set_re(true));
        LAST_PASS_CYCLES.store(DWT::cycle_count(), Ordering::Relaxed);
        interrupt::USART2.set_priority(Priority::P1);
        typelevel::USART2::unpend();
        // SAFETY: everything that the handler uses is initialised.
        unsafe { typelevel::USART2::enable() };
        Self { taken: 0, _pin: pin }
    }
}

/// Received bytes were overwritten before they were read.
#[derive(Clone, Copy, Debug, defmt::Format)]
pub struct Overrun;

impl core::fmt::Display for Overrun {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("receive buffer overrun: bytes were lost")
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
        for (offset, slot) in buffer.iter_mut().take(count).enumerate() {
            *slot = byte(self.taken as usize + offset);
        }
        self.taken = self.taken.wrapping_add(count as u32);
        Ok(count)
    }
}
