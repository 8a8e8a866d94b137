//! The table of docs/rate-accuracy.md: `cargo run -p stand-tests --example rate_accuracy`.

use rayon::prelude::*;
use stand_firmware::speed_loop::Settings;
use stand_tests::rate_accuracy::{Accuracy, Step, accuracy, calibrated_stand, cogging_stand, step};

const RATES_DEG_S: [f64; 8] = [10.0, 20.0, 45.0, 90.0, 180.0, 360.0, 500.0, 720.0];
const SEEDS: [u64; 3] = [1, 2, 3];
const STEP_DEG_S: f64 = 100.0;

/// Worst values of all seeds.
fn worst(of: &[Accuracy]) -> Accuracy {
    let greatest = |value: fn(&Accuracy) -> f64| of.iter().map(value).fold(0.0, f64::max);
    Accuracy {
        rate_deg_s: greatest(|a| a.rate_deg_s),
        mean: greatest(|a| a.mean.abs()),
        turn: greatest(|a| a.turn),
        ten_degrees: greatest(|a| a.ten_degrees),
        one_degree: greatest(|a| a.one_degree),
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let settings = Settings::default();
    println!("Gains: {settings:?}\n");
    let bare = cogging_stand();
    let stands = [("no compensation", bare.clone()), ("own calibration", calibrated_stand(&bare, 1))];
    println!("Compensation of the second: {:?}\n", stands[1].1.firmware.compensation);
    println!("| compensation | rate, °/s | mean of ten turns off by, ppm | σ over 360°, ppm | σ over 10°, ppm | σ over 1°, ppm |");
    println!("|---|---:|---:|---:|---:|---:|");
    for (name, stand) in &stands {
        let runs: Vec<(f64, u64)> = RATES_DEG_S.iter().flat_map(|rate| SEEDS.map(|seed| (*rate, seed))).collect();
        let all: Vec<Accuracy> = runs.par_iter().map(|(rate, seed)| accuracy(stand, *rate, *seed)).collect::<Result<_, _>>()?;
        for seeds in all.chunks(SEEDS.len()) {
            let Accuracy { rate_deg_s, mean, turn, ten_degrees, one_degree } = worst(seeds);
            let [mean, turn, ten, one] = [mean, turn, ten_degrees, one_degree].map(|part| part * 1e6);
            println!("| {name} | {rate_deg_s} | {mean:.2} | {turn:.2} | {ten:.0} | {one:.0} |");
        }
    }
    println!("\n| compensation | step, °/s | within 2 % after, s | overshoot, % |\n|---|---:|---:|---:|");
    for (name, stand) in &stands {
        let steps: Vec<Step> = SEEDS.iter().map(|seed| step(stand, STEP_DEG_S, *seed)).collect::<Result<_, _>>()?;
        let greatest = |value: fn(&Step) -> f64| steps.iter().map(value).fold(0.0, f64::max);
        println!("| {name} | {STEP_DEG_S} | {:.3} | {:.2} |", greatest(|s| s.settled_s), 100.0 * greatest(|s| s.overshoot));
    }
    Ok(())
}
