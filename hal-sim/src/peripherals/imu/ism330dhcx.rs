//! ISM330DHCX: samples by its own oscillator, responds byte by byte.

use super::fault::{FLIP_SEED, Fault};
use super::fifo::{ACCEL, Fifo, RATE, STAMP};
use super::ramp::{Ends, Ramp};
use super::registers::address::*;
use super::registers::{FASTEST_HZ, G_M_S2, ID, Registers};
use crate::peripherals::{Noise, SlowNoise, nearest};
use stand_firmware::board::CONTROL_HZ;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Time stamp step of a chip without oscillator error, s.
const STAMP_S: f64 = 25e-6;
/// Response to a self-test, the middle of the data sheet limits (DS13012, tables 3 and 4): 400 °/s on each axis, and 400 mg. The
/// gyroscope's value holds for ± 2000 °/s; the narrow ranges have other limits, which are not modelled.
const TEST: [f64; 2] = [400.0 / 180.0 * std::f64::consts::PI, 0.4 * G_M_S2];

/// The chip.
#[derive(Clone, Debug)]
pub struct Ism330dhcx {
    registers: Registers,
    fifo: Fifo,
    noise: [Noise; 6],
    slow: [SlowNoise; 6],
    density: [f64; 2],
    /// Its time over true time, and its trim value for that.
    pace: f64,
    trim: i8,
    /// Start of its samples and of its time stamp, s of its own time.
    stamped_from_s: f64,
    own_s: f64,
    /// Time of the last selection: the time stamp runs on between ticks.
    asked_s: f64,
    /// Number of the next sample at the highest rate.
    next: u64,
    /// States and inputs of the low-passes: rates, then forces.
    filtered: [f64; 6],
    input: [Ends; 6],
    /// Values that depend on registers, computed at each write.
    decay: [f64; 2],
    late_ticks: [f64; 2],
    sigma: [f64; 2],
    on: bool,
    /// Software resets so far.
    starts: u32,
    every: u64,
    output: [i16; 6],
    /// Outputs whose low byte has been read and whose high byte has not.
    held: [bool; 6],
    fresh: [bool; 3],
    temperature: i16,
    moments: u32,
    fault: Fault,
    flips: u64,
    /// Byte index and address of a transaction.
    selected: Option<(u8, bool)>,
}

impl Ism330dhcx {
    /// A chip at power-on. `density` is the white noise of gyroscope and accelerometer per √Hz, `slow` the flicker noise and random walk
    /// of each axis; `pace` its time over true time.
    pub fn new(noise: [Noise; 6], slow: [SlowNoise; 6], density: [f64; 2], pace: f64, trim: i8) -> Self {
        let mut chip = Self {
            registers: Registers::after_power_on(),
            fifo: Fifo::new(),
            noise,
            slow,
            density,
            pace,
            trim,
            stamped_from_s: 0.0,
            own_s: 0.0,
            asked_s: 0.0,
            next: 0,
            filtered: [0.0; 6],
            input: [Ends::default(); 6],
            decay: [0.0; 2],
            late_ticks: [0.0; 2],
            sigma: [0.0; 2],
            on: false,
            starts: 0,
            every: 1,
            output: [0; 6],
            held: [false; 6],
            fresh: [false; 3],
            temperature: 0,
            moments: 0,
            fault: Fault::None,
            flips: FLIP_SEED,
            selected: None,
        };
        chip.follow_registers();
        chip
    }

    /// Number of software resets.
    #[inline]
    pub fn starts(&self) -> u32 {
        self.starts
    }

    /// Sets or clears a fault.
    pub fn set_fault(&mut self, fault: Fault) {
        self.fault = fault;
    }

    /// Whether the chip takes samples.
    #[inline]
    pub fn samples(&self) -> bool {
        self.on
    }

    /// Advances without samples.
    #[inline]
    pub fn pass(&mut self, now_s: f64) {
        self.own_s = now_s * self.pace;
    }

    /// Ends a tick at `now_s` with these rates and forces at its end.
    pub fn tick(&mut self, now_s: f64, seen: &[f64; 6], temp_C: f64) {
        let before_s = self.own_s;
        self.own_s = now_s * self.pace;
        let before = self.filtered;
        for (axis, ((filtered, input), seen)) in self.filtered.iter_mut().zip(&mut self.input).zip(seen).enumerate() {
            let Ramp { begin, end } = input.to(*seen);
            // Steady-state response to a ramp.
            let (decay, late_ticks) = (self.decay[axis / 3], self.late_ticks[axis / 3]);
            let late = (end - begin) * late_ticks;
            *filtered = end - late + (*filtered - (begin - late)) * decay;
        }
        let fastest_s = 1.0 / FASTEST_HZ;
        while self.next as f64 * fastest_s <= self.own_s {
            let part = ((self.next as f64 * fastest_s - before_s) / (self.own_s - before_s)).clamp(0.0, 1.0);
            let now: [f64; 6] = std::array::from_fn(|k| before[k] + (self.filtered[k] - before[k]) * part);
            if self.fault != Fault::Stuck {
                self.sample(&now, temp_C);
            }
            self.next += self.every;
        }
    }

    fn sample(&mut self, now: &[f64; 6], temp_C: f64) {
        let scales = self.registers.scales();
        let tests = self.registers.tests();
        let number = self.next;
        let due = |every: Option<u32>| every.is_some_and(|every| number.is_multiple_of(u64::from(every)));
        let sampled = self.registers.divided().map(due);
        for (axis, now) in now.iter().enumerate() {
            let kind = axis / 3;
            if !sampled[kind] {
                continue;
            }
            let slow = self.slow[axis].at(number as f64 / FASTEST_HZ);
            let value = now + tests[kind] * TEST[kind] + self.sigma[kind] * self.noise[axis].draw() + slow;
            let code = nearest(value / scales[kind]).clamp(-32_768, 32_767) as i16;
            if !(self.registers.block_data_update() && self.held[axis]) {
                self.output[axis] = code;
            }
            self.fresh[1 - kind] = true;
        }
        // 256 codes per kelvin from 25 °C; the thermometer's noise is some hundredths of a kelvin.
        self.temperature = nearest((temp_C - 25.0) * 256.0).clamp(-32_768, 32_767) as i16;
        self.fresh[2] = true;
        self.batch(sampled, due);
    }

    fn batch(&mut self, sampled: [bool; 2], due: impl Fn(Option<u32>) -> bool) {
        let mode = self.registers.fifo_mode();
        let [rate, accel] = self.registers.batched().map(due);
        let (rate, accel) = (rate && sampled[0], accel && sampled[1]);
        if mode == 0 || !(rate || accel) {
            return;
        }
        let runs_on = mode == 6;
        self.fifo.next_moment();
        let bytes = |output: &[i16]| {
            let mut body = [0; 6];
            for (pair, code) in body.chunks_exact_mut(2).zip(output) {
                pair.copy_from_slice(&code.to_le_bytes());
            }
            body
        };
        if rate {
            self.fifo.push(RATE, bytes(&self.output[..3]), runs_on);
        }
        if accel {
            self.fifo.push(ACCEL, bytes(&self.output[3..]), runs_on);
        }
        self.moments += 1;
        if self.registers.stamp_every().is_some_and(|every| self.moments.is_multiple_of(every)) {
            let at_s = self.next as f64 / FASTEST_HZ;
            let [a, b, c, d] = self.stamp_of(at_s).to_le_bytes();
            self.fifo.push(STAMP, [a, b, c, d, 0, 0], runs_on);
        }
    }

    /// The time stamp at its own time; the trim scales its steps as it scales its time.
    fn stamp_of(&self, own_s: f64) -> u32 {
        if self.registers.stamps() { ((own_s - self.stamped_from_s) / STAMP_S).max(0.0) as u64 as u32 } else { 0 }
    }

    /// Chip select went low at `now_s`.
    pub fn select(&mut self, now_s: f64) {
        self.asked_s = now_s * self.pace;
        self.selected = None;
    }

    /// Transfers a byte.
    pub fn byte(&mut self, sent: u8) -> u8 {
        let answer = match self.selected {
            None => {
                self.selected = Some((sent & 0x7F, sent & 0x80 != 0));
                0xFF
            }
            Some((address, true)) => {
                self.selected = Some((self.after(address), true));
                self.read(address)
            }
            Some((address, false)) => {
                self.selected = Some((self.after(address), false));
                if !matches!(self.fault, Fault::Silent(_)) {
                    self.write(address, sent);
                }
                0xFF
            }
        };
        self.fault.on_bus(answer, &mut self.flips)
    }

    /// A burst continues with the next register; at the FIFO it wraps, so that several words can be read.
    fn after(&self, address: u8) -> u8 {
        match address {
            FIFO_Z_H => FIFO_TAG,
            _ if !self.registers.increments() => address,
            _ => (address + 1) & 0x7F,
        }
    }

    fn read(&mut self, address: u8) -> u8 {
        match address {
            WHO_AM_I => {
                if let Fault::Named(name) = self.fault {
                    name
                } else {
                    ID
                }
            }
            STATUS => u8::from(self.fresh[0]) | u8::from(self.fresh[1]) << 1 | u8::from(self.fresh[2]) << 2,
            OUT_TEMP_L => {
                self.fresh[2] = false;
                self.temperature.to_le_bytes()[0]
            }
            0x21 => self.temperature.to_le_bytes()[1],
            OUTX_L_G..=OUTZ_H_A => {
                let (axis, high) = (usize::from(address - OUTX_L_G) / 2, (address - OUTX_L_G) % 2 == 1);
                self.held[axis] = !high;
                if high {
                    self.fresh[1 - axis / 3] = false;
                }
                self.output[axis].to_le_bytes()[usize::from(high)]
            }
            FIFO_STATUS1 => self.fifo.status()[0],
            FIFO_STATUS2 => {
                let status = self.fifo.status()[1];
                self.fifo.unlatch();
                status
            }
            TIMESTAMP0..=TIMESTAMP3 => self.stamp_of(self.asked_s).to_le_bytes()[usize::from(address - TIMESTAMP0)],
            INTERNAL_FREQ_FINE => self.trim as u8,
            FIFO_TAG..=FIFO_Z_H => self.fifo.read(usize::from(address - FIFO_TAG)),
            _ => self.registers.read(address).unwrap_or(0),
        }
    }

    fn write(&mut self, address: u8, value: u8) {
        match address {
            TIMESTAMP2 if value == 0xAA => self.stamped_from_s = self.asked_s,
            CTRL3_C if value & 1 != 0 => {
                self.registers = Registers::after_power_on();
                self.starts = self.starts.wrapping_add(1);
                self.fifo.clear();
                self.follow_registers();
            }
            _ => {
                let stamped = self.registers.stamps();
                if !self.registers.write(address, value) {
                    return;
                }
                if !stamped && self.registers.stamps() {
                    self.stamped_from_s = self.asked_s;
                }
                if self.registers.fifo_mode() == 0 {
                    self.fifo.clear();
                }
                self.follow_registers();
            }
        }
    }

    fn follow_registers(&mut self) {
        let divided = self.registers.divided();
        let was_on = std::mem::replace(&mut self.on, divided.iter().any(Option::is_some));
        self.every = divided.iter().flatten().min().map_or(1, |every| u64::from(*every));
        // Samples are at multiples of their divided rate; none is generated for earlier times.
        let now = (self.own_s * FASTEST_HZ) as u64 + 1;
        self.next = now.next_multiple_of(self.every);
        let cutoffs_Hz = self.registers.cutoffs_Hz();
        self.late_ticks = cutoffs_Hz.map(|cutoff_Hz| CONTROL_HZ as f64 / (TAU * cutoff_Hz));
        self.decay = self.late_ticks.map(|ticks| libm::exp(-1.0 / ticks));
        self.sigma = std::array::from_fn(|kind| self.density[kind] * (FRAC_PI_2 * cutoffs_Hz[kind]).sqrt());
        if !was_on {
            self.filtered = self.input.map(|input| input.last());
        }
    }
}
