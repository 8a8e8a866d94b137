//! FPv4-SP: decoding, loads, stores and transfers (A6.4 to A6.7).
//!
//! The first floating-point instruction of a context sets CONTROL.FPCA and takes the modes of FPDSCR, which holds 0 after reset (B1.5.7).
use super::alu::bit;
use super::registers::CONTROL_FLOAT_ACTIVE;
use super::thumb32::undefined;
use super::{Bus, Core, Outcome, Width};

/// Writable bits of FPSCR (A2.5.2).
const FPSCR_MASK: u32 = 0xf7c0_009f;
/// FPSCR bits AHP, DN, FZ and RMode, which FPDSCR supplies.
const FPSCR_MODES: u32 = 0x07c0_0000;

impl Core {
    pub(super) fn float<B: Bus>(&mut self, bus: &mut B, first: u32, second: u32) -> Outcome {
        // 0xEF00 and above is Advanced SIMD of the A profile (A6.4: bits 11 to 8 are 1110).
        if second >> 9 & 7 != 5 || first >> 8 & 3 == 3 {
            return undefined(first, second);
        }
        if self.control & CONTROL_FLOAT_ACTIVE == 0 {
            self.fpscr &= !FPSCR_MODES;
            self.control |= CONTROL_FLOAT_ACTIVE;
        }
        match (bit(first, 9), bit(second, 4)) {
            (false, _) if first & 0x1e0 == 0x40 => self.float_transfer_64(first, second),
            (false, _) => self.float_load_store(bus, first, second),
            (true, true) => self.float_transfer_32(first, second),
            (true, false) if bit(second, 8) => undefined(first, second),
            (true, false) => self.float_arithmetic(first, second),
        }
    }

    /// VMOV between two core registers and one double or two single registers (A6.7).
    fn float_transfer_64(&mut self, first: u32, second: u32) -> Outcome {
        let (t, t2) = (second >> 12, first & 15);
        let m = if bit(second, 8) {
            (bit(second, 5) as usize) << 5 | ((second & 15) as usize) << 1
        } else {
            (second << 1 & 0x1e | second >> 5 & 1) as usize
        };
        let to_core = bit(first, 4);
        if second & 0xd0 != 0x10 || m > 30 || t == 15 || t2 == 15 || t == 13 || t2 == 13 || to_core && t == t2 {
            return undefined(first, second);
        }
        if to_core {
            self.r[t as usize] = self.s[m];
            self.r[t2 as usize] = self.s[m + 1];
        } else {
            self.s[m] = self.r[t as usize];
            self.s[m + 1] = self.r[t2 as usize];
        }
        Ok(2)
    }

    /// VLDR, VSTR, VLDM, VSTM, VPUSH, VPOP (A6.5).
    fn float_load_store<B: Bus>(&mut self, bus: &mut B, first: u32, second: u32) -> Outcome {
        let (n, load, double) = (first & 15, bit(first, 4), bit(second, 8));
        let (indexed, up, writes_back) = (bit(first, 8), bit(first, 7), bit(first, 5));
        let d = if double { (first >> 6 & 1) << 5 | (second >> 12) << 1 } else { (second >> 12) << 1 | first >> 6 & 1 };
        let (base, offset) = (self.base(n), (second & 0xff) * 4);
        let moved = if up { base.wrapping_add(offset) } else { base.wrapping_sub(offset) };
        let single_transfer = indexed && !writes_back;
        let count = match (single_transfer, double) {
            (true, false) => 1,
            (true, true) => 2,
            (false, false) => second & 0xff,
            (false, true) => second & 0xfe,
        };
        let valid =
            single_transfer && (load || n != 15) || !single_transfer && (indexed && !up && writes_back || !indexed && up) && n != 15;
        if !valid || count == 0 || d + count > 32 {
            return undefined(first, second);
        }
        let mut address = if indexed { moved } else { base };
        for register in &mut self.s[d as usize..(d + count) as usize] {
            if load {
                *register = bus.read(address, Width::Word);
            } else {
                bus.write(address, Width::Word, *register);
            }
            address = address.wrapping_add(4);
        }
        if writes_back {
            self.set_register(n, moved);
        }
        Ok(1 + count)
    }

    /// VMOV of one core register, VMRS, VMSR (A6.6).
    fn float_transfer_32(&mut self, first: u32, second: u32) -> Outcome {
        let (n, t, to_core) = (first & 15, second >> 12, bit(first, 4));
        if second & 0x6f != 0 {
            return undefined(first, second);
        }
        if bit(second, 8) {
            // VMOV between a core register and one word of a double register.
            let index = (bit(second, 7) as usize) << 5 | (n as usize) << 1 | bit(first, 5) as usize;
            if first & 0xc0 != 0 || index > 31 || t == 15 || t == 13 {
                return undefined(first, second);
            }
            if to_core {
                self.r[t as usize] = self.s[index];
            } else {
                self.s[index] = self.r[t as usize];
            }
            return Ok(1);
        }
        let index = (n << 1 | second >> 7 & 1) as usize;
        match (first >> 5 & 7, to_core) {
            (0, _) if t == 15 || t == 13 => return undefined(first, second),
            (0, true) => self.r[t as usize] = self.s[index],
            (0, false) => self.s[index] = self.r[t as usize],
            (7, true) if n == 1 && t == 15 => self.set_nzcv(self.fpscr),
            (7, true) if n == 1 && t != 13 => self.r[t as usize] = self.fpscr,
            (7, false) if n == 1 && t != 15 && t != 13 => self.fpscr = self.r[t as usize] & FPSCR_MASK,
            _ => return undefined(first, second),
        }
        Ok(1)
    }
}
