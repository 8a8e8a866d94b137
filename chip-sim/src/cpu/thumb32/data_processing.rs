//! Data processing with a modified immediate (A5.3.1), a shifted register (A5.3.11) and a plain immediate (A5.3.3).
use super::super::alu::{bit, expand_immediate, shift_amount, shift_immediate, sign_extend};
use super::super::{Core, Outcome};
use super::{bad_register, undefined};

impl Core {
    /// Modified immediate, A5.3.1.
    pub(super) fn data_processing_immediate(&mut self, first: u32, second: u32) -> Outcome {
        let (operand, carry) = expand_immediate(immediate_12(first, second), self.carry);
        self.data_processing(first, second, operand, carry)
    }

    /// Shifted register, A5.3.11.
    pub(super) fn data_processing_register(&mut self, first: u32, second: u32) -> Outcome {
        let (n, d, m) = (first & 15, second >> 8 & 15, second & 15);
        let is_move = first & 0x1ef == 0x4f;
        if m == 15 || m == 13 && !is_move || bit(second, 15) {
            return undefined(first, second);
        }
        let (operand, carry) = shift_immediate(self.r[m as usize], second >> 4 & 3, shift_amount(second), self.carry);
        if first >> 5 & 15 == 6 {
            // PKHBT and PKHTB, A7.7.93
            if bit(first, 4) || bit(second, 4) || bad_register(d) || bad_register(n) {
                return undefined(first, second);
            }
            let other = self.r[n as usize];
            self.r[d as usize] =
                if bit(second, 5) { other & 0xffff_0000 | operand & 0xffff } else { other & 0xffff | operand & 0xffff_0000 };
            return Ok(1);
        }
        self.data_processing(first, second, operand, carry)
    }

    /// The operation in bits 8 to 5 of the first halfword; Rd = 15 with S is the comparing form, Rn = 15 the moving form.
    #[inline]
    fn data_processing(&mut self, first: u32, second: u32, operand: u32, carry: bool) -> Outcome {
        let (n, d) = (first & 15, second >> 8 & 15);
        let (operation, set_flags) = (first >> 5 & 15, bit(first, 4));
        let arithmetic = matches!(operation, 8 | 13);
        let moves = matches!(operation, 2 | 3) && n == 15;
        let compares = d == 15 && set_flags && matches!(operation, 0 | 4 | 8 | 13);
        if n == 15 && !moves
            || n == 13 && !arithmetic
            || d == 15 && !compares
            || d == 13 && !(arithmetic && n == 13 || operation == 2 && moves)
        {
            return undefined(first, second);
        }
        let a = self.r[n as usize];
        let result = match operation {
            8 => self.add(a, operand, false, set_flags),
            10 => self.add(a, operand, self.carry, set_flags),
            11 => self.add(a, !operand, self.carry, set_flags),
            13 => self.add(a, !operand, true, set_flags),
            14 => self.add(!a, operand, true, set_flags),
            _ => {
                let value = match operation {
                    0 => a & operand,
                    1 => a & !operand,
                    2 if moves => operand,
                    2 => a | operand,
                    3 if moves => !operand,
                    3 => a | !operand,
                    4 => a ^ operand,
                    _ => return undefined(first, second),
                };
                if set_flags {
                    self.set_nz(value);
                    self.carry = carry;
                }
                value
            }
        };
        if !compares {
            self.set_register(d, result);
        }
        Ok(1)
    }

    /// Plain binary immediate: ADR, ADDW, SUBW, MOVW, MOVT, saturation and bit fields (A5.3.3).
    pub(super) fn plain_immediate(&mut self, first: u32, second: u32) -> Outcome {
        let (n, d) = (first & 15, second >> 8 & 15);
        let operation = first >> 4 & 31;
        if d == 15 || d == 13 && !(matches!(operation, 0 | 10) && n == 13) {
            return undefined(first, second);
        }
        // Bit 10 of the first and bit 5 of the second halfword are zero in saturation and bit fields.
        if operation >= 16 && (bit(first, 10) || bit(second, 5)) {
            return undefined(first, second);
        }
        let immediate = immediate_12(first, second);
        let lsb = shift_amount(second);
        let target = self.r[d as usize];
        let result = match operation {
            0 => self.base(n).wrapping_add(immediate),
            10 => self.base(n).wrapping_sub(immediate),
            4 => n << 12 | immediate,
            12 => target & 0xffff | (n << 12 | immediate) << 16,
            22 => {
                // BFI and BFC, A7.7.14 and A7.7.13
                let msb = second & 31;
                if msb < lsb || n == 13 {
                    return undefined(first, second);
                }
                let mask = (u32::MAX >> (31 - (msb - lsb))) << lsb;
                let source = if n == 15 { 0 } else { self.r[n as usize] };
                target & !mask | source << lsb & mask
            }
            _ if bad_register(n) => return undefined(first, second),
            20 | 28 => {
                // SBFX and UBFX, A7.7.125 and A7.7.192
                let width = (second & 31) + 1;
                if lsb + width > 32 {
                    return undefined(first, second);
                }
                let field = self.r[n as usize] << (32 - lsb - width);
                if operation == 20 { (field as i32 >> (32 - width)) as u32 } else { field >> (32 - width) }
            }
            18 | 26 if lsb == 0 => {
                // SSAT16 and USAT16, A7.7.152 and A7.7.213
                let (source, bits) = (self.r[n as usize], second & 15);
                let mut half = |value: u32| self.saturate(i64::from(value as i16), operation == 26, bits) & 0xffff;
                half(source) | half(source >> 16) << 16
            }
            16 | 18 | 24 | 26 => {
                // SSAT and USAT, A7.7.151 and A7.7.212
                let value = shift_immediate(self.r[n as usize], u32::from(bit(first, 5)) * 2, lsb, false).0;
                self.saturate(i64::from(value as i32), operation >= 24, second & 31)
            }
            _ => return undefined(first, second),
        };
        self.set_register(d, result);
        Ok(1)
    }

    /// SatQ (A2.2.1) with the field of the encoding: 0 to 2^bits − 1, or −2^bits to 2^bits − 1. Sets Q.
    fn saturate(&mut self, value: i64, unsigned: bool, bits: u32) -> u32 {
        let limit = 1i64 << bits;
        let clamped = value.clamp(if unsigned { 0 } else { -limit }, limit - 1);
        self.saturated |= clamped != value;
        clamped as u32
    }

    /// Register shifts, extensions, and the groups of A5.3.13 to A5.3.15.
    pub(super) fn shift_extend_simd(&mut self, first: u32, second: u32) -> Outcome {
        let (n, d, m) = (first & 15, second >> 8 & 15, second & 15);
        if second >> 12 != 15 || bad_register(d) || bad_register(m) {
            return undefined(first, second);
        }
        if bit(first, 7) {
            return if bit(second, 7) { self.miscellaneous(first, second) } else { self.parallel_add_subtract(first, second) };
        }
        if bit(second, 7) { self.extend(first, second) } else { self.shift_register(first, second, n, d, m) }
    }

    /// LSL, LSR, ASR, ROR (register), A5.3.12.
    fn shift_register(&mut self, first: u32, second: u32, n: u32, d: u32, m: u32) -> Outcome {
        if second & 0x70 != 0 || bad_register(n) {
            return undefined(first, second);
        }
        let (value, carry) = super::super::alu::shift(self.r[n as usize], first >> 5 & 3, self.r[m as usize] & 0xff, self.carry);
        if bit(first, 4) {
            self.set_nz(value);
            self.carry = carry;
        }
        self.r[d as usize] = value;
        Ok(1)
    }

    /// SXTB, UXTB, SXTH, UXTH, SXTB16, UXTB16 and their adding forms (A5.3.12); Rn = 15 adds nothing.
    fn extend(&mut self, first: u32, second: u32) -> Outcome {
        let (n, d, m) = (first & 15, second >> 8 & 15, second & 15);
        if bit(second, 6) || n == 13 {
            return undefined(first, second);
        }
        let addend = if n == 15 { 0 } else { self.r[n as usize] };
        let value = self.r[m as usize].rotate_right(8 * (second >> 4 & 3));
        let bytes = |signed: bool| {
            let byte = |x: u32| if signed { sign_extend(x & 0xff, 8) } else { x & 0xff };
            addend.wrapping_add(byte(value)) & 0xffff | (addend >> 16).wrapping_add(byte(value >> 16)) << 16
        };
        self.r[d as usize] = match first >> 4 & 7 {
            0 => addend.wrapping_add(sign_extend(value & 0xffff, 16)),
            1 => addend.wrapping_add(value & 0xffff),
            2 => bytes(true),
            3 => bytes(false),
            4 => addend.wrapping_add(sign_extend(value & 0xff, 8)),
            5 => addend.wrapping_add(value & 0xff),
            _ => return undefined(first, second),
        };
        Ok(1)
    }
}

/// The field i:imm3:imm8.
#[inline(always)]
fn immediate_12(first: u32, second: u32) -> u32 {
    (first >> 10 & 1) << 11 | (second >> 12 & 7) << 8 | second & 0xff
}
