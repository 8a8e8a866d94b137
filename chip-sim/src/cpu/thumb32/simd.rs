//! Parallel addition and subtraction (A5.3.13, A5.3.14) and miscellaneous operations (A5.3.15).
use super::super::alu::sign_extend;
use super::super::{Core, Outcome};
use super::{bad_register, undefined};

impl Core {
    /// ADD8, ADD16, ASX, SUB8, SUB16, SAX with the prefixes S, Q, SH, U, UQ, UH.
    pub(super) fn parallel_add_subtract(&mut self, first: u32, second: u32) -> Outcome {
        let (n, d, m) = (first & 15, second >> 8 & 15, second & 15);
        let (operation, prefix) = (first >> 4 & 7, second >> 4 & 7);
        let (signed, treatment) = (prefix < 4, prefix & 3);
        if bad_register(n) || treatment == 3 || operation & 3 == 3 {
            return undefined(first, second);
        }
        let exchanges = operation & 3 == 2;
        let width = if operation & 3 == 0 { 8 } else { 16 };
        let mask = (1u32 << width) - 1;
        let a = self.r[n as usize];
        let b = self.r[m as usize].rotate_right(if exchanges { 16 } else { 0 });
        let (mut result, mut ge) = (0, 0);
        for lane in 0..32 / width {
            let element = |value: u32| {
                let field = value >> (lane * width) & mask;
                (if signed { sign_extend(field, width) } else { field }) as i32
            };
            // ASX subtracts in the lower lane and adds in the upper, SAX the reverse.
            let subtracts = if exchanges { (operation == 2) == (lane == 0) } else { operation & 4 != 0 };
            let value = if subtracts { element(a) - element(b) } else { element(a) + element(b) };
            let flag = if signed || subtracts { value >= 0 } else { value >> width != 0 };
            if flag {
                ge |= if width == 8 { 1 << lane } else { 3 << (2 * lane) };
            }
            let treated = match (treatment, signed) {
                (0, _) => value,
                (1, true) => value.clamp(-(1 << (width - 1)), (1 << (width - 1)) - 1),
                (1, false) => value.clamp(0, mask as i32),
                _ => value >> 1,
            };
            result |= (treated as u32 & mask) << (lane * width);
        }
        if treatment == 0 {
            self.ge = ge;
        }
        self.r[d as usize] = result;
        Ok(1)
    }

    /// QADD, QDADD, QSUB, QDSUB, REV, REV16, RBIT, REVSH, SEL, CLZ.
    pub(super) fn miscellaneous(&mut self, first: u32, second: u32) -> Outcome {
        let (n, d, m) = (first & 15, second >> 8 & 15, second & 15);
        let (group, variant) = (first >> 4 & 7, second >> 4 & 3);
        if bad_register(n) || second & 0x40 != 0 || matches!(group, 1 | 3) && n != m {
            return undefined(first, second);
        }
        let (x, y) = (self.r[n as usize], self.r[m as usize]);
        self.r[d as usize] = match (group, variant) {
            (0, _) => {
                let doubled = if variant & 1 != 0 { self.saturate_word(2 * i64::from(x as i32)) } else { x };
                let (augend, addend) = (i64::from(y as i32), i64::from(doubled as i32));
                self.saturate_word(if variant & 2 != 0 { augend - addend } else { augend + addend })
            }
            (1, 0) => y.swap_bytes(),
            (1, 1) => y.swap_bytes().rotate_right(16),
            (1, 2) => y.reverse_bits(),
            (1, _) => sign_extend(y.swap_bytes() >> 16, 16),
            (2, 0) => {
                let mask = (0..4).filter(|lane| self.ge >> lane & 1 != 0).fold(0, |mask, lane| mask | 0xffu32 << (8 * lane));
                x & mask | y & !mask
            }
            (3, 0) => y.leading_zeros(),
            _ => return undefined(first, second),
        };
        Ok(1)
    }

    /// Signed saturation to 32 bits; sets Q.
    fn saturate_word(&mut self, value: i64) -> u32 {
        let clamped = value.clamp(i64::from(i32::MIN), i64::from(i32::MAX));
        self.saturated |= clamped != value;
        clamped as u32
    }
}
