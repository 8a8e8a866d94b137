//! Multiplication, long multiplication and division (A5.3.16, A5.3.17).
use super::super::alu::signed_half;
use super::super::{Core, Outcome};
use super::{bad_register, undefined};

impl Core {
    /// Products of 32 bits (A5.3.16); Ra = 15 adds nothing.
    pub(super) fn multiply(&mut self, first: u32, second: u32) -> Outcome {
        let (n, a, d, m) = (first & 15, second >> 12, second >> 8 & 15, second & 15);
        let (operation, variant) = (first >> 4 & 7, second >> 4 & 3);
        if second & 0xc0 != 0 || bad_register(n) || bad_register(d) || bad_register(m) || a == 13 {
            return undefined(first, second);
        }
        let (x, y) = (self.r[n as usize], self.r[m as usize]);
        let addend = if a == 15 { 0 } else { self.r[a as usize] };
        let (upper_x, upper_y) = (variant & 2 != 0, variant & 1 != 0);
        let swapped = if upper_y { y.rotate_right(16) } else { y };
        let product = i64::from(x as i32) * i64::from(y as i32);
        let rounding = if upper_y { 0x8000_0000 } else { 0 };
        let wide_addend = i64::from(addend as i32) << 32;
        let mut cycles = 1;
        let result = match (operation, variant) {
            (0, 0) => {
                // DDI 0439B table 3-1: MUL 1 cycle, MLA and MLS 2.
                cycles = if a == 15 { 1 } else { 2 };
                addend.wrapping_add(x.wrapping_mul(y))
            }
            (0, 1) if a != 15 => {
                cycles = 2;
                addend.wrapping_sub(x.wrapping_mul(y))
            }
            (1, _) => self.accumulate(addend, signed_half(x, upper_x) * signed_half(y, upper_y)),
            (2, 0 | 1) => self.accumulate(
                addend,
                signed_half(x, false) * signed_half(swapped, false) + signed_half(x, true) * signed_half(swapped, true),
            ),
            (3, 0 | 1) => self.accumulate(addend, (i64::from(x as i32) * signed_half(y, upper_y)) >> 16),
            (4, 0 | 1) => self.accumulate(
                addend,
                signed_half(x, false) * signed_half(swapped, false) - signed_half(x, true) * signed_half(swapped, true),
            ),
            (5, 0 | 1) => (wide_addend.wrapping_add(product).wrapping_add(rounding) >> 32) as u32,
            (6, 0 | 1) if a != 15 => (wide_addend.wrapping_sub(product).wrapping_add(rounding) >> 32) as u32,
            (7, 0) => {
                x.to_le_bytes().into_iter().zip(y.to_le_bytes()).fold(addend, |sum, (p, q)| sum.wrapping_add(u32::from(p.abs_diff(q))))
            }
            _ => return undefined(first, second),
        };
        self.r[d as usize] = result;
        Ok(cycles)
    }

    /// Adds a product; Q reports a sum beyond 32 bits, the sum wraps.
    fn accumulate(&mut self, addend: u32, product: i64) -> u32 {
        let sum = product + i64::from(addend as i32);
        self.saturated |= i64::from(sum as i32) != sum;
        sum as u32
    }

    /// Products of 64 bits and division (A5.3.17). Division by zero gives 0 (CCR.DIV_0_TRP is clear after reset).
    pub(super) fn long_multiply_divide(&mut self, first: u32, second: u32) -> Outcome {
        let (n, low, high, m) = (first & 15, second >> 12, second >> 8 & 15, second & 15);
        let (operation, variant) = (first >> 4 & 7, second >> 4 & 15);
        if bad_register(n) || bad_register(high) || bad_register(m) {
            return undefined(first, second);
        }
        let (x, y) = (self.r[n as usize], self.r[m as usize]);
        if let (1 | 3, 15) = (operation, variant) {
            if low != 15 {
                return undefined(first, second);
            }
            let signed = operation == 1;
            self.r[high as usize] = match (y, signed) {
                (0, _) => 0,
                (_, true) => (x as i32).wrapping_div(y as i32) as u32,
                (_, false) => x / y,
            };
            return Ok(divide_cycles(x, y, signed));
        }
        if bad_register(low) || low == high {
            return undefined(first, second);
        }
        let (low, high) = (low as usize, high as usize);
        let sum = u64::from(self.r[high]) << 32 | u64::from(self.r[low]);
        let signed_product = (i64::from(x as i32) * i64::from(y as i32)) as u64;
        let product = u64::from(x) * u64::from(y);
        let swapped = if variant & 1 != 0 { y.rotate_right(16) } else { y };
        let dual = |subtract: bool| {
            let (p, q) = (signed_half(x, false) * signed_half(swapped, false), signed_half(x, true) * signed_half(swapped, true));
            (if subtract { p - q } else { p + q }) as u64
        };
        let result = match (operation, variant) {
            (0, 0) => signed_product,
            (2, 0) => product,
            (4, 0) => sum.wrapping_add(signed_product),
            (4, 8..=11) => sum.wrapping_add((signed_half(x, variant & 2 != 0) * signed_half(y, variant & 1 != 0)) as u64),
            (4 | 5, 12 | 13) => sum.wrapping_add(dual(operation == 5)),
            (6, 0) => sum.wrapping_add(product),
            // UMAAL (A7.7.203) cannot overflow: (2^32 − 1)² + 2 (2^32 − 1) = 2^64 − 1.
            (6, 6) => product + u64::from(self.r[high]) + u64::from(self.r[low]),
            _ => return undefined(first, second),
        };
        self.r[low] = result as u32;
        self.r[high] = (result >> 32) as u32;
        Ok(1)
    }
}

/// Cycles of a division: 2 to 12 by the difference of leading zeros (DDI 0439B table 3-1, note d).
fn divide_cycles(x: u32, y: u32, signed: bool) -> u32 {
    let magnitude = |v: u32| if signed { (v as i32).unsigned_abs() } else { v };
    let (x, y) = (magnitude(x), magnitude(y));
    if y == 0 || x < y { 2 } else { (3 + (y.leading_zeros() - x.leading_zeros()) / 4).min(12) }
}
