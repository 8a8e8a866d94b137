//! A shaft and play under the speed loop, fitted with and without the first moment of the voltage within the row: what the true model
//! leaves, and coverage.
//!
//! `cargo bench -p stand-tests --bench voltage_slope -- [N]`: N logs per effect.

use std::collections::BTreeMap;

use identification::deadline::Deadline;
use identification::identify::evaluation::{Evaluation, ParameterTreatment, evaluate};
use identification::log::{Column, Log};
use rayon::prelude::*;
use stand_tests::TWO_SIDED_95;
use stand_tests::campaign::coverage::Interval;
use stand_tests::campaign::coverage::rows::{CoverageRecord, table};
use stand_tests::draw::Drawn;

const PROFILES: [&str; 3] = ["multi-step", "multisine", "prbs"];

fn main() {
    let count = std::env::args().skip(1).find_map(|w| w.parse().ok()).unwrap_or(30_u64);
    println!("{count} logs of 30 s per effect under the speed loop, the true model fitted from its true values");
    println!("| effect | logs fitted | worst channel, × noise: median | greatest |\n|---|---|---|---|");
    let mut rows = Vec::new();
    for effect in ["none", "compliance", "backlash"] {
        for with_slope in [true, false] {
            let fits: Vec<_> = (0..count).into_par_iter().filter_map(|k| fitted(effect, with_slope, k)).collect();
            let case = format!("{effect}, {} `u_slope_V`", if with_slope { "with" } else { "without" });
            let mut ratios: Vec<f64> = fits.iter().map(|f| f.worst_ratio).collect();
            ratios.sort_by(f64::total_cmp);
            let median = ratios.get(ratios.len() / 2).copied().unwrap_or(f64::NAN);
            println!("| {case} | {} | {median:.2} | {:.2} |", ratios.len(), ratios.last().copied().unwrap_or(f64::NAN));
            let mut by_name: BTreeMap<&str, Vec<Interval>> = BTreeMap::new();
            for (name, error, sigma) in fits.iter().flat_map(|f| &f.estimates) {
                let error_sigma = error / sigma;
                let interval =
                    Interval { quantity: name.clone(), error_sigma: Some(error_sigma), covers: error_sigma.abs() <= TWO_SIDED_95 };
                by_name.entry(name).or_default().push(interval);
            }
            let refused = count as usize - fits.len();
            rows.extend(by_name.iter().map(|(name, of)| CoverageRecord::counted(("fit", &case, name), count as usize, refused, of, "")));
        }
    }
    print!("\n{}", table(&rows));
}

/// The true model fitted to a log.
struct Fitted {
    /// rms of the worst channel over its noise.
    worst_ratio: f64,
    /// Name, error and standard error of each parameter.
    estimates: Vec<(String, f64, f64)>,
}

/// `None` where the log is refused.
fn fitted(effect: &str, with_slope: bool, k: u64) -> Option<Fitted> {
    let (profile, seed) = (PROFILES[k as usize % 3], 2000 + k);
    let drawn = match effect {
        "none" => Drawn::by_name(&format!("nulls/rate/{profile}/{seed}")),
        _ => Drawn::by_name(&format!("own/{effect}/rate/{profile}/{seed}")),
    };
    let drawn = drawn?;
    let mut log = drawn.log();
    if !with_slope {
        let columns = log.columns().iter().filter(|c| c.name != "u_slope_V");
        let columns = columns.map(|c| Column { name: c.name.clone(), values: c.values.clone() }).collect();
        log = Log::new("without.parquet", columns, log.notes().to_vec()).ok()?;
    }
    let truth = drawn.true_model();
    let Ok(Evaluation::Evaluated(fitted)) = evaluate(&log, &truth, ParameterTreatment::Fitted, Deadline::NEVER) else { return None };
    let result = &fitted.result;
    let known = result.parameters.list.iter().zip(&result.sigmas).filter(|(p, sigma)| !p.fixed && **sigma > 0.0);
    let estimates = known.filter_map(|(p, sigma)| Some((p.name.clone(), p.value - truth.value(&p.name)?, *sigma))).collect();
    Some(Fitted { worst_ratio: result.channels.iter().map(|c| c.rms / c.noise).fold(0.0, f64::max), estimates })
}
