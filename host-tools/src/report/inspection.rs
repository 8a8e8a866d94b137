//! An inspected file as text and JSON.

use serde::Serialize;
use serde_json::Value;

use super::json::value;
use super::numbers::{grouped, plain};
use crate::log::import::{Belief, ColumnInspection, Evidence, Inspection};

/// Jitter below which the times are even, part of the interval.
const MIN_JITTER: f64 = 1e-4;

/// Why a column is believed to be something.
fn evidence(belief: &Belief) -> String {
    let unit = belief.unit.as_ref().map_or("", |u| u.text.as_str());
    match belief.evidence {
        Evidence::Stated => "stated".to_owned(),
        Evidence::OwnName => "a column of the project".to_owned(),
        Evidence::NameAndUnit => "name and unit".to_owned(),
        Evidence::NameOnly => format!("its name; no unit is stated, {unit} is assumed"),
        Evidence::NameAndValues => format!("its name; no unit is stated, {unit} gives a usual row rate"),
        Evidence::RateAgainstAngle => format!("its name; no unit is stated, {unit} makes the rate the derivative of the angle"),
        Evidence::UnitOnly => "its unit, which no other column has".to_owned(),
        Evidence::IncreasesEvenly => "it increases evenly".to_owned(),
        Evidence::Unknown => "name of your own, for expressions".to_owned(),
    }
}

/// What a person must still decide before the mapping can be accepted.
pub fn open_question(inspection: &Inspection) -> Option<String> {
    if inspection.timing.is_none() {
        return Some("no column is known to be the time: state it with --map NAME=t_s, or the row rate with --sample-rate HZ".to_owned());
    }
    inspection.columns.iter().find_map(|c| {
        let b = &c.belief;
        let first = b.alternatives.first()?;
        let unit = b.unit.as_ref().map_or("", |u| u.text.as_str());
        Some(format!("the unit of “{0}” is not certain: state it with --unit {0}={unit} or --unit {0}={first}", b.source))
    })
}

/// The inspection as text.
pub fn text(inspection: &Inspection) -> String {
    let mut text = format!("{}: {} rows", inspection.path.display(), grouped(inspection.rows));
    if let Some(t) = &inspection.timing {
        text += &format!(", {} s at {} ms ({} Hz)\n", plain(t.duration_s, 5), plain(t.interval_s * 1e3, 4), plain(1.0 / t.interval_s, 4));
        text += &match t.gaps {
            0 => "  gaps: none".to_owned(),
            gaps => format!("  gaps: {gaps}, the longest step {} s; the rows are {} segments", plain(t.longest_s, 3), gaps + 1),
        };
        let jitter = if t.jitter < MIN_JITTER { "none".to_owned() } else { format!("{} % of the interval", plain(100.0 * t.jitter, 2)) };
        text += &format!("; jitter of the time: {jitter}\n");
        if t.disorder > 0 {
            text += &format!("  the time repeats or steps back {} times: such a file is refused\n", t.disorder);
        }
    } else {
        text += "; no column is known to be the time\n";
    }
    if let Some(d) = &inspection.dialect {
        let separator = match d.separator {
            '\t' => "tabs".to_owned(),
            ' ' => "spaces".to_owned(),
            other => format!("“{other}”"),
        };
        let header = if d.has_header { "a row of names" } else { "no row of names" };
        text += &format!("  text: {separator} between columns, decimal “{}”, {header}", d.decimal);
        text += &if inspection.preamble > 0 { format!(", {} lines before it\n", inspection.preamble) } else { "\n".to_owned() };
    }
    text += "\n";
    let rows: Vec<[String; 5]> = inspection.columns.iter().map(row).collect();
    let head = ["column", "is", "unit", "range", "why"].map(str::to_owned);
    let width = |k: usize| rows.iter().chain([&head]).map(|r| r[k].chars().count()).max().unwrap_or(0);
    let widths = [width(0), width(1), width(2), width(3)];
    for line in [&head].into_iter().chain(&rows) {
        for (cell, width) in line.iter().zip(widths) {
            text += &format!("{cell:width$}  ");
        }
        text += &format!("{}\n", line[4]);
    }
    text += "\n";
    for column in &inspection.columns {
        remarks(column).into_iter().for_each(|remark| text += &format!("{}: {remark}\n", column.belief.source));
    }
    let name = inspection.path.display();
    text += &match (inspection.is_own, inspection.is_mapped, open_question(inspection)) {
        (true, ..) => "A log of the project: no import is needed.\n".to_owned(),
        (_, true, _) => "The import file exists; the other commands read the file by it.\n".to_owned(),
        (_, _, Some(question)) => format!("Open: {question}.\n"),
        _ => {
            format!("If this is right: stand log inspect {name} --accept. If not, correct it with --map FROM=TO and --unit COLUMN=UNIT.\n")
        }
    };
    text
}

fn row(column: &ColumnInspection) -> [String; 5] {
    let b = &column.belief;
    let unit = b.unit.as_ref().map_or(String::new(), |u| u.text.clone());
    let range = column.range.map_or("no numbers".to_owned(), |(low, high)| format!("{} … {}", plain(low, 5), plain(high, 5)));
    match &b.target {
        Some(target) => [b.source.clone(), target.clone(), unit, range, evidence(b)],
        None => [b.source.clone(), "–".to_owned(), unit, range, "not used".to_owned()],
    }
}

fn remarks(column: &ColumnInspection) -> Vec<String> {
    let unit = column.belief.unit.as_ref().map_or(String::new(), |u| format!(" {}", u.text));
    let mut remarks = Vec::new();
    if column.is_constant {
        remarks.push("constant".to_owned());
    }
    if let Some(step) = column.quantization_step {
        remarks.push(format!("quantised in steps of {}{unit}", plain(step, 4)));
    }
    if column.saturated_rows > 0 {
        remarks
            .push(format!("{} rows rest at the largest or smallest value: the range seems to be limited", grouped(column.saturated_rows)));
    }
    if column.missing > 0 && column.range.is_some() {
        let first = column.text.as_ref().map_or(String::new(), |(row, text)| format!(", the first text is “{text}” in row {row}"));
        remarks.push(format!("{} cells have no number{first}", grouped(column.missing)));
    }
    remarks
}

#[derive(Serialize)]
struct InspectionJson {
    log: String,
    rows: usize,
    duration_s: Option<f64>,
    interval_s: Option<f64>,
    jitter: Option<f64>,
    gaps: Option<usize>,
    segments: Option<usize>,
    longest_step_s: Option<f64>,
    time_disorder: Option<usize>,
    separator: Option<char>,
    decimal: Option<char>,
    has_header: Option<bool>,
    is_own: bool,
    is_mapped: bool,
    open: Option<String>,
    columns: Vec<ColumnJson>,
}

#[derive(Serialize)]
struct ColumnJson {
    name: String,
    is: Option<String>,
    unit: Option<String>,
    alternatives: Vec<String>,
    why: String,
    min: Option<f64>,
    max: Option<f64>,
    missing: usize,
    quantization_step: Option<f64>,
    saturated_rows: usize,
    constant: bool,
}

/// The inspection as JSON.
pub fn json(inspection: &Inspection) -> Value {
    let column = |c: &ColumnInspection| ColumnJson {
        name: c.belief.source.clone(),
        is: c.belief.target.clone(),
        unit: c.belief.unit.as_ref().map(|u| u.text.clone()),
        alternatives: c.belief.alternatives.clone(),
        why: evidence(&c.belief),
        min: c.range.map(|r| r.0),
        max: c.range.map(|r| r.1),
        missing: c.missing,
        quantization_step: c.quantization_step,
        saturated_rows: c.saturated_rows,
        constant: c.is_constant,
    };
    let t = inspection.timing;
    value(&InspectionJson {
        log: inspection.path.display().to_string(),
        rows: inspection.rows,
        duration_s: t.map(|t| t.duration_s),
        interval_s: t.map(|t| t.interval_s),
        jitter: t.map(|t| t.jitter),
        gaps: t.map(|t| t.gaps),
        segments: t.map(|t| t.gaps + 1),
        longest_step_s: t.map(|t| t.longest_s),
        time_disorder: t.map(|t| t.disorder),
        separator: inspection.dialect.map(|d| d.separator),
        decimal: inspection.dialect.map(|d| d.decimal),
        has_header: inspection.dialect.map(|d| d.has_header),
        is_own: inspection.is_own,
        is_mapped: inspection.is_mapped,
        open: open_question(inspection).filter(|_| !inspection.is_own && !inspection.is_mapped),
        columns: inspection.columns.iter().map(column).collect(),
    })
}
