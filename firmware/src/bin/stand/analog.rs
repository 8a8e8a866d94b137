//! ADC1: motor current, supply, temperature, and angle sensor and torquer current of the gyroscope, sampled in step with the bridge.
//!
//! Channel 3 of TIM1 has no pin. Its edge at the top of the bridge's counter starts a sweep of five conversions, 20 000 times per second;
//! there the bridge conducts and the current passes through its mean of the PWM period. A sweep takes 14.5 µs of 50 µs (ADC clock 22.5 MHz:
//! 27 + 68 + 96 + 68 + 68 cycles). DMA writes into a ring of 64 sweeps, 3.2 ms: the tick reads the newest sweep, the measurement loop sums
//! the sweeps since its last call.
//!
//! ADC2 and ADC3 are not used: the three converters share one reset.

use core::sync::atomic::{AtomicU16, Ordering};
use embassy_stm32::Peri;
use embassy_stm32::adc::Adc;
use embassy_stm32::gpio::Flex;
use embassy_stm32::pac::adc::vals::{Dds, Exten, SampleTime};
use embassy_stm32::pac::dma::vals::{Dir, Pl, Size};
use embassy_stm32::pac::timer::vals::Ocm;
use embassy_stm32::pac::{ADC1, DMA2, RCC, TIM1};
use embassy_stm32::peripherals;
use stand_firmware::board::{CurrentCode, CurrentSum, GyroSample};

/// Position of each conversion within a sweep.
const CURRENT: usize = 0;
const SUPPLY: usize = 1;
const TEMPERATURE: usize = 2;
const ANGLE: usize = 3;
const TORQUER: usize = 4;
const CHANNELS: usize = 5;
/// Sweeps in the ring.
const SWEEPS: usize = 64;
const LENGTH: usize = CHANNELS * SWEEPS;
/// ADC1 is request 0 of DMA2's stream 0 (RM0390, table 29).
const STREAM: usize = 0;
/// The channels of PC0 to PC4 (DS10693, table 10).
const PINS: [u8; CHANNELS] = [10, 11, 12, 13, 14];
/// Trigger "TIM1_CC3" of the regular sequence (RM0390, table 83).
const TIM1_CC3: u8 = 0b0010;

static RING: [AtomicU16; LENGTH] = [const { AtomicU16::new(0) }; LENGTH];

/// Configures converter, DMA and trigger; the bridge's timer may already run. `top`: compare count at the top of its counter.
pub fn start(
    adc: Peri<'static, peripherals::ADC1>,
    _stream: Peri<'static, peripherals::DMA2_CH0>,
    pins: (
        Peri<'static, peripherals::PC0>,
        Peri<'static, peripherals::PC1>,
        Peri<'static, peripherals::PC2>,
        Peri<'static, peripherals::PC3>,
        Peri<'static, peripherals::PC4>,
    ),
    top: u16,
) {
    // Powers the converter on. Dropping `Adc` would stop the converter and its clock.
    core::mem::forget(Adc::new(adc));
    // Kept for ever, so that no other driver can take the pin.
    for mut pin in [Flex::new(pins.0), Flex::new(pins.1), Flex::new(pins.2), Flex::new(pins.3), Flex::new(pins.4)] {
        pin.set_as_analog();
        core::mem::forget(pin);
    }
    ADC1.cr1().modify(|w| w.set_scan(true));
    ADC1.sqr1().modify(|w| w.set_l(CHANNELS as u8 - 1));
    for (rank, channel) in PINS.into_iter().enumerate() {
        ADC1.sqr3().modify(|w| w.set_sq(rank, channel));
        // The INA240's output has a few ohms, the dividers have kilohms and need a longer sample time.
        let sample_times = [SampleTime::CYCLES15, SampleTime::CYCLES56, SampleTime::CYCLES84, SampleTime::CYCLES56, SampleTime::CYCLES56];
        if let Some(time) = sample_times.get(rank) {
            ADC1.smpr1().modify(|w| w.set_smp(usize::from(channel) - 10, *time));
        }
    }
    RCC.ahb1enr().modify(|w| w.set_dma2en(true));
    start_dma();
    TIM1.ccmr_output(1).modify(|w| w.set_ocm(0, Ocm::PWM_MODE2));
    TIM1.ccr(2).write(|w| w.set_ccr(top - 1));
    TIM1.ccer().modify(|w| w.set_cce(2, true));
}

/// Starts DMA and converter at the start of the ring.
fn start_dma() {
    let stream = DMA2.st(STREAM);
    stream.cr().modify(|w| w.set_en(false));
    while stream.cr().read().en() {}
    DMA2.ifcr(0).write(|w| {
        w.set_tcif(STREAM, true);
        w.set_htif(STREAM, true);
        w.set_teif(STREAM, true);
        w.set_dmeif(STREAM, true);
        w.set_feif(STREAM, true);
    });
    stream.par().write_value(ADC1.dr().as_ptr() as u32);
    stream.m0ar().write_value(RING.as_ptr() as u32);
    stream.ndtr().write(|w| w.set_ndt(LENGTH as u16));
    stream.cr().write(|w| {
        w.set_dir(Dir::PERIPHERAL_TO_MEMORY);
        w.set_circ(true);
        w.set_minc(true);
        w.set_psize(Size::BITS16);
        w.set_msize(Size::BITS16);
        w.set_pl(Pl::VERY_HIGH);
        w.set_en(true);
    });
    ADC1.sr().modify(|w| w.set_ovr(false));
    ADC1.cr2().modify(|w| {
        w.set_dma(false);
        w.set_dds(Dds::CONTINUOUS);
        w.set_extsel(TIM1_CC3);
        w.set_exten(Exten::RISING_EDGE);
    });
    ADC1.cr2().modify(|w| w.set_dma(true));
}

/// Number of the sweep that DMA is writing, 0 … 63.
#[inline]
pub fn sweep_in_progress() -> usize {
    let left = usize::from(DMA2.st(STREAM).ndtr().read().ndt());
    LENGTH.saturating_sub(left) / CHANNELS % SWEEPS
}

#[inline]
fn code(sweep: usize, channel: usize) -> u16 {
    RING.get(sweep % SWEEPS * CHANNELS + channel).map_or(0, |code| code.load(Ordering::Relaxed))
}

/// Codes of current and supply in the newest complete sweep.
#[inline]
pub fn newest_current_and_supply() -> (CurrentCode, u32) {
    let sweep = sweep_in_progress().wrapping_sub(1);
    (CurrentCode(i32::from(code(sweep, CURRENT))), u32::from(code(sweep, SUPPLY)))
}

/// The measurement loop's position in the ring.
#[derive(Default)]
pub struct Sweeps {
    taken: usize,
}

/// Slowly varying quantities of a sweep.
#[derive(Clone, Copy, Default)]
pub struct SlowChannels {
    /// Code of the supply.
    pub supply: u16,
    /// Code of the thermistor.
    pub temperature: u16,
}

/// Gyroscope: code of the angle sensor in the sweep before `sweep`, and torquer current summed over the sweeps from `since` up to there.
pub fn gyro_sample(since: usize, sweep: usize) -> GyroSample {
    let angle = i32::from(code(sweep.wrapping_sub(1), ANGLE));
    let mut sample = GyroSample { angle, ..GyroSample::default() };
    let mut taken = since % SWEEPS;
    while taken != sweep % SWEEPS {
        sample.torquer += i32::from(code(taken, TORQUER));
        sample.conversions += 1;
        taken = (taken + 1) % SWEEPS;
    }
    sample
}

impl Sweeps {
    /// Sum of the current codes since the last call. After more than 3.2 ms, the length of the ring, older sweeps are missing from the sum.
    pub fn current(&mut self) -> CurrentSum {
        // After an overrun the converter requests no DMA transfer until it is restarted; the ring would keep its last codes.
        if ADC1.sr().read().ovr() {
            start_dma();
            self.taken = 0;
        }
        let end = sweep_in_progress();
        let mut sum = CurrentSum::default();
        while self.taken != end {
            sum.codes += i64::from(code(self.taken, CURRENT));
            sum.count += 1;
            self.taken = (self.taken + 1) % SWEEPS;
        }
        sum
    }
}

/// Supply and temperature in the newest complete sweep.
pub fn slow_channels() -> SlowChannels {
    let sweep = sweep_in_progress().wrapping_sub(1);
    SlowChannels { supply: code(sweep, SUPPLY), temperature: code(sweep, TEMPERATURE) }
}
