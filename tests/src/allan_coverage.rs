//! Records of a sensor at rest with known noise: coverage of the coefficients of an Allan analysis.
//!
//! Input: seeds. The rows are means over their interval, as an integrating gyro gives them: single samples of flicker noise would fold its fast part into N.
//! Each record has white noise, flicker noise and random walk of random size, as an inertial sensor has. Output: a [`CoverageTable`] of N, B, K
//! where the record shows them, and of the limits where it does not.

use crate::coverage_table::CoverageTable;
use hal_sim::peripherals::{Noise, SlowNoise};
use identification::log::{Column, Log};
use rayon::prelude::*;
use stand_analysis::allan::{Answer, Request, Taus};
use std::path::Path;

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
    /// The mixture of a seed: N of 0.05 to 0.5 °/√h, B of 1 to 10 °/h, K of 5 to 100 °/h/√h, one to three hours; one in six without flicker noise, one in six
    /// without random walk.
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

    /// Analyses the record by the command's library call, from a log in this folder.
    ///
    /// # Panics
    /// The log cannot be written or analysed.
    pub fn answer(&self, seed: u64, folder: &Path) -> Answer {
        let rates = self.rates(seed);
        let t_s = (0..rates.len()).map(|k| k as f64 * self.interval_s).collect();
        let path = folder.join(format!("record-{seed}.parquet"));
        let columns = [("t_s", t_s), ("gyro_rad_s", rates)].map(|(name, values)| Column { name: name.to_owned(), values });
        let log = Log::new(&path, columns.into(), Vec::new()).unwrap_or_else(|e| panic!("{seed}: {e}"));
        log.write(&path).unwrap_or_else(|e| panic!("{seed}: {e}"));
        let request =
            Request { log: path.clone(), column: "gyro_rad_s".into(), from_s: None, to_s: None, taus: Taus::Octave, interpretation: None };
        let answer = request.answer().unwrap_or_else(|e| panic!("{seed}: {e}"));
        // A file that remains does no harm.
        let _ = std::fs::remove_file(&path);
        answer
    }

    /// Adds the coefficients of a seed to the table.
    pub fn add(&self, seed: u64, folder: &Path, table: &mut CoverageTable) {
        let answer = self.answer(seed, folder);
        let units = [1.0, DEG_H * 60.0, DEG_H, DEG_H / 60.0, 1.0];
        let truths = [0.0, self.white, self.flicker, self.walk, 0.0];
        let names = ["Q", "N, °/√h", "B, °/h", "K, °/h/√h", "R"];
        let what = format!(
            "seed {seed} (N {:.3}, B {:.2}, K {:.1}, {:.1} h)",
            self.white / units[1],
            self.flicker / units[2],
            self.walk / units[3],
            self.rows as f64 * self.interval_s / 3600.0
        );
        for (p, coefficient) in answer.coefficients.iter().enumerate() {
            let truth = truths[p] / units[p];
            match (coefficient.estimate, coefficient.within_95, coefficient.below) {
                (Some(found), Some([low, high]), _) => {
                    // The interval is not symmetric: both the interval and ± U are counted.
                    let (low, high) = (low / units[p], high / units[p]);
                    table.add(&format!("{}, interval", names[p]), 0.5 * (low + high), 0.5 * (high - low), truth, &what);
                    let expanded = found.expanded().unwrap_or(0.0) / units[p];
                    table.add(&format!("{} ± U", names[p]), found.value / units[p], expanded, truth, &what);
                }
                (_, _, Some(below)) if (1..4).contains(&p) => {
                    table.add_limit(&format!("{}, limit", names[p]), below / units[p], truth, &what)
                }
                _ => {}
            }
        }
    }
}

/// The table over these seeds; the folder is used for the records.
pub fn table(seeds: std::ops::Range<u64>, folder: &Path) -> CoverageTable {
    seeds
        .into_par_iter()
        .map(|seed| {
            let mut table = CoverageTable::default();
            Mixture::drawn(seed).add(seed, folder, &mut table);
            table
        })
        .reduce(CoverageTable::default, |mut all, more| {
            all.merge(more);
            all
        })
}
