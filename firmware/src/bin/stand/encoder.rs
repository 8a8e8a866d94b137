//! One encoder input: a counter of both channels, a timer that captures the times of the edges, and the index on both. The timer of the
//! measurement loop also captures the pulses of the clock reference.
//!
//! The board has two inputs on the same three wires, one for the speed loop and one for the measurement loop; they share nothing. The
//! counter is a timer in encoder mode (16 bits). The edge timer runs free at 90 MHz with 32 bits; its first input is A XOR B (RM0390
//! §17.3.19), captured at both edges, which gives all four edges of the encoder.
//!
//! Counter and edge timer have the same input filter (eight equal samples at 90 MHz, 89 ns: shorter than the 4 µs of a count at twice the
//! maximum rate, longer than a spike), so that count and time agree within a few cycles of 11 ns. The count is read before and after
//! the time; if an edge came in between, both are read again.

use embassy_stm32::Peri;
use embassy_stm32::gpio::{AfType, Flex, Pin, Pull};
use embassy_stm32::pac::timer::vals::{CcmrInputCcs, FilterValue, Ti1s};
use embassy_stm32::pac::timer::{TimGp16, TimGp32};
use stand_firmware::board::EncoderCount;

const FILTER: FilterValue = FilterValue::FCK_INT_N8;
/// The alternate functions of the timers' pins (DS10693, table 11).
const AF_TIM2: u8 = 1;
const AF_TIM3_4_5: u8 = 2;
/// Capture channels: A XOR B of an edge timer; the index of a counter; clock reference and index of the measurement loop's edge timer.
const EDGE: usize = 0;
const COUNTER_INDEX: usize = 2;
const TIMER_REFERENCE: usize = 2;
const TIMER_INDEX: usize = 3;

/// A consistent reading of counter and edge timer.
#[derive(Clone, Copy)]
pub struct Reading {
    /// The counter.
    pub count: EncoderCount,
    /// The edge timer at the last edge; `None` before the first edge.
    pub edge: Option<u32>,
    /// The edge timer now.
    pub now: u32,
}

/// An encoder input.
pub struct Encoder {
    counter: TimGp16,
    edges: TimGp32,
    seen: bool,
    _pins: [Flex<'static>; 3],
}

impl Encoder {
    /// Configures the captures. `counter` (TIM3, TIM4) must be in encoder mode, with its pins configured by the HAL; `edges` (TIM2, TIM5)
    /// must have its clock and be in its reset state otherwise.
    pub fn new(
        counter: TimGp16,
        edges: TimGp32,
        a: Peri<'static, impl Pin>,
        b: Peri<'static, impl Pin>,
        counter_index: Peri<'static, impl Pin>,
        edges_af: EdgeTimer,
    ) -> Self {
        counter.ccmr_input(0).modify(|w| {
            w.set_icf(0, FILTER);
            w.set_icf(1, FILTER);
        });
        counter.ccmr_input(1).modify(|w| {
            w.set_ccs(COUNTER_INDEX - 2, CcmrInputCcs::TI4);
            w.set_icf(COUNTER_INDEX - 2, FILTER);
        });
        counter.ccer().modify(|w| w.set_cce(COUNTER_INDEX, true));

        edges.cr2().modify(|w| w.set_ti1s(Ti1s::XOR));
        edges.ccmr_input(0).modify(|w| {
            w.set_ccs(EDGE, CcmrInputCcs::TI4);
            w.set_icf(EDGE, FILTER);
        });
        edges.ccer().modify(|w| {
            // Both polarity bits: both edges.
            w.set_ccp(EDGE, true);
            w.set_ccnp(EDGE, true);
            w.set_cce(EDGE, true);
        });
        edges.psc().write_value(0);
        edges.arr().write_value(u32::MAX);
        edges.cr1().modify(|w| w.set_cen(true));
        let af = edges_af as u8;
        Self { counter, edges, seen: false, _pins: [input(a, af), input(b, af), input(counter_index, AF_TIM3_4_5)] }
    }

    /// Reads count, last edge and time consistently.
    #[inline]
    pub fn read(&mut self) -> Reading {
        if !self.seen {
            self.seen = self.edges.sr().read().ccif(EDGE);
        }
        let mut count = self.counter.cnt().read().cnt();
        let mut edge = self.edges.ccr(EDGE).read();
        let mut now = self.edges.cnt().read();
        // Edges are microseconds apart and a reading takes 0.1 µs: the second reading meets no further edge.
        let count_after = self.counter.cnt().read().cnt();
        if count_after != count {
            count = count_after;
            edge = self.edges.ccr(EDGE).read();
            now = self.edges.cnt().read();
        }
        Reading { count: EncoderCount(count), edge: self.seen.then_some(edge), now }
    }

    /// The count at the index, if one came since the last call. Reading it clears the flag.
    #[inline]
    pub fn index(&mut self) -> Option<EncoderCount> {
        self.counter.sr().read().ccif(COUNTER_INDEX).then(|| EncoderCount(self.counter.ccr(COUNTER_INDEX).read().ccr()))
    }
}

/// The edge timer; the value is the alternate function of its pins.
#[derive(Clone, Copy)]
pub enum EdgeTimer {
    /// TIM2, of the measurement loop.
    Tim2 = AF_TIM2 as isize,
    /// TIM5, of the speed loop.
    Tim5 = AF_TIM3_4_5 as isize,
}

/// Times of the rising edges at a pin of its own, captured by the measurement loop's edge timer (TIM2).
pub struct RisingEdges {
    edges: TimGp32,
    channel: usize,
    _pin: Flex<'static>,
}

impl RisingEdges {
    /// The index on channel 4; call after [`Encoder::new`].
    pub fn of_index(edges: TimGp32, pin: Peri<'static, impl Pin>) -> Self {
        Self::new(edges, TIMER_INDEX, input(pin, AF_TIM2))
    }

    /// The clock reference on channel 3; call after [`Encoder::new`]. Its pin has a pull-down resistor, so that it has no edges without a
    /// reference.
    pub fn of_clock_reference(edges: TimGp32, pin: Peri<'static, impl Pin>) -> Self {
        let mut pin = Flex::new(pin);
        pin.set_as_af_unchecked(AF_TIM2, AfType::input(Pull::Down));
        Self::new(edges, TIMER_REFERENCE, pin)
    }

    fn new(edges: TimGp32, channel: usize, pin: Flex<'static>) -> Self {
        edges.ccmr_input(1).modify(|w| {
            w.set_ccs(channel - 2, CcmrInputCcs::TI4);
            w.set_icf(channel - 2, FILTER);
        });
        edges.ccer().modify(|w| w.set_cce(channel, true));
        Self { edges, channel, _pin: pin }
    }

    /// The edge timer at the last edge, if one came since the last call.
    pub fn take(&mut self) -> Option<u32> {
        self.edges.sr().read().ccif(self.channel).then(|| self.edges.ccr(self.channel).read())
    }
}

/// Input pin without pull resistors: the encoder's outputs have 5 V, which the pins tolerate only then (DS10693, table 17).
fn input(pin: Peri<'static, impl Pin>, af: u8) -> Flex<'static> {
    let mut pin = Flex::new(pin);
    pin.set_as_af_unchecked(af, AfType::input(Pull::None));
    pin
}
