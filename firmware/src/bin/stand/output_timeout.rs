//! The bridge goes off 4 ms after the last control tick, by hardware alone.
//!
//! Each tick restarts TIM8. When it is not restarted for 4 ms, its update event requests one DMA transfer, which writes BDTR of TIM1 with
//! MOE = 0: both inputs of the bridge take their idle level, high, and the motor brakes as when the drive is off. Neither the core nor an
//! interrupt takes part. The tick sets MOE again while it commands off; after a late tick the fault `clock` is latched.
//!
//! The alternatives: the window watchdog cannot be stopped, so that it would reset the chip during each erase of the flash (0.25 s). TIM1's
//! break input is on PA6 or PB12 (DS10693, table 11), and both are in use: PA6 counts the encoder, PB12 selects the sensor under test. DMA
//! into the compare registers would act at the next update event only, and needs two transfers.

use core::sync::atomic::{AtomicU32, Ordering};
use embassy_stm32::pac::dma::vals::{Dir, Pl, Size};
use embassy_stm32::pac::timer::regs::BdtrAdv;
use embassy_stm32::pac::timer::vals::Urs;
use embassy_stm32::pac::{DMA2, RCC, TIM1, TIM8};
use embassy_stm32::{Peri, peripherals, rcc};

/// TIM8_UP is request 7 of DMA2's stream 1 (RM0390, table 29).
const STREAM: usize = 1;
const REQUEST: u8 = 7;
/// Counting rate of TIM8, Hz.
const COUNT_HZ: u32 = 100_000;
/// Time without a tick after which the bridge goes off: 4 ms. A tick is 0.1 ms; interrupts are held off for some microseconds at most.
const TIMEOUT_COUNTS: u16 = 400;

/// BDTR with MOE = 0, the source of the DMA transfer.
static OFF: AtomicU32 = AtomicU32::new(0);

/// Starts the timeout; the bridge's timer is configured. From now on [`restart`] must be called in each tick.
pub fn start(_tim: Peri<'static, peripherals::TIM8>, _stream: Peri<'static, peripherals::DMA2_CH1>, off: BdtrAdv) {
    rcc::enable_and_reset::<peripherals::TIM8>();
    RCC.ahb1enr().modify(|w| w.set_dma2en(true));
    OFF.store(off.0, Ordering::Relaxed);
    let stream = DMA2.st(STREAM);
    stream.par().write_value(TIM1.bdtr().as_ptr() as u32);
    stream.m0ar().write_value(OFF.as_ptr() as u32);
    stream.ndtr().write(|w| w.set_ndt(1));
    stream.cr().write(|w| {
        w.set_chsel(REQUEST);
        w.set_dir(Dir::MEMORY_TO_PERIPHERAL);
        // Circular: ready again after each transfer, without the core.
        w.set_circ(true);
        w.set_psize(Size::BITS16);
        w.set_msize(Size::BITS16);
        w.set_pl(Pl::HIGH);
        w.set_en(true);
    });
    TIM8.psc().write_value((crate::clocks::CORE_HZ / COUNT_HZ - 1) as u16);
    TIM8.arr().write(|w| w.set_arr(TIMEOUT_COUNTS - 1));
    // The restart by UG is an update event without a request.
    TIM8.cr1().write(|w| w.set_urs(Urs::COUNTER_ONLY));
    TIM8.egr().write(|w| w.set_ug(true));
    TIM8.dier().write(|w| w.set_ude(true));
    TIM8.cr1().modify(|w| w.set_cen(true));
}

/// The control tick runs.
#[inline]
pub fn restart() {
    TIM8.egr().write(|w| w.set_ug(true));
}
