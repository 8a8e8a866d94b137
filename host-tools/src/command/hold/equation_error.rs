//! `stand fit --equation-error`: the parameters row by row from the inverse model, the free run's beside them.

use serde_json::{Map, Value, json};

use super::super::error::CliError;
use super::super::output::{ReportOutput, working};
use crate::identify::fit::equation_error::{self, EquationErrorFit, Settings};
use crate::identify::fit::{self, FitError, FitResult};
use crate::log::Log;
use crate::log::plausible;
use crate::model::{Input, Model};
use crate::report::{self, Style, finite, plain, significant, with_sigma};

/// A parameter whose two values are further apart than this many standard errors of their difference is marked.
const APART: f64 = 3.0;

/// Fits by equation error, and by a free run where the model has one; says what came of both. `None`: the log is not plausible.
pub(super) fn hold(
    log: &Log,
    model: &Model,
    cutoff_hz: Option<f64>,
    all_rows: bool,
    output: &ReportOutput,
    style: Style,
) -> Result<Option<EquationErrorFit>, CliError> {
    let settings = cutoff_hz.map_or_else(|| Ok(Settings::usual(log)), |hz| Settings::with_cutoff(log, hz)).map_err(input)?;
    let problems = plausible::check(log, model.input().column());
    if !problems.is_empty() {
        output.text(&report::bad_log_text(log, &problems, style))?;
        output.json(|| report::bad_log_json(log, &problems))?;
        return Ok(None);
    }
    let working = working("fitting");
    let equation = equation_error::fit(log, model, settings).map_err(input)?;
    let free = free_run(log, model, all_rows)?;
    working.finish_and_clear();
    let telling = Telling { log, model, equation: &equation, free: free.as_ref() };
    output.text(&telling.text(style))?;
    output.json(|| telling.json())?;
    Ok(Some(equation))
}

fn input(error: equation_error::InverseModelError) -> CliError {
    CliError::Input(error.to_string())
}

/// The fit of `stand fit`; of a prescribed motion there is none, for nothing runs free.
fn free_run(log: &Log, model: &Model, all_rows: bool) -> Result<Option<Result<FitResult, FitError>>, CliError> {
    if model.input() == Input::Motion {
        return Ok(None);
    }
    let (record, _) = fit::prepare::prepare(log, model, !all_rows)?;
    let (system, parameters) = fit::build::system(model, record.temp_C.is_some());
    Ok(Some(fit::fit(&system, &parameters, &record)))
}

struct Telling<'a> {
    log: &'a Log,
    model: &'a Model,
    equation: &'a EquationErrorFit,
    free: Option<&'a Result<FitResult, FitError>>,
}

impl Telling<'_> {
    /// Value and standard error of the free run.
    fn by_free_run(&self, k: usize) -> Option<(f64, f64)> {
        let held = self.free?.as_ref().ok()?;
        Some((held.parameters.list.get(k)?.value, *held.sigmas.get(k)?))
    }

    /// The two values differ by more than their errors.
    fn apart(&self, k: usize) -> bool {
        let (value, sigma) = (self.equation.parameters.list[k].value, self.equation.sigmas[k]);
        self.by_free_run(k).is_some_and(|(free, free_sigma)| (value - free).abs() > APART * sigma.hypot(free_sigma))
    }

    fn text(&self, style: Style) -> String {
        let e = self.equation;
        let (log, model) = (self.log.path().display(), self.model.name());
        let mut text = format!("{}\n", style.strong(&format!("{model} held against {log} by equation error")));
        let thinned = if e.thinned > 1 { format!(", one row of {} kept", e.thinned) } else { String::new() };
        let how = format!("low-pass at {} Hz, without delay{thinned}: {} rows", plain(e.settings.cutoff_hz, 4), e.rows);
        text.push_str(&style.faint(&how));
        text.push_str(&format!(
            "\n\n{}  error {} %, rms {} {}, condition {}\n\n",
            e.explained.column(),
            significant(e.error_percent, 3),
            significant(e.rms, 3),
            report::unit(e.explained),
            significant(e.condition, 2)
        ));
        text.push_str(&self.table(style));
        if let Some(Err(error)) = self.free {
            text.push_str(&style.warn(&style.wrapped("! ", "  ", &format!("no free run: {error}"))));
        }
        if (0..e.parameters.list.len()).any(|k| self.apart(k)) {
            let says =
                "* the two ways differ by more than their errors: the model lacks something, or the angle is too coarse for the cutoff.";
            text.push_str(&format!("\n{}", style.wrapped("", "  ", says)));
        }
        text
    }

    fn table(&self, style: Style) -> String {
        let free = matches!(self.free, Some(Ok(_)));
        let mut rows = vec![["".to_owned(), "equation error".to_owned(), if free { "free run".to_owned() } else { String::new() }]];
        for (k, p) in self.equation.parameters.list.iter().enumerate() {
            let value = if p.fixed { format!("{} fixed", plain(p.value, 6)) } else { with_sigma(p.value, self.equation.sigmas[k]) };
            let beside = self.by_free_run(k).filter(|_| !p.fixed).map_or(String::new(), |(v, s)| with_sigma(v, s));
            rows.push([p.name.clone(), value, beside + if self.apart(k) { " *" } else { "" }]);
        }
        let width = |c: usize| rows.iter().map(|r| r[c].chars().count()).max().unwrap_or(0);
        let (names, values) = (width(0), width(1));
        let line = |[name, value, beside]: &[String; 3]| format!("  {name:<names$}  {value:<values$}  {beside}").trim_end().to_owned();
        rows.iter().enumerate().map(|(k, row)| if k == 0 { style.faint(&line(row)) } else { line(row) } + "\n").collect()
    }

    fn json(&self) -> Value {
        let e = self.equation;
        let parameter = |value: f64, sigma: f64, fixed: bool| json!({"value": finite(value), "sigma": finite(sigma), "fixed": fixed});
        let own = e.parameters.list.iter().zip(&e.sigmas).map(|(p, &s)| (p.name.clone(), parameter(p.value, s, p.fixed)));
        let free = match self.free {
            None => Value::Null,
            Some(Err(error)) => json!({"error": error.to_string()}),
            Some(Ok(held)) => {
                let list = held.parameters.list.iter().zip(&held.sigmas);
                let parameters: Map<String, Value> = list.map(|(p, &s)| (p.name.clone(), parameter(p.value, s, p.fixed))).collect();
                let outputs = held.channels.iter().map(|f| {
                    let says = json!({"rms": finite(f.rms), "noise": finite(f.noise), "ratio": finite(f.rms / f.noise)});
                    (f.channel.column().to_owned(), says)
                });
                json!({"parameters": parameters, "outputs": outputs.collect::<Map<_, _>>(), "converged": held.converged})
            }
        };
        let explained =
            json!({"rms": finite(e.rms), "error_percent": finite(e.error_percent), "rows": e.rows, "unit": report::unit(e.explained)});
        json!({
            "log": self.log.path().display().to_string(),
            "model": self.model.name(),
            "method": "equation-error",
            "parameters": own.collect::<Map<_, _>>(),
            "not_identifiable": [],
            "outputs": {e.explained.column(): explained},
            "condition": finite(e.condition),
            "cutoff_Hz": finite(e.settings.cutoff_hz),
            "one_row_of": e.thinned,
            "free_run": free,
        })
    }
}
