//! FPv4-SP: arithmetic, comparison and conversion (A6.4, pseudocode A2.5).
//!
//! NaN: a signalling operand before a quiet one, in the order of the operands (FPProcessNaNs, A2.5.4); FPSCR.DN gives the default NaN.
//! FPSCR.FZ flushes denormal operands and results to zero of the same sign.
use super::alu::bit;
use super::thumb32::undefined;
use super::{Core, Outcome};

const DEFAULT_NAN: u32 = 0x7fc0_0000;
const QUIET: u32 = 0x0040_0000;
const SIGN: u32 = 0x8000_0000;
const FPSCR_FLUSH: u32 = 1 << 24;
const FPSCR_DEFAULT_NAN: u32 = 1 << 25;
/// DDI 0439B table 7-1.
const DIVIDE_CYCLES: u32 = 14;
const MULTIPLY_ADD_CYCLES: u32 = 3;

fn is_nan(bits: u32) -> bool {
    bits & !SIGN > 0x7f80_0000
}

fn is_signalling(bits: u32) -> bool {
    is_nan(bits) && bits & QUIET == 0
}

impl Core {
    fn flush(&self, bits: u32) -> u32 {
        if self.fpscr & FPSCR_FLUSH != 0 && bits & 0x7f80_0000 == 0 { bits & SIGN } else { bits }
    }

    /// FPProcessNaNs: the NaN that the operands, in the order of the manual, give as a result.
    fn propagated_nan(&self, operands: &[u32]) -> Option<u32> {
        let nan =
            operands.iter().copied().find(|bits| is_signalling(*bits)).or_else(|| operands.iter().copied().find(|bits| is_nan(*bits)))?;
        Some(if self.fpscr & FPSCR_DEFAULT_NAN != 0 { DEFAULT_NAN } else { nan | QUIET })
    }

    /// A binary operation with the manual's NaN and flush rules.
    #[inline]
    fn float_operation(&self, a: u32, b: u32, operation: impl Fn(f32, f32) -> f32) -> u32 {
        let (a, b) = (self.flush(a), self.flush(b));
        let result = operation(f32::from_bits(a), f32::from_bits(b));
        if result.is_nan() { self.propagated_nan(&[a, b]).unwrap_or(DEFAULT_NAN) } else { self.flush(result.to_bits()) }
    }

    /// FPMulAdd: addend + a × b with one rounding. Infinity × 0 with a quiet NaN as addend gives the default NaN.
    fn fused_multiply_add(&self, addend: u32, a: u32, b: u32) -> u32 {
        let (addend, a, b) = (self.flush(addend), self.flush(a), self.flush(b));
        let (x, y) = (f32::from_bits(a), f32::from_bits(b));
        let result = x.mul_add(y, f32::from_bits(addend));
        if !result.is_nan() {
            return self.flush(result.to_bits());
        }
        let invalid_product = x.is_infinite() && y == 0.0 || x == 0.0 && y.is_infinite();
        if invalid_product && is_nan(addend) && !is_signalling(addend) {
            return DEFAULT_NAN;
        }
        self.propagated_nan(&[addend, a, b]).unwrap_or(DEFAULT_NAN)
    }

    /// Data processing (A6.4, table A6-4).
    pub(super) fn float_arithmetic(&mut self, first: u32, second: u32) -> Outcome {
        let d = ((second >> 12) << 1 | first >> 6 & 1) as usize;
        let (a, b) = (self.s[((first & 15) << 1 | second >> 7 & 1) as usize], self.s[((second & 15) << 1 | second >> 5 & 1) as usize]);
        let operation_bit = bit(second, 6);
        let target = self.s[d];
        let multiply = |core: &Self| core.float_operation(a, b, |x, y| x * y);
        let negated = |bits: u32, negate: bool| if negate { bits ^ SIGN } else { bits };
        let (result, cycles) = match (bit(first, 7), first >> 4 & 3) {
            // VMLA, VMLS; VNMLA (operation bit set), VNMLS; A7.7.232, A7.7.249
            (false, 0) => (self.float_operation(target, negated(multiply(self), operation_bit), |x, y| x + y), MULTIPLY_ADD_CYCLES),
            (false, 1) => (self.float_operation(target ^ SIGN, negated(multiply(self), operation_bit), |x, y| x + y), MULTIPLY_ADD_CYCLES),
            // VMUL, VNMUL
            (false, 2) => (negated(multiply(self), operation_bit), 1),
            (false, _) if operation_bit => (self.float_operation(a, b, |x, y| x - y), 1),
            (false, _) => (self.float_operation(a, b, |x, y| x + y), 1),
            (true, 0) if !operation_bit => (self.float_operation(a, b, |x, y| x / y), DIVIDE_CYCLES),
            // VFNMS, VFNMA (operation bit set); VFMA, VFMS; A7.7.229, A7.7.230: the signs change before the NaN rules apply.
            (true, 1) => (self.fused_multiply_add(target ^ SIGN, negated(a, operation_bit), b), MULTIPLY_ADD_CYCLES),
            (true, 2) => (self.fused_multiply_add(target, negated(a, operation_bit), b), MULTIPLY_ADD_CYCLES),
            (true, 3) if operation_bit => return self.float_unary(first, second, d, b),
            (true, 3) if second & 0xa0 == 0 => (expand_float_immediate((first & 15) << 4 | second & 15), 1),
            _ => return undefined(first, second),
        };
        self.s[d] = result;
        Ok(cycles)
    }

    /// Moves, square root, comparison and conversion (table A6-5).
    fn float_unary(&mut self, first: u32, second: u32, d: usize, b: u32) -> Outcome {
        let variant = bit(second, 7);
        let mut cycles = 1;
        self.s[d] = match (first & 15, variant) {
            (0, false) => b,
            (0, true) => b & !SIGN,
            (1, false) => b ^ SIGN,
            (1, true) => {
                cycles = DIVIDE_CYCLES;
                self.float_operation(b, b, |x, _| x.sqrt())
            }
            (4, _) => return Ok(self.float_compare(self.s[d], b)),
            (5, _) if second & 0x2f == 0 => return Ok(self.float_compare(self.s[d], 0)),
            (8, false) => (b as f32).to_bits(),
            (8, true) => (b as i32 as f32).to_bits(),
            (12, _) => self.rounded(b, variant) as u32,
            (13, _) => self.rounded(b, variant) as i32 as u32,
            (10 | 11 | 14 | 15, _) => match self.fixed_point(first, second, self.s[d]) {
                Some(result) => result,
                None => return undefined(first, second),
            },
            _ => return undefined(first, second),
        };
        Ok(cycles)
    }

    /// VCMP (A7.7.223): NZCV of FPSCR.
    fn float_compare(&mut self, a: u32, b: u32) -> u32 {
        let (x, y) = (f32::from_bits(self.flush(a)), f32::from_bits(self.flush(b)));
        let nzcv = match x.partial_cmp(&y) {
            None => 0b0011,
            Some(std::cmp::Ordering::Equal) => 0b0110,
            Some(std::cmp::Ordering::Less) => 0b1000,
            Some(std::cmp::Ordering::Greater) => 0b0010,
        };
        self.fpscr = self.fpscr & 0x0fff_ffff | nzcv << 28;
        1
    }

    /// The operand as an integer: toward zero, or by FPSCR.RMode (VCVTR, A7.7.226). The cast of the caller saturates and gives 0 for a NaN.
    fn rounded(&self, bits: u32, toward_zero: bool) -> f64 {
        let value = f64::from(f32::from_bits(self.flush(bits)));
        match (toward_zero, self.fpscr >> 22 & 3) {
            (false, 0) => value.round_ties_even(),
            (false, 1) => value.ceil(),
            (false, 2) => value.floor(),
            _ => value.trunc(),
        }
    }

    /// VCVT between float and fixed point (A7.7.227): `None` for more fraction bits than bits.
    fn fixed_point(&self, first: u32, second: u32, value: u32) -> Option<u32> {
        let (to_fixed, unsigned, wide) = (bit(first, 2), bit(first, 0), bit(second, 7));
        let size: u32 = if wide { 32 } else { 16 };
        let fraction_bits = size.checked_sub((second & 15) << 1 | second >> 5 & 1)?;
        let scale = (1u64 << fraction_bits) as f64;
        if to_fixed {
            let scaled = (f64::from(f32::from_bits(self.flush(value))) * scale).trunc();
            return Some(match (wide, unsigned) {
                (true, false) => scaled as i32 as u32,
                (true, true) => scaled as u32,
                (false, false) => scaled as i16 as u32,
                (false, true) => u32::from(scaled as u16),
            });
        }
        let integer = match (wide, unsigned) {
            (true, false) => f64::from(value as i32),
            (true, true) => f64::from(value),
            (false, false) => f64::from(value as i16),
            (false, true) => f64::from(value as u16),
        };
        Some(((integer / scale) as f32).to_bits())
    }
}

/// VFPExpandImm (A6.4.1).
fn expand_float_immediate(imm8: u32) -> u32 {
    let exponent = if bit(imm8, 6) { 0x1f } else { 0 };
    (imm8 >> 7) << 31 | (!(imm8 >> 6) & 1) << 30 | exponent << 25 | (imm8 & 0x3f) << 19
}
