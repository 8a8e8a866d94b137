//! `drift`: whole sessions on the simulated stand. Conditions: how the drift moves ([`DriftCase`]).
//!
//! Each session draws own drift, site, lag, unequal currents and an asymmetry of the torquer. The true own drift is its mean over the
//! cycles.

use hal_sim::gyro::{DEG_H, Orientation, OwnDrift, SingleAxis, Site};
use hal_sim::peripherals::Noise;
use identification::statistics::uncertainty::Estimate;
use stand_acquire::drift_session::{CyclePlan, DriftSessionRequest, VisitOrder, simulate};
use stand_analysis::drift::measurement::SetupUncertainties;
use stand_analysis::drift::{DriftResult, Measurement};
use std::f64::consts::PI;

use super::{Interval, Measured};
use crate::campaign::inputs::InputHash;

const FIRST_SEED: u64 = 7001;
const CASES: u64 = 12;

pub(super) fn conditions() -> Vec<(String, u64, u64)> {
    DriftCase::ALL.map(|case| (case.name.to_owned(), FIRST_SEED, CASES)).to_vec()
}

pub(super) fn measured(condition: &str, seed: u64) -> Result<Measured, String> {
    DriftCase::ALL.iter().find(|case| case.name == condition).ok_or("no such condition")?.measured(seed)
}

/// How the drift moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriftCase {
    /// Name of the condition.
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
    /// The conditions. All have flicker noise, as a real gyroscope.
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
            name: "walk-four-positions",
            flicker_deg_h: 0.003,
            walk_deg_h_sqrt_h: 0.6,
            ramp_deg_h_min: 0.0,
            level_error_rad: 0.0,
            cycles: 2,
            four_positions: true,
        },
        Self {
            name: "visit-offsets",
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

    /// Simulates and evaluates the session with this seed.
    fn measured(&self, seed: u64) -> Result<Measured, String> {
        let gyroscope = self.gyroscope(seed);
        let recording = simulate(gyroscope.clone(), seed, &self.request(), |_| true).map_err(|e| e.to_string())?;
        let inputs = InputHash::default().text(&format!("{:?}", recording.cycles)).short();
        let latitude_deg = gyroscope.site.latitude_rad.to_degrees();
        let measurement = Measurement::of_recording("simulated".to_owned(), &recording, Some(latitude_deg), SetupUncertainties::default());
        let result = measurement.and_then(Measurement::evaluate).map_err(|e| e.to_string());
        Ok(Measured { inputs, intervals: result.map(|result| self.intervals(&gyroscope, seed, &result)) })
    }

    fn intervals(&self, gyroscope: &SingleAxis, seed: u64, result: &DriftResult) -> Vec<Interval> {
        let found = &result.corrected;
        let azimuth = found.azimuth_rad.map(|azimuth| {
            let truth = gyroscope.site.azimuth_rad;
            // Angles near ± 180° are compared on the circle.
            (azimuth, truth + ((azimuth.value - truth) / (2.0 * PI)).round() * 2.0 * PI)
        });
        let quantities = [
            ("own_drift", Some((found.own_rad_s[0], self.true_own_rad_s(gyroscope, seed, result)))),
            ("apparent_drift", Some((found.apparent_rad_s[0], gyroscope.apparent_rad_s(0.0)))),
            ("azimuth", azimuth),
            // (1 + inequality)(1 + gain inequality) − 1; the current corrects the first.
            ("torquer_asymmetry", Some((found.inequality[0], gyroscope.torquer.gain_inequality))),
        ];
        let interval = |(name, pair): (&str, Option<(Estimate, f64)>)| {
            let (estimate, truth) = pair?;
            let error_sigma = Some((estimate.value - truth) / estimate.sigma()?);
            Some(Interval { quantity: name.to_owned(), error_sigma, covers: estimate.covers(truth) })
        };
        quantities.into_iter().filter_map(interval).collect()
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
}
