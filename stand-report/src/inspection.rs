//! An inspected file as text and JSON.

use crate::json::schema_of;
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use super::json::value;
use super::log_warning::log_warning;
use super::numbers::{grouped, plain};
use identification::log::import::{Belief, ColumnInspection, Evidence, Inspection, Question};
use identification::log::{Axis, Notes};

/// Jitter below which the times are even, part of the interval.
const MIN_JITTER: f64 = 1e-4;

/// Why a column is believed to be something.
fn evidence(belief: &Belief) -> String {
    let unit = belief.unit.as_ref().map_or("", |u| u.text.as_str());
    match belief.evidence {
        Evidence::Stated => "stated".to_owned(),
        Evidence::OtherUnit => "stated; the unit is that of the file".to_owned(),
        Evidence::OwnName => "a column of the project".to_owned(),
        Evidence::NameAndUnit => "name and unit".to_owned(),
        Evidence::NameOnly if unit.is_empty() => "its name; its unit must be stated".to_owned(),
        Evidence::NameOnly => format!("its name; no unit is stated, {unit} is assumed"),
        Evidence::NameAndValues => format!("its name; no unit is stated, only {unit} gives a usual row rate"),
        Evidence::RateAgainstAngle => format!("its name; no unit is stated, {unit} makes the rate the derivative of the angle"),
        Evidence::LikeTheReading => format!("its name; no unit is stated, {unit} is assumed as of the reading"),
        Evidence::ConstantVoltage => "a constant voltage drives nothing: the supply".to_owned(),
        Evidence::UnitOnly => "its unit, which no other column has".to_owned(),
        Evidence::Program(name) => format!("a column of {name}"),
        Evidence::IncreasesEvenly => "it increases evenly".to_owned(),
        Evidence::Unknown => "name of your own, for expressions".to_owned(),
    }
}

/// A name as a shell takes it.
fn quoted(name: &str) -> String {
    let plain = name.chars().all(|c| c.is_alphanumeric() || "_-.:/=".contains(c));
    if plain { name.to_owned() } else { format!("\"{name}\"") }
}

/// An option that answers a question, with what is probable.
fn answer(question: &Question) -> String {
    let interval = |stated: &Option<(f64, String)>| stated.as_ref().map_or("HZ".to_owned(), |s| ascii(1.0 / s.0));
    match question {
        Question::NoTime { stated_interval } => format!("--sample-rate {}", interval(stated_interval)),
        Question::TimeOrRowNumber { column, stated_interval: stated @ Some(_), .. } => {
            format!("--map {}=- --sample-rate {}", quoted(column), interval(stated))
        }
        Question::TimeOrRowNumber { column, unit, .. } => {
            format!("--unit {}", quoted(&format!("{column}={}", unit.as_deref().unwrap_or("ms"))))
        }
        Question::Unit { column, units, .. } => {
            format!("--unit {}", quoted(&format!("{column}={}", units.first().map_or("UNIT", String::as_str))))
        }
        Question::Size { column, wanted, .. } => format!("--unit {}", quoted(&format!("{column}=1 {wanted}"))),
        Question::RateAndAngle { rate, angle, pairs } => {
            let (of_rate, of_angle) = pairs.first().map_or(("rad/s", "rad"), |p| (p.0.as_str(), p.1.as_str()));
            format!("--unit {} --unit {}", quoted(&format!("{rate}={of_rate}")), quoted(&format!("{angle}={of_angle}")))
        }
        Question::Counts { column, per_turn } => {
            let n = per_turn.map_or("N".to_owned(), |c| c.usual.map_or_else(|| ascii(c.estimate), |u| u.to_string()));
            format!("--unit {}", quoted(&format!("{column}=counts:{n}")))
        }
        Question::Duty { column, full } => format!("--unit {}", quoted(&format!("{column}={}", duty_unit(*full)))),
        Question::PolePairs { column } => format!("--unit {}", quoted(&format!("{column}=erpm:7"))),
        Question::Which { target, columns } => {
            format!("--map {}", quoted(&format!("{}={target}", columns.first().map_or("NAME", String::as_str))))
        }
    }
}

/// Unit of a duty at a supply of 12 V.
fn duty_unit(full: u32) -> String {
    if full == 1 { "12 V".to_owned() } else { format!("12/{full} V") }
}

/// A number for a command line.
fn ascii(value: f64) -> String {
    plain(value, 5).replace('−', "-")
}

/// A question in one sentence, without its full stop.
fn sentence(question: &Question) -> String {
    let stated = |interval: &Option<(f64, String)>| {
        interval.as_ref().map_or(String::new(), |(s, words)| format!(" (the file states “{words}”: {} ms)", plain(s * 1e3, 4)))
    };
    let list = |items: &[String]| match items {
        [one] => one.clone(),
        [rest @ .., last] => format!("{} or {last}", rest.join(", ")),
        [] => String::new(),
    };
    match question {
        Question::NoTime { stated_interval } => {
            format!(
                "no column is known to be the time{}: state it with --map NAME=t_s, or the row rate with --sample-rate HZ",
                stated(stated_interval)
            )
        }
        Question::TimeOrRowNumber { column, unit, stated_interval } => {
            let time = unit.as_ref().map_or("a time".to_owned(), |u| format!("a time in {u}"));
            format!(
                "“{column}” counts by one: {time}, or the number of the row{}: state --unit {}, or --map {} --sample-rate HZ",
                stated(stated_interval),
                quoted(&format!("{column}={}", unit.as_deref().unwrap_or("ms"))),
                quoted(&format!("{column}=-")),
            )
        }
        Question::Unit { column, target, units } => {
            format!(
                "no unit of “{column}” ({target}) is stated: {}? State it with --unit {}",
                list(units),
                quoted(&format!("{column}=UNIT"))
            )
        }
        Question::Size { column, target, unit, wanted } => format!(
            "“{column}” is in {unit} in the file, {target} in {wanted}: state what 1 {unit} means with --unit {} (10 {wanted} for each {unit})",
            quoted(&format!("{column}=10 {wanted}"))
        ),
        Question::RateAndAngle { rate, angle, pairs } => {
            let pairs: Vec<String> = pairs.iter().map(|(r, a)| format!("{r} with {a}")).collect();
            format!(
                "no units of “{rate}” and “{angle}” are stated, and several fit each other: {}? State them with --unit {} --unit {}",
                list(&pairs),
                quoted(&format!("{rate}=UNIT")),
                quoted(&format!("{angle}=UNIT"))
            )
        }
        Question::Counts { column, per_turn } => {
            let found = per_turn.map_or(String::new(), |c| {
                let usual = c.usual.map_or(String::new(), |u| format!(", probably {u}"));
                format!(" By the rate, a turn has {} counts{usual}.", plain(c.estimate, 4))
            });
            format!(
                "“{column}” has whole numbers without a unit: counts of an encoder?{found} State the counts per turn with --unit {}, or the unit",
                quoted(&format!("{column}=counts:N"))
            )
        }
        Question::Duty { column, full } => format!(
            "“{column}” is the duty of a bridge, whose full scale is probably {full}: state its voltage by the supply, with --unit {} for a supply of 12 V",
            quoted(&format!("{column}={}", duty_unit(*full)))
        ),
        Question::PolePairs { column } => format!(
            "“{column}” is the electrical rate of the motor, in 1/min: state its pole pairs with --unit {} for 7 of them",
            quoted(&format!("{column}=erpm:7"))
        ),
        Question::Which { target, columns } => {
            let names: Vec<String> = columns.iter().map(|c| format!("“{c}”")).collect();
            format!("{} may be {target}: state which with --map {}", list(&names), quoted(&format!("NAME={target}")))
        }
    }
}

/// What a person must still decide before the mapping can be accepted; one line.
pub fn open_question(inspection: &Inspection) -> Option<String> {
    // Until it is stated how much a unit of the file is, the column has a unit of another quantity and cannot be read.
    let is_size = |q: &Question| matches!(q, Question::Size { .. });
    if let Some(refusal) = inspection.refusal.as_ref().filter(|_| !inspection.questions.iter().any(is_size)) {
        return Some(refusal.to_string());
    }
    let all: Vec<String> = inspection.questions.iter().map(sentence).collect();
    (!all.is_empty()).then(|| all.join("; "))
}

/// The first of these notes that is not understood, in one line.
pub fn note_not_understood(notes: &[(String, String)]) -> Option<String> {
    let added: Vec<(String, String)> = notes.iter().filter(|(_, text)| !text.is_empty()).cloned().collect();
    Notes::from(added).not_understood().first().map(log_warning)
}

/// The command that accepts the file with probable answers to what is open.
fn accepting_command(inspection: &Inspection) -> String {
    let options: String = inspection.questions.iter().map(|q| format!(" {}", answer(q))).collect();
    format!("stand log inspect {}{options} --accept", quoted(&inspection.path.display().to_string()))
}

/// What a comparison needs and no column is known to be.
fn missing_for_comparison(inspection: &Inspection) -> Option<String> {
    let has = |names: &[&str]| inspection.columns.iter().any(|c| c.belief.target.as_deref().is_some_and(|t| names.contains(&t)));
    let input = has(&["u_V", "i_A", "torque_N_m"]);
    let output = has(&["omega_rad_s", "theta_rad"]) || (has(&["u_V"]) && has(&["i_A"]));
    let lack = match (input, output) {
        (true, true) => return None,
        (false, true) => "no column is known to be the voltage (u_V), current (i_A) or torque (torque_N_m) of the motor",
        (true, false) => "no column is known to be the rate (omega_rad_s) or angle (theta_rad)",
        (false, false) => "no column is known to be an input (u_V, i_A, torque_N_m) or a motion (omega_rad_s, theta_rad)",
    };
    Some(format!("For a comparison with a model, {lack}: name it with --map NAME=COLUMN.\n"))
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
    } else {
        text += "\n";
    }
    if let Some(d) = &inspection.dialect {
        let separator = match d.separator {
            '\t' => "tabs".to_owned(),
            ' ' => "spaces".to_owned(),
            other => format!("“{other}”"),
        };
        let header = if d.has_header { "a row of names" } else { "no row of names" };
        text += &format!("  text: {separator} between columns, decimal “{}”, {header}", d.decimal);
        text += &match inspection.preamble {
            0 => "\n".to_owned(),
            1 => ", one line before it\n".to_owned(),
            lines => format!(", {lines} lines before it\n"),
        };
    }
    text += "\n";
    let rows: Vec<[String; 6]> = inspection.columns.iter().map(row).collect();
    let head = ["", "column", "is", "unit", "range", "why"].map(str::to_owned);
    let width = |k: usize| rows.iter().chain([&head]).map(|r| r[k].chars().count()).max().unwrap_or(0);
    let widths = [width(0), width(1), width(2), width(3), width(4)];
    for line in [&head].into_iter().chain(&rows) {
        for (cell, width) in line.iter().zip(widths) {
            text += &format!("{cell:width$}  ");
        }
        text += &format!("{}\n", line[5]);
    }
    text += "\n";
    for column in &inspection.columns {
        remarks(column).into_iter().for_each(|remark| text += &format!("{}: {remark}\n", column.belief.source));
    }
    if let Some(line) = &inspection.unmatched_header {
        text +=
            &format!("The words “{line}” before the rows do not fit the number of columns: name the columns with --map NUMBER=COLUMN.\n");
    }
    inspection.warnings.iter().for_each(|w| text += &format!("{}.\n", sentence_case(&log_warning(w))));
    if let Some(ratio) = inspection.rate_over_derivative {
        text += &format!(
            "The rate is {} × the derivative of the angle: a unit is wrong, or there is a gear between their sensors.\n",
            plain(ratio, 4)
        );
    }
    if inspection.is_own {
        return text + "A log of the project: no import is needed.\n";
    }
    text += &missing_for_comparison(inspection).unwrap_or_default();
    if let Some(refusal) = &inspection.refusal {
        text += &format!("Refused: {}.\n", refusal.to_string().trim_end_matches('.'));
    }
    inspection.questions.iter().for_each(|q| text += &format!("Open: {}.\n", sentence(q)));
    let command = accepting_command(inspection);
    let remedy = "correct it with --map FROM=TO (FROM: name or number) and --unit COLUMN=UNIT";
    text += &match (inspection.is_mapped, inspection.refusal.is_some(), inspection.questions.is_empty()) {
        (_, true, _) => String::new(),
        (true, _, true) => "The import file exists; the other commands read the file by it.\n".to_owned(),
        (_, _, true) => format!("If this is right: {command}\nIf not, {remedy}.\n"),
        (_, _, false) => format!("For example: {command}\n"),
    };
    text
}

fn sentence_case(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

fn row(column: &ColumnInspection) -> [String; 6] {
    let number = column.position.to_string();
    let b = &column.belief;
    let unit = b.unit.as_ref().map_or(String::new(), |u| u.text.clone());
    let axis = if b.unit.as_ref().is_some_and(|u| u.linear) { Axis::Linear } else { Axis::Rotary };
    let range = column.range.map_or("no numbers".to_owned(), |(low, high)| format!("{} … {}", plain(low, 5), plain(high, 5)));
    match &b.target {
        Some(target) => [number, b.source.clone(), axis.file_column(target).to_owned(), unit, range, evidence(b)],
        None => [number, b.source.clone(), "–".to_owned(), unit, range, "not used".to_owned()],
    }
}

fn remarks(column: &ColumnInspection) -> Vec<String> {
    let unit = column.belief.unit.as_ref().map_or(String::new(), |u| {
        let has_factor = u.text.starts_with(|c: char| c.is_ascii_digit() || c == '-') || u.text.contains(':');
        if has_factor { format!(" × {}", u.text) } else { format!(" {}", u.text) }
    });
    let mut remarks = Vec::new();
    if column.range.is_none()
        && let Some((row, text)) = &column.text
    {
        let is_hexadecimal = text.starts_with("0x") || text.starts_with("0X");
        let remedy = if is_hexadecimal { ": hexadecimal numbers are not read; export decimal ones" } else { "" };
        remarks.push(format!("text and no numbers, “{text}” in row {row}{remedy}"));
    }
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
        let cells = if column.missing == 1 { "one cell has".to_owned() } else { format!("{} cells have", grouped(column.missing)) };
        remarks.push(format!("{cells} no number{first}"));
    }
    remarks
}

#[derive(Serialize, JsonSchema)]
struct InspectionJson {
    log: String,
    rows: usize,
    duration_s: Option<f64>,
    interval_s: Option<f64>,
    jitter: Option<f64>,
    gaps: Option<usize>,
    segments: Option<usize>,
    longest_step_s: Option<f64>,
    warnings: Vec<String>,
    refused: Option<String>,
    rate_over_derivative: Option<f64>,
    separator: Option<char>,
    decimal: Option<char>,
    has_header: Option<bool>,
    is_own: bool,
    is_mapped: bool,
    open: Option<String>,
    columns: Vec<ColumnJson>,
}

#[derive(Serialize, JsonSchema)]
struct ColumnJson {
    number: usize,
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
        number: c.position,
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
        warnings: inspection.warnings.iter().map(log_warning).collect(),
        refused: inspection.refusal.as_ref().map(ToString::to_string),
        rate_over_derivative: inspection.rate_over_derivative,
        separator: inspection.dialect.map(|d| d.separator),
        decimal: inspection.dialect.map(|d| d.decimal),
        has_header: inspection.dialect.map(|d| d.has_header),
        is_own: inspection.is_own,
        is_mapped: inspection.is_mapped,
        open: open_question(inspection).filter(|_| !inspection.is_own),
        columns: inspection.columns.iter().map(column).collect(),
    })
}

/// Schemas of the answers.
pub(crate) fn schemas() -> Vec<(&'static str, Value)> {
    vec![("log inspect", schema_of::<InspectionJson>())]
}
