//! Pseudo-random binary sequence (PRBS10) of +amplitude and −amplitude: 1023 bits from a shift register of ten stages.
//!
//! Taps 10 and 7: x¹⁰ + x⁷ + 1 is primitive, so that a period has every state except zero. The seed selects the start of the sequence.

use super::{ProfileConfig, milliseconds};

#[derive(Clone, Debug)]
pub(super) struct Prbs {
    amplitude: f64,
    bit_ms: u32,
    left_ms: u32,
    register: u16,
}

impl Prbs {
    pub(super) fn new(amplitude: f64, c: &ProfileConfig) -> Self {
        let bit_ms = milliseconds(c.bit_s);
        let start = super::steps::SplitMix(c.seed).next() as u16 & 0x3ff;
        Self { amplitude, bit_ms, left_ms: bit_ms, register: if start == 0 { 1 } else { start } }
    }

    pub(super) fn next_value(&mut self) -> f64 {
        if self.left_ms == 0 {
            self.left_ms = self.bit_ms;
            let bit = (self.register >> 9 ^ self.register >> 6) & 1;
            self.register = (self.register << 1 | bit) & 0x3ff;
        }
        self.left_ms -= 1;
        if self.register & 1 == 1 { self.amplitude } else { -self.amplitude }
    }
}
