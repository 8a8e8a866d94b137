//! Exception entry and return (B1.5.6 to B1.5.8).
//!
//! The floating-point registers are pushed at entry. The chip reserves the space and pushes them at the first floating-point instruction of
//! the handler (FPCCR.LSPEN, B1.5.7). A handler sees the same values; the cost is too high by 17 cycles for a handler without floating
//! point.
use super::registers::{CONTROL_FLOAT_ACTIVE, CONTROL_PROCESS_STACK};
use super::{Bus, Core, Width};

/// Registers of the basic frame in the order of their addresses; xPSR follows.
const FRAME_REGISTERS: [usize; 7] = [0, 1, 2, 3, 12, 14, 15];
const BASIC_FRAME_BYTES: u32 = 0x20;
const FLOAT_FRAME_BYTES: u32 = 0x68;
/// Offset of FPSCR, after S0 to S15.
const FPSCR_OFFSET: u32 = 0x60;
/// Bit 9 of the stacked xPSR: the entry inserted a word to align the frame.
const STACKED_PADDING: u32 = 1 << 9;
/// Cycles of entry and return without wait states (DDI 0439B section 3.9.1) and of the floating-point part of the frame.
const ENTRY_CYCLES: u32 = 12;
const RETURN_CYCLES: u32 = 10;
const FLOAT_FRAME_CYCLES: u32 = 17;
/// EXC_RETURN (table B1-8): bit 4 basic frame, bit 3 thread mode, bit 2 process stack.
const EXC_RETURN: u32 = 0xffff_ffe1;
const EXC_RETURN_BASIC_FRAME: u32 = 1 << 4;
const EXC_RETURN_THREAD: u32 = 1 << 3;
const EXC_RETURN_PROCESS_STACK: u32 = 1 << 2;

impl Core {
    /// Enters exception `number`: stacks the frame, loads the vector, sets LR to EXC_RETURN. Returns the cycles: 12, or 29 with floating
    /// point.
    pub fn enter_exception<B: Bus>(&mut self, bus: &mut B, number: u32, vector_table: u32) -> u32 {
        let float = self.control & CONTROL_FLOAT_ACTIVE != 0;
        let process_stack = self.uses_process_stack();
        let padding = if self.r[13] & 4 != 0 { STACKED_PADDING } else { 0 };
        let frame = self.r[13].wrapping_sub(if float { FLOAT_FRAME_BYTES } else { BASIC_FRAME_BYTES }) & !7;
        for (offset, register) in (0u32..).step_by(4).zip(FRAME_REGISTERS) {
            bus.write(frame.wrapping_add(offset), Width::Word, self.r[register]);
        }
        bus.write(frame.wrapping_add(0x1c), Width::Word, self.xpsr() | padding);
        if float {
            for (offset, value) in (BASIC_FRAME_BYTES..).step_by(4).zip(&self.s[..16]) {
                bus.write(frame.wrapping_add(offset), Width::Word, *value);
            }
            bus.write(frame.wrapping_add(FPSCR_OFFSET), Width::Word, self.fpscr);
        }
        self.r[13] = frame;
        self.r[14] = EXC_RETURN
            | if float { 0 } else { EXC_RETURN_BASIC_FRAME }
            | if self.ipsr == 0 { EXC_RETURN_THREAD } else { 0 }
            | if process_stack { EXC_RETURN_PROCESS_STACK } else { 0 };
        if process_stack {
            std::mem::swap(&mut self.r[13], &mut self.banked_stack_pointer);
        }
        self.control &= !(CONTROL_FLOAT_ACTIVE | CONTROL_PROCESS_STACK);
        self.ipsr = number & 0x1ff;
        self.it_state = 0;
        self.exclusive = None;
        self.r[15] = bus.read(vector_table.wrapping_add(4 * number), Width::Word) & !1;
        ENTRY_CYCLES + if float { FLOAT_FRAME_CYCLES } else { 0 }
    }

    /// Returns from the active exception by `exc_return`. Returns the cycles: 10, or 27 with floating point.
    pub fn return_from_exception<B: Bus>(&mut self, bus: &mut B, exc_return: u32) -> u32 {
        const NON_MASKABLE_INTERRUPT: u32 = 2;
        let float = exc_return & EXC_RETURN_BASIC_FRAME == 0;
        if self.ipsr != NON_MASKABLE_INTERRUPT {
            self.faultmask = false;
        }
        self.control &= !(CONTROL_FLOAT_ACTIVE | CONTROL_PROCESS_STACK);
        if exc_return & EXC_RETURN_PROCESS_STACK != 0 {
            std::mem::swap(&mut self.r[13], &mut self.banked_stack_pointer);
            self.control |= CONTROL_PROCESS_STACK;
        }
        let frame = self.r[13];
        for (offset, register) in (0u32..).step_by(4).zip(FRAME_REGISTERS) {
            self.r[register] = bus.read(frame.wrapping_add(offset), Width::Word);
        }
        let xpsr = bus.read(frame.wrapping_add(0x1c), Width::Word);
        if float {
            for (offset, value) in (BASIC_FRAME_BYTES..).step_by(4).zip(&mut self.s[..16]) {
                *value = bus.read(frame.wrapping_add(offset), Width::Word);
            }
            self.fpscr = bus.read(frame.wrapping_add(FPSCR_OFFSET), Width::Word);
            self.control |= CONTROL_FLOAT_ACTIVE;
        }
        let bytes = if float { FLOAT_FRAME_BYTES } else { BASIC_FRAME_BYTES } + if xpsr & STACKED_PADDING != 0 { 4 } else { 0 };
        self.r[13] = frame.wrapping_add(bytes);
        self.r[15] &= !1;
        self.set_xpsr(xpsr);
        self.exclusive = None;
        RETURN_CYCLES + if float { FLOAT_FRAME_CYCLES } else { 0 }
    }
}
