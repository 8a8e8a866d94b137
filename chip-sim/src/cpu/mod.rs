//! Interpreter of the Cortex-M4 with FPv4-SP (ARMv7-M Architecture Reference Manual, DDI 0403E).
//!
//! Input: halfwords and data through [`Bus`]. Output: changed registers, accesses of the bus, and the cycles of each instruction without
//! wait states (Cortex-M4 TRM, DDI 0439B table 3-1 and table 7-1; a taken branch costs two cycles of pipeline refill). Encodings that the
//! manual calls undefined or unpredictable end in [`Event::Undefined`] where the decoder distinguishes them.
//!
//! Limits: access permissions of the coprocessor (CPACR), faults for unaligned LDM, LDRD and LDREX, and the MPU belong to the bus.
//! Floating point: arithmetic rounds to nearest, the cumulative exception flags of FPSCR stay as written.
//! Conversions to and from half precision (VCVTB, VCVTT) are undefined here.
mod alu;
mod exception;
mod float;
mod float_arithmetic;
mod registers;
mod thumb16;
mod thumb32;

/// Width of a data access.
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
    /// Width in bytes.
    #[inline(always)]
    pub fn bytes(self) -> u32 {
        match self {
            Width::Byte => 1,
            Width::Half => 2,
            Width::Word => 4,
        }
    }
}

/// Memory and peripherals as the core sees them.
pub trait Bus {
    /// Halfword of an instruction. A bad address is recorded by the bus and returns a permanently undefined encoding (0xDE00).
    fn fetch(&mut self, address: u32) -> u16;
    /// Data read, zero-extended. The bus records faults; the machine ends the run after the instruction.
    fn read(&mut self, address: u32, width: Width) -> u32;
    /// Data write of the low `width` bits of `value`. The bus records faults.
    fn write(&mut self, address: u32, width: Width, value: u32);
}

/// Request of an instruction to its surroundings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// Undefined or unpredictable encoding, or a branch to an address without the Thumb bit. The program counter stays on the instruction.
    Undefined(u32),
    /// A value of the form EXC_RETURN was written to the program counter in handler mode (B1.5.8).
    ExceptionReturn(u32),
    /// WFE; the program counter is past the instruction.
    WaitForEvent,
    /// WFI; the program counter is past the instruction.
    WaitForInterrupt,
    /// SEV; the program counter is past the instruction.
    SendEvent,
    /// SVC with its immediate; the program counter is past the instruction.
    SupervisorCall(u8),
    /// BKPT with its immediate; the program counter stays on the instruction.
    Breakpoint(u8),
}

/// Cycles of an instruction without wait states, or its event.
type Outcome = Result<u32, Event>;

/// Cycles to refill the pipeline after a taken branch: 1 to 3 in DDI 0439B section 3.3.1.
const REFILL_CYCLES: u32 = 2;
/// Cycles of a taken branch.
const BRANCH_CYCLES: u32 = 1 + REFILL_CYCLES;

/// Registers of the core.
#[derive(Clone, Debug)]
pub struct Core {
    /// R0 to R15. R13 is the stack pointer in use; R15 is the address of the next instruction to execute.
    pub r: [u32; 16],
    /// Single-precision registers S0 to S31 as bits.
    pub s: [u32; 32],
    /// APSR.N, negative.
    pub negative: bool,
    /// APSR.Z, zero.
    pub zero: bool,
    /// APSR.C, carry.
    pub carry: bool,
    /// APSR.V, overflow.
    pub overflow: bool,
    /// APSR.Q, saturation.
    pub saturated: bool,
    /// APSR.GE, four bits.
    pub ge: u8,
    /// ITSTATE (A7.3.3); 0 outside an IT block.
    pub it_state: u8,
    /// Number of the active exception; 0 in thread mode.
    pub ipsr: u32,
    /// PRIMASK.
    pub primask: bool,
    /// FAULTMASK.
    pub faultmask: bool,
    /// BASEPRI; the upper four bits, as the F446 implements them.
    pub basepri: u8,
    /// CONTROL: bit 0 nPRIV, bit 1 SPSEL, bit 2 FPCA.
    pub control: u32,
    /// The stack pointer that is not in use: the process stack while R13 is the main stack, and the reverse.
    pub banked_stack_pointer: u32,
    /// FPSCR.
    pub fpscr: u32,
    /// Address of the local exclusive monitor; `None`: open access.
    pub exclusive: Option<u32>,
    /// Address of the following instruction while one executes.
    next_pc: u32,
}

impl Core {
    /// State after reset (B1.5.5): main stack, thread mode, privileged. `entry` is the reset vector with or without its Thumb bit.
    pub fn reset(stack: u32, entry: u32) -> Self {
        let mut r = [0; 16];
        r[13] = stack & !3;
        r[14] = u32::MAX;
        r[15] = entry & !1;
        Self {
            r,
            s: [0; 32],
            negative: false,
            zero: false,
            carry: false,
            overflow: false,
            saturated: false,
            ge: 0,
            it_state: 0,
            ipsr: 0,
            primask: false,
            faultmask: false,
            basepri: 0,
            control: 0,
            banked_stack_pointer: 0,
            fpscr: 0,
            exclusive: None,
            next_pc: 0,
        }
    }

    /// Executes one instruction and returns its cycles without wait states.
    ///
    /// # Errors
    /// The [`Event`] that the surroundings have to handle.
    #[inline]
    pub fn step<B: Bus>(&mut self, bus: &mut B) -> Result<u32, Event> {
        let pc = self.r[15];
        let first = u32::from(bus.fetch(pc));
        // A5.1: 0b11101, 0b11110 and 0b11111 in the top bits begin a 32-bit instruction.
        let wide = first >= 0xe800;
        self.next_pc = pc.wrapping_add(if wide { 4 } else { 2 });
        let it_state = self.it_state;
        if it_state != 0 {
            let passed = self.condition(u32::from(it_state) >> 4);
            self.it_state = if it_state & 7 == 0 { 0 } else { it_state & 0xe0 | it_state << 1 & 0x1f };
            // BKPT executes whatever the condition (A7.7.17).
            if !passed && first >> 8 != 0xbe {
                self.r[15] = self.next_pc;
                return Ok(1);
            }
        }
        let outcome = if wide {
            let second = u32::from(bus.fetch(pc.wrapping_add(2)));
            self.thumb32(bus, first, second)
        } else {
            self.thumb16(bus, first, it_state == 0)
        };
        match outcome {
            Ok(_) | Err(Event::WaitForEvent | Event::WaitForInterrupt | Event::SendEvent | Event::SupervisorCall(_)) => {
                self.r[15] = self.next_pc
            }
            Err(Event::Undefined(_) | Event::Breakpoint(_)) => self.it_state = it_state,
            Err(Event::ExceptionReturn(_)) => {}
        }
        outcome
    }
}

#[cfg(test)]
mod tests;
