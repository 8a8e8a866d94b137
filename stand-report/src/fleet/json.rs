//! A fleet for programs.

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use super::words::limits;
use crate::json::schema_of;
use crate::json::{Entries, value};
use stand_analysis::fleet::change::{FindingChange, Observation, ParameterChange};
use stand_analysis::fleet::evaluation::FleetEvaluation;
use stand_analysis::fleet::run::FleetRun;

#[derive(Serialize, JsonSchema)]
struct RunJson<'a> {
    table: &'a str,
    logs: usize,
    done: usize,
    computed: usize,
    failed: usize,
    interrupted: bool,
    verdicts: Entries<usize>,
}

/// The computation of a table.
pub fn run_json(table: &str, run: &FleetRun) -> Value {
    let mut verdicts = std::collections::BTreeMap::<String, usize>::new();
    run.rows.iter().for_each(|row| *verdicts.entry(row.verdict.clone()).or_default() += 1);
    value(&RunJson {
        table,
        logs: run.logs,
        done: run.rows.len(),
        computed: run.computed,
        failed: run.failed(),
        interrupted: run.is_interrupted,
        verdicts: Entries(verdicts.into_iter().collect()),
    })
}

#[derive(Serialize, JsonSchema)]
struct EvaluationJson {
    logs: usize,
    stands: usize,
    batches: usize,
    since: Option<String>,
    logs_before: usize,
    logs_since: usize,
    verdicts: Entries<usize>,
    effects: Entries<usize>,
    parameter_changes: Vec<ParameterChangeJson>,
    finding_changes: Vec<FindingChangeJson>,
    batch_effects: Vec<BatchEffectJson>,
    parameters: Vec<SpreadJson>,
    failed: Vec<FailedJson>,
    limits: Vec<String>,
}

#[derive(Serialize, JsonSchema)]
struct MeanJson {
    value: f64,
    standard_uncertainty: f64,
}

#[derive(Serialize, JsonSchema)]
struct ParameterChangeJson {
    stand: String,
    parameter: String,
    unit: String,
    before: MeanJson,
    since: MeanJson,
    logs_before: usize,
    logs_since: usize,
    /// Difference in units of its combined standard uncertainty.
    z: f64,
    adjusted_p: Option<f64>,
    significant: bool,
}

#[derive(Serialize, JsonSchema)]
struct FindingChangeJson {
    stand: String,
    finding: String,
    with_before: usize,
    logs_before: usize,
    with_since: usize,
    logs_since: usize,
    adjusted_p: f64,
    significant: bool,
}

#[derive(Serialize, JsonSchema)]
struct BatchEffectJson {
    batch: String,
    effect: String,
    with_inside: usize,
    stands_inside: usize,
    with_outside: usize,
    stands_outside: usize,
    adjusted_p: f64,
    significant: bool,
}

#[derive(Serialize, JsonSchema)]
struct SpreadJson {
    parameter: String,
    unit: String,
    median: f64,
    scale: f64,
    variation_between_logs: Option<f64>,
    stands: Vec<StandJson>,
}

#[derive(Serialize, JsonSchema)]
struct StandJson {
    stand: String,
    mean: MeanJson,
    z: f64,
    adjusted_p: Option<f64>,
    significant: bool,
}

#[derive(Serialize, JsonSchema)]
struct FailedJson {
    path: String,
    verdict: String,
    error: String,
}

fn mean(o: Observation) -> MeanJson {
    MeanJson { value: o.value, standard_uncertainty: o.u }
}

/// The evaluation.
pub fn json(e: &FleetEvaluation) -> Value {
    let entries = |counts: &std::collections::BTreeMap<String, usize>| Entries(counts.iter().map(|(k, n)| (k.clone(), *n)).collect());
    let parameter_change = |c: &ParameterChange| ParameterChangeJson {
        stand: c.stand.clone(),
        parameter: c.parameter.clone(),
        unit: c.unit.clone(),
        before: mean(c.before),
        since: mean(c.since),
        logs_before: c.logs.0,
        logs_since: c.logs.1,
        z: c.z(),
        adjusted_p: c.adjusted_p,
        significant: c.is_significant(),
    };
    let finding_change = |c: &FindingChange| FindingChangeJson {
        stand: c.stand.clone(),
        finding: c.finding.clone(),
        with_before: c.before.0,
        logs_before: c.before.1,
        with_since: c.since.0,
        logs_since: c.since.1,
        adjusted_p: c.adjusted_p,
        significant: c.is_significant(),
    };
    let batch_effects = e.batch_effects.iter().map(|b| BatchEffectJson {
        batch: b.batch.clone(),
        effect: b.effect.clone(),
        with_inside: b.inside.0,
        stands_inside: b.inside.1,
        with_outside: b.outside.0,
        stands_outside: b.outside.1,
        adjusted_p: b.adjusted_p,
        significant: b.is_significant(),
    });
    let parameters = e.spreads.iter().map(|s| SpreadJson {
        parameter: s.parameter.clone(),
        unit: s.unit.clone(),
        median: s.median,
        scale: s.scale,
        variation_between_logs: e.variations.get(&s.parameter).filter(|v| v.dof > 0).map(|v| v.tau),
        stands: (s.stands.iter())
            .map(|s| StandJson {
                stand: s.stand.clone(),
                mean: mean(s.mean),
                z: s.z,
                adjusted_p: s.adjusted_p,
                significant: s.is_significant(),
            })
            .collect(),
    });
    value(&EvaluationJson {
        logs: e.logs,
        stands: e.stands,
        batches: e.batches,
        since: e.since_us.map(stand_analysis::fleet::row::day_of),
        logs_before: e.logs_by_period.0,
        logs_since: e.logs_by_period.1,
        verdicts: entries(&e.verdicts),
        effects: entries(&e.effects),
        parameter_changes: e.parameter_changes.iter().map(parameter_change).collect(),
        finding_changes: e.finding_changes.iter().map(finding_change).collect(),
        batch_effects: batch_effects.collect(),
        parameters: parameters.collect(),
        failed: (e.failed.iter())
            .map(|(path, verdict, error)| FailedJson { path: path.clone(), verdict: verdict.clone(), error: error.clone() })
            .collect(),
        limits: limits(e),
    })
}

/// Schemas of the answers.
pub(crate) fn schemas() -> Vec<(&'static str, Value)> {
    vec![("explain --table", schema_of::<RunJson<'_>>()), ("fleet report", schema_of::<EvaluationJson>())]
}
