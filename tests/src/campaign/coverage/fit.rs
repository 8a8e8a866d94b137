//! `fit`: logs of the simulated stand, fitted as `stand fit` does.
//!
//! Conditions: `MODE-IMPERFECTION`, 30 s on the default stand with an imperfection of the log ([`crate::dirt`]), start values wrong by a
//! factor of 1.5 either way; and `rate-shaft`, `rate-play`, a drawn stand with a soft shaft or with play under the speed loop, fitted from
//! the true values.

use hal_sim::plant::Stand;
use identification::deadline::Deadline;
use identification::identify::evaluation::{Evaluation, ParameterTreatment, evaluate};
use identification::log::Log;
use identification::model::Model;
use stand_firmware::profile::ProfileKind;
use stand_firmware::speed_loop::Mode;

use super::{Interval, Measured};
use crate::TWO_SIDED_95;
use crate::campaign::inputs::InputHash;
use crate::dirt::Dirt;
use crate::draw::Drawn;
use crate::own::{TRUTH, log, model};

const PROFILES: [(ProfileKind, &str); 3] =
    [(ProfileKind::MultiStep, "multi-step"), (ProfileKind::Multisine, "multisine"), (ProfileKind::Prbs, "prbs")];
const MODES: [(&str, Mode); 2] = [("voltage", Mode::Voltage), ("rate", Mode::Rate)];
/// Imperfections under the speed loop, and numbers of logs: a fit takes 1 to 6 s of processor time there, so jitter and outliers are left
/// out.
const RATE: [(Dirt, u64); 5] = [(Dirt::Clean, 10), (Dirt::Coloured, 20), (Dirt::SlowInstant, 10), (Dirt::SlowMean, 16), (Dirt::Counts, 16)];
/// Logs of each imperfection in voltage mode.
const VOLTAGE_CASES: u64 = 20;
/// Conditions with a drawn stand, the hidden effect of its generator, and numbers of logs.
const DRAWN: [(&str, &str, u64); 2] = [("rate-shaft", "compliance", 20), ("rate-play", "backlash", 5)];
/// Length of a log, s.
const DURATION_S: f64 = 30.0;
/// Factor of the start values.
const START_FACTOR: f64 = 1.5;
const FIRST_SEED: u64 = 1000;
const FIRST_DRAWN_SEED: u64 = 2000;

pub(super) fn conditions() -> Vec<(String, u64, u64)> {
    let voltage = Dirt::ALL.map(|dirt| (format!("voltage-{}", dirt.name()), FIRST_SEED, VOLTAGE_CASES));
    let rate = RATE.map(|(dirt, cases)| (format!("rate-{}", dirt.name()), FIRST_SEED, cases));
    let drawn = DRAWN.map(|(name, _, cases)| (name.to_owned(), FIRST_DRAWN_SEED, cases));
    voltage.into_iter().chain(rate).chain(drawn).collect()
}

pub(super) fn measured(condition: &str, seed: u64) -> Result<Measured, String> {
    let unknown = || format!("{condition}: no such condition");
    if let Some((_, effect, _)) = DRAWN.iter().find(|(name, ..)| *name == condition) {
        let drawn = drawn(effect, seed).ok_or_else(unknown)?;
        let truth = drawn.true_model();
        return Ok(fitted(&drawn.log(), &truth, |name| truth.value(name)));
    }
    let (mode, dirt) = condition.split_once('-').ok_or_else(unknown)?;
    let (_, mode) = MODES.into_iter().find(|(name, _)| *name == mode).ok_or_else(unknown)?;
    let dirt = Dirt::by_name(dirt).ok_or_else(unknown)?;
    let k = seed.wrapping_sub(FIRST_SEED);
    let mut log = dirt.on(&log(&Stand::default(), mode, PROFILES[(k % 3) as usize].0, DURATION_S, seed), k);
    log.even_out_times();
    let start = model(&std::array::from_fn(|p| if (k >> p) & 1 == 0 { START_FACTOR } else { 1.0 / START_FACTOR }));
    Ok(fitted(&log, &start, |name| TRUTH.iter().find(|(truth, _)| *truth == name).map(|(_, value)| *value)))
}

/// The drawn stand under the speed loop with this effect.
fn drawn(effect: &str, seed: u64) -> Option<Drawn> {
    let (_, profile) = PROFILES[(seed % 3) as usize];
    Drawn::by_name(&format!("own/{effect}/rate/{profile}/{seed}"))
}

fn fitted(log: &Log, start: &Model, truth: impl Fn(&str) -> Option<f64>) -> Measured {
    let inputs = InputHash::default().log(log).text(&start.to_toml()).short();
    let intervals = match evaluate(log, start, ParameterTreatment::Fitted, Deadline::NEVER) {
        Err(e) => Err(e.to_string()),
        Ok(Evaluation::ImplausibleLog(defects)) => Err(format!("implausible log: {defects:?}")),
        Ok(Evaluation::Evaluated(fitted)) => {
            let list = fitted.result.parameters.list.iter().zip(&fitted.result.sigmas);
            // A parameter that ends at its bound has no standard error.
            let free = list.filter(|(p, sigma)| !p.fixed && sigma.is_finite() && **sigma > 0.0);
            let intervals = free.filter_map(|(p, sigma)| {
                let error_sigma = (p.value - truth(&p.name)?) / sigma;
                Some(Interval { quantity: p.name.clone(), error_sigma: Some(error_sigma), covers: error_sigma.abs() <= TWO_SIDED_95 })
            });
            Ok(intervals.collect())
        }
    };
    Measured { inputs, intervals }
}
