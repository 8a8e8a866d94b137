//! ST's ISM330DHCX (data sheet DS13012, application note AN5398), with the register definitions of ST's driver.
//!
//! Only the driver's registers and bit fields are used. Its methods for the data rate also access other parts of the chip, and those for
//! the FIFO read one word at a time. Here registers are exchanged as a whole and the FIFO is read in bursts. Every written register is read
//! back.

use super::fifo::{Decoded, Decoder, WORD};
use super::line::{BusLine, MAX_BYTES};
use super::{Drained, InForce, Ready, STANDARD_GRAVITY_M_S2, Sample, SelfTest, Sensor, SensorError, Setup, at_least};
use crate::board::{Clock, SensorSpi, Stamped, TICKS_PER_S};
use embedded_hal_async::spi::MODE_3;
use ism330dhcx_rs::asynchronous as st;
use ism330dhcx_rs::asynchronous::prelude::*;

/// Output data rates, Hz, and their codes (CTRL1_XL, CTRL2_G, FIFO_CTRL3).
const RATES: [(f32, u8); 7] = [
    (104.0, OdrGy::_104hz as u8),
    (208.0, OdrGy::_208hz as u8),
    (417.0, OdrGy::_416hz as u8),
    (833.0, OdrGy::_833hz as u8),
    (1667.0, OdrGy::_1666hz as u8),
    (3333.0, OdrGy::_3332hz as u8),
    (6667.0, OdrGy::_6667hz as u8),
];
/// Cutoff frequency of the rate's low-pass at those data rates, Hz: LPF1 with FTYPE 000 and LPF2 (DS13012, table 60).
const RATE_CUTOFFS_HZ: [f32; 7] = [33.0, 67.0, 136.6, 239.2, 304.2, 328.5, 335.5];
/// Ranges of the rate, °/s, their codes (CTRL2_G), and mdps per code (DS13012, table 2).
const RATE_RANGES: [(f32, u8, f32); 6] = [
    (125.0, FsGy::_125dps as u8, 4.375),
    (250.0, FsGy::_250dps as u8, 8.75),
    (500.0, FsGy::_500dps as u8, 17.5),
    (1000.0, FsGy::_1000dps as u8, 35.0),
    (2000.0, FsGy::_2000dps as u8, 70.0),
    (4000.0, FsGy::_4000dps as u8, 140.0),
];
/// Ranges of the acceleration, g, their codes (CTRL1_XL), and mg per code.
const ACCEL_RANGES: [(f32, u8, f32); 4] =
    [(2.0, FsXl::_2g as u8, 0.061), (4.0, FsXl::_4g as u8, 0.122), (8.0, FsXl::_8g as u8, 0.244), (16.0, FsXl::_16g as u8, 0.488)];
/// Cutoff of the acceleration's LPF2 relative to the data rate (HPCF_XL 001; DS13012, table 65).
const ACCEL_CUTOFF_PART: f32 = 0.1;
const HPCF_TENTH: u8 = 1;

/// Capacity of the FIFO, words (3 KiB).
const FIFO_WORDS: u16 = 512;
/// Words in one burst: three samples and one more.
const BURST_WORDS: usize = MAX_BYTES.wrapping_div(WORD);
/// Nominal resolution of the time stamp, s, and its relative change per step of INTERNAL_FREQ_FINE (AN5398 §6.4).
const STAMP_S: f64 = 25e-6;
const FINE: f64 = 0.0015;

/// Limits of the self-test on each axis (DS13012, tables 3 and 4): mg, and °/s at ± 2000 °/s.
const TEST_MG: (f32, f32) = (40.0, 1700.0);
const TEST_DEG_S: (f32, f32) = (150.0, 700.0);
/// Readings in the mean of a self-test, and the settling time before, board clock steps (AN5398 §7).
const TEST_READINGS: u32 = 5;
const TEST_SETTLING: u64 = TICKS_PER_S >> 3;

/// Read flag in the first byte, which is the register address.
const READS: u8 = 0x80;

/// The sensor on its SPI bus.
pub struct Ism330dhcx<D: SensorSpi, C: Clock> {
    pub(super) line: BusLine<D, C>,
    /// Scales, rad/s and m/s² per code.
    rate_rad_s: f32,
    accel_m_s2: f32,
    decoder: Decoder,
    overrun: bool,
}

impl<D: SensorSpi, C: Clock> Ism330dhcx<D, C> {
    /// The chip on this bus; sends nothing yet.
    pub fn new(device: D, clock: C) -> Self {
        Self::on(BusLine::new(device, clock))
    }

    pub(super) fn on(line: BusLine<D, C>) -> Self {
        Self { line, rate_rad_s: 0.0, accel_m_s2: 0.0, decoder: Decoder::default(), overrun: false }
    }

    /// Reads `count` bytes from a register on into [`Line::received`].
    async fn read(&mut self, register: Reg, count: usize) -> Result<(), SensorError> {
        self.line.exchange(register as u8 | READS, count).await
    }

    /// Writes registers, one after the other, and reads each back.
    async fn set_all(&mut self, registers: &[(Reg, u8)]) -> Result<(), SensorError> {
        for (register, value) in registers {
            let register = *register as u8;
            self.line.set(register, register, register | READS, *value).await?;
        }
        Ok(())
    }

    /// Resets the chip to its state after power-on.
    async fn reset(&mut self) -> Result<(), SensorError> {
        let power_on = Ctrl3C::new().into_bits();
        let mut read = Ctrl3C::new().with_sw_reset(1).into_bits();
        self.line.bytes = [read; _];
        let mut first = Reg::Ctrl3C as u8;
        // Written once, then read until the reset is over, about 50 µs.
        for _ in 0..=10 {
            self.line.exchange(first, 1).await?;
            self.line.wait(1_000).await;
            if first & READS != 0 {
                [read] = self.line.received();
            }
            first |= READS;
            if read == power_on {
                // Block data update: both bytes of a reading belong together. Bursts increment the address by default.
                return self.set_all(&[(Reg::Ctrl3C, Ctrl3C::new().with_bdu(1).into_bits())]).await;
            }
        }
        Err(SensorError::NotConfigured { register: Reg::Ctrl3C as u8, wrote: power_on, read })
    }

    /// Mean of several readings, rad/s and m/s², at ± 2000 °/s and ± 4 g.
    async fn mean(&mut self) -> Result<([f32; 3], [f32; 3]), SensorError> {
        let mut sums = ([0.0_f32; 3], [0.0_f32; 3]);
        for _ in 0..TEST_READINGS {
            let mut tries = 0;
            loop {
                let ready = self.ready().await?;
                if ready.rate && ready.accel {
                    break;
                }
                tries += 1;
                // The slower of both gives 52 readings per second.
                if tries > 100 {
                    return Err(SensorError::Silent);
                }
                self.line.wait(10_000).await;
            }
            self.read(Reg::OutxLG, 12).await?;
            let [a, b, c, d, e, f, g, h, i, j, k, l] = self.line.received();
            let code = |low, high| f32::from(i16::from_le_bytes([low, high]));
            let (rates, forces) = ([code(a, b), code(c, d), code(e, f)], [code(g, h), code(i, j), code(k, l)]);
            sums.0.iter_mut().zip(rates).for_each(|(sum, code)| *sum += code);
            sums.1.iter_mut().zip(forces).for_each(|(sum, code)| *sum += code);
        }
        let part = 1.0 / TEST_READINGS as f32;
        Ok((sums.0.map(|sum| sum * part * 70e-3_f32.to_radians()), sums.1.map(|sum| sum * part * 0.122e-3 * STANDARD_GRAVITY_M_S2)))
    }
}

impl<D: SensorSpi, C: Clock> Sensor for Ism330dhcx<D, C> {
    fn name(&self) -> &'static str {
        "ISM330DHCX"
    }

    async fn identify(&mut self) -> Result<(), SensorError> {
        self.line.set_mode(MODE_3)?;
        self.read(Reg::WhoAmI, 1).await?;
        let [who_am_i] = self.line.received();
        match (who_am_i, st::ISM330DHCX_ID) {
            (who_am_i, expected) if who_am_i == expected => Ok(()),
            (who_am_i @ (0x00 | 0xFF), expected) => Err(SensorError::Absent { who_am_i, expected }),
            (who_am_i, expected) => Err(SensorError::WrongChip { who_am_i, expected }),
        }
    }

    async fn configure(&mut self, wanted: &Setup) -> Result<InForce, SensorError> {
        let nothing = SensorError::InvalidData("the list of ranges is empty");
        let (rate_Hz, rate_code) = at_least(&RATES, wanted.data_rate_Hz, |r| r.0).ok_or(nothing)?;
        let cutoff_Hz = RATES.iter().zip(RATE_CUTOFFS_HZ).find(|((Hz, _), _)| *Hz == rate_Hz).map_or(0.0, |(_, cutoff)| cutoff);
        let (deg_s, rate_range, mdps) = at_least(&RATE_RANGES, wanted.rate_range_rad_s.to_degrees(), |r| r.0).ok_or(nothing)?;
        let (g, accel_range, mg) = at_least(&ACCEL_RANGES, wanted.accel_range_m_s2 / STANDARD_GRAVITY_M_S2, |r| r.0).ok_or(nothing)?;
        self.reset().await?;
        let continuous = FifoCtrl4::new().with_fifo_mode(FifoMode::StreamMode as u8).with_odr_ts_batch(OdrTsBatch::_1 as u8);
        self.set_all(&[
            // Device configuration as AN5398 §4 recommends; I²C off.
            (Reg::Ctrl9Xl, Ctrl9Xl::new().with_device_conf(1).into_bits()),
            (Reg::Ctrl4C, Ctrl4C::new().with_i2c_disable(1).with_lpf1_sel_g(1).into_bits()),
            (Reg::Ctrl6C, Ctrl6C::new().into_bits()),
            (Reg::Ctrl8Xl, Ctrl8Xl::new().with_hpcf_xl(HPCF_TENTH).into_bits()),
            (Reg::Ctrl10C, Ctrl10C::new().with_timestamp_en(1).into_bits()),
            (Reg::FifoCtrl3, FifoCtrl3::new().with_bdr_gy(rate_code).with_bdr_xl(rate_code).into_bits()),
            // The ranges of 125 and 4000 °/s are the low bits of the same code.
            (Reg::Ctrl2G, rate_code << 4 | rate_range),
            (Reg::Ctrl1Xl, Ctrl1Xl::new().with_odr_xl(rate_code).with_fs_xl(accel_range).with_lpf2_xl_en(1).into_bits()),
            (Reg::FifoCtrl4, continuous.into_bits()),
        ])
        .await?;
        self.read(Reg::InternalFreqFine, 1).await?;
        let fine = f64::from(i8::from_le_bytes(self.line.received()));
        self.rate_rad_s = (mdps * 1e-3).to_radians();
        self.accel_m_s2 = mg * 1e-3 * STANDARD_GRAVITY_M_S2;
        self.decoder = Decoder::default();
        let setup = Setup { data_rate_Hz: rate_Hz, rate_range_rad_s: deg_s.to_radians(), accel_range_m_s2: g * STANDARD_GRAVITY_M_S2 };
        Ok(InForce {
            setup,
            rate_cutoff_Hz: cutoff_Hz,
            accel_cutoff_Hz: rate_Hz * ACCEL_CUTOFF_PART,
            stamp_s: STAMP_S / (1.0 + FINE * fine),
        })
    }

    async fn ready(&mut self) -> Result<Ready, SensorError> {
        self.read(Reg::StatusRegOrSpiaux, 1).await?;
        let [status] = self.line.received();
        let status = StatusReg::from_bits(status);
        Ok(Ready { rate: status.gda() != 0, accel: status.xlda() != 0, temperature: status.tda() != 0 })
    }

    async fn drain(&mut self, samples: &mut [Sample]) -> Result<Drained, SensorError> {
        let mut drained = Drained::default();
        while drained.samples < samples.len() {
            self.read(Reg::FifoStatus1, 2).await?;
            let [low, high] = self.line.received();
            let flags = FifoStatus2::from_bits(high);
            let level = u16::from_le_bytes([low, flags.diff_fifo()]);
            if level > FIFO_WORDS {
                return Err(SensorError::InvalidData("the FIFO level exceeds its capacity"));
            }
            // The chip does not count overwritten words; an overrun counts as one lost sample.
            let overrun = flags.fifo_ovr_ia() != 0;
            drained.lost = drained.lost.saturating_add(u32::from(overrun && !self.overrun));
            self.overrun = overrun;
            let room = samples.len().saturating_sub(drained.samples).saturating_mul(3);
            let words = usize::from(level).min(BURST_WORDS).min(room);
            if words == 0 {
                break;
            }
            self.read(Reg::FifoDataOutTag, words.saturating_mul(WORD)).await?;
            let (whole, _) = self.line.bytes.get(1..).unwrap_or_default().as_chunks::<WORD>();
            for word in whole.iter().take(words) {
                match self.decoder.take(*word, self.rate_rad_s, self.accel_m_s2) {
                    Decoded::Incomplete => {}
                    Decoded::Refused => drained.refused = drained.refused.saturating_add(1),
                    Decoded::Sample(sample) => {
                        if let Some(place) = samples.get_mut(drained.samples) {
                            *place = sample;
                            drained.samples = drained.samples.saturating_add(1);
                        }
                    }
                }
            }
            if words == usize::from(level) {
                break;
            }
        }
        drained.lost = drained.lost.saturating_add(self.decoder.take_lost());
        Ok(drained)
    }

    async fn stamp(&mut self) -> Result<Stamped<u32>, SensorError> {
        let before = self.line.clock.now();
        self.read(Reg::Timestamp0, 4).await?;
        let at = before + ((self.line.clock.now() - before) >> 1);
        Ok(Stamped { value: u32::from_le_bytes(self.line.received()), at })
    }

    async fn temperature_C(&mut self) -> Result<f32, SensorError> {
        self.read(Reg::OutTempL, 2).await?;
        Ok(st::from_lsb_to_celsius(i16::from_le_bytes(self.line.received())))
    }

    async fn self_test(&mut self) -> Result<SelfTest, SensorError> {
        self.reset().await?;
        let quiet = Ctrl5C::new().into_bits();
        let moved = Ctrl5C::new().with_st_xl(StXl::Positive as u8).with_st_g(StGy::Positive as u8).into_bits();
        let mut means = [([0.0; 3], [0.0; 3]); 2];
        for (mean, test) in means.iter_mut().zip([quiet, moved]) {
            self.set_all(&[
                (Reg::Ctrl1Xl, Ctrl1Xl::new().with_odr_xl(OdrXl::_52hz as u8).with_fs_xl(FsXl::_4g as u8).into_bits()),
                (Reg::Ctrl2G, (OdrGy::_208hz as u8) << 4 | FsGy::_2000dps as u8),
                (Reg::Ctrl5C, test),
            ])
            .await?;
            self.line.wait(TEST_SETTLING).await;
            // The first mean is discarded.
            for _ in 0..2 {
                *mean = self.mean().await?;
            }
        }
        self.set_all(&[(Reg::Ctrl5C, quiet)]).await?;
        let [without, with] = means;
        let change = |with: [f32; 3], without: [f32; 3]| {
            let ([a, b, c], [d, e, f]) = (with, without);
            [a - d, b - e, c - f]
        };
        let (rate_rad_s, accel_m_s2) = (change(with.0, without.0), change(with.1, without.1));
        let within = |(least, greatest): (f32, f32), value: f32| value >= least && value <= greatest;
        let passed = accel_m_s2.iter().all(|a| within(TEST_MG, a.abs() / STANDARD_GRAVITY_M_S2 * 1e3))
            && rate_rad_s.iter().all(|r| within(TEST_DEG_S, r.abs().to_degrees()));
        Ok(SelfTest { rate_rad_s, accel_m_s2, passed })
    }
}
