//! Coverage of the expanded uncertainties of calibrations: random devices and drives, complete sessions over the simulated serial line. Every reported quantity
//! that has a true value is compared; each miss beyond 3 u is printed with the largest contribution of its budget.
//!
//! `cargo bench -p stand-tests --bench calibration -- [PARTS] [FIRST] [gyro|accel|drive]`; the environment variable `CALIBRATION_LOGS` names a folder in which the
//! sessions are kept and used again.

use std::collections::BTreeMap;
use std::path::PathBuf;

use identification::statistics::distributions::binomial_interval;
use rayon::prelude::*;
use stand_analysis::calibrate::DutKind;
use stand_tests::drawn_parts::{Compared, DESCRIPTIVE, calibrated};

fn main() {
    // Cargo itself passes `--bench`.
    let numbers: Vec<u64> = std::env::args().skip(1).filter_map(|word| word.parse().ok()).collect();
    let (parts, first) = (numbers.first().copied().unwrap_or(1000), numbers.get(1).copied().unwrap_or(1));
    let kept = std::env::var_os("CALIBRATION_LOGS").map(PathBuf::from);
    let (low, high) = binomial_interval(parts, 0.95, 0.99);
    println!(
        "parts {first} to {}; intervals of 95 %, of which {:.1} to {:.1} % are expected inside (99 % interval at n = {parts})",
        first + parts - 1,
        100.0 * low,
        100.0 * high
    );
    println!("| calibration | quantity | n | inside U | within the 99 % interval | mean error / u | rms error / u | median u |");
    println!("|---|---|---|---|---|---|---|---|");
    let mut misses = Vec::new();
    let only: Vec<String> = std::env::args().skip(1).filter(|w| !w.starts_with("--")).collect();
    for what in [DutKind::Gyro, DutKind::Accel, DutKind::Drive] {
        if only.iter().any(|w| ["gyro", "accel", "drive"].contains(&w.as_str())) && !only.iter().any(|w| w == what.name()) {
            continue;
        }
        let all: Vec<(u64, Compared)> = (first..first + parts)
            .into_par_iter()
            .flat_map_iter(|seed| {
                let base = kept.clone().unwrap_or_else(|| std::env::temp_dir().join(format!("calibration-{}", std::process::id())));
                let folder = base.join(format!("{}-{seed}", what.name()));
                let found = calibrated(what, seed, &folder);
                if kept.is_none() {
                    let _ = std::fs::remove_dir_all(&folder);
                }
                found.into_iter().map(move |c| (seed, c)).collect::<Vec<_>>()
            })
            .collect();
        let mut by_name: BTreeMap<&str, Vec<&Compared>> = BTreeMap::new();
        for (seed, c) in &all {
            by_name.entry(&c.name).or_default().push(c);
            if c.error_u().abs() > 3.0 {
                let line = format!(
                    "{} {seed}: {} off by {:+.1} u; largest contribution: {}",
                    what.name(),
                    c.name,
                    c.error_u(),
                    c.largest_contribution()
                );
                misses.push(line);
            }
        }
        for (name, of) in by_name {
            let n = of.len() as f64;
            let share = of.iter().filter(|c| c.found.covers(c.truth)).count() as f64 / n;
            let (low, high) = binomial_interval(of.len() as u64, 0.95, 0.99);
            let mean = of.iter().map(|c| c.error_u()).sum::<f64>() / n;
            let rms = (of.iter().map(|c| c.error_u().powi(2)).sum::<f64>() / n).sqrt();
            let mut size: Vec<f64> = of.iter().map(|c| c.found.combined_u()).collect();
            size.sort_by(f64::total_cmp);
            println!(
                "| {} | `{name}` | {} | {:.1} % | {} | {mean:+.2} | {rms:.2} | {:.1e} {} |",
                what.name(),
                of.len(),
                100.0 * share,
                if share < low {
                    "below"
                } else if share > high {
                    "above"
                } else {
                    "yes"
                },
                size[size.len() / 2],
                if of[0].found.unit == "1" { "" } else { &of[0].found.unit },
            );
        }
    }
    println!("\nDescribe the record and have no true value: {}.", DESCRIPTIVE.join(", "));
    println!("Errors beyond 3 u: {}", misses.len());
    misses.iter().for_each(|line| println!("{line}"));
}
