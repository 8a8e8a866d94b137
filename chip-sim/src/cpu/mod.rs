//! The Cortex-M4's instruction set: ARMv7E-M with FPv4-SP, executed instruction by instruction (ARMv7-M Architecture Reference Manual, DDI 0403E).
//!
//! Input: halfwords and data through [`Bus`]. Output: the state of [`Core`] after each instruction and its cycles by the Cortex-M4's tables (DDI
//! 0439B, tables 3-1 and 7-1), without wait states of the memory. Encodings are named as in chapter A7 of the manual; an encoding that it
//! calls undefined, or that is not listed here, is [`Event::Undefined`].

mod alu;
mod exception;
mod float;
mod load_store;
mod multiply;
mod simd;
mod thumb16;
mod thumb32;

use alu::{add_with_carry, bit};

/// Width of an access.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Width {
    /// 8 bits.
    Byte,
    /// 16 bits.
    Half,
    /// 32 bits.
    Word,
}

impl Width {
    /// Bytes of the access.
    #[inline]
    pub fn bytes(self) -> u32 {
        match self {
            Self::Byte => 1,
            Self::Half => 2,
            Self::Word => 4,
        }
    }
}

/// Memory as the core sees it. Errors are recorded by the bus itself; the machine looks for them after each instruction.
pub trait Bus {
    /// A halfword of an instruction.
    fn fetch(&mut self, address: u32) -> u16;
    /// Reads with zero extension.
    fn read(&mut self, address: u32, width: Width) -> u32;
    /// Writes the low bytes of `value`.
    fn write(&mut self, address: u32, width: Width, value: u32);
}

/// What an instruction asks of its surroundings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// An undefined encoding; the program counter stays on it.
    Undefined(u32),
    /// A branch to EXC_RETURN inside a handler.
    ExceptionReturn(u32),
    /// WFE.
    WaitForEvent,
    /// WFI.
    WaitForInterrupt,
    /// SEV.
    SendEvent,
    /// SVC with its number.
    SupervisorCall(u8),
    /// BKPT with its number; the program counter stays on it.
    Breakpoint(u8),
}

/// Result of an instruction.
type Step = Result<(), Event>;

/// Cycles that refill the pipeline after a taken branch: 1 to 3 (DDI 0439B, table 3-1).
const REFILL_CYCLES: u32 = 2;
const SP: usize = 13;
const LR: usize = 14;
const PC: usize = 15;
/// CONTROL.FPCA: floating-point state is active.
const CONTROL_FPCA: u32 = 4;
/// CONTROL.SPSEL: thread mode uses the process stack.
const CONTROL_SPSEL: u32 = 2;

/// Registers and state of the core.
#[derive(Clone, Debug, Default)]
pub struct Core {
    /// R0 to R15; R13 is the stack pointer in use, R15 the address of the next instruction.
    pub r: [u32; 16],
    /// S0 to S31.
    pub s: [u32; 32],
    /// Flags N, Z, C, V of APSR.
    pub negative: bool,
    /// Z.
    pub zero: bool,
    /// C.
    pub carry: bool,
    /// V.
    pub overflow: bool,
    /// Q: saturation.
    pub saturated: bool,
    /// GE bits of the parallel additions.
    pub greater_equal: u8,
    /// ITSTATE.
    pub it_state: u8,
    /// Number of the running exception, 0 in thread mode.
    pub ipsr: u32,
    /// PRIMASK.
    pub primask: bool,
    /// FAULTMASK.
    pub faultmask: bool,
    /// BASEPRI.
    pub basepri: u8,
    /// CONTROL.
    pub control: u32,
    /// The stack pointer that is not in use.
    pub other_sp: u32,
    /// FPSCR.
    pub fpscr: u32,
    /// Address of the exclusive monitor.
    exclusive: Option<u32>,
    /// Address of the instruction after this one.
    next_pc: u32,
    /// Cycles of this instruction above one.
    extra_cycles: u32,
}

impl Core {
    /// The core after a reset with these first two vectors.
    pub fn reset(stack: u32, entry: u32) -> Self {
        let mut core = Self::default();
        core.r[SP] = stack & !3;
        core.r[LR] = u32::MAX;
        core.r[PC] = entry & !1;
        core
    }

    /// Executes one instruction and returns its cycles. After WFE, WFI, SEV and SVC the program counter is behind the instruction.
    ///
    /// # Errors
    /// The event that the instruction causes.
    #[inline]
    pub fn step<B: Bus>(&mut self, bus: &mut B) -> Result<u32, Event> {
        let pc = self.r[PC];
        let first = u32::from(bus.fetch(pc));
        let wide = first >> 11 >= 0x1D;
        let second = if wide { u32::from(bus.fetch(pc + 2)) } else { 0 };
        let following = pc.wrapping_add(if wide { 4 } else { 2 });
        self.next_pc = following;
        self.extra_cycles = 0;
        let it_state = self.it_state;
        if it_state != 0 {
            let execute = self.condition(u32::from(it_state >> 4));
            // ITAdvance (A7.3.3).
            self.it_state = if it_state & 7 == 0 { 0 } else { it_state & 0xE0 | it_state << 1 & 0x1F };
            // BKPT executes whatever the condition.
            if !execute && first >> 8 != 0xBE {
                self.r[PC] = following;
                return Ok(1);
            }
        }
        let outcome = if wide { self.thumb32(bus, first, second) } else { self.thumb16(bus, first, it_state == 0) };
        match outcome {
            Ok(()) => {
                self.r[PC] = self.next_pc;
                if self.next_pc != following {
                    self.extra_cycles += REFILL_CYCLES;
                }
                Ok(1 + self.extra_cycles)
            }
            Err(event) => {
                if matches!(event, Event::WaitForEvent | Event::WaitForInterrupt | Event::SendEvent | Event::SupervisorCall(_)) {
                    self.r[PC] = following;
                }
                Err(event)
            }
        }
    }

    /// APSR.
    pub fn apsr(&self) -> u32 {
        u32::from(self.negative) << 31
            | u32::from(self.zero) << 30
            | u32::from(self.carry) << 29
            | u32::from(self.overflow) << 28
            | u32::from(self.saturated) << 27
            | u32::from(self.greater_equal) << 16
    }

    /// Sets the flags from a value of APSR.
    pub fn set_apsr(&mut self, value: u32) {
        self.negative = bit(value, 31);
        self.zero = bit(value, 30);
        self.carry = bit(value, 29);
        self.overflow = bit(value, 28);
        self.saturated = bit(value, 27);
        self.greater_equal = (value >> 16 & 0xF) as u8;
    }

    /// xPSR as it is pushed on the stack.
    pub fn xpsr(&self) -> u32 {
        let it = u32::from(self.it_state);
        self.apsr() | self.ipsr | 1 << 24 | (it >> 2) << 10 | (it & 3) << 25
    }

    /// Sets flags, exception number and ITSTATE from a value of xPSR.
    pub fn set_xpsr(&mut self, value: u32) {
        self.set_apsr(value);
        self.ipsr = value & 0x1FF;
        self.it_state = (value >> 25 & 3 | (value >> 10 & 0x3F) << 2) as u8;
    }

    /// ConditionPassed (A7.3.1).
    #[inline]
    fn condition(&self, condition: u32) -> bool {
        let holds = match condition >> 1 {
            0 => self.zero,
            1 => self.carry,
            2 => self.negative,
            3 => self.overflow,
            4 => self.carry && !self.zero,
            5 => self.negative == self.overflow,
            6 => !self.zero && self.negative == self.overflow,
            _ => return true,
        };
        holds != (condition & 1 != 0)
    }

    /// The program counter as an operand: the instruction's address plus 4.
    #[inline]
    fn pc_operand(&self) -> u32 {
        self.r[PC].wrapping_add(4)
    }

    /// Align(PC, 4), the base of literals and ADR.
    #[inline]
    fn literal_base(&self) -> u32 {
        self.pc_operand() & !3
    }

    /// A register as an operand.
    #[inline]
    fn register(&self, number: u32) -> u32 {
        if number == 15 { self.pc_operand() } else { self.r[number as usize] }
    }

    /// Sets N and Z.
    #[inline]
    fn set_nz(&mut self, value: u32) {
        self.negative = value >> 31 != 0;
        self.zero = value == 0;
    }

    /// AddWithCarry, with the flags where `flags` is set.
    #[inline]
    fn add(&mut self, a: u32, b: u32, carry: bool, flags: bool) -> u32 {
        let (sum, carry, overflow) = add_with_carry(a, b, carry);
        if flags {
            self.set_nz(sum);
            self.carry = carry;
            self.overflow = overflow;
        }
        sum
    }

    /// BXWritePC and BLXWritePC: interworking branch, exception return in a handler.
    fn branch_exchange(&mut self, target: u32) -> Step {
        if target >= 0xFFFF_FF00 && self.ipsr != 0 {
            return Err(Event::ExceptionReturn(target));
        }
        if target & 1 == 0 {
            // The ARM state does not exist: a usage fault.
            return Err(Event::Undefined(target));
        }
        self.next_pc = target & !1;
        Ok(())
    }

    /// Writes a register; a write to R15 is a branch without change of state.
    fn write_register(&mut self, number: u32, value: u32) -> Step {
        match number {
            15 => self.next_pc = value & !1,
            13 => self.r[SP] = value & !3,
            _ => self.r[number as usize] = value,
        }
        Ok(())
    }

    /// Writes a loaded value; a load to R15 is an interworking branch.
    fn write_loaded(&mut self, number: u32, value: u32) -> Step {
        if number == 15 { self.branch_exchange(value) } else { self.write_register(number, value) }
    }

    /// Whether thread mode uses the process stack now.
    fn uses_process_stack(&self) -> bool {
        self.control & CONTROL_SPSEL != 0 && self.ipsr == 0
    }
}
