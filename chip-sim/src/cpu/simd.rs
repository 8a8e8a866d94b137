//! Parallel additions and operations on bits (A5.3.13 to A5.3.15).

use super::alu::{bit, sign_extend};
use super::thumb32::undefined;
use super::{Core, Step};

impl Core {
    /// SADD8, QSUB16, UHASX …: lanes of 8 or 16 bits.
    pub(super) fn parallel_add_subtract(&mut self, h: u32, l: u32) -> Step {
        let (operation, kind) = (h >> 4 & 7, l >> 4 & 7);
        let signed = kind < 4;
        let exchanged = matches!(operation, 2 | 6);
        let width = if operation & 3 == 0 { 8 } else { 16 };
        let mask = (1 << width) - 1;
        let a = self.r[(h & 15) as usize];
        let b = self.r[(l & 15) as usize].rotate_right(if exchanged { 16 } else { 0 });
        if operation & 3 == 3 || kind & 3 == 3 {
            return Err(undefined(h, l));
        }
        let (mut result, mut greater_equal) = (0, 0);
        for lane in 0..32 / width {
            let part = |x: u32| {
                let x = x >> (lane * width) & mask;
                if signed { sign_extend(x, width) as i32 } else { x as i32 }
            };
            let subtract = match operation {
                4 | 5 => true,
                2 => lane == 0,
                6 => lane == 1,
                _ => false,
            };
            let value = if subtract { part(a) - part(b) } else { part(a) + part(b) };
            let passes = if signed || subtract { value >= 0 } else { value >> width != 0 };
            if passes {
                greater_equal |= if width == 8 { 1 << lane } else { 3 << (2 * lane) };
            }
            let value = match kind & 3 {
                0 => value,
                1 if signed => value.clamp(-(1 << (width - 1)), (1 << (width - 1)) - 1),
                1 => value.clamp(0, (1 << width) - 1),
                _ => value >> 1,
            };
            result |= (value as u32 & mask) << (lane * width);
        }
        if kind & 3 == 0 {
            self.greater_equal = greater_equal;
        }
        self.r[(l >> 8 & 15) as usize] = result;
        Ok(())
    }

    /// QADD … QDSUB, REV, REV16, RBIT, REVSH, SEL, CLZ.
    pub(super) fn bit_operations(&mut self, h: u32, l: u32) -> Step {
        let (n, m) = (self.r[(h & 15) as usize], self.r[(l & 15) as usize]);
        let value = match (h >> 4 & 7, l >> 4 & 3) {
            (0, operation) => {
                let doubled = if bit(operation, 0) { self.saturate_sum(2 * i64::from(n as i32)) } else { i64::from(n as i32) };
                let m = i64::from(m as i32);
                self.saturate_sum(if bit(operation, 1) { m - doubled } else { m + doubled }) as u32
            }
            (1, 0) => m.swap_bytes(),
            (1, 1) => m.swap_bytes().rotate_right(16),
            (1, 2) => m.reverse_bits(),
            (1, _) => sign_extend(m.swap_bytes() >> 16, 16),
            (2, 0) => (0..4).fold(0, |value, lane| {
                let source = if self.greater_equal >> lane & 1 != 0 { n } else { m };
                value | source & 0xFF << (8 * lane)
            }),
            (3, 0) => m.leading_zeros(),
            _ => return Err(undefined(h, l)),
        };
        self.r[(l >> 8 & 15) as usize] = value;
        Ok(())
    }

    /// Saturates to 32 bits and sets Q.
    fn saturate_sum(&mut self, value: i64) -> i64 {
        let limited = value.clamp(i64::from(i32::MIN), i64::from(i32::MAX));
        self.saturated |= limited != value;
        limited
    }
}
