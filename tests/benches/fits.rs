//! Run time of a fit, and memory for an hour's log.
//!
//! `cargo bench -p stand-tests --bench fits`. Best and median of several runs on one core; memory is the peak resident set.

use std::time::Instant;

use hal_sim::plant::Stand;
use identification::log::{Column, Log};
use stand_firmware::profile::ProfileKind;
use stand_firmware::speed_loop::Mode;
use stand_tests::memory::{peak_MiB, resident_MiB};
use stand_tests::own::{fit_or_compare, log, model};

const RUNS: usize = 9;

fn main() {
    println!("| fit of six parameters and two initial states | start | best, ms | median, ms | steps |");
    println!("|---|---|---|---|---|");
    for (mode, profile) in
        [(Mode::Voltage, ProfileKind::MultiStep), (Mode::Rate, ProfileKind::MultiStep), (Mode::Voltage, ProfileKind::Multisine)]
    {
        let log = log(&Stand::default(), mode, profile, 30.0, 1);
        for (description, factor) in [("25 % off", 1.25), ("3 × off", 3.0)] {
            let factors = std::array::from_fn(|p| if p % 2 == 0 { factor } else { 1.0 / factor });
            let model = model(&factors);
            let mut steps = 0;
            let mut ms: Vec<f64> = (0..RUNS)
                .map(|_| {
                    let begin = Instant::now();
                    steps = fit_or_compare(&log, &model, true).expect("a fit").steps;
                    begin.elapsed().as_secs_f64() * 1e3
                })
                .collect();
            ms.sort_by(f64::total_cmp);
            println!("| 30 s × 1 kHz, {mode:?}, {profile} | {description} | {:.0} | {:.0} | {steps} |", ms[0], ms[RUNS / 2]);
        }
    }
    // An hour: the session's columns repeated.
    let minute = log(&Stand::default(), Mode::Rate, ProfileKind::MultiStep, 3600.0, 1);
    let bytes = minute.columns().iter().map(|c| c.values.len() * 8).sum::<usize>();
    let columns: Vec<Column> = minute.columns().to_vec();
    let notes = minute.notes().to_vec();
    drop(minute);
    let log = Log::new("hour.parquet", columns, notes).expect("a good log");
    let before = resident_MiB();
    let begin = Instant::now();
    let held = fit_or_compare(&log, &model(&[1.25, 0.8, 1.25, 0.8, 1.25, 0.8]), true).expect("a fit");
    println!(
        "\nan hour, {} rows × {} columns ({:.0} MiB): {:.1} s, {} steps; resident {before:.0} MiB before, {:.0} MiB at most",
        log.len(),
        log.columns().len(),
        bytes as f64 / 1048576.0,
        begin.elapsed().as_secs_f64(),
        held.steps,
        peak_MiB()
    );
}
