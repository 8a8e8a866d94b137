//! An observer on a recorded log, as text and JSON.

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use crate::json::schema_of;
use crate::json::value;
use crate::uncertainty::{EstimateJson, coverage, with_expanded};
use crate::units::Scale;
use crate::{plain, significant};
use stand_analysis::observer::Design;
use stand_analysis::observer::recorded::{Tracked, TrackedSignal};

/// The estimates as text.
pub fn track_text(log: &str, design: &Design, tracked: &Tracked) -> String {
    let slowest = design.poles.first().map_or(0.0, |pole| pole.re);
    let mut text = format!(
        "{log}: {} rows, {} s apart; {} observer, slowest pole {} 1/s, settled from {} s\n",
        tracked.t_s.len(),
        plain(tracked.step_s, 6),
        design.request.kind.name(),
        significant(slowest, 3),
        plain(tracked.settled_s, 4)
    );
    for signal in &tracked.states {
        text += &format!("  {:<18} mean {}{}\n", signal.name, significant(signal.mean, 5), beside(signal));
    }
    match (&tracked.moment, &tracked.mean_moment_N_m) {
        (Some(signal), Some(mean)) => {
            let unit = Scale { factor: 1.0, unit: "N m".to_owned() };
            let of = mean.uncertainty.as_ref().map_or(String::new(), |uncertainty| format!(" {}", coverage(uncertainty)));
            text += &format!("  {:<18} mean {}{of}{}\n", "learnt moment", with_expanded(mean, &unit), beside(signal));
        }
        _ => text += "  a static observer learns no moment; --kind augmented or integral does\n",
    }
    text += &format!("  measured minus predicted angle: {} rad rms\n", significant(tracked.innovation_rms_rad, 3));
    if tracked.ignores_torquer {
        text +=
            "  the current of the torquer is not used, and its moment is part of the learnt one; --torquer gives the moment per current\n";
    }
    text += "  Means and rms over the settled rows. The parameters of the element are taken as exact.\n";
    text
}

fn beside(signal: &TrackedSignal) -> String {
    signal.against_truth.map_or(String::new(), |(mean, rms)| format!("; truth {}, rms error {}", significant(mean, 5), significant(rms, 3)))
}

#[derive(Serialize, JsonSchema)]
struct SignalJson {
    name: &'static str,
    mean: f64,
    true_mean: Option<f64>,
    rms_error: Option<f64>,
}

impl SignalJson {
    fn new(signal: &TrackedSignal) -> Self {
        Self {
            name: signal.name,
            mean: signal.mean,
            true_mean: signal.against_truth.map(|(mean, _)| mean),
            rms_error: signal.against_truth.map(|(_, rms)| rms),
        }
    }
}

#[derive(Serialize, JsonSchema)]
struct TrackJson<'a> {
    log: &'a str,
    kind: &'static str,
    step_s: f64,
    settled_s: f64,
    states: Vec<SignalJson>,
    moment: Option<SignalJson>,
    moment_N_m: Option<EstimateJson>,
    innovation_rms_rad: f64,
    ignores_torquer: bool,
}

/// The estimates as JSON.
pub fn track_json(log: &str, design: &Design, tracked: &Tracked) -> Value {
    value(&TrackJson {
        log,
        kind: design.request.kind.name(),
        step_s: tracked.step_s,
        settled_s: tracked.settled_s,
        states: tracked.states.iter().map(SignalJson::new).collect(),
        moment: tracked.moment.as_ref().map(SignalJson::new),
        moment_N_m: tracked.mean_moment_N_m.as_ref().map(|mean| EstimateJson::new(mean, 1.0)),
        innovation_rms_rad: tracked.innovation_rms_rad,
        ignores_torquer: tracked.ignores_torquer,
    })
}

/// Schemas of the answers.
pub(crate) fn schemas() -> Vec<(&'static str, Value)> {
    vec![("observer track", schema_of::<TrackJson<'_>>())]
}
