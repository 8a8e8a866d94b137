//! Allan analysis as JSON. A number that is not finite is `null`.

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use super::Display;
use super::words::{NoteKind, name, not_shown, note, note_kind, standard};
use crate::json::schema_of;
use crate::json::{Entries, value};
use crate::uncertainty::QuantityJson;
use stand_analysis::allan::answer::{Answer, Interpretation, LevelStep, Lowest, NotShown, Note, WHITE};
use stand_analysis::allan::units::{PROCESSES, Process};

/// The answer: lists over the averaging times in SI units; coefficients in both units.
#[derive(Serialize, JsonSchema)]
struct AnswerJson<'a> {
    log: &'a str,
    column: &'a str,
    unit: &'a str,
    taken_as: &'static str,
    samples: usize,
    interval_s: f64,
    elapsed_per_row_s: f64,
    duration_s: f64,
    segments: usize,
    missing_samples: f64,
    bursts: bool,
    quantum: Option<f64>,
    tau_s: Vec<f64>,
    oadev: Vec<f64>,
    adev: Vec<f64>,
    n: Vec<usize>,
    n_adev: Vec<usize>,
    degrees_of_freedom: Vec<f64>,
    interval_68: Vec<[f64; 2]>,
    interval_95: Vec<[f64; 2]>,
    fitted: Vec<f64>,
    strongest: Vec<&'static str>,
    read_s: Option<[f64; 2]>,
    chi2_per_degree: Option<f64>,
    /// Coefficients in degrees and hours.
    #[serde(flatten)]
    in_degrees: Entries<CoefficientJson>,
    density_one_sided: Entries<CoefficientJson>,
    /// Coefficients in the unit of the column.
    coefficients: Entries<CoefficientJson>,
    lowest: Option<LowestJson>,
    /// By the names of the standards, in the units of the user.
    quantities: Vec<QuantityJson>,
    steps: Vec<StepJson>,
    says: Vec<String>,
    /// The same remarks: kind and numbers.
    notes: Vec<NoteKind>,
}

#[derive(Serialize, JsonSchema)]
struct CoefficientJson {
    value: Option<f64>,
    sigma: Option<f64>,
    dof: Option<f64>,
    k: Option<f64>,
    #[serde(rename = "U")]
    expanded: Option<f64>,
    interval_95: Option<[f64; 2]>,
    unit: String,
    #[serde(flatten)]
    absence: Option<AbsenceJson>,
}

/// Why a coefficient has no value.
#[derive(Serialize, JsonSchema)]
struct AbsenceJson {
    /// Upper limit; the outer `None` omits the key.
    #[serde(skip_serializing_if = "Option::is_none")]
    below: Option<Option<f64>>,
    says: String,
    reason: Option<ReasonKind>,
}

#[derive(Serialize, JsonSchema)]
struct LowestJson {
    tau_s: f64,
    oadev: f64,
    over_0_664: f64,
    sigma: f64,
    #[serde(rename = "U")]
    expanded: f64,
    unit: String,
    inside: bool,
}

/// The answer of `stand allan --json`.
pub fn json(answer: &Answer, display: &Display) -> Value {
    let points = || answer.points.iter();
    value(&AnswerJson {
        log: &answer.log,
        column: &answer.column,
        unit: &answer.unit.name,
        taken_as: match answer.interpretation {
            Interpretation::Value => "value",
            Interpretation::Integral => "integral",
        },
        samples: answer.rows,
        interval_s: answer.interval_s,
        elapsed_per_row_s: answer.elapsed_s,
        duration_s: answer.duration_s(),
        segments: answer.segments,
        missing_samples: answer.missing,
        bursts: answer.bursts,
        quantum: answer.quantum,
        tau_s: points().map(|p| p.tau_s).collect(),
        oadev: points().map(|p| p.oadev).collect(),
        adev: points().map(|p| p.adev).collect(),
        n: points().map(|p| p.terms).collect(),
        n_adev: points().map(|p| p.plain_terms).collect(),
        degrees_of_freedom: points().map(|p| p.degrees).collect(),
        interval_68: points().map(|p| p.within_68).collect(),
        interval_95: points().map(|p| p.within_95).collect(),
        fitted: points().map(|p| p.fitted).collect(),
        strongest: points().map(|p| PROCESSES[p.strongest].letter).collect(),
        read_s: answer.read_s,
        chi2_per_degree: answer.misfit,
        in_degrees: in_degrees(answer, display),
        density_one_sided: densities(answer, display),
        coefficients: in_column_unit(answer, display),
        lowest: answer.lowest.map(|l| lowest(display, l)),
        quantities: quantities(answer, display),
        steps: steps(answer),
        says: answer.notes.iter().map(|found| note(found, display)).collect(),
        notes: answer.notes.iter().map(|found| note_kind(found, display)).collect(),
    })
}

/// Why a coefficient has no value, for programs.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum ReasonKind {
    /// Not significant; the limit stands beside it.
    NotSignificant {
        /// The curve has a minimum.
        has_minimum: Option<bool>,
    },
    /// Not separable from the other processes.
    NotSeparable {
        /// The curve has a minimum.
        has_minimum: Option<bool>,
    },
    /// Too few rows.
    TooFewRows {
        /// Rows.
        rows: usize,
    },
    /// No variance.
    ZeroVariance,
    /// A transient would be taken for it.
    Transient,
    /// A slow motion of the level would be taken for it.
    SlowMotion,
    /// Long averages do not follow the processes.
    LongTimesOmitted,
    /// The resolution of the column hides it.
    CoarseResolution,
    /// Many steps of the level.
    ManySteps,
    /// The column is not a rate.
    NotARate,
}

/// Why a coefficient has no value, for programs; `has_limit`: its upper limit is known.
fn reason_kind(reason: NotShown, has_limit: bool) -> ReasonKind {
    match (reason, has_limit) {
        (NotShown::NotSignificant { has_minimum }, true) => ReasonKind::NotSignificant { has_minimum },
        (NotShown::NotSignificant { has_minimum }, false) => ReasonKind::NotSeparable { has_minimum },
        (NotShown::TooFewRows { rows }, _) => ReasonKind::TooFewRows { rows },
        (NotShown::ZeroVariance, _) => ReasonKind::ZeroVariance,
        (NotShown::Transient, _) => ReasonKind::Transient,
        (NotShown::SlowMotion, _) => ReasonKind::SlowMotion,
        (NotShown::LongTimesOmitted, _) => ReasonKind::LongTimesOmitted,
        (NotShown::CoarseResolution, _) => ReasonKind::CoarseResolution,
        (NotShown::ManySteps, _) => ReasonKind::ManySteps,
    }
}

/// A step of the level, in the column's unit.
#[derive(Serialize, JsonSchema)]
struct StepJson {
    t_s: f64,
    size: f64,
}

fn steps(answer: &Answer) -> Vec<StepJson> {
    let of = |note: &Note| if let Note::Steps(steps) = note { steps.clone() } else { Vec::new() };
    answer.notes.iter().flat_map(of).map(|LevelStep { t_s, size }| StepJson { t_s, size }).collect()
}

/// The coefficients that the record shows.
fn quantities(answer: &Answer, display: &Display) -> Vec<QuantityJson> {
    let shown = |(p, process): (usize, &Process)| {
        let estimate = answer.coefficients[p].estimate?;
        Some(QuantityJson::new(name(answer, process), standard(p), &estimate, display.coefficient(p)))
    };
    PROCESSES.iter().enumerate().filter_map(shown).collect()
}

fn in_degrees(answer: &Answer, display: &Display) -> Entries<CoefficientJson> {
    let entries = PROCESSES.iter().enumerate().map(|(p, process)| {
        let unit = process.deg_unit.to_owned();
        let entry = match answer.hours(process) {
            Some(scale) => coefficient(answer, display, p, scale, unit),
            None => {
                let says = "the column is not a rate: see coefficients".to_owned();
                let absence = Some(AbsenceJson { below: None, says, reason: Some(ReasonKind::NotARate) });
                CoefficientJson { value: None, sigma: None, dof: None, k: None, expanded: None, interval_95: None, unit, absence }
            }
        };
        (process.deg_key.to_owned(), entry)
    });
    Entries(entries.collect())
}

fn in_column_unit(answer: &Answer, display: &Display) -> Entries<CoefficientJson> {
    let entries = PROCESSES.iter().enumerate();
    Entries(
        entries
            .map(|(p, process)| (process.key.to_owned(), coefficient(answer, display, p, 1.0, answer.unit.times(process.unit))))
            .collect(),
    )
}

/// One-sided density of the white noise: √2 N.
fn densities(answer: &Answer, display: &Display) -> Entries<CoefficientJson> {
    let density = |scale: f64, unit: String| coefficient(answer, display, WHITE, std::f64::consts::SQRT_2 * scale, unit);
    let mut entries = vec![("column".to_owned(), density(1.0, answer.unit.times("/√Hz")))];
    if let Some(rad) = answer.unit.rad() {
        entries.push(("deg_h_sqrt_Hz".to_owned(), density(rad.to_degrees() * 3600.0, "(°/h)/√Hz".to_owned())));
        entries.push(("deg_s_sqrt_Hz".to_owned(), density(rad.to_degrees(), "(°/s)/√Hz".to_owned())));
    }
    Entries(entries)
}

/// Coefficient `p`, an index of [`PROCESSES`], times `scale`.
fn coefficient(answer: &Answer, display: &Display, p: usize, scale: f64, unit: String) -> CoefficientJson {
    let coefficient = &answer.coefficients[p];
    let scaled = |x: Option<f64>| x.map(|x| x * scale);
    let uncertainty = coefficient.estimate.and_then(|found| found.uncertainty);
    CoefficientJson {
        value: scaled(coefficient.estimate.map(|found| found.value)),
        sigma: scaled(uncertainty.map(|u| u.u)),
        dof: uncertainty.map(|u| u.dof),
        k: uncertainty.map(|u| u.k),
        expanded: scaled(uncertainty.map(|u| u.expanded())),
        interval_95: coefficient.within_95.map(|range| range.map(|end| end * scale)),
        unit,
        absence: not_shown(answer, display, p).map(|says| AbsenceJson {
            below: Some(scaled(coefficient.below)),
            says,
            reason: coefficient.not_shown.map(|reason| reason_kind(reason, coefficient.below.is_some())),
        }),
    }
}

fn lowest(display: &Display, lowest: Lowest) -> LowestJson {
    let (scale, unit) = (display.deviation().factor, display.deviation().unit.clone());
    LowestJson {
        tau_s: lowest.tau_s,
        oadev: lowest.oadev * scale,
        over_0_664: lowest.over_floor * scale,
        sigma: lowest.uncertainty.u * scale,
        expanded: lowest.uncertainty.expanded() * scale,
        unit,
        inside: lowest.inside,
    }
}

/// Schemas of the answers.
pub(crate) fn schemas() -> Vec<(&'static str, Value)> {
    vec![("allan", schema_of::<AnswerJson<'_>>())]
}
