//! A thousand draws of the three-axis drift measurement with the published values. Prints the table of docs/drift.md.
//!
//! Method: latitude 70°, azimuth 80°, drifts of ± 0.5 to 2 °/h, T = 5 s (a cycle of 10 s), 200 samples per second, initial gimbal angles
//! within ± 60″; the platform is integrated exactly, the rates are computed with the tools' formulas.
//! `cargo bench -p stand-tests --bench drift_monte_carlo`.

use stand_tests::drift::{cases, errors, monte_carlo, separated};
use std::time::Instant;

const DRAWS: u64 = 1000;

fn main() {
    println!("| case, {DRAWS} draws | drift, mean relative error | azimuth, mean error raw | corrected |");
    println!("|---|---|---|---|");
    let begun = Instant::now();
    for (case, theory) in cases() {
        let [drift, raw, corrected] = monte_carlo(&case, DRAWS, 5);
        println!("| {} | {drift:.3} % ({:.3}) | {raw:.3}′ ({:.3}) | {corrected:.3}′ ({:.3}) |", case.name, theory[0], theory[1], theory[2]);
    }
    let exact = hal_sim::gyro::Campaign::default();
    let (_, azimuth) = errors(&exact, &separated(&exact, &mut hal_sim::peripherals::Noise::new(1, 0, 0.0))[1]);
    println!("| no noise, no steps | | | {:.4}′ |", azimuth.abs());
    println!("| the paper | 0.34 % | 2′ | |");
    println!("In brackets: docs/theory.md's 200 draws. {:.0} s in all.", begun.elapsed().as_secs_f64());
}
