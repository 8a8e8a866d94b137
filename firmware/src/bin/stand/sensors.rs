//! The tasks' half of the board: the second encoder counter, supply and temperature, the current's sum.
//!
//! The current (ADC2) is converted once in each tick, started by the interrupt at a turning point of the bridge's
//! counter, where a period's mean shows; that is a sample each 100 µs, not yet a gapless mean. Supply and temperature
//! (ADC1) are converted when asked, some 4 µs each. There is no rate sensor yet, and it says so.

use crate::index::Index;
use crate::tick::{BoardClock, SUPPLY, take_current};
use core::sync::atomic::Ordering;
use embassy_stm32::Peri;
use embassy_stm32::adc::{Adc, AdcChannel, InjectedAdc, SampleTime};
use embassy_stm32::pac::adc::vals::Exten;
use embassy_stm32::peripherals::{ADC1, ADC2, PA0, PA1, PA4, TIM4};
use embassy_stm32::timer::qei::Qei;
use embassy_stm32::triggers::TIM1_TRGO;
use stand_firmware::board::{Board, Clock, CurrentSum, EncoderCount, RateCode, Stamped, SupplyCode, TemperatureCode};

/// The current's converter, kept by the interrupt.
pub type Current = InjectedAdc<'static, ADC2, 1>;

/// Sets the current's converter up for starts by software.
pub fn start_current(adc: Peri<'static, ADC2>, pin: Peri<'static, PA0>) -> Current {
    let channel = pin.degrade_adc();
    // 15 cycles of 22.5 MHz: the INA240 drives the pin with a few ohms.
    Adc::new(adc).setup_injected_conversions([(channel, SampleTime::CYCLES15)], TIM1_TRGO, Exten::DISABLED, false)
}

/// The tasks' half.
pub struct StandBoard {
    qei: Qei<'static, TIM4>,
    index: Index,
    adc: Adc<'static, ADC1>,
    supply: Peri<'static, PA1>,
    thermistor: Peri<'static, PA4>,
}

impl StandBoard {
    /// The tasks' half of these peripherals.
    pub fn new(
        qei: Qei<'static, TIM4>,
        index: Index,
        adc: Adc<'static, ADC1>,
        supply: Peri<'static, PA1>,
        thermistor: Peri<'static, PA4>,
    ) -> Self {
        Self { qei, index, adc, supply, thermistor }
    }
}

impl Board for StandBoard {
    type Clock = BoardClock;

    fn clock(&self) -> BoardClock {
        BoardClock
    }

    fn encoder(&mut self) -> Stamped<EncoderCount> {
        let value = EncoderCount(self.qei.count());
        Stamped { value, at: BoardClock.now() }
    }

    fn index(&mut self) -> Option<EncoderCount> {
        self.index.take()
    }

    fn current(&mut self) -> Stamped<CurrentSum> {
        take_current()
    }

    fn rate(&mut self) -> Option<Stamped<RateCode>> {
        None
    }

    fn supply(&mut self) -> Option<Stamped<SupplyCode>> {
        let at = BoardClock.now();
        let code = self.adc.blocking_read(&mut self.supply, SampleTime::CYCLES56);
        SUPPLY.store(u32::from(code), Ordering::Relaxed);
        Some(Stamped { value: SupplyCode(u32::from(code)), at })
    }

    fn temperature(&mut self) -> Option<Stamped<TemperatureCode>> {
        let at = BoardClock.now();
        let code = self.adc.blocking_read(&mut self.thermistor, SampleTime::CYCLES84);
        celsius(code).map(|degrees| Stamped { value: TemperatureCode((degrees * 100.0) as i32), at })
    }
}

/// 10 kΩ NTC (Vishay NTCLE100E3103, B25/85 = 3977 K), to ground under 10 kΩ; `None` if the wire is off.
fn celsius(code: u16) -> Option<f32> {
    const B_K: f32 = 3977.0;
    const T0_K: f32 = 298.15;
    if !(20..=4075).contains(&code) {
        return None;
    }
    let ratio = f32::from(code) / (4096.0 - f32::from(code));
    Some(1.0 / (1.0 / T0_K + libm::logf(ratio) / B_K) - 273.15)
}
