//! 180 MHz from the ST-Link's 8 MHz clock, or from the chip's own oscillator where that is missing.
//!
//! On the NUCLEO the 8 MHz come from the ST-Link's MCO (UM1724 §6.7.1), with the accuracy of its crystal. The internal oscillator is
//! accurate to 1 % (DS10693); a warning is logged.

use defmt::warn;
use embassy_stm32::interrupt::Priority;
use embassy_stm32::pac::{FLASH, RCC};
use embassy_stm32::rcc::{AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllMul, PllPDiv, PllPreDiv, PllSource, Sysclk};
use embassy_stm32::time::Hertz;

/// Core clock, Hz.
pub const CORE_HZ: u32 = 180_000_000;

/// Clock configuration. APB2 timers (the bridge) run at 180 MHz, APB1 timers at 90 MHz.
pub fn config() -> embassy_stm32::Config {
    let mut config = embassy_stm32::Config::default();
    let external = external_clock_runs();
    if external {
        config.rcc.hse = Some(Hse { freq: Hertz(8_000_000), mode: HseMode::Bypass });
        config.rcc.pll_src = PllSource::HSE;
    } else {
        warn!("no 8 MHz clock from the ST-Link: running from the internal oscillator, times are accurate to 1 % only");
        config.rcc.pll_src = PllSource::HSI;
    }
    config.rcc.pll = Some(Pll {
        prediv: if external { PllPreDiv::DIV4 } else { PllPreDiv::DIV8 },
        mul: PllMul::MUL180,
        divp: Some(PllPDiv::DIV2),
        divq: None,
        divr: None,
    });
    config.rcc.sys = Sysclk::PLL1_P;
    config.rcc.ahb_pre = AHBPrescaler::DIV1;
    config.rcc.apb1_pre = APBPrescaler::DIV4;
    config.rcc.apb2_pre = APBPrescaler::DIV2;
    // Below the control interrupt and the serial guard.
    config.dma_interrupt_priority = Priority::P6;
    config
}

/// Enables prefetch and both caches of the flash and keeps the wait states. Call after `embassy_stm32::init`, which overwrites ACR and
/// disables them: at 180 MHz each access to the flash would take six cycles (RM0390 §3.4.1).
pub fn enable_flash_caches() {
    FLASH.acr().modify(|w| {
        w.set_prften(true);
        w.set_icen(true);
        w.set_dcen(true);
    });
}

/// Enables the external clock and waits at most a few milliseconds until it is ready. (The HAL would wait without end.)
fn external_clock_runs() -> bool {
    RCC.cr().modify(|w| {
        w.set_hsebyp(true);
        w.set_hseon(true);
    });
    let runs = (0..20_000).any(|_| RCC.cr().read().hserdy());
    if !runs {
        RCC.cr().modify(|w| {
            w.set_hseon(false);
            w.set_hsebyp(false);
        });
    }
    runs
}
