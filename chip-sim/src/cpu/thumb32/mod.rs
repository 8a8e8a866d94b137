//! 32-bit instructions (A5.3): one module per group.
mod branch_control;
mod data_processing;
mod load_store;
mod multiply;
mod simd;

use super::alu::bit;
use super::{Bus, Core, Event, Outcome};

/// True for R13 and R15, which most fields do not accept (A5.1.1, BadReg).
#[inline(always)]
fn bad_register(n: u32) -> bool {
    n == 13 || n == 15
}

/// The event of an undefined or unpredictable 32-bit encoding.
#[inline(always)]
pub(super) fn undefined(first: u32, second: u32) -> Outcome {
    Err(Event::Undefined(first << 16 | second))
}

impl Core {
    #[inline]
    pub(super) fn thumb32<B: Bus>(&mut self, bus: &mut B, first: u32, second: u32) -> Outcome {
        match first >> 9 & 15 {
            4 if !bit(first, 6) => self.load_store_multiple(bus, first, second),
            4 if first & 0x120 == 0 => self.exclusive_and_table_branch(bus, first, second),
            4 => self.load_store_dual(bus, first, second),
            5 => self.data_processing_register(first, second),
            6 | 7 => self.float(bus, first, second),
            8..=11 if bit(second, 15) => self.branch_and_control(first, second),
            8 | 10 => self.data_processing_immediate(first, second),
            9 | 11 => self.plain_immediate(first, second),
            12 => self.load_store_single(bus, first, second),
            13 => match first >> 7 & 3 {
                0 | 1 => self.shift_extend_simd(first, second),
                2 => self.multiply(first, second),
                _ => self.long_multiply_divide(first, second),
            },
            _ => undefined(first, second),
        }
    }
}
