//! The chip around its core: memories, address map, clock gates, events in time, DMA requests, interrupt lines, wait states.
//!
//! Every access is checked as the chip checks it: a peripheral whose clock is off reads zero and ignores writes (and is listed in
//! [`Soc::gated`]), a pin reaches a peripheral only through the right alternate function, locked flash cannot be written. An address or a register
//! that is not modelled ends the simulation with an error.

use crate::board::{self, Board};
use crate::cpu::{Bus, Width};
use crate::peripherals::adc::Adc;
use crate::peripherals::advanced_timer::AdvancedTimer;
use crate::peripherals::dac::Dac;
use crate::peripherals::dma::{Dma, Item, STREAMS};
use crate::peripherals::flash::{self, Flash, Stall};
use crate::peripherals::general_timer::GeneralTimer;
use crate::peripherals::gpio::{Gpio, Pin, pin};
use crate::peripherals::rcc::{Rcc, ResetCause, period};
use crate::peripherals::spi::Spi;
use crate::peripherals::usart::Usart;
use crate::peripherals::watchdog::{IndependentWatchdog, WindowWatchdog};
use crate::system_control::{Request, SystemControl};
use crate::time::{NEVER, Time};
use std::collections::BTreeMap;

/// First address and size of the RAM (SRAM1 and SRAM2).
pub const RAM: u32 = 0x2000_0000;
/// Bytes of the RAM.
pub const RAM_BYTES: u32 = 128 * 1024;
const PERIPHERALS: u32 = 0x4000_0000;
const CORE: u32 = 0xE000_0000;
/// Halfword that no core executes: permanently undefined (DDI 0403E A7.7.194).
const UNDEFINED: u16 = 0xDE00;
/// Bytes of a line of the flash and of its caches (RM0390 §3.4.2).
const LINE_SHIFT: u32 = 4;
const INSTRUCTION_LINES: usize = 64;
const DATA_LINES: usize = 8;

/// Interrupt numbers (RM0390, table 38).
mod interrupt {
    pub const ADC: u32 = 18;
    pub const TIM1_BREAK: u32 = 24;
    pub const TIM1_UPDATE: u32 = 25;
    pub const TIM2_TO_5: [u32; 4] = [28, 29, 30, 50];
    pub const SPI2: u32 = 36;
    pub const USART2: u32 = 38;
    pub const DMA: [[u32; 8]; 2] = [[11, 12, 13, 14, 15, 16, 17, 47], [56, 57, 58, 59, 60, 68, 69, 70]];
}

/// Index of TIM2 to TIM5 in [`Soc::timers`].
const TIM2: usize = 0;
const TIM3: usize = 1;
const TIM4: usize = 2;
const TIM5: usize = 3;

/// Channel of an encoder timer or edge timer that captures the index, from 0.
const COUNTER_INDEX: usize = 2;
const TIMER_INDEX: usize = 3;

/// An access that the chip cannot make.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AccessError {
    /// Nothing is at this address.
    #[error("{} at {address:#010x}: no memory there", verb(*.write))]
    Unmapped {
        /// The address.
        address: u32,
        /// A write, else a read.
        write: bool,
    },
    /// The peripheral has the register, but the simulated chip has not.
    #[error("{} of {peripheral} at offset {offset:#x}{}: not modelled", verb(*.write), value.map_or(String::new(), |v| format!(", value {v:#010x}")))]
    NotModelled {
        /// Name of the peripheral.
        peripheral: &'static str,
        /// Offset of the register.
        offset: u32,
        /// A write, else a read.
        write: bool,
        /// The written value.
        value: Option<u32>,
    },
    /// Flash that is locked or not in programming mode.
    #[error("write to locked flash at {0:#010x}")]
    LockedFlash(u32),
    /// A region that the MPU protects, such as the guard below the stack.
    #[error("{} at {address:#010x}: forbidden by the MPU", verb(*.write))]
    Forbidden {
        /// The address.
        address: u32,
        /// A write, else a read.
        write: bool,
    },
    /// A DMA stream is enabled for a request that the chip does not have, or that is not modelled.
    #[error("DMA{controller} stream {stream}: channel {channel} is not a modelled request")]
    DmaRequest {
        /// 1 or 2.
        controller: usize,
        /// Stream.
        stream: usize,
        /// Channel.
        channel: u32,
    },
    /// A DMA address outside the RAM.
    #[error("DMA at {0:#010x}: no memory there")]
    DmaMemory(u32),
}

fn verb(write: bool) -> &'static str {
    if write { "write" } else { "read" }
}

/// A peripheral of the address map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Block {
    Timer(usize),
    WindowWatchdog,
    IndependentWatchdog,
    Spi2,
    Usart2,
    Pwr,
    Dac,
    Tim1,
    Adc,
    SysCfg,
    Exti,
    Gpio(usize),
    Rcc,
    FlashInterface,
    Dma(usize),
}

impl Block {
    fn of(address: u32) -> Option<(Self, u32)> {
        let (block, base) = match address & !0x3FF {
            base @ (0x4000_0000 | 0x4000_0400 | 0x4000_0800 | 0x4000_0C00) => (Self::Timer((base >> 10 & 3) as usize), base),
            base @ 0x4000_2C00 => (Self::WindowWatchdog, base),
            base @ 0x4000_3000 => (Self::IndependentWatchdog, base),
            base @ 0x4000_3800 => (Self::Spi2, base),
            base @ 0x4000_4400 => (Self::Usart2, base),
            base @ 0x4000_7000 => (Self::Pwr, base),
            base @ 0x4000_7400 => (Self::Dac, base),
            base @ 0x4001_0000 => (Self::Tim1, base),
            base @ 0x4001_2000 => (Self::Adc, base),
            base @ 0x4001_3800 => (Self::SysCfg, base),
            base @ 0x4001_3C00 => (Self::Exti, base),
            base @ 0x4002_0000..=0x4002_1C00 => (Self::Gpio((base >> 10 & 7) as usize), base),
            base @ 0x4002_3800 => (Self::Rcc, base),
            base @ 0x4002_3C00 => (Self::FlashInterface, base),
            base @ (0x4002_6000 | 0x4002_6400) => (Self::Dma((base >> 10 & 1) as usize), base),
            _ => return None,
        };
        Some((block, address - base))
    }

    fn name(self) -> &'static str {
        match self {
            Self::Timer(index) => ["TIM2", "TIM3", "TIM4", "TIM5"][index],
            Self::WindowWatchdog => "WWDG",
            Self::IndependentWatchdog => "IWDG",
            Self::Spi2 => "SPI2",
            Self::Usart2 => "USART2",
            Self::Pwr => "PWR",
            Self::Dac => "DAC",
            Self::Tim1 => "TIM1",
            Self::Adc => "ADC",
            Self::SysCfg => "SYSCFG",
            Self::Exti => "EXTI",
            Self::Gpio(index) => ["GPIOA", "GPIOB", "GPIOC", "GPIOD", "GPIOE", "GPIOF", "GPIOG", "GPIOH"][index],
            Self::Rcc => "RCC",
            Self::FlashInterface => "FLASH",
            Self::Dma(0) => "DMA1",
            Self::Dma(_) => "DMA2",
        }
    }

    /// Offset and bit of the clock gate in RCC (RM0390 §6.3); `None`: always on.
    fn gate(self) -> Option<(u32, u32)> {
        Some(match self {
            Self::Timer(index) => (0x40, index as u32),
            Self::WindowWatchdog => (0x40, 11),
            Self::Spi2 => (0x40, 14),
            Self::Usart2 => (0x40, 17),
            Self::Pwr => (0x40, 28),
            Self::Dac => (0x40, 29),
            Self::Tim1 => (0x44, 0),
            Self::Adc => (0x44, 8),
            Self::SysCfg => (0x44, 14),
            Self::Gpio(index) => (0x30, index as u32),
            Self::Dma(index) => (0x30, 21 + index as u32),
            Self::IndependentWatchdog | Self::Exti | Self::Rcc | Self::FlashInterface => return None,
        })
    }
}

/// Cached lines of the flash, by line number.
struct Caches {
    current: u32,
    entered: u64,
    instructions: [u32; INSTRUCTION_LINES],
    data: [u32; DATA_LINES],
    next_data: usize,
}

impl Default for Caches {
    fn default() -> Self {
        Self { current: u32::MAX, entered: 0, instructions: [u32::MAX; INSTRUCTION_LINES], data: [u32::MAX; DATA_LINES], next_data: 0 }
    }
}

/// The chip.
pub struct Soc {
    /// Present time.
    pub now: Time,
    /// Core cycles since power-on, sleep included.
    pub cycles: u64,
    /// Time of the next event of any peripheral.
    next: Time,
    core_period: Time,
    pclk2: Time,
    ram: Vec<u8>,
    /// The flash.
    pub flash: Flash,
    /// The core's registers.
    pub control: SystemControl,
    /// Ports.
    pub gpio: Gpio,
    rcc: Rcc,
    pwr: [u32; 2],
    syscfg: [u32; 12],
    exti: [u32; 6],
    tim1: AdvancedTimer,
    timers: [GeneralTimer; 4],
    /// Converter.
    pub adc: Adc,
    /// Torquer output.
    pub dac: Dac,
    dma: [Dma; 2],
    /// Serial line.
    pub usart: Usart,
    spi: Spi,
    /// Independent watchdog.
    pub watchdog: IndependentWatchdog,
    window: WindowWatchdog,
    /// Pending start of the ADC's sequence.
    trigger: Time,
    /// What is wired to the pins.
    pub board: Board,
    caches: Caches,
    /// Wait states of the running instruction.
    waits: u64,
    /// The first impossible access.
    pub error: Option<AccessError>,
    /// Accesses to peripherals whose clock is off: address, and whether written.
    pub gated: BTreeMap<(u32, bool), u64>,
    /// A reset is due.
    pub reset: Option<ResetCause>,
    /// The core has no clock.
    pub is_stopped: bool,
    /// Time of the oldest update event of TIM1 whose interrupt has not begun, and number of update events.
    pub update_at: Option<Time>,
    /// Update events of TIM1 since power-on: ticks.
    pub updates: u64,
    sensor_selected: bool,
}

impl Soc {
    /// The chip at power-on with this flash, on this board.
    pub fn new(flash: Flash, board: Board) -> Self {
        let mut gpio = Gpio::new();
        gpio.drive(board::STOP_CONTACT, false);
        gpio.drive(board::BUTTON, true);
        gpio.drive(board::SERIAL[1], true);
        let mut soc = Self {
            now: 0,
            cycles: 0,
            next: 0,
            core_period: period(16_000_000),
            pclk2: period(16_000_000),
            ram: vec![0; RAM_BYTES as usize],
            flash,
            control: SystemControl::default(),
            gpio,
            rcc: Rcc::new(ResetCause::PowerOn, 0, true),
            pwr: [0xC000, 0],
            syscfg: [0; 12],
            exti: [0; 6],
            tim1: AdvancedTimer::default(),
            timers: [true, false, false, true].map(GeneralTimer::new),
            adc: Adc::default(),
            dac: Dac::default(),
            dma: [Dma::default(), Dma::default()],
            usart: Usart::default(),
            spi: Spi::default(),
            watchdog: IndependentWatchdog::default(),
            window: WindowWatchdog::default(),
            trigger: NEVER,
            board,
            caches: Caches::default(),
            waits: 0,
            error: None,
            gated: BTreeMap::new(),
            reset: None,
            is_stopped: false,
            update_at: None,
            updates: 0,
            sensor_selected: false,
        };
        soc.follow_clocks();
        soc.schedule();
        soc
    }

    /// Resets everything but flash, RAM and the board.
    pub fn reset_by(&mut self, cause: ResetCause) {
        self.flash.reset();
        self.gpio.reset();
        self.control = SystemControl::default();
        self.rcc = Rcc::new(cause, self.rcc.flags(), true);
        (self.pwr, self.syscfg, self.exti) = ([0xC000, 0], [0; 12], [0; 6]);
        self.tim1 = AdvancedTimer::default();
        self.timers = [true, false, false, true].map(GeneralTimer::new);
        self.adc.reset();
        self.dac.reset();
        self.dma.iter_mut().for_each(Dma::reset);
        self.usart.reset();
        self.spi = Spi::default();
        self.watchdog = IndependentWatchdog::default();
        self.window = WindowWatchdog::default();
        self.trigger = NEVER;
        self.caches = Caches::default();
        self.reset = None;
        self.update_at = None;
        self.follow_clocks();
        self.follow_bridge();
        self.schedule();
    }

    /// Bytes of the RAM.
    pub fn ram(&self) -> &[u8] {
        &self.ram
    }

    /// Bytes of the RAM, for a debugger's writes.
    pub fn ram_mut(&mut self) -> &mut [u8] {
        &mut self.ram
    }

    /// Passes `cycles` of the core and the wait states of its accesses.
    #[inline]
    pub fn pass(&mut self, cycles: u32) {
        let all = u64::from(cycles) + std::mem::take(&mut self.waits);
        self.cycles += all;
        self.now += all * self.core_period;
    }

    /// The core sleeps until `to`.
    pub fn sleep_until(&mut self, to: Time) {
        if to > self.now {
            self.cycles += (to - self.now) / self.core_period;
            self.now = to;
        }
    }

    /// Time of a core cycle.
    pub fn core_period(&self) -> Time {
        self.core_period
    }

    /// Time of the next event.
    #[inline]
    pub fn next_event(&self) -> Time {
        self.next
    }

    /// Cycles by the clocks that are configured now.
    fn follow_clocks(&mut self) {
        let clocks = self.rcc.clocks(self.now);
        self.core_period = period(clocks.core_Hz);
        self.pclk2 = period(clocks.apb2_Hz);
        self.usart.pclk = period(clocks.apb1_Hz);
        self.spi.pclk = period(clocks.apb1_Hz);
        self.window.pclk = period(clocks.apb1_Hz);
        self.tim1.set_clock(clocks.timer2_Hz);
        for timer in &mut self.timers {
            timer.set_clock(clocks.timer1_Hz, self.now);
        }
    }

    /// The external clock stops: the core goes on by the clock security system, or stops.
    pub fn stop_external_clock(&mut self) {
        self.is_stopped = !self.rcc.stop_external_clock();
        self.control.set_nmi(self.rcc.has_failed());
        if self.rcc.has_failed() {
            // A clock failure is a break event (RM0390 §16.3.12).
            self.tim1.break_now();
        }
        self.follow_clocks();
        self.follow_bridge();
        self.schedule();
    }

    /// Levels at the inputs of the bridge.
    fn follow_bridge(&mut self) {
        let level = |channel: usize, at: Pin| {
            if self.gpio.is_alternate(at, 1) {
                self.tim1.mean_level(channel).unwrap_or(0.0)
            } else {
                // An undriven input is pulled low inside the driver.
                self.gpio.output(at).map_or(0.0, |high| f64::from(u8::from(high)))
            }
        };
        let levels = [level(0, board::BRIDGE[0]), level(1, board::BRIDGE[1])];
        self.board.set_bridge(levels, self.now);
        self.follow_encoder();
    }

    /// Compare counts in force of the bridge's channels, with their full scale.
    pub fn bridge_compare(&self) -> [(u32, u32); 2] {
        [self.tim1.compare(0), self.tim1.compare(1)]
    }

    /// Delivers edges and index to the timers whose pins are connected.
    fn follow_encoder(&mut self) {
        let passage = self.board.take_passage();
        let both = |a: Pin, b: Pin, function: u32| self.gpio.is_alternate(a, function) && self.gpio.is_alternate(b, function);
        if let Some(at) = passage.edge {
            if both(pin(b'A', 0), pin(b'A', 1), 2) {
                self.timers[TIM5].encoder_edge(at);
            }
            if both(pin(b'A', 15), pin(b'B', 3), 1) {
                self.timers[TIM2].encoder_edge(at);
            }
        }
        if let Some((at, disc)) = passage.index {
            for (timer, channel, input, function) in
                [(TIM3, COUNTER_INDEX, pin(b'B', 0), 2), (TIM4, COUNTER_INDEX, pin(b'B', 8), 2), (TIM2, TIMER_INDEX, pin(b'B', 2), 1)]
            {
                if self.gpio.is_alternate(input, function) {
                    self.timers[timer].index_edge(channel, at, disc);
                }
            }
        }
    }

    /// Passes everything that is due at the present time.
    pub fn run_events(&mut self) {
        while self.next <= self.now {
            self.turn_bridge();
            while self.board.next_sensor_step() <= self.now {
                self.board.step_sensor();
                self.follow_encoder();
            }
            if self.trigger <= self.now {
                self.adc.trigger(self.trigger, self.pclk2);
                self.trigger = NEVER;
            }
            while self.adc.next() <= self.now {
                self.board.advance(self.adc.next());
                self.follow_encoder();
                let channel = self.adc.channel();
                let code = self.board.analog_code(channel, self.dac.code());
                self.adc.convert(code, self.pclk2);
                self.serve_dma();
            }
            while self.spi.next() <= self.now {
                self.exchange_byte();
                self.serve_dma();
            }
            while self.usart.advance(self.now) {
                self.gpio.drive(board::SERIAL[1], !self.usart.is_low);
                self.serve_dma();
            }
            if self.watchdog.next() <= self.now {
                self.reset = Some(ResetCause::IndependentWatchdog);
            } else if self.window.next() <= self.now {
                self.reset = Some(ResetCause::WindowWatchdog);
            }
            self.serve_dma();
            self.schedule();
            if self.reset.is_some() {
                return;
            }
        }
    }

    fn turn_bridge(&mut self) {
        while self.tim1.next() <= self.now {
            let turn = self.tim1.turn();
            if turn.update {
                self.updates += 1;
                self.update_at.get_or_insert(turn.at);
                let now = std::mem::replace(&mut self.now, turn.at);
                self.follow_bridge();
                self.now = now;
            }
            if turn.at_bottom
                && let Some(at) = self.tim1.compare3_rises(turn.at)
            {
                self.trigger = at;
            }
        }
    }

    fn exchange_byte(&mut self) {
        let Some(sent) = self.spi.sent() else { return };
        let wired = board::SENSOR_BUS.iter().all(|pin| self.gpio.is_alternate(*pin, 5));
        let mode = self.spi.mode();
        let answer = if wired { self.board.sensor_byte(sent, mode) } else { 0xFF };
        self.spi.finish(answer);
    }

    /// Something outside the chip has changed what happens next.
    pub fn reschedule(&mut self) {
        self.schedule();
    }

    /// Sets interrupt lines and the time of the next event.
    fn schedule(&mut self) {
        let mut lines = 0;
        let mut set = |number: u32, high: bool| lines |= u128::from(high) << number;
        set(interrupt::TIM1_UPDATE, self.tim1.is_update_pending());
        set(interrupt::TIM1_BREAK, self.tim1.is_break_pending());
        for (timer, number) in self.timers.iter().zip(interrupt::TIM2_TO_5) {
            set(number, timer.is_pending());
        }
        set(interrupt::ADC, self.adc.is_pending());
        set(interrupt::USART2, self.usart.is_pending());
        set(interrupt::SPI2, self.spi.is_pending());
        for (dma, numbers) in self.dma.iter().zip(interrupt::DMA).filter(|(dma, _)| dma.has_flags()) {
            for (stream, number) in numbers.into_iter().enumerate() {
                set(number, dma.is_pending(stream));
            }
        }
        self.control.set_lines(lines);
        self.next = [
            self.tim1.next(),
            self.trigger,
            self.adc.next(),
            self.usart.next(),
            self.spi.next(),
            self.watchdog.next(),
            self.window.next(),
            self.board.next_sensor_step(),
        ]
        .into_iter()
        .min()
        .unwrap_or(NEVER);
    }

    /// The request lines of the DMA (RM0390, tables 28 and 29).
    fn is_requested(&mut self, controller: usize, stream: usize, channel: u32, to_peripheral: bool) -> bool {
        let [usart_receive, usart_transmit] = self.usart.requests_dma();
        let [spi_receive, spi_transmit] = self.spi.requests_dma();
        match (controller, stream, channel, to_peripheral) {
            (0, 3, 0, false) => spi_receive,
            (0, 4, 0, true) => spi_transmit,
            (0, 5, 4, false) => usart_receive,
            (0, 6, 4, true) => usart_transmit,
            (1, 0, 0, false) => self.adc.requests_dma(),
            _ => {
                self.fail(AccessError::DmaRequest { controller: controller + 1, stream, channel });
                false
            }
        }
    }

    fn serve_dma(&mut self) {
        loop {
            let mut moved = false;
            for controller in 0..2 {
                for stream in 0..STREAMS {
                    let Some((channel, to_peripheral, _)) = self.dma[controller].request(stream) else { continue };
                    if self.is_requested(controller, stream, channel, to_peripheral) {
                        let item = self.dma[controller].take(stream);
                        self.move_item(item);
                        moved = true;
                    }
                }
            }
            if !moved {
                return;
            }
        }
    }

    fn move_item(&mut self, item: Item) {
        let Item { register, memory, bytes, to_peripheral } = item;
        let Some((block, offset)) = Block::of(register) else {
            return self.fail(AccessError::Unmapped { address: register, write: to_peripheral });
        };
        let start = memory.wrapping_sub(RAM) as usize;
        let Some(place) = self.ram.get_mut(start..start.saturating_add(bytes as usize)) else {
            return self.fail(AccessError::DmaMemory(memory));
        };
        if to_peripheral {
            let value = place.iter().rev().fold(0, |value, byte| value << 8 | u32::from(*byte));
            self.write_block(block, offset, value);
        } else {
            let value = self.read_block(block, offset);
            let start = memory.wrapping_sub(RAM) as usize;
            for (k, byte) in self.ram[start..start + bytes as usize].iter_mut().enumerate() {
                *byte = (value >> (8 * k)) as u8;
            }
        }
    }

    #[cold]
    fn fail(&mut self, error: AccessError) {
        self.error.get_or_insert(error);
    }

    fn is_clocked(&mut self, block: Block, address: u32, write: bool) -> bool {
        let on = block.gate().is_none_or(|(offset, bit)| self.rcc.is_enabled(offset, bit));
        if !on {
            *self.gated.entry((address & !3, write)).or_default() += 1;
        }
        on
    }

    fn read_block(&mut self, block: Block, offset: u32) -> u32 {
        let now = self.now;
        let value = match block {
            Block::Timer(index) => {
                self.board.catch_up(now);
                self.follow_encoder();
                let disc = self.board.disc();
                // Reading a capture clears its flag; the stand's timers raise no interrupt.
                self.timers[index].read(offset, now, disc)
            }
            Block::WindowWatchdog => self.window.read(offset, now),
            Block::IndependentWatchdog => self.watchdog.read(offset),
            Block::Spi2 => {
                let value = self.spi.read(offset);
                self.schedule();
                value
            }
            Block::Usart2 => {
                let value = self.usart.read(offset);
                self.schedule();
                value
            }
            Block::Pwr => match offset {
                0 => Some(self.pwr[0]),
                // Over-drive and regulator are ready at once; VOS is in force (RM0390 §5.4.2).
                4 => Some(self.pwr[1] | self.pwr[0] & 0x3_0000 | 1 << 14),
                _ => None,
            },
            Block::Dac => self.dac.read(offset),
            Block::Tim1 => self.tim1.read(offset, now),
            Block::Adc => self.adc.read(offset),
            Block::SysCfg => self.syscfg.get(offset as usize / 4).copied(),
            Block::Exti => self.exti.get(offset as usize / 4).copied(),
            Block::Gpio(index) => self.gpio.read(index, offset),
            Block::Rcc => self.rcc.read(offset, now),
            Block::FlashInterface => self.flash.read(offset),
            Block::Dma(index) => self.dma[index].read(offset),
        };
        value.unwrap_or_else(|| {
            self.fail(AccessError::NotModelled { peripheral: block.name(), offset, write: false, value: None });
            0
        })
    }

    fn write_block(&mut self, block: Block, offset: u32, value: u32) {
        let now = self.now;
        let done = match block {
            Block::Timer(index) => {
                self.board.catch_up(now);
                self.follow_encoder();
                let disc = self.board.disc();
                self.timers[index].write(offset, value, now, disc)
            }
            Block::WindowWatchdog => self.window.write(offset, value, now).map(|early| {
                if early {
                    self.reset = Some(ResetCause::WindowWatchdog);
                }
            }),
            Block::IndependentWatchdog => self.watchdog.write(offset, value, now),
            Block::Spi2 => self.spi.write(offset, value, now),
            Block::Usart2 => self.usart.write(offset, value, now),
            Block::Pwr => self.pwr.get_mut(offset as usize / 4).map(|word| *word = value),
            Block::Dac => self.dac.write(offset, value, now),
            Block::Tim1 => {
                let done = self.tim1.write(offset, value, now);
                // Only these change the outputs at once; compare values wait for the update event.
                if !matches!(offset, 0x10 | 0x34..=0x40) {
                    self.follow_bridge();
                }
                done
            }
            Block::Adc => self.adc.write(offset, value),
            Block::SysCfg => self.syscfg.get_mut(offset as usize / 4).map(|word| *word = value),
            // Only the masks and edge selections are stored: the stand uses no external interrupt; a software interrupt is not modelled.
            Block::Exti if offset < 0x10 => self.exti.get_mut(offset as usize / 4).map(|word| *word = value),
            Block::Exti if offset == 0x14 => Some(()),
            Block::Exti => None,
            Block::Gpio(index) => {
                let done = self.gpio.write(index, offset, value);
                self.follow_pins(index);
                done
            }
            Block::Rcc => {
                let done = self.rcc.write(offset, value, now);
                self.reset_peripherals(offset, value);
                self.control.set_nmi(self.rcc.has_failed());
                self.follow_clocks();
                done
            }
            Block::FlashInterface => self.flash.write(offset, value, now).map(|stall| self.stall(stall)),
            Block::Dma(index) => self.dma[index].write(offset, value),
        };
        if done.is_none() {
            self.fail(AccessError::NotModelled { peripheral: block.name(), offset, write: true, value: Some(value) });
        }
    }

    /// Pins of a port have changed.
    fn follow_pins(&mut self, port: usize) {
        if port == usize::from(board::SENSOR_SELECT.port) {
            let selected = self.gpio.output(board::SENSOR_SELECT) == Some(false);
            if selected != self.sensor_selected {
                self.sensor_selected = selected;
                self.board.select_sensor(selected, self.now);
            }
        }
        if port == usize::from(board::BRIDGE[0].port) {
            self.follow_bridge();
        }
    }

    /// Bits in a reset register of RCC hold peripherals in reset (RM0390 §6.3.5 to 6.3.9).
    fn reset_peripherals(&mut self, offset: u32, value: u32) {
        let bit = |number: u32| value >> number & 1 != 0;
        match offset {
            0x10 => {
                for index in 0..2 {
                    if bit(21 + index as u32) {
                        self.dma[index].reset();
                    }
                }
            }
            0x20 => {
                for index in 0..4 {
                    if bit(index as u32) {
                        self.timers[index] = GeneralTimer::new(matches!(index, TIM2 | TIM5));
                    }
                }
                if bit(14) {
                    self.spi = Spi::default();
                }
                if bit(17) {
                    self.usart.reset();
                }
            }
            0x24 => {
                if bit(0) {
                    self.tim1 = AdvancedTimer::default();
                }
                if bit(8) {
                    self.adc.reset();
                }
            }
            _ => {}
        }
    }

    /// The core, which executes from the flash, waits for it; the peripherals go on.
    fn stall(&mut self, stall: Stall) {
        let Stall::Busy(duration) = stall else { return };
        let end = self.now + duration;
        self.schedule();
        while self.next < end && self.reset.is_none() {
            let at = self.next.max(self.now);
            self.sleep_until(at);
            self.run_events();
        }
        self.sleep_until(end);
    }

    /// Wait states of a fetch from the flash (RM0390 §3.4.2).
    #[inline]
    fn wait_for_line(&mut self, address: u32) {
        let line = address >> LINE_SHIFT;
        if line == self.caches.current {
            return;
        }
        let follows = line == self.caches.current.wrapping_add(1);
        let spent = self.cycles - self.caches.entered;
        self.caches.current = line;
        self.caches.entered = self.cycles;
        let waits = u64::from(self.flash.wait_states());
        if waits == 0 {
            return;
        }
        let [prefetch, cache, _] = self.flash.accelerated();
        let place = &mut self.caches.instructions[line as usize % INSTRUCTION_LINES];
        if cache && *place == line {
            return;
        }
        if cache {
            *place = line;
        }
        // Prefetch reads the next line while the core executes this one.
        self.waits += if prefetch && follows { waits.saturating_sub(spent) } else { waits };
    }

    /// Wait states of a data read from the flash.
    #[inline]
    fn wait_for_data(&mut self, address: u32) {
        let line = address >> LINE_SHIFT;
        let waits = u64::from(self.flash.wait_states());
        if waits == 0 {
            return;
        }
        let [_, _, cache] = self.flash.accelerated();
        if cache {
            if self.caches.data.contains(&line) {
                return;
            }
            self.caches.data[self.caches.next_data] = line;
            self.caches.next_data = (self.caches.next_data + 1) % DATA_LINES;
        }
        self.waits += waits;
    }

    #[cold]
    fn read_system_memory(&mut self, address: u32) -> u32 {
        match address {
            // Unique identifier and flash size (RM0390 §34).
            0x1FFF_7A10 => 0x0012_0034,
            0x1FFF_7A14 => 0x3436_510D,
            0x1FFF_7A18 => 0x3730_3832,
            0x1FFF_7A20 => (flash::BYTES as u32 / 1024) << 16 | 0xFFFF,
            _ => {
                self.fail(AccessError::Unmapped { address, write: false });
                0
            }
        }
    }

    fn read_register(&mut self, address: u32, width: Width) -> u32 {
        let word = if address >= CORE {
            match self.control.read(address & !3, self.cycles) {
                Some(value) => value,
                None => {
                    self.fail(AccessError::NotModelled { peripheral: "core", offset: address, write: false, value: None });
                    0
                }
            }
        } else if (0x1FFF_0000..0x2000_0000).contains(&address) {
            self.read_system_memory(address & !3)
        } else {
            match Block::of(address & !3) {
                None => {
                    self.fail(AccessError::Unmapped { address, write: false });
                    0
                }
                Some((block, _)) if !self.is_clocked(block, address, false) => 0,
                Some((block, offset)) => self.read_block(block, offset),
            }
        };
        match width {
            Width::Word => word,
            Width::Half => word >> (8 * (address & 2)) & 0xFFFF,
            Width::Byte => word >> (8 * (address & 3)) & 0xFF,
        }
    }

    fn write_register(&mut self, address: u32, width: Width, value: u32) {
        if address >= CORE {
            match self.control.write(address, width.bytes(), value, self.cycles) {
                Some(Request::None) => {}
                Some(Request::Reset) => self.reset = Some(ResetCause::Software),
                None => self.fail(AccessError::NotModelled { peripheral: "core", offset: address, write: true, value: Some(value) }),
            }
            return;
        }
        match Block::of(address & !3) {
            None => self.fail(AccessError::Unmapped { address, write: true }),
            Some((block, _)) if !self.is_clocked(block, address, true) => {}
            Some((block, offset)) => {
                // APB registers are written as words: a narrow access is repeated on the other lanes (RM0390 §2.1); data registers take it as it is.
                let narrow = match width {
                    Width::Word => value,
                    Width::Half => value & 0xFFFF,
                    Width::Byte => value & 0xFF,
                };
                self.write_block(block, offset, narrow << (8 * (address & 3)));
                self.serve_dma();
                self.schedule();
            }
        }
    }

    fn flash_offset(address: u32) -> Option<usize> {
        let offset = address & !flash::BASE;
        ((address | flash::BASE) & !0x07_FFFF == flash::BASE && (offset as usize) < flash::BYTES).then_some(offset as usize)
    }
}

impl Bus for Soc {
    #[inline]
    fn fetch(&mut self, address: u32) -> u16 {
        if let Some(offset) = Self::flash_offset(address) {
            self.wait_for_line(address);
            let bytes = self.flash.bytes();
            return match bytes.get(offset..offset + 2) {
                Some(&[low, high]) => u16::from_le_bytes([low, high]),
                _ => UNDEFINED,
            };
        }
        let offset = address.wrapping_sub(RAM) as usize;
        match self.ram.get(offset..offset.saturating_add(2)) {
            Some(&[low, high]) => u16::from_le_bytes([low, high]),
            _ => {
                self.fail(AccessError::Unmapped { address, write: false });
                UNDEFINED
            }
        }
    }

    #[inline]
    fn read(&mut self, address: u32, width: Width) -> u32 {
        let offset = address.wrapping_sub(RAM) as usize;
        let length = width.bytes() as usize;
        let bytes = if offset < RAM_BYTES as usize {
            if self.control.forbids(address) {
                self.fail(AccessError::Forbidden { address, write: false });
            }
            self.ram.get(offset..offset + length)
        } else if let Some(offset) = Self::flash_offset(address) {
            self.wait_for_data(address);
            self.flash.bytes().get(offset..offset + length)
        } else {
            return self.read_register(address, width);
        };
        match bytes {
            Some(&[a]) => u32::from(a),
            Some(&[a, b]) => u32::from(u16::from_le_bytes([a, b])),
            Some(&[a, b, c, d]) => u32::from_le_bytes([a, b, c, d]),
            _ => {
                self.fail(AccessError::Unmapped { address, write: false });
                0
            }
        }
    }

    #[inline]
    fn write(&mut self, address: u32, width: Width, value: u32) {
        let offset = address.wrapping_sub(RAM) as usize;
        let length = width.bytes() as usize;
        if offset < RAM_BYTES as usize {
            if self.control.forbids(address) {
                return self.fail(AccessError::Forbidden { address, write: true });
            }
            match self.ram.get_mut(offset..offset + length) {
                Some(place) => place.copy_from_slice(&value.to_le_bytes()[..length]),
                None => self.fail(AccessError::Unmapped { address, write: true }),
            }
        } else if Self::flash_offset(address).is_some() && address >= flash::BASE {
            match self.flash.program(address, &value.to_le_bytes()[..length]) {
                Some(stall) => self.stall(stall),
                None => self.fail(AccessError::LockedFlash(address)),
            }
        } else if address >= PERIPHERALS {
            self.write_register(address, width, value);
        } else {
            self.fail(AccessError::Unmapped { address, write: true });
        }
    }
}
