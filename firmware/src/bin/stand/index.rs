//! The encoder's index, captured by the counters themselves.
//!
//! In encoder mode a timer's third channel is free: it captures the counter at the rising edge of its pin (RM0390 §17.3.5), so that the
//! angle of the index is right however late it is looked at. The pulse, gated to a count, begins at the same count from either side.

use embassy_stm32::Peri;
use embassy_stm32::gpio::{AfType, Flex, Pin, Pull};
use embassy_stm32::pac::timer::TimGp16;
use embassy_stm32::pac::timer::vals::CcmrInputCcs;
use stand_firmware::board::EncoderCount;

/// The alternate function of TIM3 and TIM4 on all their pins (DS10693, table 11).
const AF_TIM3_4: u8 = 2;
/// Channel 3, counted from 0.
const CHANNEL: usize = 2;
/// Eight equal samples at the timer's clock, 89 ns: shorter than the 0.5 µs of a count at the highest rate, longer than a spike.
const FILTER: embassy_stm32::pac::timer::vals::FilterValue = embassy_stm32::pac::timer::vals::FilterValue::FCK_INT_N8;

/// One counter's capture of the index.
pub struct Index {
    timer: TimGp16,
    _pin: Flex<'static>,
}

impl Index {
    /// Sets the third channel of an encoder's timer up; the timer must be in encoder mode already.
    pub fn new(timer: TimGp16, pin: Peri<'static, impl Pin>) -> Self {
        let mut pin = Flex::new(pin);
        pin.set_as_af_unchecked(AF_TIM3_4, AfType::input(Pull::Down));
        timer.ccmr_input(1).modify(|w| {
            w.set_ccs(0, CcmrInputCcs::TI4);
            w.set_icf(0, FILTER);
        });
        timer.ccer().modify(|w| w.set_cce(CHANNEL, true));
        Self { timer, _pin: pin }
    }

    /// The count at the index, if it came since the last call; reading it clears the flag.
    #[inline]
    pub fn take(&mut self) -> Option<EncoderCount> {
        self.timer.sr().read().ccif(CHANNEL).then(|| EncoderCount(self.timer.ccr(CHANNEL).read().ccr()))
    }
}
