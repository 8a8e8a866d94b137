//! Sentences about an Allan analysis.

use super::Display;
use crate::allan::FLOOR;
use crate::allan::answer::{Answer, FLICKER, Interpretation, NotShown, Note, WHITE};
use crate::allan::time_stamps::TimingNote;
use crate::allan::units::{PROCESSES, Process, Unit};
use crate::report::{grouped, log_warning, plain, significant, with_sigma};

/// Rows that a fit of coefficients needs.
const ROWS_FOR_COEFFICIENTS: usize = 80;

/// The reason why coefficient `p` has no value; `None` if it has one.
pub(super) fn not_shown(answer: &Answer, display: &Display, p: usize) -> Option<String> {
    let coefficient = &answer.coefficients[p];
    Some(match coefficient.not_shown? {
        NotShown::NotSignificant { has_minimum } => {
            let scale = display.coefficient(p);
            let limit = match coefficient.below {
                Some(below) => {
                    format!("not significant in this record: below {} {} (95 %)", significant(below * scale.factor, 2), scale.unit)
                }
                None => "not distinguishable from the other processes in this record".to_owned(),
            };
            let minimum = match has_minimum {
                Some(true) => "; the other processes explain the minimum of the curve",
                Some(false) => "; the curve has no minimum up to T/10, a longer record may show one",
                None => "",
            };
            limit + minimum
        }
        general => no_coefficients(general),
    })
}

fn no_coefficients(reason: NotShown) -> String {
    match reason {
        NotShown::TooFewRows { rows } => {
            format!("{rows} rows are too few to separate the processes: at least {ROWS_FOR_COEFFICIENTS} rows are needed")
        }
        NotShown::ZeroVariance => "the curve reaches zero and cannot be fitted".to_owned(),
        NotShown::NotSignificant { .. } => "not significant in this record".to_owned(),
    }
}

/// A remark about the record or the fit.
pub(super) fn note(note: &Note) -> String {
    match note {
        Note::Log(warning) => log_warning(warning),
        Note::Timing(TimingNote::Scatter { relative }) => {
            format!(
                "time stamps scatter by {} % of the interval; the samples are treated as evenly spaced",
                significant(100.0 * relative, 2)
            )
        }
        Note::Timing(TimingNote::Bursts { rows, interval_s }) => format!(
            "time stamps come in bursts of {} rows on average; the samples are treated as evenly spaced by {} s, the time per row",
            significant(*rows, 3),
            significant(*interval_s, 6)
        ),
        Note::Timing(TimingNote::Gaps { count, missing }) => format!(
            "{count} {}, about {} samples missing: no difference crosses a gap, the terms of all segments are pooled",
            if *count == 1 { "gap" } else { "gaps" },
            missing.round().max(1.0)
        ),
        Note::NoCoefficients(reason) => no_coefficients(*reason),
        Note::Unexplained { misfit } => format!(
            "the five processes do not explain this curve: χ² is {} per degree of freedom, and the uncertainties are multiplied by its square root. Possible causes: vibration, a periodic signal or steps in the record",
            significant(*misfit, 3)
        ),
        Note::ShortTimesOmitted { below_s } => format!(
            "averages below {} s do not follow the five processes (a filter in the sensor, the step of its converter) and are not used in the fit",
            significant(*below_s, 3)
        ),
    }
}

/// What was analysed.
pub(super) fn title(answer: &Answer) -> String {
    let taken = if answer.interpretation == Interpretation::Integral { ", interpreted as an integral" } else { "" };
    format!(
        "{}: {}{taken}, {} rows, {} s at {} s",
        answer.log,
        answer.column,
        grouped(answer.rows),
        plain(answer.duration_s(), 6),
        plain(answer.interval_s, 6)
    )
}

/// Name of a process for this column.
pub(super) fn name(answer: &Answer, process: &Process) -> &'static str {
    if answer.unit.rad().is_some() { process.name } else { process.plain_name }
}

/// The value of coefficient `p` with its standard uncertainty, or the reason why it has none.
pub(super) fn value(answer: &Answer, display: &Display, p: usize) -> String {
    let (coefficient, process) = (&answer.coefficients[p], &PROCESSES[p]);
    let (scale, unit) = (display.coefficient(p).factor, &display.coefficient(p).unit);
    match (coefficient.value, coefficient.sigma) {
        (Some(value), Some(sigma)) => {
            let floor = if process.letter == "B" {
                format!("; floor of the curve 0.664 B = {} {unit}", significant(FLOOR * value * scale, 3))
            } else {
                String::new()
            };
            format!("{} {unit}{floor}", with_sigma(value * scale, sigma * scale))
        }
        _ => not_shown(answer, display, p).unwrap_or_default(),
    }
}

/// One-sided noise density √2 N in the units of data sheets.
pub(super) fn density(answer: &Answer, display: &Display) -> Option<String> {
    let shown = std::f64::consts::SQRT_2 * answer.coefficients[WHITE].value?;
    let each: Vec<String> =
        display.densities().iter().map(|scale| format!("{} {}", significant(shown * scale.factor, 4), scale.unit)).collect();
    Some(format!("one-sided density √2 N = {}", each.join(" = ")))
}

fn lowest(answer: &Answer, display: &Display) -> Option<String> {
    let found = answer.lowest.as_ref()?;
    let (scale, unit) = (display.deviation().factor, &display.deviation().unit);
    let low = format!("lowest point {} {unit} at {} s", significant(found.oadev * scale, 3), significant(found.tau_s, 3));
    Some(if found.inside {
        format!(
            "{low}, over 0.664: {} {unit} (bias instability as defined in data sheets{})",
            with_sigma(found.over_floor * scale, found.sigma * scale),
            if answer.coefficients[FLICKER].value.is_some() { ", includes the other processes" } else { "" }
        )
    } else {
        let floor =
            if answer.coefficients[FLICKER].value.is_some() { "the curve still decreases towards 0.664 B" } else { "no floor is visible" };
        format!("{low}, at the end of the range used: {floor}")
    })
}

fn read(answer: &Answer) -> Option<String> {
    let [from, to] = answer.read_s?;
    Some(format!(
        "coefficients from τ = {} s to T/10 = {} s; χ² per degree of freedom {}",
        significant(from, 3),
        significant(to, 3),
        significant(answer.misfit?, 2)
    ))
}

fn quantum(answer: &Answer) -> Option<String> {
    let unit = Unit::of(&answer.column).name;
    answer.quantum.map(|quantum| format!("least significant bit of the column: {} {unit}", significant(quantum, 3)))
}

/// Lowest point, range of the fit and resolution.
pub(super) fn facts(answer: &Answer, display: &Display) -> Vec<String> {
    [lowest(answer, display), read(answer), quantum(answer)].into_iter().flatten().collect()
}
