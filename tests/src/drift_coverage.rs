//! Drift sessions on the simulated stand with known truth: coverage of own drift, apparent drift, azimuth and asymmetry of the torquer.
//!
//! Input: a case (how the drift moves) and seeds. Each session draws own drift, site, lag, unequal currents and an asymmetry of the torquer. Output: a
//! [`CoverageTable`] against the truth; the true own drift is its mean over the cycles.

use crate::coverage_table::CoverageTable;
use hal_sim::gyro::{DEG_H, Orientation, OwnDrift, SingleAxis, Site};
use hal_sim::peripherals::Noise;
use rayon::prelude::*;
use stand_acquire::drift_session::{CyclePlan, DriftSessionRequest, VisitOrder, simulate};
use stand_analysis::drift::measurement::SetupUncertainties;
use stand_analysis::drift::{DriftResult, Measurement};
use std::f64::consts::PI;

/// How the drift moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriftCase {
    /// Name in the table.
    pub name: &'static str,
    /// Flicker noise B, °/h.
    pub flicker_deg_h: f64,
    /// Random walk K, °/h/√h.
    pub walk_deg_h_sqrt_h: f64,
    /// Ramp, °/h per minute.
    pub ramp_deg_h_min: f64,
    /// Standard deviation of the level after each turn, rad.
    pub level_error_rad: f64,
    /// Cycles in each position at each rate.
    pub cycles: u32,
    /// Four positions instead of two.
    pub four_positions: bool,
}

impl DriftCase {
    /// The cases of the bench. All have flicker noise, as a real gyroscope.
    pub const ALL: [Self; 5] = [
        Self {
            name: "steady",
            flicker_deg_h: 0.003,
            walk_deg_h_sqrt_h: 0.0,
            ramp_deg_h_min: 0.0,
            level_error_rad: 0.0,
            cycles: 4,
            four_positions: false,
        },
        Self {
            name: "walk",
            flicker_deg_h: 0.003,
            walk_deg_h_sqrt_h: 0.6,
            ramp_deg_h_min: 0.0,
            level_error_rad: 0.0,
            cycles: 4,
            four_positions: false,
        },
        Self {
            name: "ramp",
            flicker_deg_h: 0.003,
            walk_deg_h_sqrt_h: 0.0,
            ramp_deg_h_min: 0.5,
            level_error_rad: 0.0,
            cycles: 4,
            four_positions: false,
        },
        Self {
            name: "walk, four positions",
            flicker_deg_h: 0.003,
            walk_deg_h_sqrt_h: 0.6,
            ramp_deg_h_min: 0.0,
            level_error_rad: 0.0,
            cycles: 2,
            four_positions: true,
        },
        Self {
            name: "offsets of the visits",
            flicker_deg_h: 0.003,
            walk_deg_h_sqrt_h: 0.0,
            ramp_deg_h_min: 0.0,
            level_error_rad: 5e-3,
            cycles: 4,
            four_positions: false,
        },
    ];

    /// The gyroscope with this seed.
    fn gyroscope(&self, seed: u64) -> SingleAxis {
        let mut draw = Noise::new(seed, 30, 1.0);
        let mut uniform = |low: f64, high: f64| low + (high - low) * (0.5 + draw.uniform(0.5));
        let own = OwnDrift {
            constant_rad_s: uniform(-5.0, 5.0) * DEG_H,
            flicker_rad_s: self.flicker_deg_h * DEG_H,
            random_walk_rad_s_sqrt_s: self.walk_deg_h_sqrt_h * DEG_H / 60.0,
            ramp_rad_s2: self.ramp_deg_h_min * DEG_H / 60.0,
            ..OwnDrift::default()
        };
        let azimuth = if self.four_positions { uniform(-170.0, 170.0) } else { uniform(30.0, 150.0) };
        let site = Site { latitude_rad: uniform(30.0, 75.0).to_radians(), azimuth_rad: azimuth.to_radians() };
        let mut gyroscope = SingleAxis::default();
        (gyroscope.own, gyroscope.site, gyroscope.level_error_rad) = (own, site, self.level_error_rad);
        let torquer = &mut gyroscope.torquer;
        (torquer.lag_s, torquer.inequality, torquer.gain_inequality) = (uniform(0.5e-3, 3e-3), uniform(-3e-4, 3e-4), uniform(-5e-3, 5e-3));
        gyroscope
    }

    fn request(&self) -> DriftSessionRequest {
        let turned: &[f64] = if self.four_positions { &[0.0, 0.5, 1.0, 1.5] } else { &[0.0, 1.0] };
        DriftSessionRequest {
            plan: CyclePlan {
                shape: "RECTangular",
                reversed: false,
                sequence: "BOTH",
                pulse_s: 5.0,
                period_s: 0.02,
                rest_s: 4.0,
                cycles: self.cycles,
            },
            rates_rad_s: [0.05_f64, 0.02].map(f64::to_radians).to_vec(),
            positions: turned.iter().map(|half_turns| Orientation { turned_rad: half_turns * PI, ..Orientation::default() }).collect(),
            order: VisitOrder::Abba,
            rounds: 2,
            turn_by_drive: false,
            keep_rows: false,
        }
    }

    /// Simulates and evaluates the session with this seed; adds its results to the table.
    ///
    /// # Panics
    /// The session fails, or is refused although nothing is wrong.
    pub fn run(&self, seed: u64, table: &mut CoverageTable) -> DriftResult {
        let gyroscope = self.gyroscope(seed);
        let recording =
            simulate(gyroscope.clone(), seed, &self.request(), |_| true).unwrap_or_else(|e| panic!("{} {seed}: {e}", self.name));
        let latitude_deg = gyroscope.site.latitude_rad.to_degrees();
        let measurement = Measurement::of_recording("simulated".to_owned(), &recording, Some(latitude_deg), SetupUncertainties::default());
        let result = measurement.and_then(Measurement::evaluate).unwrap_or_else(|e| panic!("{} {seed}: {e}", self.name));
        let found = &result.corrected;
        let what = format!("{} {seed}", self.name);
        let mut add = |name: &str, estimate: &identification::statistics::uncertainty::Estimate, truth: f64, unit: f64| {
            let expanded = estimate.expanded().unwrap_or_else(|| panic!("{what}: {name} has no uncertainty"));
            table.add(name, estimate.value / unit, expanded / unit, truth / unit, &what);
        };
        add("own drift, °/h", &found.own_rad_s[0], self.true_own_rad_s(&gyroscope, seed, &result), DEG_H);
        add("apparent drift, °/h", &found.apparent_rad_s[0], gyroscope.apparent_rad_s(0.0), DEG_H);
        let azimuth = found.azimuth_rad.unwrap_or_else(|| panic!("{what}: no azimuth"));
        // Angles near ± 180° are compared on the circle.
        let truth = gyroscope.site.azimuth_rad;
        let nearest = truth + ((azimuth.value - truth) / (2.0 * PI)).round() * 2.0 * PI;
        add("azimuth, °", &azimuth, nearest, 1_f64.to_radians());
        // (1 + inequality)(1 + gain inequality) − 1; the current corrects the first.
        add("asymmetry of the torquer, %", &found.inequality[0], gyroscope.torquer.gain_inequality, 0.01);
        result
    }

    /// Mean of the own drift over the cycles, with the triangular weight of each.
    fn true_own_rad_s(&self, gyroscope: &SingleAxis, seed: u64, result: &DriftResult) -> f64 {
        const POINTS: usize = 40;
        let mut slow = gyroscope.own.slow_noise(seed);
        let mut cycles = result.measurement.valid_cycles();
        cycles.sort_by(|a, b| a.start_s.total_cmp(&b.start_s));
        let mut sum = 0.0;
        for cycle in &cycles {
            for k in 0..2 * POINTS {
                let share = (k as f64 + 0.5) / POINTS as f64;
                let t_s = cycle.start_s + share * cycle.integral.pulse_s;
                let weight = (1.0 - (share - 1.0).abs()) / POINTS as f64;
                sum += weight * (slow.at(t_s) + gyroscope.own.ramp_rad_s2 * t_s);
            }
        }
        gyroscope.own.constant_rad_s + sum / cycles.len() as f64
    }

    /// The table over these seeds.
    pub fn table(&self, seeds: std::ops::Range<u64>) -> CoverageTable {
        seeds
            .into_par_iter()
            .map(|seed| {
                let mut table = CoverageTable::default();
                self.run(seed, &mut table);
                table
            })
            .reduce(CoverageTable::default, |mut all, more| {
                all.merge(more);
                all
            })
    }
}
