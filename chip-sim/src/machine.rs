//! The running chip: core and peripherals in step, exceptions, sleep, resets, measurements.
//!
//! Time follows the cycle model: the core's cycles by DDI 0439B, wait states of the flash with its caches. It is accurate to about 30 %,
//! because bus contention, the depth of the prefetch and the write buffer are not modelled. Two runs of an image with the same input are
//! identical.

use crate::board::Board;
use crate::cpu::{Bus, Core, Event, Width};
use crate::image::Image;
use crate::peripherals::flash::Flash;
use crate::peripherals::rcc::ResetCause;
use crate::rtt;
use crate::soc::{AccessError, Soc};
use crate::system_control::{FIRST_INTERRUPT, NMI};
use crate::time::Time;
use std::collections::{BTreeMap, BTreeSet};

/// Exception number of TIM1's update event: the control tick.
pub const TICK: u32 = FIRST_INTERRUPT + 25;

/// Why the chip cannot go on.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Halt {
    /// An impossible access.
    #[error("{error}, in {place}")]
    Access {
        /// The access.
        error: AccessError,
        /// Instruction behind it.
        place: String,
    },
    /// An instruction that the core does not have: a panic's trap, or a jump into nothing.
    #[error("undefined instruction {encoding:#x} in {place}")]
    Undefined {
        /// Its bits.
        encoding: u32,
        /// Its address.
        place: String,
    },
    /// An instruction that the stand's program does not use.
    #[error("{what} in {place}")]
    Unexpected {
        /// The event.
        what: String,
        /// Its address.
        place: String,
    },
}

/// Measurements of one exception's handler.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HandlerMeasure {
    /// Calls.
    pub calls: u64,
    /// Instructions of all calls, preempting handlers excluded, and of the longest one.
    pub instructions: u64,
    /// Most instructions of a call.
    pub most_instructions: u64,
    /// Most core cycles of a call, entry and return included, preempting handlers excluded.
    pub most_cycles: u64,
}

/// Measurements of one function.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FunctionMeasure {
    /// Calls that have returned.
    pub calls: u64,
    /// Instructions of all calls, interrupts included.
    pub instructions: u64,
    /// Most instructions of a call.
    pub most_instructions: u64,
    /// Most core cycles of a call.
    pub most_cycles: u64,
}

/// A handler that is running.
struct Running {
    exception: u32,
    instructions: u64,
    cycles: u64,
}

/// A watched function that is running.
struct Call {
    function: u32,
    returns_to: u32,
    stack: u32,
    instructions: u64,
    cycles: u64,
}

/// Measurements since the last [`Machine::start_measuring`].
#[derive(Default)]
pub struct Measures {
    /// By exception number.
    pub handlers: BTreeMap<u32, HandlerMeasure>,
    /// By start address.
    pub functions: BTreeMap<u32, FunctionMeasure>,
    /// Cycles from TIM1's update event to the first instruction of its handler.
    pub worst_tick_latency_cycles: u64,
    /// Lowest stack pointer.
    pub lowest_stack: u32,
    /// Instructions.
    pub instructions: u64,
    /// Core cycles in sleep.
    pub sleep_cycles: u64,
    /// Core cycle at the start.
    pub since_cycles: u64,
}

impl Measures {
    /// Share of the time in which the core did not sleep, until core cycle `cycles`.
    pub fn load(&self, cycles: u64) -> f64 {
        let all = cycles.saturating_sub(self.since_cycles).max(1);
        1.0 - self.sleep_cycles as f64 / all as f64
    }
}

/// The chip with its program.
pub struct Machine<'i> {
    image: &'i Image,
    core: Core,
    /// The chip.
    pub soc: Soc,
    event: bool,
    is_asleep: bool,
    log: Vec<u8>,
    running: Vec<Running>,
    calls: Vec<Call>,
    watched: BTreeSet<u32>,
    /// Resets since power-on.
    pub resets: Vec<(Time, ResetCause)>,
    /// Measurements.
    pub measures: Measures,
    halted: Option<Halt>,
}

impl<'i> Machine<'i> {
    /// The chip at power-on.
    pub fn new(image: &'i Image, board: Board) -> Self {
        let segments: Vec<(u32, &[u8])> = image.segments.iter().map(|(address, bytes)| (*address, bytes.as_slice())).collect();
        let mut soc = Soc::new(Flash::new(&segments), board);
        let core = start(&mut soc);
        let measures = Measures { lowest_stack: u32::MAX, ..Measures::default() };
        Self {
            image,
            core,
            soc,
            event: false,
            is_asleep: false,
            log: Vec::new(),
            running: Vec::new(),
            calls: Vec::new(),
            watched: BTreeSet::new(),
            resets: Vec::new(),
            measures,
            halted: None,
        }
    }

    /// Measures all functions whose name contains `part`; returns how many there are.
    pub fn watch(&mut self, part: &str) -> usize {
        let before = self.watched.len();
        self.watched.extend(self.image.functions_named(part).map(|(address, _)| address));
        self.watched.len() - before
    }

    /// Measurements begin anew.
    pub fn start_measuring(&mut self) {
        self.measures = Measures { lowest_stack: u32::MAX, since_cycles: self.soc.cycles, ..Measures::default() };
        self.calls.clear();
    }

    /// The image.
    pub fn image(&self) -> &'i Image {
        self.image
    }

    /// Present time.
    pub fn now(&self) -> Time {
        self.soc.now
    }

    /// The host sends `bytes` now.
    pub fn send(&mut self, bytes: &[u8], baud: u64) {
        let now = self.soc.now;
        self.soc.usart.send(now, bytes, baud);
        self.soc.reschedule();
    }

    /// Bytes that the chip has sent since the last call.
    pub fn take_sent(&mut self) -> Vec<u8> {
        self.soc.usart.transmitted.drain(..).map(|(_, byte)| byte).collect()
    }

    /// What the image has logged since power-on, as defmt encodes it: the image's file has the texts.
    pub fn log(&mut self) -> &[u8] {
        self.drain_log();
        &self.log
    }

    fn drain_log(&mut self) {
        if let Some(address) = self.image.symbol("_SEGGER_RTT") {
            rtt::drain(self.soc.ram_mut(), address, &mut self.log);
        }
    }

    /// Runs until `to`.
    ///
    /// # Errors
    /// The program did something that the chip cannot do; every further call returns the same error.
    pub fn run_until(&mut self, to: Time) -> Result<(), Halt> {
        if let Some(halt) = &self.halted {
            return Err(halt.clone());
        }
        let done = self.run(to);
        self.drain_log();
        if let Err(halt) = &done {
            self.halted = Some(halt.clone());
        }
        done
    }

    /// The core executes nothing until `to`, as in an endless loop with interrupts masked; the peripherals go on. Ends early with a reset.
    pub fn hang_until(&mut self, to: Time) {
        while self.soc.now < to {
            let wake = self.soc.next_event().min(to);
            self.soc.sleep_until(wake);
            self.soc.run_events();
            if let Some(cause) = self.soc.reset {
                return self.reset(cause);
            }
        }
    }

    fn run(&mut self, to: Time) -> Result<(), Halt> {
        let mut candidate = self.soc.control.candidate();
        while self.soc.now < to {
            if self.soc.now >= self.soc.next_event() {
                self.soc.run_events();
            }
            if let Some(cause) = self.soc.reset {
                self.reset(cause);
                candidate = None;
            }
            if self.soc.is_stopped {
                self.soc.now = to;
                break;
            }
            if self.soc.control.changed {
                self.soc.control.changed = false;
                candidate = self.soc.control.candidate();
            }
            if let Some((exception, priority)) = candidate {
                self.is_asleep = false;
                if self.accepts(exception, priority) {
                    self.enter(exception);
                    continue;
                }
            }
            if self.is_asleep {
                let wake = self.soc.next_event().min(to);
                let before = self.soc.cycles;
                self.soc.sleep_until(wake);
                self.measures.sleep_cycles += self.soc.cycles - before;
                continue;
            }
            // Until something happens that the checks above look at. A masked exception is looked at after each instruction.
            loop {
                self.execute()?;
                if self.soc.now >= to
                    || self.soc.now >= self.soc.next_event()
                    || candidate.is_some()
                    || self.soc.control.changed
                    || self.is_asleep
                {
                    break;
                }
            }
        }
        Ok(())
    }

    fn accepts(&self, exception: u32, priority: u32) -> bool {
        if exception == NMI {
            return true;
        }
        let base = u32::from(self.core.basepri);
        !self.core.primask && !self.core.faultmask && (base == 0 || priority < base + 2)
    }

    #[inline]
    fn execute(&mut self) -> Result<(), Halt> {
        if !self.watched.is_empty() {
            self.follow_calls();
        }
        let pc = self.core.r[15];
        let outcome = self.core.step(&mut self.soc);
        self.measures.instructions += 1;
        self.measures.lowest_stack = self.measures.lowest_stack.min(self.core.r[13]);
        if self.soc.error.is_some() {
            return Err(self.access_error(pc));
        }
        match outcome {
            Ok(cycles) => self.soc.pass(cycles),
            Err(event) => {
                self.soc.pass(1);
                self.take_event(event, pc)?;
            }
        }
        Ok(())
    }

    #[cold]
    fn access_error(&mut self, pc: u32) -> Halt {
        let place = self.image.place(pc);
        match self.soc.error.clone() {
            Some(error) => Halt::Access { error, place },
            None => Halt::Unexpected { what: "unknown".to_owned(), place },
        }
    }

    fn take_event(&mut self, event: Event, pc: u32) -> Result<(), Halt> {
        match event {
            Event::ExceptionReturn(value) => self.leave(value),
            Event::SendEvent => self.event = true,
            Event::WaitForEvent if self.event => self.event = false,
            Event::WaitForEvent | Event::WaitForInterrupt => self.is_asleep = true,
            Event::Undefined(encoding) => return Err(Halt::Undefined { encoding, place: self.image.place(pc) }),
            other => return Err(Halt::Unexpected { what: format!("{other:?}"), place: self.image.place(pc) }),
        }
        Ok(())
    }

    fn enter(&mut self, exception: u32) {
        self.soc.control.enter(exception);
        let table = self.soc.control.vector_table();
        let (instructions, before) = (self.measures.instructions, self.soc.cycles);
        let cycles = self.core.enter_exception(&mut self.soc, exception, table);
        self.soc.pass(cycles);
        self.event = true;
        if exception == TICK
            && let Some(at) = self.soc.update_at.take()
        {
            let latency = self.soc.now.saturating_sub(at) / self.soc.core_period();
            self.measures.worst_tick_latency_cycles = self.measures.worst_tick_latency_cycles.max(latency);
        }
        self.running.push(Running { exception, instructions, cycles: before });
    }

    fn leave(&mut self, exc_return: u32) {
        let exception = self.core.ipsr;
        let cycles = self.core.return_from_exception(&mut self.soc, exc_return);
        self.soc.pass(cycles);
        self.soc.control.leave(exception);
        self.event = true;
        let Some(done) = self.running.pop() else { return };
        let instructions = self.measures.instructions.saturating_sub(done.instructions);
        let cycles = self.soc.cycles - done.cycles;
        // The outer handler does not count this one.
        for outer in &mut self.running {
            outer.instructions += instructions;
            outer.cycles += cycles;
        }
        let measure = self.measures.handlers.entry(done.exception).or_default();
        measure.calls += 1;
        measure.instructions += instructions;
        measure.most_instructions = measure.most_instructions.max(instructions);
        measure.most_cycles = measure.most_cycles.max(cycles);
    }

    fn follow_calls(&mut self) {
        let (pc, stack) = (self.core.r[15], self.core.r[13]);
        while let Some(call) = self.calls.last().filter(|call| call.returns_to == pc && call.stack <= stack) {
            let instructions = self.measures.instructions.saturating_sub(call.instructions);
            let cycles = self.soc.cycles - call.cycles;
            let measure = self.measures.functions.entry(call.function).or_default();
            measure.calls += 1;
            measure.instructions += instructions;
            measure.most_instructions = measure.most_instructions.max(instructions);
            measure.most_cycles = measure.most_cycles.max(cycles);
            self.calls.pop();
        }
        if self.watched.contains(&pc) {
            let returns_to = self.core.r[14] & !1;
            self.calls.push(Call { function: pc, returns_to, stack, instructions: self.measures.instructions, cycles: self.soc.cycles });
        }
    }

    fn reset(&mut self, cause: ResetCause) {
        self.resets.push((self.soc.now, cause));
        self.soc.reset_by(cause);
        self.core = start(&mut self.soc);
        (self.event, self.is_asleep) = (false, false);
        self.running.clear();
        self.calls.clear();
    }

    /// Takes power away and gives it back: everything but the flash is lost.
    pub fn power_cycle(&mut self) {
        self.soc.ram_mut().fill(0);
        self.reset(ResetCause::PowerOn);
        self.halted = None;
        self.soc.error = None;
    }
}

/// The core after a reset, by the first two vectors.
fn start(soc: &mut Soc) -> Core {
    let table = crate::peripherals::flash::BASE;
    let (stack, entry) = (soc.read(table, Width::Word), soc.read(table + 4, Width::Word));
    Core::reset(stack, entry)
}
