//! Calibration records in words: the record file, text for a terminal, an HTML page; lists of records, verification, and trends.

pub(crate) mod archive;
mod by_hand;
mod display;
pub(crate) mod evaluated;
mod html;
mod standards;
mod text;
pub(crate) mod trend;
mod words;

pub use archive::{added_json, export_csv, export_json, list_json, list_text, show_json, show_text, skipped_text};
pub use by_hand::{by_hand_json, by_hand_text};
pub use display::{displayed, displayed_record};
pub use evaluated::{evaluated_json, evaluated_text};
pub use html::{html, value_text};
pub use text::text;
pub use trend::{trend_html, trend_json, trend_text};
pub use words::{absence, basis, meaning};

use crate::{plain, with_sigma};
use identification::statistics::uncertainty::{COVERAGE_PROBABILITY, CovarianceMatrix, Quantity};
use stand_analysis::calibrate::crystal::expanded_u;
use stand_analysis::calibrate::{CalibrateError, Curve, Meaning};
use stand_records::record::CalibrationRecord;
use stand_records::stored_record::{RecordHeader, StoredAbsence, StoredCrystal, StoredCurve, StoredQuantity, StoredRecord, StoredSeries};

/// A computed record with its texts, as its file contains it.
pub fn stored(record: &CalibrationRecord) -> StoredRecord {
    let (journal, session, findings) = (&record.journal, &record.session, &record.findings);
    StoredRecord {
        quantities: findings.quantities.iter().map(|q| q.map_texts(basis, meaning_with_standard)).collect(),
        header: RecordHeader {
            dut_kind: session.dut_kind,
            sensor: session.sensor.clone(),
            serial: session.serial.clone(),
            operator: session.operator.clone(),
            began: journal.began.clone(),
            computed: record.computed.clone(),
            stand: journal.stand.clone(),
            simulated: journal.simulated_seed.is_some(),
            tools: journal.tools.clone(),
            is_complete: record.is_complete(),
            statement: statement(),
            session: session.clone(),
            steps: journal.steps.clone(),
            interruptions: journal.interruptions.clone(),
            absent: findings.absent.iter().map(|a| StoredAbsence { name: a.quantity.clone(), reason: absence(&a.reason) }).collect(),
            remarks: findings.remarks.iter().map(words::remark).collect(),
            curves: findings.curves.iter().map(curve).collect(),
            covariance: CovarianceMatrix::of(&findings.quantities),
            response_function: findings.response_function.as_ref().map(|f| f.stored(basis)),
            frequency_response: findings.frequency_response.clone(),
            crystal: findings.crystal.as_ref().zip(session.clock_reference.as_ref()).map(|(found, reference)| StoredCrystal {
                reference: reference.name.clone(),
                error_ppm: 1e6 * found.relative_error,
                expanded_u_ppm: 1e6 * expanded_u(found),
                seconds: found.seconds,
            }),
        },
    }
}

fn curve(curve: &Curve) -> StoredCurve {
    let finite = |x: f64| x.is_finite().then_some(x);
    let points = |points: &[(f64, f64)]| points.iter().map(|(x, y)| [finite(*x), finite(*y)]).collect::<Vec<_>>();
    let style = words::curve_style(curve.kind);
    let series = curve.other_series.iter().map(|(kind, p)| StoredSeries { name: words::series(*kind).into(), points: points(p) });
    StoredCurve {
        title: style.title.into(),
        x: style.x.into(),
        y: style.y.into(),
        points: points(&curve.points),
        other_series: series.collect(),
        line: points(&curve.line),
    }
}

/// Meaning of the uncertainties of a record.
fn statement() -> String {
    format!(
        "Expanded uncertainties U have a coverage probability of {} %. This is not an accredited certificate.",
        COVERAGE_PROBABILITY * 100.0
    )
}

/// The last line of texts with expanded uncertainties.
fn footnote() -> String {
    format!("± U: expanded uncertainty, coverage probability {} %. Not an accredited certificate.", plain(COVERAGE_PROBABILITY * 100.0, 3))
}

/// Remarks, lost rows and interruptions of a record.
fn remarks(header: &RecordHeader) -> Vec<String> {
    let lost = header.steps.iter().filter(|step| step.lost_rows > 0);
    let lost = lost
        .map(|step| format!("Step `{}`: {} rows were lost on the serial line, {} were recorded.", step.name, step.lost_rows, step.rows));
    header.remarks.iter().cloned().chain(lost).chain(header.interruptions.iter().cloned()).collect()
}

/// The settings of a stand that a calibration has changed, with their new values.
pub fn settings_text(settings: &[(&str, f64)]) -> String {
    if settings.is_empty() {
        return "no setting of the stand corresponds to the calibrated quantities\n".to_owned();
    }
    let written: Vec<String> = settings.iter().map(|(name, value)| format!("{name} {}", crate::significant(*value, 6))).collect();
    format!("saved in the stand: {}\n", written.join(", "))
}

/// Why the logs give no calibration, with the reason of the first absent quantity.
pub fn calibrate_error(error: &CalibrateError) -> String {
    let first = match error {
        CalibrateError::NoQuantities { absent } => absent.first(),
        _ => None,
    };
    first.map_or(error.to_string(), |first| format!("{error}. {}: {}", first.quantity, absence(&first.reason)))
}

/// A unit behind a number; nothing for a ratio.
fn unit_suffix(unit: &str) -> String {
    if unit == "1" { String::new() } else { format!(" {unit}") }
}

/// Meaning of a quantity with the term of a standard.
fn meaning_with_standard(of: &Meaning) -> String {
    let text = meaning(of);
    standards::standard(of).map_or(text.clone(), |standard| format!("{text}; {standard}"))
}

/// Definition of a quantity with the temperature at which it holds.
pub fn definition(q: &StoredQuantity) -> String {
    let at = temperature(q);
    let meaning = q.meaning.clone().unwrap_or_default();
    if meaning.is_empty() || at.is_empty() { meaning + &at } else { format!("{meaning}; {at}") }
}

/// Temperature at which a quantity holds: `at 26.5 °C`, with the range where it varied.
fn temperature<B, M>(q: &Quantity<B, M>) -> String {
    match q.conditions.temperature {
        Some(t) if t.high_C - t.low_C < MIN_RANGE_K => format!("at {:.1} °C", t.at_C),
        Some(t) => format!("at {:.1} °C, measured from {:.1} to {:.1} °C", t.at_C, t.low_C, t.high_C),
        None => String::new(),
    }
}

/// Temperature range below which only the mean is printed, K.
const MIN_RANGE_K: f64 = 0.1;

/// Meaning of ± in a line: `U, k = 1.96, ν = 12`.
fn coverage_text<B, M>(q: &Quantity<B, M>) -> String {
    let k = words::coverage_factor(q.coverage_factor(COVERAGE_PROBABILITY));
    let dof = q.effective_dof();
    if dof < words::MANY_DOF { format!("U, k = {k}, ν = {}", words::degrees_of_freedom(dof)) } else { format!("U, k = {k}") }
}

/// Value ± U with the unit.
fn with_expanded_u<B, M>(q: &Quantity<B, M>) -> String {
    format!("{}{}", with_sigma(q.value, q.expanded_u()), unit_suffix(&q.unit))
}
