//! The full bridge on TIM1, and the beat of the tick.
//!
//! A driver with two inputs (DRV8871, SLVSCY9): both high brakes over the low sides, one of them pulsed low drives. TIM1
//! counts up and down to 4500 at 180 MHz: 20 kHz. Compare values are preloaded and taken over at the update event, which
//! the repetition counter lets come every fourth turning point, each 100 µs: that update is the tick's interrupt, and
//! what the tick writes therefore acts from the next tick on, for exactly one tick.

use crate::clocks::CORE_HZ;
use embassy_stm32::Peri;
use embassy_stm32::gpio::OutputType;
use embassy_stm32::pac::TIM1;
use embassy_stm32::peripherals;
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::Channel;
use embassy_stm32::timer::complementary_pwm::ComplementaryPwm;
use embassy_stm32::timer::low_level::CountingMode;
use embassy_stm32::timer::simple_pwm::PwmPin;
use stand_firmware::board::Drive;

const PWM_HZ: u32 = 20_000;
/// Compare counts at full scale.
pub const FULL: u16 = (CORE_HZ / PWM_HZ / 2) as u16;
/// Above all counts: an input that stays high. At `FULL` it would fall for one cycle at the turning point (RM0390 §16.3.10).
const HIGH: u16 = FULL + 1;
/// Turning points of the counter in one tick, minus one.
const REPETITIONS: u16 = 3;

/// The bridge, braking until it is told otherwise.
pub struct Bridge {
    _pwm: ComplementaryPwm<'static, peripherals::TIM1>,
}

impl Bridge {
    /// Starts the bridge's timer with both inputs high.
    pub fn new(tim: Peri<'static, peripherals::TIM1>, in1: Peri<'static, peripherals::PA8>, in2: Peri<'static, peripherals::PA9>) -> Self {
        let mut pwm = ComplementaryPwm::new(
            tim,
            Some(PwmPin::new(in1, OutputType::PushPull)),
            None,
            Some(PwmPin::new(in2, OutputType::PushPull)),
            None,
            None,
            None,
            None,
            None,
            Hertz(PWM_HZ),
            CountingMode::CenterAlignedUpInterrupts,
        );
        pwm.set_repetition_counter(REPETITIONS);
        defmt::assert_eq!(pwm.get_max_duty(), u32::from(FULL), "the bridge's scale");
        let mut bridge = Self { _pwm: pwm };
        bridge.drive(Drive::Off);
        bridge._pwm.enable(Channel::Ch1);
        bridge._pwm.enable(Channel::Ch2);
        bridge
    }

    /// Lets the update event interrupt, once every tick.
    pub fn interrupt_each_tick(&mut self) {
        TIM1.sr().modify(|w| w.set_uif(false));
        TIM1.dier().modify(|w| w.set_uie(true));
    }

    /// The interrupt was seen.
    #[inline]
    pub fn acknowledge(&mut self) {
        TIM1.sr().modify(|w| w.set_uif(false));
    }

    /// Writes the preload registers; no call of the HAL, whose checks could panic.
    #[inline]
    pub fn drive(&mut self, out: Drive) {
        let counts = out.counts();
        let pulsed = match counts.unsigned_abs() {
            0 => HIGH,
            counts => FULL.saturating_sub(counts),
        };
        let (in1, in2) = if counts >= 0 { (HIGH, pulsed) } else { (pulsed, HIGH) };
        TIM1.ccr(0).write(|w| w.set_ccr(in1));
        TIM1.ccr(1).write(|w| w.set_ccr(in2));
    }
}
