//! A fit by equation error beside the output-error fit, as text and JSON.

use crate::json::schema_of;
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use super::json::{Entries, is_false, value};
use super::{Style, plain, significant, with_sigma};
use identification::identify::equation_error::EquationErrorComparison;
use identification::identify::fit::{ChannelFit, FitError, FitResult, Parameter, Parameters};
use identification::log::{Axis, Log};
use identification::model::Model;

/// The fit as text.
pub fn text(log: &Log, model: &Model, fit: &EquationErrorComparison, style: Style) -> String {
    Fit { log, model, fit }.text(style)
}

/// The fit as JSON.
pub fn json(log: &Log, model: &Model, fit: &EquationErrorComparison) -> Value {
    Fit { log, model, fit }.json()
}

struct Fit<'a> {
    log: &'a Log,
    model: &'a Model,
    fit: &'a EquationErrorComparison,
}

impl Fit<'_> {
    fn text(&self, style: Style) -> String {
        let e = &self.fit.equation;
        let axis = self.model.axis();
        let (log, model) = (self.log.path().display(), self.model.name());
        let mut text = format!("{}\n", style.strong(&format!("Fit of {model} to {log} by equation error")));
        let thinned = if e.decimation > 1 { format!(", every {}th row kept", e.decimation) } else { String::new() };
        let how = format!("zero-phase low-pass at {} Hz{thinned}: {} rows", plain(e.settings.cutoff_hz, 4), e.rows);
        text.push_str(&style.faint(&how));
        text.push_str(&format!(
            "\n\n{}  error {} %, rms {} {}, condition {}\n\n",
            axis.column(e.explained.column()),
            significant(e.error_percent, 3),
            significant(e.rms, 3),
            super::unit(axis, e.explained),
            significant(e.condition, 2)
        ));
        text.push_str(&self.table(style));
        if let Some(Err(error)) = &self.fit.free_run {
            text.push_str(&style.warn(&style.wrapped("! ", "  ", &format!("no output-error fit (free run): {error}"))));
        }
        if (0..e.parameters.list.len()).any(|k| self.fit.differs(k)) {
            let note = "* The two estimates differ by more than three standard uncertainties: the model lacks an effect, or the angle resolution is too coarse for the cutoff.";
            text.push_str(&format!("\n{}", style.wrapped("", "  ", note)));
        }
        text
    }

    fn table(&self, style: Style) -> String {
        let free = matches!(self.fit.free_run, Some(Ok(_)));
        let mut rows = vec![["".to_owned(), "equation error".to_owned(), if free { "free run".to_owned() } else { String::new() }]];
        for (k, p) in self.fit.equation.parameters.list.iter().enumerate() {
            let fixed = || format!("{} fixed", plain(p.value, 6));
            let estimate = |value: f64, sigma: f64, at_bound: bool| {
                if at_bound { format!("{} at its bound", plain(value, 6)) } else { with_sigma(value, sigma) }
            };
            let equation = &self.fit.equation;
            let value = if p.fixed { fixed() } else { estimate(p.value, equation.sigmas[k], equation.parameters.at_bounds().contains(&k)) };
            let free_run_at_bound = self.fit.free_run.as_ref().is_some_and(|run| run.as_ref().is_ok_and(|run| run.is_at_bound(&p.name)));
            let beside = self.fit.by_free_run(k).filter(|_| !p.fixed).map_or(String::new(), |(v, s)| estimate(v, s, free_run_at_bound));
            rows.push([self.model.axis().parameter(&p.name), value, beside + if self.fit.differs(k) { " *" } else { "" }]);
        }
        let width = |c: usize| rows.iter().map(|r| r[c].chars().count()).max().unwrap_or(0);
        let (names, values) = (width(0), width(1));
        let line = |[name, value, beside]: &[String; 3]| format!("  {name:<names$}  {value:<values$}  {beside}").trim_end().to_owned();
        rows.iter().enumerate().map(|(k, row)| if k == 0 { style.faint(&line(row)) } else { line(row) } + "\n").collect()
    }

    fn json(&self) -> Value {
        let e = &self.fit.equation;
        let axis = self.model.axis();
        let explained = ExplainedJson { rms: e.rms, error_percent: e.error_percent, rows: e.rows, unit: super::unit(axis, e.explained) };
        value(&EquationErrorJson {
            log: self.log.path().display().to_string(),
            model: self.model.name(),
            method: "equation-error",
            parameters: parameters(axis, &e.parameters, &e.sigmas),
            not_identifiable: [],
            outputs: Entries(vec![(axis.column(e.explained.column()).to_owned(), explained)]),
            condition: e.condition,
            cutoff_Hz: e.settings.cutoff_hz,
            one_row_of: e.decimation,
            free_run: self.fit.free_run.as_ref().map(|run| free_run(axis, run)),
        })
    }
}

/// The answer of `stand fit --equation-error --json`.
#[derive(Serialize, JsonSchema)]
struct EquationErrorJson<'a> {
    log: String,
    model: &'a str,
    method: &'static str,
    parameters: Entries<ParameterJson>,
    not_identifiable: [(); 0],
    outputs: Entries<ExplainedJson>,
    condition: f64,
    cutoff_Hz: f64,
    one_row_of: usize,
    free_run: Option<FreeRunJson>,
}

#[derive(Serialize, JsonSchema)]
struct ParameterJson {
    value: f64,
    sigma: f64,
    fixed: bool,
    #[serde(skip_serializing_if = "is_false")]
    at_bound: bool,
}

#[derive(Serialize, JsonSchema)]
struct ExplainedJson {
    rms: f64,
    error_percent: f64,
    rows: usize,
    unit: &'static str,
}

#[derive(Serialize, JsonSchema)]
#[serde(untagged)]
enum FreeRunJson {
    Fitted { parameters: Entries<ParameterJson>, outputs: Entries<OutputJson>, converged: bool },
    Failed { error: String },
}

#[derive(Serialize, JsonSchema)]
struct OutputJson {
    rms: f64,
    noise: f64,
    ratio: f64,
}

fn parameters(axis: Axis, parameters: &Parameters, sigmas: &[f64]) -> Entries<ParameterJson> {
    let at_bounds = parameters.at_bounds();
    let list = parameters.list.iter().zip(sigmas).enumerate();
    let json =
        |k: usize, p: &Parameter, sigma: f64| ParameterJson { value: p.value, sigma, fixed: p.fixed, at_bound: at_bounds.contains(&k) };
    Entries(list.map(|(k, (p, &sigma))| (axis.parameter(&p.name), json(k, p, sigma))).collect())
}

fn free_run(axis: Axis, result: &Result<FitResult, FitError>) -> FreeRunJson {
    match result {
        Ok(fit) => {
            let output = |f: &ChannelFit| OutputJson { rms: f.rms, noise: f.noise, ratio: f.rms / f.noise };
            FreeRunJson::Fitted {
                parameters: parameters(axis, &fit.parameters, &fit.sigmas),
                outputs: Entries(fit.channels.iter().map(|f| (axis.column(f.channel.column()).to_owned(), output(f))).collect()),
                converged: fit.converged,
            }
        }
        Err(error) => FreeRunJson::Failed { error: error.to_string() },
    }
}

/// Schemas of the answers.
pub(crate) fn schemas() -> Vec<(&'static str, Value)> {
    vec![("fit --equation-error", schema_of::<EquationErrorJson<'_>>())]
}
