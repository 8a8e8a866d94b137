//! The chip around its core: memories, address map, clock gates, events in time, DMA requests, interrupt lines, wait states.
//!
//! Every access is checked as the chip checks it: a peripheral whose clock is off reads zero and ignores writes (and is listed in
//! [`Soc::gated`]), a pin reaches a peripheral only through the right alternate function, locked flash cannot be written. An address or a
//! register that is not modelled ends the simulation with an error.

mod address_map;
mod bus;
mod dma_requests;
mod flash_access;
mod registers;

use crate::board::{self, Board};
use crate::peripherals::adc::Adc;
use crate::peripherals::advanced_timer::AdvancedTimer;
use crate::peripherals::dac::Dac;
use crate::peripherals::dma::Dma;
use crate::peripherals::flash::{Flash, Stall};
use crate::peripherals::general_timer::GeneralTimer;
use crate::peripherals::gpio::{Gpio, Pin, pin};
use crate::peripherals::rcc::{Rcc, ResetCause, period};
use crate::peripherals::spi::Spi;
use crate::peripherals::up_counter::UpCounter;
use crate::peripherals::usart::Usart;
use crate::peripherals::watchdog::{IndependentWatchdog, WindowWatchdog};
use crate::system_control::SystemControl;
use crate::time::{NEVER, Time};
use std::collections::BTreeMap;

pub use address_map::AccessError;
use flash_access::Caches;

/// First address and size of the RAM (SRAM1 and SRAM2).
pub const RAM: u32 = 0x2000_0000;
/// Bytes of the RAM.
pub const RAM_BYTES: u32 = 128 * 1024;
const PERIPHERALS: u32 = 0x4000_0000;
const CORE: u32 = 0xE000_0000;

/// Interrupt numbers (RM0390, table 38).
mod interrupt {
    pub const VOLTAGE_DETECTOR: u32 = 1;
    pub const ADC: u32 = 18;
    pub const TIM1_BREAK: u32 = 24;
    pub const TIM1_UPDATE: u32 = 25;
    pub const TIM2_TO_5: [u32; 4] = [28, 29, 30, 50];
    pub const SPI2: u32 = 36;
    pub const TIM8_UPDATE: u32 = 44;
    pub const USART2: u32 = 38;
    pub const DMA: [[u32; 8]; 2] = [[11, 12, 13, 14, 15, 16, 17, 47], [56, 57, 58, 59, 60, 68, 69, 70]];
}

/// Index of TIM2 to TIM5 in [`Soc::timers`].
const TIM2: usize = 0;
const TIM3: usize = 1;
const TIM4: usize = 2;
const TIM5: usize = 3;

/// Channels from 0: of an encoder timer or edge timer that captures the index, and of the edge timer that captures the clock reference.
const COUNTER_INDEX: usize = 2;
const TIMER_REFERENCE: usize = 2;
const TIMER_INDEX: usize = 3;

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
    tim8: UpCounter,
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
    /// The chip's own supply is below the level of the voltage detector.
    is_voltage_low: bool,
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
            tim8: UpCounter::default(),
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
            is_voltage_low: false,
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
        self.rcc = Rcc::new(cause, self.rcc.flags(), self.rcc.has_external_clock());
        (self.pwr, self.syscfg, self.exti) = ([0xC000, 0], [0; 12], [0; 6]);
        self.tim1 = AdvancedTimer::default();
        self.tim8 = UpCounter::default();
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
        self.tim1.set_clock(clocks.apb2_timers_Hz);
        self.tim8.set_clock(clocks.apb2_timers_Hz, self.now);
        for timer in &mut self.timers {
            timer.set_clock(clocks.apb1_timers_Hz, self.now);
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

    /// The supply of the chip itself falls below the level of its voltage detector, or is back.
    pub fn set_voltage_low(&mut self, is_low: bool) {
        self.is_voltage_low = is_low;
        self.schedule();
    }

    /// The voltage detector is on and its interrupt on falling voltage is enabled (RM0390 §5.2.2: PVDE; EXTI line 16 at its rising edge).
    fn detects_voltage(&self) -> bool {
        const LINE: u32 = 1 << 16;
        let [imr, _, rtsr, ..] = self.exti;
        self.pwr[0] & 1 << 4 != 0 && imr & LINE != 0 && rtsr & LINE != 0
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
                    self.timers[timer].rising_edge(channel, at, disc);
                }
            }
        }
    }

    /// Passes everything that is due at the present time.
    pub fn run_events(&mut self) {
        while self.next <= self.now {
            self.turn_bridge();
            while self.tim8.next() <= self.now {
                self.tim8.overflow();
                self.serve_dma();
            }
            while self.board.next_sensor_step() <= self.now {
                self.board.step_sensor();
                self.follow_encoder();
            }
            while self.board.next_reference_pulse() <= self.now {
                let at = self.board.next_reference_pulse();
                self.board.pass_reference_pulse();
                if self.gpio.is_alternate(board::CLOCK_REFERENCE, 1) {
                    self.timers[TIM2].rising_edge(TIMER_REFERENCE, at, 0);
                }
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
        set(interrupt::TIM8_UPDATE, self.tim8.is_pending());
        set(interrupt::VOLTAGE_DETECTOR, self.is_voltage_low && self.detects_voltage());
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
            self.tim8.next(),
            self.trigger,
            self.adc.next(),
            self.usart.next(),
            self.spi.next(),
            self.watchdog.next(),
            self.window.next(),
            self.board.next_sensor_step(),
            self.board.next_reference_pulse(),
        ]
        .into_iter()
        .min()
        .unwrap_or(NEVER);
    }

    #[cold]
    fn fail(&mut self, error: AccessError) {
        self.error.get_or_insert(error);
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
                if bit(1) {
                    self.tim8 = UpCounter::default();
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
}
