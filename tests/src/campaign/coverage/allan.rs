//! `allan`: records of a sensor at rest with known noise. Conditions: `mixture`, noise alone; and the same with a [`Disturbance`]:
//! `warm-up`, `wild-rows`, `periodic`, `rounded`.
//!
//! The rows are means over their interval, as an integrating gyro gives them: single samples of flicker noise would fold its fast part into
//! N. Each record has white noise, flicker noise and random walk of random size, as an inertial sensor has. Quantities: N (white noise), B
//! (flicker noise), K (random walk), Q (quantisation) and R (ramp), each as `…_interval` (the reported asymmetric interval), as
//! `…_plus_minus_U` (value ± U, U the distance to the farther end of the interval), or as `…_limit` (the upper limit of a coefficient that
//! the record does not show).

use hal_sim::peripherals::{Noise, SlowNoise};
use identification::log::{Column, Log};
use stand_analysis::allan::{Answer, Request, Taus};
use std::path::Path;

use super::{Interval, Measured, TemporaryFolder};
use crate::TWO_SIDED_95;
use crate::campaign::inputs::InputHash;

/// Condition, first seed, number of records.
const CONDITIONS: [(&str, u64, u64, Option<Disturbance>); 5] = [
    ("mixture", 9001, 150, None),
    ("warm-up", 12_001, 80, Some(Disturbance::WarmUp)),
    ("wild-rows", 12_201, 80, Some(Disturbance::WildRows)),
    ("periodic", 12_401, 80, Some(Disturbance::Periodic)),
    ("rounded", 12_601, 80, Some(Disturbance::Rounded)),
];

/// What a record contains besides its noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Disturbance {
    /// A decaying exponential of 20 to 200 °/h, with a time constant of 3 to 30 % of the record.
    WarmUp,
    /// 5 to 30 rows that are off by 20 to 60 standard deviations of a row.
    WildRows,
    /// A sinusoid of 3 to 60 °/h, with 1.5 to 500 periods in the record.
    Periodic,
    /// Rows rounded to a step of 0.3 to 4 standard deviations of a row.
    Rounded,
}

impl Disturbance {
    /// Adds itself to the rates, rad/s, of noise with this standard deviation of a row.
    fn add(self, rates: &mut [f64], seed: u64, row_sigma: f64) {
        let mut draw = Noise::new(seed, 54, 1.0);
        let mut log_uniform = |low: f64, high: f64| low * (high / low).powf(0.5 + draw.uniform(0.5));
        let rows = rates.len() as f64;
        match self {
            Disturbance::WarmUp => {
                let (size, time_constant) = (log_uniform(20.0, 200.0) * DEG_H, log_uniform(0.03, 0.3) * rows);
                rates.iter_mut().enumerate().for_each(|(k, rate)| *rate += size * (-(k as f64) / time_constant).exp());
            }
            Disturbance::WildRows => {
                for k in 0..log_uniform(5.0, 30.0) as usize {
                    let size = log_uniform(20.0, 60.0) * row_sigma;
                    let row = (rows * (log_uniform(1.0, std::f64::consts::E)).ln()) as usize;
                    rates[row.min(rates.len() - 1)] += if k % 2 == 0 { size } else { -size };
                }
            }
            Disturbance::Periodic => {
                let (size, periods, phase) = (log_uniform(3.0, 60.0) * DEG_H, log_uniform(1.5, 500.0), log_uniform(1.0, 500.0));
                let angle = |k: usize| std::f64::consts::TAU * periods * k as f64 / rows + phase;
                rates.iter_mut().enumerate().for_each(|(k, rate)| *rate += size * angle(k).sin());
            }
            Disturbance::Rounded => {
                let step = log_uniform(0.3, 4.0) * row_sigma;
                rates.iter_mut().for_each(|rate| *rate = (*rate / step).round() * step);
            }
        }
    }
}

pub(super) fn conditions() -> Vec<(String, u64, u64)> {
    CONDITIONS.iter().map(|(name, first, cases, _)| ((*name).to_owned(), *first, *cases)).collect()
}

pub(super) fn measured(condition: &str, seed: u64) -> Result<Measured, String> {
    let Some((.., disturbance)) = CONDITIONS.iter().find(|(name, ..)| *name == condition) else {
        return Err(format!("no condition `{condition}`"));
    };
    let folder = TemporaryFolder::new(&format!("allan-{seed}"));
    std::fs::create_dir_all(&folder.0).map_err(|e| e.to_string())?;
    let mixture = Mixture::drawn(seed);
    let log = mixture.log(seed, *disturbance, &folder.0);
    let answer = mixture.answer(&log);
    Ok(Measured { inputs: InputHash::default().log(&log).short(), intervals: answer.map(|answer| mixture.intervals(&answer)) })
}

/// One degree per hour, rad/s.
const DEG_H: f64 = std::f64::consts::PI / 180.0 / 3600.0;

/// Noise of a record, in rad and s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mixture {
    /// N, rad/√s.
    pub white: f64,
    /// B, rad/s; 0: none.
    pub flicker: f64,
    /// K, rad/s/√s; 0: none.
    pub walk: f64,
    /// Interval of the rows, s.
    pub interval_s: f64,
    /// Rows.
    pub rows: usize,
}

impl Mixture {
    /// The mixture of a seed: N of 0.05 to 0.5 °/√h, B of 1 to 10 °/h, K of 5 to 100 °/h/√h, one to three hours; one in six without flicker
    /// noise, one in six without random walk.
    pub fn drawn(seed: u64) -> Self {
        let mut draw = Noise::new(seed, 50, 1.0);
        let mut log_uniform = |low: f64, high: f64| low * (high / low).powf(0.5 + draw.uniform(0.5));
        let white = log_uniform(0.05, 0.5) * DEG_H * 60.0;
        let (flicker, walk) = (log_uniform(1.0, 10.0) * DEG_H, log_uniform(5.0, 100.0) * DEG_H / 60.0);
        let hours = log_uniform(1.0, 3.0);
        // From 0.2 s on the simulated flicker noise has its nominal floor within 2 %.
        let interval_s = 0.2;
        Self {
            white,
            flicker: if seed % 6 == 4 { 0.0 } else { flicker },
            walk: if seed % 6 == 5 { 0.0 } else { walk },
            interval_s,
            rows: (hours * 3600.0 / interval_s) as usize,
        }
    }

    /// The rates of the record. The first hours of the flicker noise are left out, so that it is stationary.
    pub fn rates(&self, seed: u64) -> Vec<f64> {
        const WARM_S: f64 = 7200.0;
        // Interval between two values of the simulated flicker noise.
        const FLICKER_STEP_S: f64 = 0.01;
        let mut white = Noise::new(seed, 51, self.white / self.interval_s.sqrt());
        let mut flicker = SlowNoise::new(seed, 52, self.flicker, 0.0);
        let mut step = Noise::new(seed, 53, self.walk * self.interval_s.sqrt());
        let mut level = 0.0;
        let parts = (self.interval_s / FLICKER_STEP_S).round();
        (0..self.rows)
            .map(|k| {
                level += step.draw();
                let part = |j: f64| (k as f64 + (j + 0.5) / parts) * self.interval_s;
                let mean = (0..parts as usize).map(|j| flicker.at(WARM_S + part(j as f64))).sum::<f64>() / parts;
                white.draw() + mean + level
            })
            .collect()
    }

    /// The record with a disturbance, as a log that is not written yet, for this folder.
    ///
    /// # Panics
    /// Never: the columns are those of a log.
    pub fn log(&self, seed: u64, disturbance: Option<Disturbance>, folder: &Path) -> Log {
        let mut rates = self.rates(seed);
        if let Some(disturbance) = disturbance {
            disturbance.add(&mut rates, seed, self.white / self.interval_s.sqrt());
        }
        let t_s = (0..rates.len()).map(|k| k as f64 * self.interval_s).collect();
        let columns = [("t_s", t_s), ("gyro_rad_s", rates)].map(|(name, values)| Column { name: name.to_owned(), values });
        Log::new(folder.join(format!("record-{seed}.parquet")), columns.into(), Vec::new()).expect("the columns of a log")
    }

    /// Writes the record and analyses it by the command's library call.
    ///
    /// # Errors
    /// The log cannot be written or analysed.
    pub fn answer(&self, log: &Log) -> Result<Answer, String> {
        log.write(log.path()).map_err(|e| e.to_string())?;
        let request = Request {
            log: log.path().into(),
            column: "gyro_rad_s".into(),
            from_s: None,
            to_s: None,
            taus: Taus::Octave,
            interpretation: None,
        };
        request.answer().map_err(|e| e.to_string())
    }

    fn intervals(&self, answer: &Answer) -> Vec<Interval> {
        let truths = [("Q", 0.0), ("N", self.white), ("B", self.flicker), ("K", self.walk), ("R", 0.0)];
        let mut intervals = Vec::new();
        for ((name, truth), coefficient) in truths.into_iter().zip(&answer.coefficients) {
            let mut add =
                |kind: &str, error_sigma, covers| intervals.push(Interval { quantity: format!("{name}_{kind}"), error_sigma, covers });
            match (coefficient.estimate, coefficient.within_95, coefficient.below) {
                (Some(found), Some([low, high]), _) => {
                    // Error from the middle of the interval, whose half width is 1.96 standard uncertainties.
                    let error = (0.5 * (low + high) - truth) / (0.5 * (high - low) / TWO_SIDED_95);
                    add("interval", Some(error), (low..=high).contains(&truth));
                    add("plus_minus_U", found.expanded().map(|U| (found.value - truth) / (U / TWO_SIDED_95)), found.covers(truth));
                }
                (_, _, Some(below)) if name != "Q" && name != "R" => add("limit", None, truth <= below),
                _ => {}
            }
        }
        intervals
    }
}
