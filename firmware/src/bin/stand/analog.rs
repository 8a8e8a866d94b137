//! Current, supply, temperature, the gyro's angle sensor and its torquer's current: converted by ADC1 in step with the bridge, brought to memory by DMA.
//!
//! TIM1's third channel has no pin; its edge at the top of the bridge's counter starts a sweep of five conversions, 20 000 a second. At the
//! top the bridge drives and the current passes through its period's mean. A sweep takes 14.5 of its 50 µs (22.5 MHz: 27 + 68 + 96 + 68 + 68
//! cycles). The ring holds 64 sweeps, 3.2 ms: the tick reads the newest, the measurement sums what came since it last looked.
//!
//! Only ADC1 is in use: the three converters share one reset.

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

/// Conversions in a sweep, in this order.
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

/// Sets everything up; the bridge's timer may be running already. `full` is the compare count of the counter's top.
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
    full: u16,
) {
    // Powers the converter on. A dropped `Adc` stops it and switches its clock off, and nothing here ever gives it back.
    core::mem::forget(Adc::new(adc));
    // Dropped, a pin is analog too, but then nothing says that it is taken.
    for mut pin in [Flex::new(pins.0), Flex::new(pins.1), Flex::new(pins.2), Flex::new(pins.3), Flex::new(pins.4)] {
        pin.set_as_analog();
        core::mem::forget(pin);
    }
    ADC1.cr1().modify(|w| w.set_scan(true));
    ADC1.sqr1().modify(|w| w.set_l(CHANNELS as u8 - 1));
    for (place, channel) in PINS.into_iter().enumerate() {
        ADC1.sqr3().modify(|w| w.set_sq(place, channel));
        // The INA240 drives its pin with a few ohms; the dividers are kilohms.
        let time = [SampleTime::CYCLES15, SampleTime::CYCLES56, SampleTime::CYCLES84, SampleTime::CYCLES56, SampleTime::CYCLES56];
        if let Some(time) = time.get(place) {
            ADC1.smpr1().modify(|w| w.set_smp(usize::from(channel) - 10, *time));
        }
    }
    RCC.ahb1enr().modify(|w| w.set_dma2en(true));
    begin();
    TIM1.ccmr_output(1).modify(|w| w.set_ocm(0, Ocm::PWM_MODE2));
    TIM1.ccr(2).write(|w| w.set_ccr(full - 1));
    TIM1.ccer().modify(|w| w.set_cce(2, true));
}

/// Lets DMA and converter begin, from the ring's start.
fn begin() {
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

/// The sweep that is being written, 0 … 63.
#[inline]
pub fn under_way() -> usize {
    let left = usize::from(DMA2.st(STREAM).ndtr().read().ndt());
    LENGTH.saturating_sub(left) / CHANNELS % SWEEPS
}

#[inline]
fn code(sweep: usize, channel: usize) -> u16 {
    RING.get(sweep % SWEEPS * CHANNELS + channel).map_or(0, |code| code.load(Ordering::Relaxed))
}

/// The newest whole sweep's current and supply. For the tick.
#[inline]
pub fn newest() -> (CurrentCode, u32) {
    let sweep = under_way().wrapping_sub(1);
    (CurrentCode(i32::from(code(sweep, CURRENT))), u32::from(code(sweep, SUPPLY)))
}

/// The measurement's eye on the ring.
#[derive(Default)]
pub struct Sweeps {
    taken: usize,
}

/// The newest sweep, but for the current.
#[derive(Clone, Copy, Default)]
pub struct Slow {
    /// Code of the supply.
    pub supply: u16,
    /// Code of the thermistor.
    pub temperature: u16,
}

/// The gyro in the sweep before `sweep`: its angle sensor, and its torquer's current summed from `since` to there.
pub fn gyro(since: usize, sweep: usize) -> GyroSample {
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
    /// Sums the current's conversions since the last call. Where it was not called for longer than the ring's 3.2 ms, the sum is of the rest.
    pub fn current(&mut self) -> CurrentSum {
        // A converter that was overrun asks DMA for nothing more: begin anew, or its last codes would stand for ever.
        if ADC1.sr().read().ovr() {
            begin();
            self.taken = 0;
        }
        let upto = under_way();
        let mut sum = CurrentSum::default();
        while self.taken != upto {
            sum.codes += i64::from(code(self.taken, CURRENT));
            sum.count += 1;
            self.taken = (self.taken + 1) % SWEEPS;
        }
        sum
    }
}

/// The newest whole sweep, but for the current.
pub fn slow() -> Slow {
    let sweep = under_way().wrapping_sub(1);
    Slow { supply: code(sweep, SUPPLY), temperature: code(sweep, TEMPERATURE) }
}
