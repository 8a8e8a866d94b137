//! ADXL355 at register level (Analog Devices, data sheet ADXL354/ADXL355, rev. D).
//!
//! An accelerometer with 20-bit codes, a FIFO of 96 entries and an oscillator of its own; no gyroscope and no time stamps. Its low-pass is
//! of first order with the cutoff of the data sheet, followed by the rest of the group delay. Not simulated, because the stand does not use
//! them: interrupt pins, activity detection, external synchronisation, high-pass, I²C.

use super::fault::Fault;
use super::ramp::{Ends, Ramp};
use super::registers::G_M_S2;
use crate::peripherals::{Noise, SlowNoise, nearest};
use stand_firmware::board::CONTROL_HZ;
use std::collections::VecDeque;
use std::f64::consts::TAU;

/// Highest output data rate, Hz.
const FASTEST_HZ: f64 = 4000.0;
/// Slowest data rate: FASTEST_HZ / 2¹⁰.
const MOST_HALVINGS: u8 = 10;
/// Group delay of the digital filter in intervals of the samples, by the code of FILTER (data sheet, digital filter group delay).
const GROUP_DELAYS: [f64; 11] = [2.52, 2.00, 1.78, 1.63, 1.57, 1.54, 1.51, 1.49, 1.50, 1.50, 1.50];
/// Entries of the FIFO.
const FIFO_ENTRIES: usize = 96;
/// Typical response to the self-test on x, y, z, m/s² (data sheet, specifications).
const TEST_M_S2: [f64; 3] = [0.3 * G_M_S2, 0.3 * G_M_S2, 1.5 * G_M_S2];

const STATUS: u8 = 0x04;
const FIFO_LEVEL: u8 = 0x05;
const TEMP2: u8 = 0x06;
const XDATA3: u8 = 0x08;
const ZDATA1: u8 = 0x10;
const FIFO_DATA: u8 = 0x11;
const FILTER: u8 = 0x28;
const RANGE: u8 = 0x2C;
const POWER_CTL: u8 = 0x2D;
const SELF_TEST: u8 = 0x2E;
const RESET: u8 = 0x2F;
const RESET_CODE: u8 = 0x52;

/// DEVID_AD, DEVID_MST, PARTID, REVID.
const IDENTITY: [u8; 4] = [0xAD, 0x1D, 0xED, 0x01];

/// Writable registers from 0x1E to 0x2E: values after power-on, and writable bits.
const FIRST_WRITABLE: u8 = 0x1E;
const AFTER_POWER_ON: [u8; 17] = [0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0x60, 0, 0, 0x81, 0x01, 0];
const WRITABLE: [u8; 17] = [0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0x07, 0xFF, 0xFF, 0xFF, 0x7F, 0x7F, 0xFF, 0x07, 0xC3, 0x07, 0x03];

/// Bits of STATUS.
const READY: u8 = 1;
const FULL: u8 = 1 << 1;
const OVERRUN: u8 = 1 << 2;

/// The chip.
#[derive(Clone, Debug)]
pub struct Adxl355 {
    registers: [u8; AFTER_POWER_ON.len()],
    fifo: VecDeque<[u8; 3]>,
    /// The entry that is being read, and its next byte.
    entry: ([u8; 3], usize),
    status: u8,
    noise: [Noise; 3],
    slow: [SlowNoise; 3],
    density: f64,
    pace: f64,
    own_s: f64,
    next: u64,
    input: [Ends; 3],
    filtered: [f64; 3],
    /// Filtered values at the ends of the last ticks, the newest at the back.
    past: VecDeque<[f64; 3]>,
    output: [i32; 3],
    temperature: u16,
    fault: Fault,
    flips: u64,
    selected: Option<(u8, bool)>,
}

impl Adxl355 {
    /// A chip at power-on. `density` is the white noise, m/s²/√Hz, `slow` the flicker noise and random walk of each axis; `pace` its time
    /// over true time.
    pub fn new(noise: [Noise; 3], slow: [SlowNoise; 3], density: f64, pace: f64) -> Self {
        Self {
            registers: AFTER_POWER_ON,
            fifo: VecDeque::with_capacity(FIFO_ENTRIES + 3),
            entry: ([0; 3], 0),
            status: 0,
            noise,
            slow,
            density,
            pace,
            own_s: 0.0,
            next: 0,
            input: [Ends::default(); 3],
            filtered: [0.0; 3],
            past: VecDeque::new(),
            output: [0; 3],
            temperature: 0,
            fault: Fault::None,
            flips: super::fault::FLIP_SEED,
            selected: None,
        }
    }

    /// Sets or clears a fault.
    pub fn set_fault(&mut self, fault: Fault) {
        self.fault = fault;
    }

    /// Whether the chip takes samples.
    #[inline]
    pub fn samples(&self) -> bool {
        self.register(POWER_CTL) & 1 == 0
    }

    /// Advances without samples.
    #[inline]
    pub fn pass(&mut self, now_s: f64) {
        self.own_s = now_s * self.pace;
    }

    fn register(&self, address: u8) -> u8 {
        address.checked_sub(FIRST_WRITABLE).and_then(|k| self.registers.get(usize::from(k))).copied().unwrap_or(0)
    }

    fn halvings(&self) -> u8 {
        (self.register(FILTER) & 0x0F).min(MOST_HALVINGS)
    }

    /// m/s² per code.
    fn scale(&self) -> f64 {
        let codes_per_g = match self.register(RANGE) & 3 {
            2 => 128_000.0,
            3 => 64_000.0,
            _ => 256_000.0,
        };
        G_M_S2 / codes_per_g
    }

    /// Ends a tick at `now_s` with these forces at its end.
    pub fn tick(&mut self, now_s: f64, forces_m_s2: [f64; 3], temp_C: f64) {
        let before_s = self.own_s;
        self.own_s = now_s * self.pace;
        let halvings = self.halvings();
        let rate_Hz = FASTEST_HZ / f64::from(1_u32 << halvings);
        // First order at a quarter of the data rate.
        let late_ticks = CONTROL_HZ as f64 / (TAU * 0.25 * rate_Hz);
        let decay = libm::exp(-1.0 / late_ticks);
        for ((filtered, input), force) in self.filtered.iter_mut().zip(&mut self.input).zip(forces_m_s2) {
            let Ramp { begin, end } = input.to(force);
            let late = (end - begin) * late_ticks;
            *filtered = end - late + (*filtered - (begin - late)) * decay;
        }
        let rest_ticks = GROUP_DELAYS[usize::from(halvings)] * CONTROL_HZ as f64 / rate_Hz - late_ticks;
        self.past.push_back(self.filtered);
        while self.past.len() > rest_ticks as usize + 3 {
            self.past.pop_front();
        }
        let every = 1_u64 << halvings;
        while self.next as f64 / FASTEST_HZ <= self.own_s {
            let ago_ticks = (self.own_s - self.next as f64 / FASTEST_HZ) / (self.own_s - before_s).max(1e-9);
            let seen = self.delayed(rest_ticks + ago_ticks.clamp(0.0, 1.0));
            if self.fault != Fault::Stuck {
                self.sample(seen, temp_C, rate_Hz);
            }
            self.next += every;
        }
    }

    /// The filtered values this many ticks before the last end.
    fn delayed(&self, ticks: f64) -> [f64; 3] {
        let last = self.past.len() - 1;
        let (whole, part) = (ticks as usize, ticks.fract());
        let [late, later] = [whole, whole + 1].map(|back| self.past[last.saturating_sub(back)]);
        std::array::from_fn(|axis| late[axis] + (later[axis] - late[axis]) * part)
    }

    fn sample(&mut self, seen: [f64; 3], temp_C: f64, rate_Hz: f64) {
        // Independent samples with the density of the data sheet up to half the data rate.
        let sigma = self.density * (0.5 * rate_Hz).sqrt();
        let scale = self.scale();
        let tested = if self.register(SELF_TEST) & 3 == 3 { 1.0 } else { 0.0 };
        let now_s = self.next as f64 / FASTEST_HZ;
        for axis in 0..3 {
            let value = seen[axis] + tested * TEST_M_S2[axis] + sigma * self.noise[axis].draw() + self.slow[axis].at(now_s);
            self.output[axis] = nearest(value / scale).clamp(-524_288, 524_287) as i32;
        }
        // 1885 at 25 °C, −9.05 per kelvin.
        self.temperature = nearest(1885.0 - 9.05 * (temp_C - 25.0)).clamp(0, 4095) as u16;
        self.status |= READY;
        if self.fifo.len() + 3 > FIFO_ENTRIES {
            self.status |= OVERRUN;
            self.fifo.drain(..3);
        }
        for axis in 0..3 {
            let [a, b, c] = self.bytes_of(axis);
            self.fifo.push_back([a, b, c | u8::from(axis == 0)]);
        }
    }

    /// The three data bytes of an axis: 20 bits from the left.
    fn bytes_of(&self, axis: usize) -> [u8; 3] {
        let [a, b, c, _] = (self.output[axis] << 12).to_be_bytes();
        [a, b, c]
    }

    /// Chip select went low.
    pub fn select(&mut self) {
        self.selected = None;
    }

    /// Transfers a byte.
    pub fn byte(&mut self, sent: u8) -> u8 {
        let answer = match self.selected {
            None => {
                self.selected = Some((sent >> 1, sent & 1 != 0));
                0
            }
            Some((address, read)) => {
                // A burst continues with the next register, but stays at the FIFO.
                let after = if address == FIFO_DATA { address } else { (address + 1) & 0x7F };
                self.selected = Some((after, read));
                if read {
                    self.read(address)
                } else {
                    if !matches!(self.fault, Fault::Silent(_)) {
                        self.write(address, sent);
                    }
                    0
                }
            }
        };
        self.fault.on_bus(answer, &mut self.flips)
    }

    fn read(&mut self, address: u8) -> u8 {
        match address {
            0 => {
                if let Fault::Named(name) = self.fault {
                    name
                } else {
                    IDENTITY[0]
                }
            }
            1..=3 => IDENTITY[usize::from(address)],
            STATUS => {
                let full = if self.fifo.len() >= usize::from(self.register(0x29)) { FULL } else { 0 };
                std::mem::take(&mut self.status) | full
            }
            FIFO_LEVEL => self.fifo.len() as u8,
            TEMP2 => self.temperature.to_be_bytes()[0],
            0x07 => self.temperature.to_be_bytes()[1],
            XDATA3..=ZDATA1 => {
                let byte = usize::from(address - XDATA3);
                self.bytes_of(byte / 3)[byte % 3]
            }
            FIFO_DATA => {
                let (entry, byte) = &mut self.entry;
                if *byte == 0 {
                    // Bit 1: the FIFO was empty.
                    *entry = self.fifo.pop_front().unwrap_or([0, 0, 2]);
                }
                let answer = entry[*byte];
                *byte = (*byte + 1) % 3;
                answer
            }
            _ => self.register(address),
        }
    }

    fn write(&mut self, address: u8, value: u8) {
        if address == RESET && value == RESET_CODE {
            self.registers = AFTER_POWER_ON;
            self.fifo.clear();
            (self.status, self.entry) = (0, ([0; 3], 0));
            return;
        }
        let Some(k) = address.checked_sub(FIRST_WRITABLE).map(usize::from).filter(|k| *k < WRITABLE.len()) else { return };
        let sampled = self.samples();
        self.registers[k] = self.registers[k] & !WRITABLE[k] | value & WRITABLE[k];
        if self.samples() && !sampled {
            // The first sample comes one interval later; the filter starts at the present force.
            let every = 1_u64 << self.halvings();
            self.next = ((self.own_s * FASTEST_HZ) as u64 + 1).next_multiple_of(every);
            self.filtered = self.input.map(|input| input.last());
            self.past.clear();
            self.past.push_back(self.filtered);
        }
    }
}
