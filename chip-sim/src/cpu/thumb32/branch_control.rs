//! Branches and miscellaneous control (A5.3.4).
use super::super::alu::{bit, sign_extend};
use super::super::{Core, Outcome};
use super::{bad_register, undefined};

impl Core {
    pub(super) fn branch_and_control(&mut self, first: u32, second: u32) -> Outcome {
        let sign = first >> 10 & 1;
        let (j1, j2) = (second >> 13 & 1, second >> 11 & 1);
        if bit(second, 12) {
            // B (encoding T4) and BL, A7.7.12 and A7.7.18: I1 = NOT(J1 EOR S), I2 = NOT(J2 EOR S).
            let (i1, i2) = (j1 ^ sign ^ 1, j2 ^ sign ^ 1);
            let offset = sign_extend(sign << 24 | i1 << 23 | i2 << 22 | (first & 0x3ff) << 12 | (second & 0x7ff) << 1, 25);
            if bit(second, 14) {
                self.r[14] = self.next_pc | 1;
            }
            return self.branch_to(self.pc().wrapping_add(offset));
        }
        if bit(second, 14) {
            return undefined(first, second);
        }
        if first >> 7 & 7 != 7 {
            // B (encoding T3), A7.7.12
            if !self.condition(first >> 6 & 15) {
                return Ok(1);
            }
            let offset = sign_extend(sign << 20 | j2 << 19 | j1 << 18 | (first & 0x3f) << 12 | (second & 0x7ff) << 1, 21);
            return self.branch_to(self.pc().wrapping_add(offset));
        }
        self.control_instruction(first, second)
    }

    /// MSR, MRS, hints, CLREX and barriers.
    fn control_instruction(&mut self, first: u32, second: u32) -> Outcome {
        match first >> 4 & 0x7f {
            0x38 => {
                // MSR, B5.2.3
                let n = first & 15;
                if bad_register(n) || self.write_special(second & 0xff, second >> 10 & 3, self.r[n as usize]).is_none() {
                    return undefined(first, second);
                }
                Ok(2)
            }
            0x3a if second & 0x700 == 0 => self.hint(second & 0xff),
            0x3b => match second >> 4 & 15 {
                2 => {
                    self.exclusive = None;
                    Ok(1)
                }
                // DSB, DMB, ISB: accesses complete in order here. DDI 0439B: 1 + cycles of the pipeline.
                4..=6 => Ok(2),
                _ => undefined(first, second),
            },
            0x3e if first & 15 == 15 => {
                // MRS, B5.2.2
                let d = second >> 8 & 15;
                match self.read_special(second & 0xff) {
                    Some(value) if !bad_register(d) => self.r[d as usize] = value,
                    _ => return undefined(first, second),
                }
                Ok(2)
            }
            _ => undefined(first, second),
        }
    }
}
