//! One encoder input: a counter of both channels, a timer that catches when its edges came, and the index in both.
//!
//! There are two of them, on the same three wires: one is the speed loop's, one is the measurement's, and neither sees the other. The counter is
//! a timer in encoder mode (16 bits: the HAL counts no more). The edge timer runs free at 90 MHz through 32 bits; its first input is A XOR B
//! (RM0390 §17.3.19), caught at both of its edges, which are all four of the encoder's.
//!
//! Counter and edge timer filter alike (eight equal samples at 90 MHz, 89 ns: shorter than the 4 µs of a count at twice the highest rate, longer
//! than a spike), so that count and time belong together to within a few cycles of 11 ns. The count is looked at before and
//! after the time: an edge that came in between makes it look again.

use embassy_stm32::Peri;
use embassy_stm32::gpio::{AfType, Flex, Pin, Pull};
use embassy_stm32::pac::timer::vals::{CcmrInputCcs, FilterValue, Ti1s};
use embassy_stm32::pac::timer::{TimGp16, TimGp32};
use stand_firmware::board::EncoderCount;

const FILTER: FilterValue = FilterValue::FCK_INT_N8;
/// The alternate functions of the timers' pins (DS10693, table 11).
const AF_TIM2: u8 = 1;
const AF_TIM3_4_5: u8 = 2;
/// Of an edge timer: A XOR B. Of a counter and of the measurement's edge timer: the index.
const EDGE: usize = 0;
const COUNTER_INDEX: usize = 2;
const TIMER_INDEX: usize = 3;

/// What is so at one moment.
#[derive(Clone, Copy)]
pub struct Look {
    /// The counter.
    pub count: EncoderCount,
    /// What the edge timer stood at when the last edge came; `None` before the first.
    pub edge: Option<u32>,
    /// What it stands at now.
    pub now: u32,
}

/// One of the two inputs.
pub struct Encoder {
    counter: TimGp16,
    edges: TimGp32,
    seen: bool,
    _pins: [Flex<'static>; 3],
}

impl Encoder {
    /// The counter's two channels and the edge timer's must be set up already: their owners are the HAL's.
    ///
    /// `counter` is in encoder mode (TIM3, TIM4); `edges` has a clock and is otherwise as after reset (TIM2, TIM5).
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
        Self {
            counter,
            edges,
            seen: false,
            _pins: [input(a, af, Pull::Up), input(b, af, Pull::Up), input(counter_index, AF_TIM3_4_5, Pull::Down)],
        }
    }

    /// Count, edge and time that belong together.
    #[inline]
    pub fn look(&mut self) -> Look {
        if !self.seen {
            self.seen = self.edges.sr().read().ccif(EDGE);
        }
        let mut count = self.counter.cnt().read().cnt();
        let mut edge = self.edges.ccr(EDGE).read();
        let mut now = self.edges.cnt().read();
        // Edges are microseconds apart, a look takes a tenth of one: a second try meets no further edge.
        let again = self.counter.cnt().read().cnt();
        if again != count {
            count = again;
            edge = self.edges.ccr(EDGE).read();
            now = self.edges.cnt().read();
        }
        Look { count: EncoderCount(count), edge: self.seen.then_some(edge), now }
    }

    /// The count at the index, if it came since the last call; reading it clears the flag.
    #[inline]
    pub fn index(&mut self) -> Option<EncoderCount> {
        self.counter.sr().read().ccif(COUNTER_INDEX).then(|| EncoderCount(self.counter.ccr(COUNTER_INDEX).read().ccr()))
    }
}

/// Which timer catches the edges, by the alternate function of its pins.
#[derive(Clone, Copy)]
pub enum EdgeTimer {
    /// TIM2, the measurement's.
    Tim2 = AF_TIM2 as isize,
    /// TIM5, the speed loop's.
    Tim5 = AF_TIM3_4_5 as isize,
}

/// The time of the index, caught by the measurement's edge timer on a pin of its own.
pub struct IndexTime {
    edges: TimGp32,
    _pin: Flex<'static>,
}

impl IndexTime {
    /// On TIM2's fourth channel; after its [`Encoder`] was made.
    pub fn new(edges: TimGp32, pin: Peri<'static, impl Pin>) -> Self {
        edges.ccmr_input(1).modify(|w| {
            w.set_ccs(TIMER_INDEX - 2, CcmrInputCcs::TI4);
            w.set_icf(TIMER_INDEX - 2, FILTER);
        });
        edges.ccer().modify(|w| w.set_cce(TIMER_INDEX, true));
        Self { edges, _pin: input(pin, AF_TIM2, Pull::Down) }
    }

    /// What the timer stood at when the index last began, if it has since the last call.
    pub fn take(&mut self) -> Option<u32> {
        self.edges.sr().read().ccif(TIMER_INDEX).then(|| self.edges.ccr(TIMER_INDEX).read())
    }
}

fn input(pin: Peri<'static, impl Pin>, af: u8, pull: Pull) -> Flex<'static> {
    let mut pin = Flex::new(pin);
    pin.set_as_af_unchecked(af, AfType::input(pull));
    pin
}
