//! The full bridge on TIM1, and the control tick.
//!
//! The driver has two inputs (DRV8871, SLVSCY9): both high brakes through the low sides; pulsing one of them low drives. TIM1
//! counts up and down between 0 and 4500 at 180 MHz, which gives 20 kHz. The repetition counter lets every fourth turning point
//! of the counter be an update event: 4 · 4500 = 18 000 cycles, exactly 100 µs. The update event raises the control interrupt and
//! loads the compare values that the previous tick has written. A tick's output therefore acts during the whole next tick.

use crate::clocks::CORE_HZ;
use embassy_stm32::Peri;
use embassy_stm32::gpio::OutputType;
use embassy_stm32::pac::TIM1;
use embassy_stm32::pac::timer::regs::BdtrAdv;
use embassy_stm32::pac::timer::vals::Ossi;
use embassy_stm32::peripherals;
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::Channel;
use embassy_stm32::timer::complementary_pwm::ComplementaryPwm;
use embassy_stm32::timer::low_level::CountingMode;
use embassy_stm32::timer::simple_pwm::PwmPin;
use stand_firmware::board::{CONTROL_HZ, Drive};

const PWM_HZ: u32 = 20_000;
/// Top of the counter, and the compare counts at full scale. In centre-aligned mode a PWM period is 2 · ARR cycles (RM0390 §16.3.2).
pub const TOP: u16 = (CORE_HZ / PWM_HZ / 2) as u16;
/// Compare value above the counter's top: the input stays high. At `TOP` it would fall for one cycle at the turning point (RM0390
/// §16.3.10).
const ALWAYS_HIGH: u16 = TOP + 1;
/// Turning points of the counter in one tick, minus one.
const REPETITIONS: u16 = 3;
const _: () = assert!((REPETITIONS as u32 + 1) * TOP as u32 * CONTROL_HZ as u32 == CORE_HZ, "a tick is 1/CONTROL_HZ exactly");

/// The full bridge; it brakes until the first command.
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
        // The HAL writes ARR = clocks − 1 = 4499, which suits edge-aligned counting only: a tick would be 17 996 cycles, 222 ppm fast.
        TIM1.arr().write(|w| w.set_arr(TOP));
        pwm.set_repetition_counter(REPETITIONS);
        // Loads both shadow registers and restarts the counter at 0: from here on ticks are at the bottom of the counter.
        TIM1.egr().write(|w| w.set_ug(true));
        defmt::assert_eq!(TIM1.arr().read().arr(), TOP, "top of the bridge's counter");
        defmt::assert_eq!(TIM1.rcr().read().rep(), REPETITIONS, "repetition counter of the bridge");
        // Without MOE both inputs are high, as in `Drive::Off`: the motor brakes.
        TIM1.cr2().modify(|w| {
            w.set_ois(0, true);
            w.set_ois(1, true);
        });
        TIM1.bdtr().modify(|w| w.set_ossi(Ossi::IDLE_LEVEL));
        let mut bridge = Self { _pwm: pwm };
        bridge.drive(Drive::Off);
        bridge._pwm.enable(Channel::Ch1);
        bridge._pwm.enable(Channel::Ch2);
        bridge
    }

    /// Enables the interrupt of the update event, once per tick.
    pub fn enable_interrupt(&mut self) {
        TIM1.sr().modify(|w| w.set_uif(false));
        TIM1.dier().modify(|w| w.set_uie(true));
    }

    /// Clears the interrupt's flag.
    #[inline]
    pub fn acknowledge(&mut self) {
        TIM1.sr().modify(|w| w.set_uif(false));
    }

    /// Writes the preload registers. Register access instead of `SetDutyCycle`: the HAL's checks can panic, and the interrupt must not.
    #[inline]
    pub fn drive(&mut self, drive: Drive) {
        // After a timeout of the output; the compare values of off are the idle levels, so that the outputs do not move.
        if drive == Drive::Off && !TIM1.bdtr().read().moe() {
            TIM1.bdtr().modify(|w| w.set_moe(true));
        }
        let counts = drive.counts();
        let pulsed = match counts.unsigned_abs() {
            0 => ALWAYS_HIGH,
            counts => TOP.saturating_sub(counts),
        };
        let (in1, in2) = if counts >= 0 { (ALWAYS_HIGH, pulsed) } else { (pulsed, ALWAYS_HIGH) };
        TIM1.ccr(0).write(|w| w.set_ccr(in1));
        TIM1.ccr(1).write(|w| w.set_ccr(in2));
    }
}

/// Value of BDTR that switches the outputs to their idle level.
pub fn outputs_off() -> BdtrAdv {
    let mut bdtr = TIM1.bdtr().read();
    bdtr.set_moe(false);
    bdtr
}

/// Sets both inputs high without access to the [`Bridge`], at once: for panics and failures of supply and clock.
pub fn off() {
    TIM1.bdtr().write_value(outputs_off());
    for channel in 0..2 {
        TIM1.ccr(channel).write(|w| w.set_ccr(ALWAYS_HIGH));
    }
}
