//! Coverage of the expanded uncertainties of calibrations: random devices and drives, complete sessions over the simulated serial line.
//!
//! `cargo bench -p stand-tests --bench calibration -- [PARTS] [FIRST]`

use std::collections::BTreeMap;

use host_tools::calibrate::DutKind;
use rayon::prelude::*;
use stand_tests::drawn_parts::{Compared, calibrated};

fn main() {
    // Cargo itself passes `--bench`.
    let numbers: Vec<u64> = std::env::args().skip(1).filter_map(|word| word.parse().ok()).collect();
    let (parts, first) = (numbers.first().copied().unwrap_or(1000), numbers.get(1).copied().unwrap_or(1));
    println!("{parts} parts of each kind from number {first} on; intervals of 95 %");
    println!("| calibration | quantity | found | inside U | mean error, u | rms error, u | median u, part of the value |");
    println!("|---|---|---|---|---|---|---|");
    let only: Vec<String> = std::env::args().skip(1).filter(|w| !w.starts_with("--")).collect();
    for what in [DutKind::Gyro, DutKind::Accel, DutKind::Drive] {
        if only.iter().any(|w| ["gyro", "accel", "drive"].contains(&w.as_str())) && !only.iter().any(|w| w == what.name()) {
            continue;
        }
        let all: Vec<Compared> = (first..first + parts)
            .into_par_iter()
            .flat_map_iter(|seed| {
                let folder = std::env::temp_dir().join(format!("calibration-{}-{}-{seed}", std::process::id(), what.name()));
                let found = calibrated(what, seed, &folder);
                let _ = std::fs::remove_dir_all(&folder);
                if let Some(far) = found.iter().find(|c| (c.found.value - c.truth).abs() > 5.0 * c.found.combined_u()) {
                    eprintln!(
                        "{} {seed}: {} {} and not {} ± {}",
                        what.name(),
                        far.name,
                        far.found.value,
                        far.truth,
                        far.found.combined_u()
                    );
                }
                found
            })
            .collect();
        let mut by_name: BTreeMap<&str, Vec<&Compared>> = BTreeMap::new();
        for c in &all {
            by_name.entry(c.name).or_default().push(c);
        }
        for (name, of) in by_name {
            let n = of.len() as f64;
            let inside = of.iter().filter(|c| c.found.covers(c.truth)).count();
            let errors: Vec<f64> = of.iter().map(|c| (c.found.value - c.truth) / c.found.combined_u()).collect();
            let mean = errors.iter().sum::<f64>() / n;
            let rms = (errors.iter().map(|e| e * e).sum::<f64>() / n).sqrt();
            let mut size: Vec<f64> = of.iter().map(|c| c.found.combined_u() / c.truth.abs().max(1e-12)).collect();
            size.sort_by(f64::total_cmp);
            println!(
                "| {} | {name} | {} | {:.1} % | {mean:+.2} | {rms:.2} | {:.1e} |",
                what.name(),
                of.len(),
                100.0 * inside as f64 / n,
                size[size.len() / 2]
            );
        }
    }
}
