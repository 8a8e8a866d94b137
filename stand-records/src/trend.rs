//! Trend of a device under test over its calibration records.
//!
//! Input: the records of one device. Output: each quantity over the dates; its change since the first and since the previous record, each
//! with an uncertainty; and a straight line over time from three records on.
//!
//! Contributions of type B with the same source, on the same stand, are *common* to two records: they enter both with the same error
//! (crystal, mounting, readings). Only their difference |u₂ − u₁| remains in a change (GUM F.1.2.3, correlation 1). A device that was
//! mounted anew has another misalignment; then the uncertainty without common contributions holds, which is given too.

use super::archive::ArchivedRecord;
use super::stored_record::StoredQuantity;
use identification::parameters::NamesParameters;
use identification::statistics::uncertainty::{Contribution, Evaluation, Quantity};
use stand_analysis::calibrate::DutKind;
use std::collections::BTreeSet;

const DAY_S: f64 = 86_400.0;
/// Fewest records of a straight line.
const MIN_LINE_RECORDS: usize = 3;

/// A quantity in one record.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Start of its session.
    pub began: String,
    /// Days since the first record of the device.
    pub day: f64,
    /// Manufacturer, type and number of the stand.
    pub stand: String,
    /// All steps of the session were done.
    pub is_complete: bool,
    /// The quantity.
    pub quantity: StoredQuantity,
}

/// The difference of two records.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// Later minus earlier value; the budget holds what is not common to both.
    pub difference: Quantity<(), ()>,
    /// Sources of the common contributions.
    pub common: Vec<String>,
    /// Expanded uncertainty without common contributions.
    pub independent_expanded_u: f64,
}

impl Change {
    /// From one record to a later one.
    pub fn between(before: &Point, after: &Point) -> Self {
        let is_same_stand = before.stand == after.stand;
        let find_common = |c: &Contribution<String>, point: &Point| {
            let is_common =
                |d: &&Contribution<String>| c.evaluation == Evaluation::B && d.evaluation == Evaluation::B && c.source == d.source;
            point.quantity.contributions.iter().filter(|_| is_same_stand).find(is_common).map(Contribution::signed_contribution)
        };
        let (mut remaining, mut all, mut common) = (Vec::new(), Vec::new(), Vec::new());
        for (point, other, when) in [(before, after, "before"), (after, before, "after")] {
            for c in &point.quantity.contributions {
                let contribution = |source: String, u: f64| Contribution {
                    evaluation: c.evaluation,
                    dof: c.dof,
                    distribution: c.distribution,
                    ..Contribution::type_b(&source, u, "", 1.0, ())
                };
                let own = contribution(format!("{}, {when}", c.source), c.contribution());
                all.push(own.clone());
                match find_common(c, other) {
                    None => remaining.push(own),
                    // Each pair is counted once.
                    Some(u) if when == "after" => {
                        remaining.push(contribution(c.source.clone(), (c.signed_contribution() - u).abs()));
                        common.push(c.source.clone());
                    }
                    Some(_) => {}
                }
            }
        }
        if let Some(u) = instability_u(before, after) {
            let wandering = Contribution { evaluation: Evaluation::A, ..Contribution::type_b("in-run instability", u, "", 1.0, ()) };
            all.push(wandering.clone());
            remaining.push(wandering);
        }
        let q = &after.quantity;
        let difference = |contributions| Quantity::new(&q.name, &q.unit, q.value - before.quantity.value, contributions);
        Self { difference: difference(remaining), common, independent_expanded_u: difference(all).expanded_u() }
    }

    /// The change exceeds its expanded uncertainty.
    pub fn is_significant(&self) -> bool {
        self.difference.value.abs() > self.difference.expanded_u()
    }
}

/// Standard deviation of the difference of two averages of a value with flicker noise, from its Allan deviation a at the averaging time τ:
/// a √(2 B₂(r)) with r = T/τ, T the time between the averages (bias function B₂ for flicker frequency noise, NIST Technical Note 375).
/// `None` where the records have no in-run instability.
fn instability_u(before: &Point, after: &Point) -> Option<f64> {
    let (a, b) = (before.quantity.conditions.instability?, after.quantity.conditions.instability?);
    let averaged_s = 0.5 * (a.averaged_s + b.averaged_s);
    let ratio = ((after.day - before.day) * DAY_S / averaged_s).max(1.0);
    Some((a.allan_deviation.powi(2) + b.allan_deviation.powi(2)).sqrt() * flicker_bias(ratio).sqrt())
}

/// Barnes' bias function B₂(r) for flicker noise; 1 for adjacent averages.
fn flicker_bias(r: f64) -> f64 {
    let term = |x: f64| if x > 0.0 { x * x * x.ln() } else { 0.0 };
    if r > 1e3 {
        // The difference of large terms, expanded: (3 + 2 ln r)/(4 ln 2).
        return (3.0 + 2.0 * r.ln()) / (4.0 * std::f64::consts::LN_2);
    }
    (term(r + 1.0) + term(r - 1.0) - 2.0 * term(r)) / (4.0 * std::f64::consts::LN_2)
}

/// The straight line over the days.
#[derive(Debug, Clone, PartialEq)]
pub struct TrendLine {
    /// Value at day 0.
    pub at_first: f64,
    /// Slope per day.
    pub slope: Quantity<(), ()>,
    /// Number of records.
    pub records: usize,
    /// Birge ratio: scatter of the records over the scatter predicted by their uncertainties.
    pub birge_ratio: f64,
}

impl TrendLine {
    /// The slope exceeds its expanded uncertainty.
    pub fn is_significant(&self) -> bool {
        self.slope.value.abs() > self.slope.expanded_u()
    }
}

/// A quantity over the records.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name of the quantity.
    pub name: String,
    /// By date.
    pub points: Vec<Point>,
    /// For each point after the first: change since the first, change since the previous one.
    pub changes: Vec<(Change, Change)>,
    /// The straight line.
    pub line: Option<TrendLine>,
    /// Standard deviation from session to session, from three records on (IEEE Std 528: repeatability; with the power switched off in
    /// between, from turn-on to turn-on).
    pub repeatability: Option<Quantity<(), ()>>,
}

/// All quantities of a device under test.
#[derive(Debug, Clone, PartialEq)]
pub struct Trend {
    /// Kind of the device: gyro, accel or drive.
    pub kind: &'static str,
    /// Its serial number.
    pub serial: String,
    /// Dates of its records.
    pub dates: Vec<String>,
    /// The quantities.
    pub series: Vec<Series>,
}

/// Manufacturer, type and number of an answer to `*IDN?`, without the firmware version.
fn without_version(identity: &str) -> String {
    identity.split(',').take(3).map(str::trim).collect::<Vec<_>>().join(",")
}

/// The device and the quantity of a trend.
#[derive(Debug, Clone, Copy)]
pub struct TrendSelection<'a> {
    /// Serial number of the device.
    pub serial: &'a str,
    /// Kind of the device; needed where several kinds have this serial number.
    pub dut_kind: Option<DutKind>,
    /// The quantity; `None` for all.
    pub quantity: Option<&'a str>,
}

/// Why a selection has no trend. The lists are sorted.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TrendError {
    /// No record has the serial number.
    #[error("no record of serial {serial}; there are: {}", listed(.known))]
    Serial {
        /// The serial number.
        serial: String,
        /// Serial numbers of the records.
        known: Vec<String>,
    },
    /// Devices of several kinds have the serial number.
    #[error("serial {serial} has records of {}: select one", listed(.kinds))]
    Kinds {
        /// The serial number.
        serial: String,
        /// The kinds.
        kinds: Vec<String>,
    },
    /// No record of the device has the quantity.
    #[error("no record has {quantity}; there are: {}", listed(.known))]
    Quantity {
        /// The quantity.
        quantity: String,
        /// Quantities of the records.
        known: Vec<String>,
    },
}

impl NamesParameters for TrendError {
    fn parameters(&self) -> Vec<&str> {
        match self {
            TrendError::Kinds { .. } => vec!["kind"],
            TrendError::Quantity { .. } => vec!["quantity"],
            _ => Vec::new(),
        }
    }
}

fn listed(words: &[String]) -> String {
    if words.is_empty() { "none".to_owned() } else { words.join(", ") }
}

/// Trend of the selected device among all records, which are sorted by date.
///
/// # Errors
/// The selection has no record, or devices of several kinds.
pub fn trend_of_device(records: &[ArchivedRecord], selection: &TrendSelection) -> Result<Trend, TrendError> {
    let sorted = |words: &mut dyn Iterator<Item = String>| {
        let words: BTreeSet<String> = words.filter(|word| !word.is_empty()).collect();
        words.into_iter().collect::<Vec<_>>()
    };
    let serial = || selection.serial.to_owned();
    let is_selected = |r: &&ArchivedRecord| {
        let header = &r.record.header;
        header.session.serial == selection.serial && selection.dut_kind.is_none_or(|kind| header.dut_kind == kind)
    };
    let selected: Vec<&ArchivedRecord> = records.iter().filter(is_selected).collect();
    if selected.is_empty() {
        let known = sorted(&mut records.iter().map(|r| r.record.header.session.serial.clone()));
        return Err(TrendError::Serial { serial: serial(), known });
    }
    let kinds = sorted(&mut selected.iter().map(|r| r.record.header.dut_kind.name().to_owned()));
    if kinds.len() > 1 {
        return Err(TrendError::Kinds { serial: serial(), kinds });
    }
    let trend = trend(&selected, selection.quantity);
    match selection.quantity {
        Some(quantity) if trend.series.is_empty() => {
            let known = sorted(&mut selected.iter().flat_map(|r| &r.record.quantities).map(|q| q.name.clone()));
            Err(TrendError::Quantity { quantity: quantity.to_owned(), known })
        }
        _ => Ok(trend),
    }
}

/// Trend of the records of one device, sorted by date; of one quantity, or of all.
fn trend(records: &[&ArchivedRecord], quantity: Option<&str>) -> Trend {
    let first_began = records.iter().find_map(|r| r.began());
    let day = |r: &ArchivedRecord| match (r.began(), first_began) {
        (Some(at), Some(first)) => at.duration_since(first).as_secs_f64() / DAY_S,
        _ => 0.0,
    };
    let mut names: Vec<String> = Vec::new();
    for q in records.iter().flat_map(|r| &r.record.quantities) {
        if !names.contains(&q.name) && quantity.is_none_or(|name| name == q.name) {
            names.push(q.name.clone());
        }
    }
    let series = names.into_iter().map(|name| {
        let point = |r: &&ArchivedRecord| {
            let header = &r.record.header;
            Some(Point {
                began: header.began.clone(),
                day: day(r),
                stand: without_version(&header.stand),
                is_complete: header.steps.len() == header.session.steps.len(),
                quantity: r.record.get(&name)?.clone(),
            })
        };
        let points: Vec<Point> = records.iter().filter_map(point).collect();
        let changes =
            (1..points.len()).map(|k| (Change::between(&points[0], &points[k]), Change::between(&points[k - 1], &points[k]))).collect();
        let (line, repeatability) = (line(&points), repeatability(&points));
        Series { name, points, changes, line, repeatability }
    });
    Trend {
        kind: records.first().map_or("", |r| r.record.header.dut_kind.name()),
        serial: records.first().map_or(String::new(), |r| r.record.header.session.serial.clone()),
        dates: records.iter().map(|r| r.record.header.began.clone()).collect(),
        series: series.collect(),
    }
}

/// Weighted least squares over the days. The weights contain what is not common to all records; a Birge ratio above 1 enlarges the
/// uncertainty of the slope.
fn line(points: &[Point]) -> Option<TrendLine> {
    if points.len() < MIN_LINE_RECORDS {
        return None;
    }
    let independent_u = |p: &Point| {
        let is_common = |c: &&Contribution<String>| {
            let has = |o: &Point| o.quantity.contributions.iter().any(|d| d.evaluation == Evaluation::B && d.source == c.source);
            c.evaluation == Evaluation::B && points.iter().all(|o| o.stand == p.stand && has(o))
        };
        let squares: f64 = p.quantity.contributions.iter().filter(|c| !is_common(c)).map(|c| c.contribution().powi(2)).sum();
        if squares > 0.0 { squares.sqrt() } else { p.quantity.combined_u() }
    };
    let weights: Vec<f64> = points.iter().map(|p| independent_u(p).powi(-2)).collect();
    let sum = |of: &dyn Fn(&Point) -> f64| points.iter().zip(&weights).map(|(p, w)| w * of(p)).sum::<f64>();
    let total = sum(&|_| 1.0);
    let (day, value) = (sum(&|p| p.day) / total, sum(&|p| p.quantity.value) / total);
    let spread = sum(&|p| (p.day - day).powi(2));
    if !(spread.is_finite() && spread / total > 1e-12) {
        return None;
    }
    let slope = sum(&|p| (p.day - day) * (p.quantity.value - value)) / spread;
    let dof = points.len() as f64 - 2.0;
    let birge_ratio = (sum(&|p| (p.quantity.value - value - slope * (p.day - day)).powi(2)) / dof).sqrt();
    let (u, dof) = if birge_ratio > 1.0 { (birge_ratio * spread.powf(-0.5), dof) } else { (spread.powf(-0.5), f64::INFINITY) };
    let q = &points[0].quantity;
    let unit = if q.unit == "1" { "1/d".to_owned() } else { format!("{}/d", q.unit) };
    let slope_quantity = Quantity::new(&q.name, &unit, slope, vec![Contribution::type_a("records", u, dof, ())]);
    Some(TrendLine { at_first: value - slope * day, slope: slope_quantity, records: points.len(), birge_ratio })
}

/// Standard deviation of the values.
fn repeatability(points: &[Point]) -> Option<Quantity<(), ()>> {
    let dof = points.len().checked_sub(1).filter(|_| points.len() >= MIN_LINE_RECORDS)? as f64;
    let mean = points.iter().map(|p| p.quantity.value).sum::<f64>() / points.len() as f64;
    let sd = (points.iter().map(|p| (p.quantity.value - mean).powi(2)).sum::<f64>() / dof).sqrt();
    let q = &points[0].quantity;
    Some(Quantity::new(&q.name, &q.unit, sd, vec![Contribution::type_a("number of records", sd / (2.0 * dof).sqrt(), dof, ())]))
}

impl Trend {
    /// Names of the quantities that differ significantly between the first and the last record.
    pub fn significant(&self) -> Vec<&str> {
        let has_moved = |s: &&Series| s.changes.last().is_some_and(|(since_first, _)| since_first.is_significant());
        self.series.iter().filter(has_moved).map(|s| s.name.as_str()).collect()
    }
}

#[cfg(test)]
mod tests;
