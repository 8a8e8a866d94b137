//! Multiplication and division (A5.3.16, A5.3.17).

use super::alu::bit;
use super::thumb32::undefined;
use super::{Core, Step};

/// The low or the high half, sign-extended.
fn half(x: u32, high: bool) -> i64 {
    if high { i64::from((x >> 16) as i16) } else { i64::from(x as i16) }
}

impl Core {
    /// MUL, MLA, MLS, SMLAxy, SMLAD, SMLSD, SMLAW, SMMLA, SMMLS, USADA8.
    pub(super) fn multiply(&mut self, h: u32, l: u32) -> Step {
        let (n, m) = (self.r[(h & 15) as usize], self.r[(l & 15) as usize]);
        let a = l >> 12;
        let accumulator = if a == 15 { 0 } else { self.r[a as usize] };
        let (first, second) = (bit(l, 5), bit(l, 4));
        let value = match h >> 4 & 7 {
            0 if !first && !second => accumulator.wrapping_add(n.wrapping_mul(m)),
            0 if second && !first => self.r[a as usize].wrapping_sub(n.wrapping_mul(m)),
            1 => self.accumulate(accumulator, half(n, first) * half(m, second)),
            kind @ (2 | 4) => {
                let m = if second { m.rotate_right(16) } else { m };
                let (low, high) = (half(n, false) * half(m, false), half(n, true) * half(m, true));
                self.accumulate(accumulator, if kind == 2 { low + high } else { low - high })
            }
            3 => self.accumulate(accumulator, (i64::from(n as i32) * half(m, second)) >> 16),
            kind @ (5 | 6) => {
                let product = i64::from(n as i32).wrapping_mul(i64::from(m as i32));
                let base = (u64::from(accumulator) << 32) as i64;
                let sum = if kind == 5 { base.wrapping_add(product) } else { base.wrapping_sub(product) };
                (sum.wrapping_add(if second { 0x8000_0000 } else { 0 }) >> 32) as u32
            }
            7 => (0..4).fold(accumulator, |sum, k| {
                let difference = (n >> (8 * k) & 0xFF) as i32 - (m >> (8 * k) & 0xFF) as i32;
                sum.wrapping_add(difference.unsigned_abs())
            }),
            _ => return Err(undefined(h, l)),
        };
        if a != 15 {
            self.extra_cycles = 1;
        }
        self.r[(l >> 8 & 15) as usize] = value;
        Ok(())
    }

    /// Adds to the accumulator and sets Q on overflow.
    fn accumulate(&mut self, accumulator: u32, product: i64) -> u32 {
        let sum = product + i64::from(accumulator as i32);
        self.saturated |= i64::from(sum as i32) != sum;
        sum as u32
    }

    /// SMULL, UMULL, SMLAL, UMLAL, UMAAL, SMLALxy, SMLALD, SMLSLD, SDIV, UDIV.
    pub(super) fn multiply_long(&mut self, h: u32, l: u32) -> Step {
        let (n, m) = (self.r[(h & 15) as usize], self.r[(l & 15) as usize]);
        let (low, high) = ((l >> 12) as usize, (l >> 8 & 15) as usize);
        let signed = |x: u32| i64::from(x as i32);
        let kind = (h >> 4 & 7, l >> 4 & 15);
        if let (1 | 3, 15) = kind {
            // 2 to 12 cycles, by the difference of the leading zeros.
            let bits = if kind.0 == 1 { ((n as i32).unsigned_abs(), (m as i32).unsigned_abs()) } else { (n, m) };
            self.extra_cycles = 1 + (bits.1.leading_zeros().saturating_sub(bits.0.leading_zeros())) / 3;
            self.r[high] = match (kind.0, m) {
                (_, 0) => 0,
                (1, _) => (n as i32).wrapping_div(m as i32) as u32,
                _ => n / m,
            };
            return Ok(());
        }
        if low == 15 || high == 15 {
            return Err(undefined(h, l));
        }
        let accumulator = u64::from(self.r[high]) << 32 | u64::from(self.r[low]);
        let result = match kind {
            (0, 0) => (signed(n) * signed(m)) as u64,
            (2, 0) => u64::from(n) * u64::from(m),
            (4, 0) => accumulator.wrapping_add((signed(n) * signed(m)) as u64),
            (6, 0) => accumulator.wrapping_add(u64::from(n) * u64::from(m)),
            (6, 6) => u64::from(n) * u64::from(m) + u64::from(self.r[high]) + u64::from(self.r[low]),
            (4, 8..=11) => accumulator.wrapping_add((half(n, bit(l, 5)) * half(m, bit(l, 4))) as u64),
            (kind @ (4 | 5), 12 | 13) => {
                let m = if bit(l, 4) { m.rotate_right(16) } else { m };
                let (bottom, top) = (half(n, false) * half(m, false), half(n, true) * half(m, true));
                accumulator.wrapping_add(if kind == 4 { bottom + top } else { bottom - top } as u64)
            }
            _ => return Err(undefined(h, l)),
        };
        self.r[low] = result as u32;
        self.r[high] = (result >> 32) as u32;
        Ok(())
    }
}
