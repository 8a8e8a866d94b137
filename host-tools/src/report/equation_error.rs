//! A fit by equation error beside the output-error fit, as text and JSON.

use serde_json::{Map, Value, json};

use super::{Style, finite, plain, significant, with_sigma};
use crate::identify::equation_error::EquationErrorComparison;
use crate::log::Log;
use crate::model::Model;

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
        let (log, model) = (self.log.path().display(), self.model.name());
        let mut text = format!("{}\n", style.strong(&format!("Fit of {model} to {log} by equation error")));
        let thinned = if e.decimation > 1 { format!(", every {}th row kept", e.decimation) } else { String::new() };
        let how = format!("zero-phase low-pass at {} Hz{thinned}: {} rows", plain(e.settings.cutoff_hz, 4), e.rows);
        text.push_str(&style.faint(&how));
        text.push_str(&format!(
            "\n\n{}  error {} %, rms {} {}, condition {}\n\n",
            e.explained.column(),
            significant(e.error_percent, 3),
            significant(e.rms, 3),
            super::unit(e.explained),
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
            let value = if p.fixed { format!("{} fixed", plain(p.value, 6)) } else { with_sigma(p.value, self.fit.equation.sigmas[k]) };
            let beside = self.fit.by_free_run(k).filter(|_| !p.fixed).map_or(String::new(), |(v, s)| with_sigma(v, s));
            rows.push([p.name.clone(), value, beside + if self.fit.differs(k) { " *" } else { "" }]);
        }
        let width = |c: usize| rows.iter().map(|r| r[c].chars().count()).max().unwrap_or(0);
        let (names, values) = (width(0), width(1));
        let line = |[name, value, beside]: &[String; 3]| format!("  {name:<names$}  {value:<values$}  {beside}").trim_end().to_owned();
        rows.iter().enumerate().map(|(k, row)| if k == 0 { style.faint(&line(row)) } else { line(row) } + "\n").collect()
    }

    fn json(&self) -> Value {
        let e = &self.fit.equation;
        let parameter = |value: f64, sigma: f64, fixed: bool| json!({"value": finite(value), "sigma": finite(sigma), "fixed": fixed});
        let own = e.parameters.list.iter().zip(&e.sigmas).map(|(p, &s)| (p.name.clone(), parameter(p.value, s, p.fixed)));
        let free = match &self.fit.free_run {
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
            json!({"rms": finite(e.rms), "error_percent": finite(e.error_percent), "rows": e.rows, "unit": super::unit(e.explained)});
        json!({
            "log": self.log.path().display().to_string(),
            "model": self.model.name(),
            "method": "equation-error",
            "parameters": own.collect::<Map<_, _>>(),
            "not_identifiable": [],
            "outputs": {e.explained.column(): explained},
            "condition": finite(e.condition),
            "cutoff_Hz": finite(e.settings.cutoff_hz),
            "one_row_of": e.decimation,
            "free_run": free,
        })
    }
}
