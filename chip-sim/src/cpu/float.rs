//! FPv4-SP: single precision (A6, A2.5). Arithmetic is IEEE 754 with rounding to nearest, as the stand's program leaves FPSCR; other rounding modes
//! act on conversions to integers only, flush-to-zero and the exception flags of FPSCR are not modelled.

use super::alu::bit;
use super::thumb32::undefined;
use super::{Bus, CONTROL_FPCA, Core, Step, Width};

/// The quiet NaN that results from operands without a NaN.
const DEFAULT_NAN: u32 = 0x7FC0_0000;
/// The bit that makes a NaN quiet.
const QUIET: u32 = 0x0040_0000;
const SIGN: u32 = 0x8000_0000;
/// Cycles of VDIV and VSQRT above one (DDI 0439B, table 7-1).
const DIVIDE_CYCLES: u32 = 13;
/// Cycles of chained multiplication and addition above one.
const MULTIPLY_ADD_CYCLES: u32 = 2;

/// The result of an operation on `a` and `b`: a NaN operand passes through, quiet (A2.5.3).
fn nan_rule(result: f32, a: f32, b: f32) -> f32 {
    if !result.is_nan() {
        return result;
    }
    let is_signalling = |x: f32| x.is_nan() && x.to_bits() & QUIET == 0;
    let source = [a, b].into_iter().find(|x| is_signalling(*x)).or_else(|| [a, b].into_iter().find(|x| x.is_nan()));
    f32::from_bits(source.map_or(DEFAULT_NAN, |x| x.to_bits() | QUIET))
}

fn add(a: f32, b: f32) -> f32 {
    nan_rule(a + b, a, b)
}

fn multiply(a: f32, b: f32) -> f32 {
    nan_rule(a * b, a, b)
}

/// FPNeg changes the sign of a NaN too.
fn negate(x: f32) -> f32 {
    f32::from_bits(x.to_bits() ^ SIGN)
}

/// FPMulAdd: `addend` + a·b with one rounding.
fn fused(addend: f32, a: f32, b: f32) -> f32 {
    let result = libm::fmaf(a, b, addend);
    if !result.is_nan() {
        return result;
    }
    let is_signalling = |x: &f32| x.is_nan() && x.to_bits() & QUIET == 0;
    let operands = [addend, a, b];
    let source = operands.iter().find(|x| is_signalling(x)).or_else(|| operands.iter().find(|x| x.is_nan()));
    f32::from_bits(source.map_or(DEFAULT_NAN, |x| x.to_bits() | QUIET))
}

impl Core {
    /// Coprocessor instructions: the FPU's, or undefined.
    #[inline]
    pub(super) fn floating_point<B: Bus>(&mut self, bus: &mut B, h: u32, l: u32) -> Step {
        if l >> 9 & 7 != 5 {
            return Err(undefined(h, l));
        }
        self.control |= CONTROL_FPCA;
        match (bit(h, 9), bit(l, 4)) {
            (false, _) => self.float_load_store(bus, h, l),
            (true, true) => self.float_transfer(h, l),
            (true, false) if bit(l, 8) => Err(undefined(h, l)), // double precision
            (true, false) => self.float_arithmetic(h, l),
        }
    }

    /// VLDR, VSTR, VLDM, VSTM, VPUSH, VPOP, VMOV between two core registers and two singles (A6.6, A6.7).
    fn float_load_store<B: Bus>(&mut self, bus: &mut B, h: u32, l: u32) -> Step {
        let double = bit(l, 8);
        let n = h & 15;
        if h & 0x1E0 == 0x040 {
            let first = if double { ((l >> 5 & 1) << 4 | l & 15) * 2 } else { (l & 15) << 1 | l >> 5 & 1 } as usize;
            let (t, t2) = ((l >> 12) as usize, n as usize);
            if first + 1 >= self.s.len() {
                return Err(undefined(h, l));
            }
            self.extra_cycles = 1;
            if bit(h, 4) {
                self.r[t] = self.s[first];
                self.r[t2] = self.s[first + 1];
            } else {
                self.s[first] = self.r[t];
                self.s[first + 1] = self.r[t2];
            }
            return Ok(());
        }
        let first = if double { ((h >> 6 & 1) << 4 | l >> 12) * 2 } else { (l >> 12) << 1 | h >> 6 & 1 } as usize;
        let base = if n == 15 { self.literal_base() } else { self.r[n as usize] };
        let offset = (l & 0xFF) * 4;
        let moved = if bit(h, 7) { base.wrapping_add(offset) } else { base.wrapping_sub(offset) };
        let is_single_access = bit(h, 8) && !bit(h, 5);
        let (mut address, count) = if is_single_access {
            (moved, if double { 2 } else { 1 })
        } else {
            // The odd count of FLDMX is not in use.
            (if bit(h, 8) { moved } else { base }, (l & 0xFF & if double { !1 } else { !0 }) as usize)
        };
        if first + count > self.s.len() {
            return Err(undefined(h, l));
        }
        for register in first..first + count {
            if bit(h, 4) {
                self.s[register] = bus.read(address, Width::Word);
            } else {
                bus.write(address, Width::Word, self.s[register]);
            }
            address = address.wrapping_add(4);
            self.extra_cycles += 1;
        }
        if bit(h, 5) {
            self.r[n as usize] = moved;
        }
        Ok(())
    }

    /// VMOV of one register or scalar, VMRS, VMSR (A6.6).
    fn float_transfer(&mut self, h: u32, l: u32) -> Step {
        let t = (l >> 12) as usize;
        let to_core = bit(h, 4);
        if bit(l, 8) {
            let scalar = (((l >> 7 & 1) << 4 | h & 15) * 2 + (h >> 5 & 1)) as usize;
            return self.move_scalar(scalar, t, to_core, h, l);
        }
        match h >> 5 & 7 {
            0 => self.move_scalar(((h & 15) << 1 | l >> 7 & 1) as usize, t, to_core, h, l),
            7 if h & 15 == 1 && to_core && t == 15 => {
                let flags = self.fpscr;
                self.negative = bit(flags, 31);
                self.zero = bit(flags, 30);
                self.carry = bit(flags, 29);
                self.overflow = bit(flags, 28);
                Ok(())
            }
            7 if h & 15 == 1 && to_core => {
                self.r[t] = self.fpscr;
                Ok(())
            }
            7 if h & 15 == 1 => {
                self.fpscr = self.r[t] & 0xF7C0_009F;
                Ok(())
            }
            _ => Err(undefined(h, l)),
        }
    }

    fn move_scalar(&mut self, register: usize, t: usize, to_core: bool, h: u32, l: u32) -> Step {
        let Some(scalar) = self.s.get_mut(register) else { return Err(undefined(h, l)) };
        if to_core {
            self.r[t] = *scalar;
        } else {
            *scalar = self.r[t];
        }
        Ok(())
    }

    /// Data processing (A6.4).
    #[inline]
    fn float_arithmetic(&mut self, h: u32, l: u32) -> Step {
        let d = ((l >> 12) << 1 | h >> 6 & 1) as usize;
        let n = ((h & 15) << 1 | l >> 7 & 1) as usize;
        let m = ((l & 15) << 1 | l >> 5 & 1) as usize;
        let (a, b, old) = (f32::from_bits(self.s[n]), f32::from_bits(self.s[m]), f32::from_bits(self.s[d]));
        let variant = bit(l, 6);
        let result = match (h >> 7 & 1, h >> 4 & 3) {
            (0, 0) => {
                // VMLA, VMLS: two roundings
                self.extra_cycles = MULTIPLY_ADD_CYCLES;
                let product = multiply(a, b);
                add(old, if variant { negate(product) } else { product })
            }
            (0, 1) => {
                // VNMLS, VNMLA
                self.extra_cycles = MULTIPLY_ADD_CYCLES;
                let product = multiply(a, b);
                add(negate(old), if variant { negate(product) } else { product })
            }
            (0, 2) => {
                let product = multiply(a, b);
                if variant { negate(product) } else { product }
            }
            (0, _) => {
                if variant {
                    nan_rule(a - b, a, b)
                } else {
                    add(a, b)
                }
            }
            (_, 0) if !variant => {
                self.extra_cycles = DIVIDE_CYCLES;
                nan_rule(a / b, a, b)
            }
            (_, 0) => return Err(undefined(h, l)),
            (_, 1) => {
                // VFNMS, VFNMA
                self.extra_cycles = MULTIPLY_ADD_CYCLES;
                fused(negate(old), if variant { negate(a) } else { a }, b)
            }
            (_, 2) => {
                // VFMA, VFMS
                self.extra_cycles = MULTIPLY_ADD_CYCLES;
                fused(old, if variant { negate(a) } else { a }, b)
            }
            (_, _) => return self.float_other(h, l, d, m),
        };
        self.s[d] = result.to_bits();
        Ok(())
    }

    /// VMOV, VABS, VNEG, VSQRT, VCMP, VCVT (A6.4, table A6-4).
    fn float_other(&mut self, h: u32, l: u32, d: usize, m: usize) -> Step {
        let b = f32::from_bits(self.s[m]);
        if !bit(l, 6) {
            // VFPExpandImm
            let immediate = (h & 15) << 4 | l & 15;
            let exponent = if bit(immediate, 6) { 0x1F } else { 0 };
            self.s[d] = (immediate >> 7) << 31 | u32::from(!bit(immediate, 6)) << 30 | exponent << 25 | (immediate & 0x3F) << 19;
            return Ok(());
        }
        let variant = bit(l, 7);
        self.s[d] = match h & 15 {
            0 if variant => b.to_bits() & !SIGN,
            0 => b.to_bits(),
            1 if variant => {
                self.extra_cycles = DIVIDE_CYCLES;
                nan_rule(b.sqrt(), b, b).to_bits()
            }
            1 => b.to_bits() ^ SIGN,
            4 => return self.compare(f32::from_bits(self.s[d]), b),
            5 => return self.compare(f32::from_bits(self.s[d]), 0.0),
            8 if variant => (self.s[m] as i32 as f32).to_bits(),
            8 => (self.s[m] as f32).to_bits(),
            kind @ (12 | 13) => {
                let x = f64::from(b);
                let rounded = if variant { x.trunc() } else { self.round(x) };
                if kind == 13 { rounded as i32 as u32 } else { rounded as u32 }
            }
            kind @ (10 | 11 | 14 | 15) => self.convert_fixed(kind, l, self.s[d]),
            _ => return Err(undefined(h, l)),
        };
        Ok(())
    }

    /// VCMP: the flags of FPSCR.
    fn compare(&mut self, a: f32, b: f32) -> Step {
        let flags = if a.is_nan() || b.is_nan() {
            0b0011
        } else if a == b {
            0b0110
        } else if a < b {
            0b1000
        } else {
            0b0010
        };
        self.fpscr = self.fpscr & 0x0FFF_FFFF | flags << 28;
        Ok(())
    }

    /// Rounding by FPSCR.RMode.
    fn round(&self, x: f64) -> f64 {
        match self.fpscr >> 22 & 3 {
            0 => x.round_ties_even(),
            1 => x.ceil(),
            2 => x.floor(),
            _ => x.trunc(),
        }
    }

    /// VCVT between floating point and fixed point of 16 or 32 bits.
    fn convert_fixed(&self, kind: u32, l: u32, value: u32) -> u32 {
        let wide = bit(l, 7);
        let size = if wide { 32 } else { 16 };
        let fraction_bits = size - ((l & 15) << 1 | l >> 5 & 1) as i32;
        let scale = libm::ldexp(1.0, fraction_bits);
        let scaled = (f64::from(f32::from_bits(value)) * scale).trunc();
        match (kind, wide) {
            (10, false) => ((f64::from(value as i16) / scale) as f32).to_bits(),
            (10, true) => ((f64::from(value as i32) / scale) as f32).to_bits(),
            (11, false) => ((f64::from(value as u16) / scale) as f32).to_bits(),
            (11, true) => ((f64::from(value) / scale) as f32).to_bits(),
            (14, false) => i32::from(scaled as i16) as u32,
            (14, true) => scaled as i32 as u32,
            (_, false) => u32::from(scaled as u16),
            (_, true) => scaled as u32,
        }
    }
}
