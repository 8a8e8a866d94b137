//! What was found of a column's noise, and the same for programs.

use serde_json::{Map, Value, json};

use super::request::Take;
use super::units::{PROCESSES, Process, Unit};
use crate::report::{finite, significant};

/// One averaging time.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Rows averaged.
    pub factor: usize,
    /// The same in s.
    pub tau_s: f64,
    /// Overlapping Allan deviation, in the unit of the answer.
    pub oadev: f64,
    /// Its number of terms.
    pub terms: usize,
    /// Plain Allan deviation.
    pub adev: f64,
    /// Its number of terms.
    pub plain_terms: usize,
    /// Equivalent degrees of freedom of the overlapping one.
    pub degrees: f64,
    /// Between which the true deviation lies, 68 %.
    pub within_68: [f64; 2],
    /// The same, 95 %.
    pub within_95: [f64; 2],
    /// What the processes that were found give on average.
    pub fitted: f64,
    /// The strongest of them here, by its place in [`PROCESSES`].
    pub strongest: usize,
}

/// One coefficient, in the unit of the answer and seconds.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Coefficient {
    /// Its value; `None`: this record does not show it.
    pub value: Option<f64>,
    /// Its standard error.
    pub sigma: Option<f64>,
    /// With 95 % it is below this, where it is not shown.
    pub below: Option<f64>,
    /// Why it is not shown.
    pub says: Option<String>,
}

/// The lowest point of the curve up to T/10.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lowest {
    /// Where, s.
    pub tau_s: f64,
    /// How low.
    pub oadev: f64,
    /// That over 0.664, as data sheets give the bias instability.
    pub over_floor: f64,
    /// Standard error of that.
    pub sigma: f64,
    /// The curve rises on both sides; else its true floor may be lower.
    pub inside: bool,
}

/// All of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    /// The log's name.
    pub log: String,
    /// The column.
    pub column: String,
    /// Unit of the deviations.
    pub unit: Unit,
    /// What the column was taken for.
    pub take: Take,
    /// Rows that were looked at.
    pub rows: usize,
    /// τ₀, s.
    pub interval_s: f64,
    /// Runs without a gap.
    pub segments: usize,
    /// Samples missing between them.
    pub missing: f64,
    /// The time stamps come in bursts.
    pub bursts: bool,
    /// Least significant bit of the column, in its own unit.
    pub quantum: Option<f64>,
    /// From which averaging time to which the coefficients were read, s.
    pub read_s: Option<[f64; 2]>,
    /// χ² per degree of freedom of their fit.
    pub misfit: Option<f64>,
    /// The lowest point.
    pub lowest: Option<Lowest>,
    /// The curve.
    pub points: Vec<Point>,
    /// Of the five processes in the order of [`PROCESSES`].
    pub coefficients: [Coefficient; 5],
    /// What a person should know, a line each.
    pub says: Vec<String>,
}

/// N's place.
pub const WHITE: usize = 1;
/// B's place.
pub const FLICKER: usize = 2;

impl Answer {
    /// How long the rows that were looked at are together, s.
    pub fn duration_s(&self) -> f64 {
        self.rows as f64 * self.interval_s
    }

    /// A coefficient in degrees and hours is so many times the one in the column's unit; `None` where the column is no rate.
    pub fn hours(&self, process: &Process) -> Option<f64> {
        self.unit.rad.map(|rad| rad.to_degrees() * process.hours)
    }

    /// A person's scale and unit for a process.
    pub fn shown(&self, process: &Process) -> (f64, String) {
        self.hours(process).map_or_else(|| (1.0, self.unit.times(process.unit)), |hours| (hours, process.deg_unit.to_owned()))
    }

    /// A person's scale and unit for the deviation.
    pub fn shown_deviation(&self) -> (f64, String) {
        self.shown(&PROCESSES[FLICKER])
    }

    /// A record too short for coefficients; `rows` 0: one that is long enough but cannot be fitted.
    pub(super) fn too_short(&mut self, rows: usize) {
        let says = if rows > 0 {
            format!("{rows} rows are too few to tell the processes apart: that takes 80")
        } else {
            "the curve touches zero and cannot be fitted".to_owned()
        };
        self.coefficients = std::array::from_fn(|_| Coefficient { says: Some(says.clone()), ..Coefficient::default() });
        self.says.push(says);
    }

    /// Why this record does not show a coefficient.
    pub(super) fn explain_what_is_not_shown(&mut self) {
        for (p, process) in PROCESSES.iter().enumerate().filter(|(p, _)| self.coefficients[*p].value.is_none()).collect::<Vec<_>>() {
            let (scale, unit) = self.shown(process);
            let mut says = match self.coefficients[p].below {
                Some(below) => format!("not shown by this record: below {} {unit} (95 %)", significant(below * scale, 2)),
                None => "this record cannot tell it from the others".to_owned(),
            };
            if let (FLICKER, Some(lowest)) = (p, &self.lowest) {
                says += if lowest.inside {
                    "; the lowest point of the curve is where the others cross"
                } else {
                    "; the curve has no floor up to T/10, a longer record may show one"
                };
            }
            self.coefficients[p].says = Some(says);
        }
    }

    /// The answer for programs: lists over the averaging times, in SI units; coefficients in both.
    pub fn json(&self) -> Value {
        let list = |of: &dyn Fn(&Point) -> f64| self.points.iter().map(|p| finite(of(p))).collect::<Vec<_>>();
        let counts = |of: &dyn Fn(&Point) -> usize| self.points.iter().map(of).collect::<Vec<_>>();
        let pairs = |of: &dyn Fn(&Point) -> [f64; 2]| self.points.iter().map(|p| of(p).map(finite)).collect::<Vec<_>>();
        let mut answer = json!({
            "log": self.log,
            "column": self.column,
            "unit": self.unit.name,
            "taken_as": match self.take { Take::Value => "value", Take::Integral => "integral" },
            "samples": self.rows,
            "interval_s": finite(self.interval_s),
            "duration_s": finite(self.duration_s()),
            "segments": self.segments,
            "missing_samples": finite(self.missing),
            "bursts": self.bursts,
            "quantum": self.quantum.map_or(Value::Null, finite),
            "tau_s": list(&|p| p.tau_s),
            "oadev": list(&|p| p.oadev),
            "adev": list(&|p| p.adev),
            "n": counts(&|p| p.terms),
            "n_adev": counts(&|p| p.plain_terms),
            "degrees_of_freedom": list(&|p| p.degrees),
            "interval_68": pairs(&|p| p.within_68),
            "interval_95": pairs(&|p| p.within_95),
            "fitted": list(&|p| p.fitted),
            "strongest": self.points.iter().map(|p| PROCESSES[p.strongest].letter).collect::<Vec<_>>(),
            "read_s": self.read_s.map_or(Value::Null, |read| json!(read.map(finite))),
            "chi2_per_degree": self.misfit.map_or(Value::Null, finite),
        });
        let Some(map) = answer.as_object_mut() else { return answer };
        for (coefficient, process) in self.coefficients.iter().zip(&PROCESSES) {
            let scale = self.hours(process);
            let told = scale.map_or_else(
                || json!({"value": null, "sigma": null, "unit": process.deg_unit, "says": "the column is no rate: see coefficients"}),
                |scale| one(coefficient, scale, process.deg_unit),
            );
            map.insert(process.deg_key.to_owned(), told);
        }
        let white = &self.coefficients[WHITE];
        let density = |scale: f64, unit: &str| one(white, std::f64::consts::SQRT_2 * scale, unit);
        let mut densities = Map::new();
        densities.insert("column".to_owned(), density(1.0, &self.unit.times("/√Hz")));
        if let Some(rad) = self.unit.rad {
            densities.insert("deg_h_sqrt_Hz".to_owned(), density(rad.to_degrees() * 3600.0, "(°/h)/√Hz"));
            densities.insert("deg_s_sqrt_Hz".to_owned(), density(rad.to_degrees(), "(°/s)/√Hz"));
        }
        map.insert("density_one_sided".to_owned(), Value::Object(densities));
        let in_unit = self.coefficients.iter().zip(&PROCESSES).map(|(c, p)| (p.key.to_owned(), one(c, 1.0, &self.unit.times(p.unit))));
        map.insert("coefficients".to_owned(), Value::Object(in_unit.collect()));
        let (scale, unit) = self.shown_deviation();
        let lowest = self.lowest.map_or(Value::Null, |l| {
            json!({"tau_s": finite(l.tau_s), "oadev": finite(l.oadev * scale), "over_0_664": finite(l.over_floor * scale),
                   "sigma": finite(l.sigma * scale), "unit": unit, "inside": l.inside})
        });
        map.insert("lowest".to_owned(), lowest);
        map.insert("says".to_owned(), json!(self.says));
        answer
    }
}

fn one(coefficient: &Coefficient, scale: f64, unit: &str) -> Value {
    let number = |x: Option<f64>| x.map_or(Value::Null, |x| finite(x * scale));
    let mut told = json!({"value": number(coefficient.value), "sigma": number(coefficient.sigma), "unit": unit});
    if let (Some(says), Some(map)) = (&coefficient.says, told.as_object_mut()) {
        map.insert("below".to_owned(), number(coefficient.below));
        map.insert("says".to_owned(), json!(says));
    }
    told
}
