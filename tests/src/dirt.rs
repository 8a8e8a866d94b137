//! Imperfections of real benches, added to simulated logs.
//!
//! In: a log of the simulated stand, a kind of dirt, a seed. Out: the log as a laboratory would have recorded it. The dynamics are
//! unchanged: a null stays a null.

use identification::identify::fit::noise;
use identification::log::{Column, Log, Notes};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// A kind of imperfection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dirt {
    /// None: the log as it is.
    Clean,
    /// Time stamps with an even error of ±20 % of the interval.
    Jitter,
    /// One value in a thousand of each measured channel is 20 standard deviations of its noise off.
    Outliers,
    /// An autoregressive noise (0.9 per row) of twice the white noise on rate and current.
    Coloured,
    /// 200 Hz; the voltage is its value at the time of the row.
    SlowInstant,
    /// 200 Hz; the voltage is the mean over the row, within which it moves.
    SlowMean,
    /// An encoder of 1000 counts per turn.
    Counts,
}

/// Probability of an outlier.
const OUTLIER_PROBABILITY: f64 = 1e-3;
/// Size of an outlier, standard deviations.
const OUTLIER_SIGMAS: f64 = 20.0;
/// Autoregressive coefficient of coloured noise.
const COLOUR: f64 = 0.9;
/// Standard deviation of coloured noise over that of the white noise.
const COLOURED_RATIO: f64 = 2.0;
/// Counts per turn of a coarse encoder.
const COARSE_COUNTS: f64 = 1000.0;
/// Rows of a log at 1 kHz that make a row at 200 Hz.
const DECIMATION: usize = 5;

impl Dirt {
    /// All kinds.
    pub const ALL: [Dirt; 7] = [Dirt::Clean, Dirt::Jitter, Dirt::Outliers, Dirt::Coloured, Dirt::SlowInstant, Dirt::SlowMean, Dirt::Counts];

    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Dirt::Clean => "clean",
            Dirt::Jitter => "jitter",
            Dirt::Outliers => "outliers",
            Dirt::Coloured => "coloured",
            Dirt::SlowInstant => "slow-instant",
            Dirt::SlowMean => "slow-mean",
            Dirt::Counts => "counts",
        }
    }

    /// The kind of this name.
    pub fn by_name(name: &str) -> Option<Dirt> {
        Dirt::ALL.into_iter().find(|d| d.name() == name)
    }

    /// The log with this dirt.
    ///
    /// # Panics
    /// The log has no rows.
    pub fn on(self, log: &Log, seed: u64) -> Log {
        let mut draw = Draw(Xoshiro256PlusPlus::seed_from_u64(seed ^ 0x6469_7274));
        let mut columns: Vec<Column> = log.columns().to_vec();
        let mut notes = log.notes().clone();
        match self {
            Dirt::Clean => {}
            Dirt::Jitter => {
                let dt_s = log.median_dt_s();
                for column in columns.iter_mut().filter(|c| c.name == "t_s") {
                    column.values.iter_mut().for_each(|t| *t += 0.2 * dt_s * (2.0 * draw.even() - 1.0));
                }
            }
            Dirt::Outliers => {
                for column in columns.iter_mut().filter(|c| MEASURED.contains(&c.name.as_str())) {
                    let sigma = noise::of_series(column.values.iter().copied());
                    for value in &mut column.values {
                        if draw.even() < OUTLIER_PROBABILITY {
                            *value += if draw.even() < 0.5 { OUTLIER_SIGMAS } else { -OUTLIER_SIGMAS } * sigma;
                        }
                    }
                }
            }
            Dirt::Counts => {
                let count_rad = std::f64::consts::TAU / COARSE_COUNTS;
                for column in columns.iter_mut().filter(|c| c.name == "theta_rad") {
                    column.values.iter_mut().for_each(|angle| *angle = (*angle / count_rad).floor() * count_rad);
                }
            }
            Dirt::Coloured => {
                for column in columns.iter_mut().filter(|c| ["omega_rad_s", "i_A"].contains(&c.name.as_str())) {
                    let sigma = COLOURED_RATIO * noise::of_series(column.values.iter().copied());
                    let mut state = sigma * draw.normal();
                    for value in &mut column.values {
                        *value += state;
                        state = COLOUR * state + sigma * (1.0 - COLOUR * COLOUR).sqrt() * draw.normal();
                    }
                }
            }
            Dirt::SlowInstant | Dirt::SlowMean => {
                let slopes = columns.extract_if(.., |c| c.name == "u_slope_V").next();
                for column in &mut columns {
                    let instant = match column.name.as_str() {
                        "u_V" if self == Dirt::SlowInstant => {
                            // The column has means; the value at t is that at the begin of the row.
                            let slopes = slopes.iter().flat_map(|c| &c.values);
                            column.values.iter_mut().zip(slopes).for_each(|(mean, slope)| *mean -= slope);
                            true
                        }
                        "u_V" | "i_A" => false,
                        _ => true,
                    };
                    let rows = column.values.chunks_exact(DECIMATION);
                    column.values = if instant {
                        rows.map(|r| r[0]).collect()
                    } else {
                        rows.map(|r| r.iter().sum::<f64>() / DECIMATION as f64).collect()
                    };
                }
                // A logger of another maker states nothing about the voltage, and knows nothing of it within a row.
                let kept = notes.iter().filter(|(key, _)| key != "u_V").cloned().collect::<Vec<_>>();
                notes = Notes::from(kept);
            }
        }
        Log::new("session.parquet", columns, notes).expect("a valid log")
    }
}

/// Measured channels of a drive.
const MEASURED: [&str; 3] = ["i_A", "theta_rad", "omega_rad_s"];

/// Random numbers of a seed.
struct Draw(Xoshiro256PlusPlus);

impl Draw {
    fn even(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Normal deviate (Box and Muller, Ann. Math. Stat. 29 (1958) 610).
    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.even()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.even()).cos()
    }
}
