//! Coverage of the standard errors: 300 simulated logs, fitted from wrong starts; 95 % intervals against the truth.
//!
//! `cargo bench -p stand-tests --bench coverage`

use hal_sim::plant::Stand;
use rayon::prelude::*;
use stand_firmware::profile::ProfileKind;
use stand_firmware::speed_loop::Mode;
use stand_tests::TWO_SIDED_95;
use stand_tests::own::{TRUTH, fit_or_compare, log, model};

/// Logs per mode; each with its own seed of profile and noise.
const LOGS: u64 = 150;
const PROFILES: [ProfileKind; 3] = [ProfileKind::MultiStep, ProfileKind::Multisine, ProfileKind::Prbs];

fn main() {
    println!("{} logs of 30 s, profiles multi-step, multisine, prbs in turn; starts wrong by 1.5 either way", 2 * LOGS);
    println!("| mode | parameter | inside 95 % | mean deviation, σ | rms deviation, σ |");
    println!("|---|---|---|---|---|");
    let (mut inside, mut all) = (0, 0);
    for mode in [Mode::Voltage, Mode::Rate] {
        let deviations: Vec<Vec<f64>> = (0..LOGS)
            .into_par_iter()
            .map(|k| {
                let log = log(&Stand::default(), mode, PROFILES[k as usize % 3], 30.0, 1000 + k);
                let factors = std::array::from_fn(|p| if (k >> p) & 1 == 0 { 1.5 } else { 1.0 / 1.5 });
                let held = fit_or_compare(&log, &model(&factors), true).expect("a fit");
                (0..6).map(|p| (held.parameters.list[p].value - TRUTH[p].1) / held.sigmas[p]).collect()
            })
            .collect();
        for (p, (name, _)) in TRUTH.iter().enumerate() {
            let n = deviations.len() as f64;
            let within = deviations.iter().filter(|d| d[p].abs() < TWO_SIDED_95).count();
            let mean = deviations.iter().map(|d| d[p]).sum::<f64>() / n;
            let rms = (deviations.iter().map(|d| d[p] * d[p]).sum::<f64>() / n).sqrt();
            println!("| {mode:?} | {name} | {:.1} % | {mean:+.2} | {rms:.2} |", 100.0 * within as f64 / n);
            inside += within;
            all += deviations.len();
        }
    }
    println!("\nall together: {:.1} % of {all} intervals cover", 100.0 * f64::from(inside as u32) / all as f64);
}
