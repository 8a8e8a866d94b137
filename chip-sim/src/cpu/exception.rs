//! Exception entry and return (B1.5.6 to B1.5.8).

use super::{Bus, CONTROL_FPCA, CONTROL_SPSEL, Core, LR, PC, SP, Width};

/// Registers of the basic frame, in order of their addresses; xPSR follows.
const FRAME: [usize; 7] = [0, 1, 2, 3, 12, LR, PC];
const XPSR_OFFSET: u32 = 0x1C;
const BASIC_BYTES: u32 = 0x20;
/// With S0 to S15, FPSCR and a reserved word.
const EXTENDED_BYTES: u32 = 0x68;
const FPSCR_OFFSET: u32 = 0x60;
/// Cycles of entry and return without wait states (DDI 0439B §3.9.1), and of the floating-point registers.
const ENTRY_CYCLES: u32 = 12;
const RETURN_CYCLES: u32 = 10;
const FLOAT_CYCLES: u32 = 17;
/// Bit of the stacked xPSR: the stack was aligned by a word.
const ALIGNED: u32 = 1 << 9;
/// EXC_RETURN: bit 4 is zero for an extended frame, bit 3 set for thread mode, bit 2 for the process stack.
const EXC_RETURN: u32 = 0xFFFF_FFE1;
const RETURN_BASIC: u32 = 1 << 4;
const RETURN_THREAD: u32 = 1 << 3;
const RETURN_PROCESS: u32 = 1 << 2;

impl Core {
    /// Enters the handler of exception `number` and returns the cycles.
    ///
    /// Floating-point registers are pushed at once. The core pushes them lazily, at the handler's first floating-point instruction; the tick, which
    /// computes with floats, pays in both cases, other handlers are charged up to 17 cycles too much.
    pub fn enter_exception<B: Bus>(&mut self, bus: &mut B, number: u32, vector_table: u32) -> u32 {
        let float = self.control & CONTROL_FPCA != 0;
        let process = self.uses_process_stack();
        let before = self.r[SP];
        let padded = before & 4 != 0;
        let frame = before.wrapping_sub(if float { EXTENDED_BYTES } else { BASIC_BYTES }) & !7;
        for (k, register) in FRAME.into_iter().enumerate() {
            bus.write(frame.wrapping_add(4 * k as u32), Width::Word, self.r[register]);
        }
        bus.write(frame.wrapping_add(XPSR_OFFSET), Width::Word, self.xpsr() | if padded { ALIGNED } else { 0 });
        if float {
            for k in 0..16 {
                bus.write(frame.wrapping_add(BASIC_BYTES + 4 * k), Width::Word, self.s[k as usize]);
            }
            bus.write(frame.wrapping_add(FPSCR_OFFSET), Width::Word, self.fpscr);
        }
        self.r[LR] = EXC_RETURN
            | if float { 0 } else { RETURN_BASIC }
            | if self.ipsr == 0 { RETURN_THREAD } else { 0 }
            | if process { RETURN_PROCESS } else { 0 };
        self.r[SP] = frame;
        if process {
            std::mem::swap(&mut self.other_sp, &mut self.r[SP]);
        }
        self.control &= !(CONTROL_FPCA | CONTROL_SPSEL);
        self.ipsr = number;
        self.it_state = 0;
        self.exclusive = None;
        self.r[PC] = bus.read(vector_table.wrapping_add(4 * number), Width::Word) & !1;
        ENTRY_CYCLES + if float { FLOAT_CYCLES } else { 0 }
    }

    /// Returns from the running handler and returns the cycles.
    pub fn return_from_exception<B: Bus>(&mut self, bus: &mut B, exc_return: u32) -> u32 {
        let float = exc_return & RETURN_BASIC == 0;
        let process = exc_return & RETURN_PROCESS != 0;
        if process {
            std::mem::swap(&mut self.other_sp, &mut self.r[SP]);
        }
        let frame = self.r[SP];
        for (k, register) in FRAME.into_iter().enumerate() {
            self.r[register] = bus.read(frame.wrapping_add(4 * k as u32), Width::Word);
        }
        self.r[PC] &= !1;
        let xpsr = bus.read(frame.wrapping_add(XPSR_OFFSET), Width::Word);
        if float {
            for k in 0..16 {
                self.s[k as usize] = bus.read(frame.wrapping_add(BASIC_BYTES + 4 * k), Width::Word);
            }
            self.fpscr = bus.read(frame.wrapping_add(FPSCR_OFFSET), Width::Word);
        }
        self.control =
            self.control & !(CONTROL_FPCA | CONTROL_SPSEL) | if float { CONTROL_FPCA } else { 0 } | if process { CONTROL_SPSEL } else { 0 };
        let padding = if xpsr & ALIGNED != 0 { 4 } else { 0 };
        self.r[SP] = frame.wrapping_add(if float { EXTENDED_BYTES } else { BASIC_BYTES } + padding);
        self.set_xpsr(xpsr);
        self.exclusive = None;
        self.faultmask = false;
        RETURN_CYCLES + if float { FLOAT_CYCLES } else { 0 }
    }
}
