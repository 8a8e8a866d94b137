//! Coverage of the standard errors: simulated logs, fitted from wrong starts as `stand fit` does; 95 % intervals against the truth, by mode and by imperfection.
//!
//! `cargo bench -p stand-tests --bench coverage -- [N] [MODE] [IMPERFECTION]`: N logs per mode and imperfection; with words, only of `voltage` or `rate`, of
//! `coloured` and so on.

use hal_sim::plant::Stand;
use identification::deadline::Deadline;
use identification::identify::evaluation::{Evaluation, ParameterTreatment, evaluate};
use rayon::prelude::*;
use stand_firmware::profile::ProfileKind;
use stand_firmware::speed_loop::Mode;
use stand_tests::TWO_SIDED_95;
use stand_tests::coverage_table::CoverageTable;
use stand_tests::dirt::Dirt;
use stand_tests::own::{TRUTH, log, model};

const PROFILES: [ProfileKind; 3] = [ProfileKind::MultiStep, ProfileKind::Multisine, ProfileKind::Prbs];

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let count = words.iter().find_map(|w| w.parse().ok()).unwrap_or(150_u64);
    let asked = |names: &[&str], name: &str| {
        let mut named = words.iter().filter(|w| names.contains(&w.as_str())).peekable();
        named.peek().is_none() || named.any(|w| w == name)
    };
    let imperfections = Dirt::ALL.map(Dirt::name);
    println!(
        "{count} logs of 30 s per mode and imperfection, profiles multi-step, multisine, prbs in turn; starts wrong by 1.5 either way"
    );
    print!("{}", CoverageTable::header());
    for (mode, mode_name) in [(Mode::Voltage, "voltage"), (Mode::Rate, "rate")] {
        for noise in Dirt::ALL {
            if !asked(&["voltage", "rate"], mode_name) || !asked(&imperfections, noise.name()) {
                continue;
            }
            let errors: Vec<Vec<(f64, f64)>> = (0..count).into_par_iter().filter_map(|k| errors(mode, noise, k)).collect();
            let mut table = CoverageTable::default();
            for (p, (name, _)) in TRUTH.iter().enumerate() {
                errors.iter().for_each(|e| table.add(name, e[p].0, TWO_SIDED_95 * e[p].1, 0.0, ""));
            }
            print!("{}", table.rows(&format!("{mode:?}, {}", noise.name())));
        }
    }
}

/// Error of each parameter and its standard error, in the unit of the parameter; `None` where the log is refused.
fn errors(mode: Mode, noise: Dirt, k: u64) -> Option<Vec<(f64, f64)>> {
    let mut log = noise.on(&log(&Stand::default(), mode, PROFILES[k as usize % 3], 30.0, 1000 + k), k);
    log.even_out_times();
    let factors = std::array::from_fn(|p| if (k >> p) & 1 == 0 { 1.5 } else { 1.0 / 1.5 });
    let model = model(&factors);
    match evaluate(&log, &model, ParameterTreatment::Fitted, Deadline::NEVER) {
        Ok(Evaluation::Evaluated(fitted)) => {
            let result = &fitted.result;
            Some(TRUTH.iter().enumerate().map(|(p, (_, truth))| (result.parameters.list[p].value - truth, result.sigmas[p])).collect())
        }
        _ => None,
    }
}
