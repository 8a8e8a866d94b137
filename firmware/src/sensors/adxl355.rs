//! Analog Devices' ADXL355, an accelerometer of low noise (data sheet ADXL354/ADXL355, rev. D).
//!
//! The public crate `adxl355` 0.2.3 is blocking, uses embedded-hal 0.2 and does not read the FIFO, so that registers and FIFO are written
//! here.
//!
//! The part has no gyroscope: [`Sample::rate_rad_s`] is `None`, range and cutoff of the rate are NaN. It has no time stamps: samples are
//! counted, and [`Sensor::stamp`] observes when the count rises. A read command is a write to an ISM330DHCX; [`Adxl355::identify`] states
//! why it does no harm.

use super::line::{BusLine, MAX_BYTES};
use super::{Drained, InForce, Ready, STANDARD_GRAVITY_M_S2, Sample, SelfTest, Sensor, SensorError, Setup};
use crate::board::{Clock, SensorSpi, Stamped, TICKS_PER_ROW, TICKS_PER_S, Ticks};
use embedded_hal_async::spi::MODE_0;

/// Registers.
mod register {
    pub const DEVID_AD: u8 = 0x00;
    pub const DEVID_MST: u8 = 0x01;
    pub const PARTID: u8 = 0x02;
    pub const STATUS: u8 = 0x04;
    pub const FIFO_ENTRIES: u8 = 0x05;
    pub const TEMP2: u8 = 0x06;
    pub const XDATA3: u8 = 0x08;
    pub const FIFO_DATA: u8 = 0x11;
    pub const FILTER: u8 = 0x28;
    pub const FIFO_SAMPLES: u8 = 0x29;
    pub const RANGE: u8 = 0x2C;
    pub const POWER_CTL: u8 = 0x2D;
    pub const SELF_TEST: u8 = 0x2E;
    pub const RESET: u8 = 0x2F;
}

/// Identity registers and their values.
const IDENTITY: [(u8, u8); 3] = [(register::DEVID_AD, 0xAD), (register::DEVID_MST, 0x1D), (register::PARTID, 0xED)];
/// Value of RESET that resets the part.
const RESET_CODE: u8 = 0x52;
/// Bits of STATUS.
const DATA_READY: u8 = 1;
const FIFO_OVERRUN: u8 = 1 << 2;
/// POWER_CTL: standby, and measurement with temperature and data-ready.
const STANDBY: u8 = 1;
const MEASURING: u8 = 0;
/// RANGE: reserved bits at their value after power-on, active-low interrupts.
const RANGE_BASE: u8 = 0x80;

/// Output data rates, Hz, and their codes (FILTER). Slower rates exist; the task would take their samples for silence.
const RATES: [(f32, u8); 7] = [(62.5, 6), (125.0, 5), (250.0, 4), (500.0, 3), (1000.0, 2), (2000.0, 1), (4000.0, 0)];
/// Cutoff of the low-pass relative to the data rate (FILTER register, ODR_LPF).
const CUTOFF_PART: f32 = 0.25;
/// Ranges, g, their codes (RANGE), and codes per g.
const RANGES: [(f32, u8, f32); 3] = [(2.048, 1, 256_000.0), (4.096, 2, 128_000.0), (8.192, 3, 64_000.0)];

/// Capacity of the FIFO, entries of one axis.
const FIFO_ENTRIES: u8 = 96;
/// Size of an entry and of the three entries of a sample, bytes.
const ENTRY: usize = 3;
const SAMPLE: usize = 3 * ENTRY;
/// Samples in one burst.
const BURST_SAMPLES: usize = MAX_BYTES.wrapping_div(SAMPLE);

/// Typical response to the self-test on x, y, z, g (data sheet, specifications), and the accepted ratio: it gives no limits.
const TEST_G: [f32; 3] = [0.3, 0.3, 1.5];
const TEST_RATIO: (f32, f32) = (1.0 / 3.0, 2.0);
/// Readings in the mean of a self-test, and the settling time before, board clock steps.
const TEST_READINGS: u32 = 8;
const TEST_SETTLING: u64 = TICKS_PER_S >> 3;

/// Temperature: code at 25 °C, and codes per kelvin (data sheet, specifications).
const TEMPERATURE_25: f32 = 1885.0;
const TEMPERATURE_PER_K: f32 = -9.05;

/// The sensor on its SPI bus.
pub struct Adxl355<D: SensorSpi, C: Clock> {
    pub(super) line: BusLine<D, C>,
    /// m/s² per code.
    scale_m_s2: f32,
    /// Interval of the samples, board clock steps.
    period: u64,
    axes: Axes,
    /// Number of the next sample from the FIFO.
    count: u32,
    /// The last sample that was observed when it came.
    observed: Option<Stamped<u32>>,
}

/// Entries of the FIFO that are being assembled to a sample.
#[derive(Clone, Copy, Debug, Default)]
struct Axes {
    codes: [i32; 3],
    present: usize,
}

/// Result of an entry.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Entry {
    /// The sample is incomplete.
    Incomplete,
    /// The sample is complete: codes of x, y, z.
    Sample([i32; 3]),
    /// The FIFO is empty.
    Empty,
    /// The entry is invalid: y or z without x, or x before z.
    Refused,
}

/// The 20-bit number in the upper bits of three bytes.
fn code([a, b, c]: [u8; 3]) -> i32 {
    i32::from_be_bytes([a, b, c, 0]) >> 12
}

impl Axes {
    /// Takes an entry: bit 0 marks x, bit 1 an empty FIFO.
    fn take(&mut self, entry: [u8; ENTRY]) -> Entry {
        let [_, _, flags] = entry;
        if flags & 2 != 0 {
            return Entry::Empty;
        }
        let is_x = flags & 1 != 0;
        let misplaced = is_x != (self.present == 0);
        if misplaced {
            *self = Self::default();
            if !is_x {
                return Entry::Refused;
            }
        }
        if let Some(place) = self.codes.get_mut(self.present) {
            *place = code(entry);
        }
        self.present = self.present.saturating_add(1);
        if self.present == 3 {
            let codes = self.codes;
            *self = Self::default();
            return Entry::Sample(codes);
        }
        if misplaced { Entry::Refused } else { Entry::Incomplete }
    }
}

/// Command bytes that read and write a register.
const fn reads(register: u8) -> u8 {
    register << 1 | 1
}
const fn writes(register: u8) -> u8 {
    register << 1
}

impl<D: SensorSpi, C: Clock> Adxl355<D, C> {
    /// The chip on this bus; sends nothing yet.
    pub fn new(device: D, clock: C) -> Self {
        Self::on(BusLine::new(device, clock))
    }

    pub(super) fn on(line: BusLine<D, C>) -> Self {
        Self { line, scale_m_s2: 0.0, period: 1, axes: Axes::default(), count: 0, observed: None }
    }

    async fn read(&mut self, register: u8, count: usize) -> Result<(), SensorError> {
        // Zeros, because an ISM330DHCX would take them as data: see `identify`.
        self.line.bytes = [0; _];
        self.line.exchange(reads(register), count).await
    }

    async fn set(&mut self, register: u8, value: u8) -> Result<(), SensorError> {
        self.line.set(register, writes(register), reads(register), value).await
    }

    /// Resets the chip to its state after power-on, standby.
    async fn reset(&mut self) -> Result<(), SensorError> {
        self.line.bytes = [RESET_CODE; _];
        self.line.exchange(writes(register::RESET), 1).await?;
        let mut read = 0;
        for _ in 0..=10 {
            self.line.wait(TICKS_PER_ROW).await;
            self.read(register::POWER_CTL, 1).await?;
            [read] = self.line.received();
            if read == STANDBY {
                return Ok(());
            }
        }
        Err(SensorError::NotConfigured { register: register::POWER_CTL, wrote: STANDBY, read })
    }

    /// Number of samples in the FIFO, and whether it overran.
    async fn level(&mut self) -> Result<(u8, bool), SensorError> {
        self.read(register::STATUS, 2).await?;
        let [status, entries] = self.line.received();
        if entries > FIFO_ENTRIES {
            return Err(SensorError::InvalidData("the FIFO level exceeds its capacity"));
        }
        Ok((entries.wrapping_div(3), status & FIFO_OVERRUN != 0))
    }

    /// Number of the newest sample in the FIFO.
    async fn newest(&mut self) -> Result<u32, SensorError> {
        self.read(register::FIFO_ENTRIES, 1).await?;
        let [entries] = self.line.received();
        if entries > FIFO_ENTRIES {
            return Err(SensorError::InvalidData("the FIFO level exceeds its capacity"));
        }
        Ok(self.count.wrapping_add(u32::from(entries.wrapping_div(3))).wrapping_sub(1))
    }

    /// Mean of several readings, m/s².
    async fn mean(&mut self) -> Result<[f32; 3], SensorError> {
        let mut sums = [0.0_f32; 3];
        for _ in 0..TEST_READINGS {
            let mut tries = 0;
            while !self.ready().await?.accel {
                tries += 1;
                if tries > 100 {
                    return Err(SensorError::Silent);
                }
                self.line.wait(10_000).await;
            }
            self.read(register::XDATA3, SAMPLE).await?;
            let bytes: [u8; SAMPLE] = self.line.received();
            let (axes, _) = bytes.as_chunks::<ENTRY>();
            sums.iter_mut().zip(axes).for_each(|(sum, axis)| *sum += code(*axis) as f32);
        }
        Ok(sums.map(|sum| sum * self.scale_m_s2 / TEST_READINGS as f32))
    }

    /// Data rate and range: codes and values.
    async fn start(&mut self, (rate_Hz, rate_code): (f32, u8), (_, range_code, per_g): (f32, u8, f32)) -> Result<(), SensorError> {
        self.reset().await?;
        for (register, value) in [
            (register::FILTER, rate_code),
            (register::FIFO_SAMPLES, FIFO_ENTRIES),
            (register::RANGE, RANGE_BASE | range_code),
            (register::POWER_CTL, MEASURING),
        ] {
            self.set(register, value).await?;
        }
        self.scale_m_s2 = STANDARD_GRAVITY_M_S2 / per_g;
        self.period = (TICKS_PER_S as f32 / rate_Hz) as u64;
        (self.axes, self.count, self.observed) = (Axes::default(), 0, None);
        Ok(())
    }

    /// Continues the count after an overrun, by the time since the last observed sample; returns the number of samples lost.
    fn resume(&mut self, level: u8) -> u32 {
        let Some(observed) = self.observed else { return 1 };
        let passed = (self.line.clock.now() - observed.at).wrapping_div(self.period.max(1));
        let next = observed.value.wrapping_add(1).wrapping_add(passed as u32).wrapping_sub(u32::from(level));
        // The chip's oscillator may be slower than nominal: the count does not go back.
        let lost = (next.wrapping_sub(self.count) as i32).max(1) as u32;
        self.count = self.count.wrapping_add(lost);
        lost
    }
}

impl<D: SensorSpi, C: Clock> Sensor for Adxl355<D, C> {
    fn name(&self) -> &'static str {
        "ADXL355"
    }

    /// The command that reads DEVID_AD is the command of an ISM330DHCX that writes its register 0x01 (FUNC_CFG_ACCESS), here with 0, its
    /// value after power-on. The other identity registers would be its reserved registers; they are read only where DEVID_AD is that of
    /// Analog Devices.
    async fn identify(&mut self) -> Result<(), SensorError> {
        self.line.set_mode(MODE_0)?;
        for (register, expected) in IDENTITY {
            self.read(register, 1).await?;
            match self.line.received() {
                [id] if id == expected => {}
                [who_am_i @ (0x00 | 0xFF)] => return Err(SensorError::Absent { who_am_i, expected }),
                [who_am_i] => return Err(SensorError::WrongChip { who_am_i, expected }),
            }
        }
        Ok(())
    }

    async fn configure(&mut self, wanted: &Setup) -> Result<InForce, SensorError> {
        let nothing = SensorError::InvalidData("the list of ranges is empty");
        let rate = super::at_least(&RATES, wanted.data_rate_Hz, |r| r.0).ok_or(nothing)?;
        let range = super::at_least(&RANGES, wanted.accel_range_m_s2 / STANDARD_GRAVITY_M_S2, |r| r.0).ok_or(nothing)?;
        self.start(rate, range).await?;
        let setup = Setup { data_rate_Hz: rate.0, rate_range_rad_s: f32::NAN, accel_range_m_s2: range.0 * STANDARD_GRAVITY_M_S2 };
        Ok(InForce { setup, rate_cutoff_Hz: f32::NAN, accel_cutoff_Hz: rate.0 * CUTOFF_PART, stamp_s: 1.0 / f64::from(rate.0) })
    }

    async fn ready(&mut self) -> Result<Ready, SensorError> {
        self.read(register::STATUS, 1).await?;
        let [status] = self.line.received();
        let accel = status & DATA_READY != 0;
        Ok(Ready { rate: false, accel, temperature: accel })
    }

    async fn drain(&mut self, samples: &mut [Sample]) -> Result<Drained, SensorError> {
        let mut drained = Drained::default();
        while drained.samples < samples.len() {
            let (level, overrun) = self.level().await?;
            if overrun {
                self.axes = Axes::default();
                drained.lost = drained.lost.saturating_add(self.resume(level));
            }
            let room = samples.len().saturating_sub(drained.samples);
            let count = usize::from(level).min(BURST_SAMPLES).min(room);
            if count == 0 {
                break;
            }
            self.read(register::FIFO_DATA, count.saturating_mul(SAMPLE)).await?;
            let (entries, _) = self.line.bytes.get(1..).unwrap_or_default().as_chunks::<ENTRY>();
            for entry in entries.iter().take(count.saturating_mul(3)) {
                match self.axes.take(*entry) {
                    Entry::Incomplete | Entry::Empty => {}
                    Entry::Refused => drained.refused = drained.refused.saturating_add(1),
                    Entry::Sample(codes) => {
                        if let Some(place) = samples.get_mut(drained.samples) {
                            let accel_m_s2 = codes.map(|code| code as f32 * self.scale_m_s2);
                            *place = Sample { stamp: self.count, rate_rad_s: None, accel_m_s2 };
                            self.count = self.count.wrapping_add(1);
                            drained.samples = drained.samples.saturating_add(1);
                        }
                    }
                }
            }
            if count == usize::from(level) {
                break;
            }
        }
        Ok(drained)
    }

    /// Waits for the next sample, at most two intervals.
    async fn stamp(&mut self) -> Result<Stamped<u32>, SensorError> {
        let before = self.newest().await?;
        let until = self.line.clock.now() + 2 * self.period;
        // The sample came between two readings: the later one is at most this late.
        let step = self.period >> 6;
        loop {
            self.line.wait(step).await;
            let begin = self.line.clock.now();
            let newest = self.newest().await?;
            if newest != before {
                let middle = begin.0.saturating_sub(step >> 1);
                let observed = Stamped { value: newest, at: Ticks(middle) };
                self.observed = Some(observed);
                return Ok(observed);
            }
            if begin > until {
                return Err(SensorError::Silent);
            }
        }
    }

    async fn temperature_C(&mut self) -> Result<f32, SensorError> {
        self.read(register::TEMP2, 2).await?;
        let code = u16::from_be_bytes(self.line.received()) & 0x0FFF;
        Ok(25.0 + (f32::from(code) - TEMPERATURE_25) / TEMPERATURE_PER_K)
    }

    async fn self_test(&mut self) -> Result<SelfTest, SensorError> {
        self.start((1000.0, 2), (8.192, 3, 64_000.0)).await?;
        let mut means = [[0.0; 3]; 2];
        // ST1 selects the self-test, ST2 applies the force.
        for (mean, test) in means.iter_mut().zip([1, 3]) {
            self.set(register::SELF_TEST, test).await?;
            self.line.wait(TEST_SETTLING).await;
            *mean = self.mean().await?;
        }
        self.set(register::SELF_TEST, 0).await?;
        let [[a, b, c], [d, e, f]] = means;
        let accel_m_s2 = [d - a, e - b, f - c];
        let passed = accel_m_s2.iter().zip(TEST_G).all(|(change, typical_g)| {
            let ratio = change.abs() / (typical_g * STANDARD_GRAVITY_M_S2);
            ratio >= TEST_RATIO.0 && ratio <= TEST_RATIO.1
        });
        Ok(SelfTest { rate_rad_s: [f32::NAN; 3], accel_m_s2, passed })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(code: i32, flags: u8) -> [u8; ENTRY] {
        let [a, b, c, _] = (code << 12).to_be_bytes();
        [a, b, c & 0xF0 | flags]
    }

    #[test]
    fn three_entries_make_a_sample_and_codes_have_twenty_bits() {
        let mut axes = Axes::default();
        let took = [(-524_288, 1), (524_287, 0), (-1, 0)].map(|(code, flags)| axes.take(entry(code, flags)));
        assert_eq!(took, [Entry::Incomplete, Entry::Incomplete, Entry::Sample([-524_288, 524_287, -1])]);
        assert_eq!(axes.take(entry(0, 2)), Entry::Empty);
    }

    #[test]
    fn a_lost_entry_is_refused_and_the_next_marked_axis_starts_a_sample() {
        let mut axes = Axes::default();
        let took = [(1, 1), (2, 0), (3, 1), (4, 0), (5, 0), (6, 0)].map(|(code, flags)| axes.take(entry(code, flags)));
        let expected = [Entry::Incomplete, Entry::Incomplete, Entry::Refused, Entry::Incomplete, Entry::Sample([3, 4, 5]), Entry::Refused];
        assert_eq!(took, expected);
    }
}
