//! 180 MHz from the ST-Link's 8 MHz clock, or from the chip's own oscillator where that is missing.
//!
//! On the NUCLEO the 8 MHz come from the ST-Link's MCO (UM1724 §6.7.1) and are as good as its crystal; the internal
//! oscillator is good to 1 % (DS10693), so a stand on it says so.

use defmt::warn;
use embassy_stm32::interrupt::Priority;
use embassy_stm32::pac::{FLASH, RCC};
use embassy_stm32::rcc::{AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllMul, PllPDiv, PllPreDiv, PllSource, Sysclk};
use embassy_stm32::time::Hertz;

/// Core clock, Hz.
pub const CORE_HZ: u32 = 180_000_000;

/// The configuration to start with. APB2 timers (the bridge) run at 180 MHz, APB1 timers at 90 MHz.
pub fn config() -> embassy_stm32::Config {
    let mut config = embassy_stm32::Config::default();
    let external = external_clock_runs();
    if external {
        config.rcc.hse = Some(Hse { freq: Hertz(8_000_000), mode: HseMode::Bypass });
        config.rcc.pll_src = PllSource::HSE;
    } else {
        warn!("no 8 MHz from the ST-Link: on the internal oscillator, times are good to 1 % only");
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
    // The tick is above everything else.
    config.dma_interrupt_priority = Priority::P6;
    config
}

/// Switches prefetch and both caches of the flash on; the wait states stay. After `embassy_stm32::init`, which writes ACR whole and with
/// that switches them off: at 180 MHz each access to the flash would take six cycles (RM0390 §3.4.1).
pub fn enable_flash_caches() {
    FLASH.acr().modify(|w| {
        w.set_prften(true);
        w.set_icen(true);
        w.set_dcen(true);
    });
}

/// Switches the external clock on and waits for it, a few milliseconds at most. (The HAL would wait for ever.)
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
