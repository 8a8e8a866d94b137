//! Program status, conditions, writes of R13 and R15, special registers (A2.3, A7.3, B1.4).
use super::alu::{add_with_carry, bit};
use super::{BRANCH_CYCLES, Core, Event, Outcome};

/// CONTROL.nPRIV.
const CONTROL_UNPRIVILEGED: u32 = 1;
/// CONTROL.SPSEL.
pub(super) const CONTROL_PROCESS_STACK: u32 = 2;
/// CONTROL.FPCA.
pub(super) const CONTROL_FLOAT_ACTIVE: u32 = 4;
/// Priority bits that the F446 implements (PM0214 section 4.4: 16 levels).
const BASEPRI_MASK: u8 = 0xf0;

impl Core {
    /// The combined program status register (B1.4.2); EPSR.T reads as 1.
    pub fn xpsr(&self) -> u32 {
        let it_state = u32::from(self.it_state);
        self.apsr() | self.ipsr | 1 << 24 | (it_state >> 2) << 10 | (it_state & 3) << 25
    }

    /// Sets flags, exception number and ITSTATE from a stacked xPSR.
    pub fn set_xpsr(&mut self, xpsr: u32) {
        self.set_apsr_flags(xpsr);
        self.ge = (xpsr >> 16 & 15) as u8;
        self.ipsr = xpsr & 0x1ff;
        self.it_state = (xpsr >> 25 & 3 | (xpsr >> 10 & 0x3f) << 2) as u8;
    }

    /// The stack pointer of the main stack.
    pub fn main_stack_pointer(&self) -> u32 {
        if self.uses_process_stack() { self.banked_stack_pointer } else { self.r[13] }
    }

    /// The stack pointer of the process stack.
    pub fn process_stack_pointer(&self) -> u32 {
        if self.uses_process_stack() { self.r[13] } else { self.banked_stack_pointer }
    }

    pub(super) fn uses_process_stack(&self) -> bool {
        self.control & CONTROL_PROCESS_STACK != 0 && self.ipsr == 0
    }

    fn privileged(&self) -> bool {
        self.ipsr != 0 || self.control & CONTROL_UNPRIVILEGED == 0
    }

    fn apsr(&self) -> u32 {
        let flag = |set: bool, n: u32| u32::from(set) << n;
        flag(self.negative, 31)
            | flag(self.zero, 30)
            | flag(self.carry, 29)
            | flag(self.overflow, 28)
            | flag(self.saturated, 27)
            | u32::from(self.ge) << 16
    }

    pub(super) fn set_nzcv(&mut self, bits: u32) {
        self.negative = bit(bits, 31);
        self.zero = bit(bits, 30);
        self.carry = bit(bits, 29);
        self.overflow = bit(bits, 28);
    }

    fn set_apsr_flags(&mut self, bits: u32) {
        self.set_nzcv(bits);
        self.saturated = bit(bits, 27);
    }

    /// ConditionPassed (A7.3) for a field of four bits.
    #[inline]
    pub(super) fn condition(&self, field: u32) -> bool {
        let holds = match field >> 1 {
            0 => self.zero,
            1 => self.carry,
            2 => self.negative,
            3 => self.overflow,
            4 => self.carry && !self.zero,
            5 => self.negative == self.overflow,
            6 => !self.zero && self.negative == self.overflow,
            _ => return true,
        };
        holds ^ (field & 1 != 0)
    }

    #[inline(always)]
    pub(super) fn set_nz(&mut self, value: u32) {
        self.negative = value >> 31 != 0;
        self.zero = value == 0;
    }

    /// AddWithCarry that sets the flags when `set_flags`.
    #[inline(always)]
    pub(super) fn add(&mut self, a: u32, b: u32, carry: bool, set_flags: bool) -> u32 {
        let (sum, carry_out, overflow) = add_with_carry(a, b, carry);
        if set_flags {
            self.set_nz(sum);
            self.carry = carry_out;
            self.overflow = overflow;
        }
        sum
    }

    /// The program counter as an instruction reads it: its address + 4 (A5.1.2).
    #[inline(always)]
    pub(super) fn pc(&self) -> u32 {
        self.r[15].wrapping_add(4)
    }

    /// Register `n` as an operand.
    #[inline(always)]
    pub(super) fn register(&self, n: u32) -> u32 {
        if n == 15 { self.pc() } else { self.r[(n & 15) as usize] }
    }

    /// Register `n` as a base: the program counter is aligned to a word (A4.1.2).
    #[inline(always)]
    pub(super) fn base(&self, n: u32) -> u32 {
        if n == 15 { self.pc() & !3 } else { self.r[(n & 15) as usize] }
    }

    /// Writes R0 to R14; the low two bits of the stack pointer are zero (B1.4.7).
    #[inline(always)]
    pub(super) fn set_register(&mut self, n: u32, value: u32) {
        self.r[(n & 15) as usize] = if n == 13 { value & !3 } else { value };
    }

    /// BranchWritePC (A2.3.1).
    #[inline(always)]
    pub(super) fn branch_to(&mut self, address: u32) -> Outcome {
        self.next_pc = address & !1;
        Ok(BRANCH_CYCLES)
    }

    /// BXWritePC (A2.3.1): EXC_RETURN in handler mode, else an address with the Thumb bit.
    #[inline(always)]
    pub(super) fn branch_exchange(&mut self, target: u32) -> Outcome {
        if self.ipsr != 0 && target >> 28 == 15 {
            return Err(Event::ExceptionReturn(target));
        }
        if target & 1 == 0 {
            return Err(Event::Undefined(target));
        }
        self.branch_to(target)
    }

    /// MRS (B5.2.2): the special register SYSm.
    pub(super) fn read_special(&self, number: u32) -> Option<u32> {
        let privileged = self.privileged();
        Some(match number {
            0..=3 | 5..=7 => (if number & 4 == 0 { self.apsr() } else { 0 }) | (if number & 1 != 0 { self.ipsr } else { 0 }),
            20 => self.control,
            8 | 9 | 16..=19 if !privileged => 0,
            8 => self.main_stack_pointer(),
            9 => self.process_stack_pointer(),
            16 => u32::from(self.primask),
            17 | 18 => u32::from(self.basepri),
            19 => u32::from(self.faultmask),
            _ => return None,
        })
    }

    /// MSR (B5.2.3) to the special register SYSm; `mask` is the field of two bits that selects NZCVQ and GE.
    pub(super) fn write_special(&mut self, number: u32, mask: u32, value: u32) -> Option<()> {
        if number <= 3 {
            if mask & 2 != 0 {
                self.set_apsr_flags(value);
            }
            if mask & 1 != 0 {
                self.ge = (value >> 16 & 15) as u8;
            }
            return Some(());
        }
        if !matches!(number, 5..=9 | 16..=20) {
            return None;
        }
        if !self.privileged() {
            return Some(());
        }
        let priority = value as u8 & BASEPRI_MASK;
        match number {
            8 if self.uses_process_stack() => self.banked_stack_pointer = value & !3,
            9 if !self.uses_process_stack() => self.banked_stack_pointer = value & !3,
            8 | 9 => self.r[13] = value & !3,
            16 => self.primask = value & 1 != 0,
            17 => self.basepri = priority,
            // BASEPRI_MAX only raises the level.
            18 if priority != 0 && (self.basepri == 0 || priority < self.basepri) => self.basepri = priority,
            19 => self.faultmask = value & 1 != 0,
            20 => self.set_control(value),
            _ => {}
        }
        Some(())
    }

    /// Writes CONTROL; handler mode leaves SPSEL as it is (B1.4.4).
    pub(super) fn set_control(&mut self, value: u32) {
        let process_stack = self.uses_process_stack();
        let writable = if self.ipsr == 0 { 7 } else { CONTROL_UNPRIVILEGED | CONTROL_FLOAT_ACTIVE };
        self.control = self.control & !writable | value & writable;
        if process_stack != self.uses_process_stack() {
            std::mem::swap(&mut self.r[13], &mut self.banked_stack_pointer);
        }
    }
}
