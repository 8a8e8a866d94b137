//! How a part changes from record to record.
//!
//! In: the records of one part. Out: each quantity over the dates, its change from the first record and from the one before with an uncertainty of its own,
//! and a straight line over time where there are three records or more.
//!
//! *Common* to two records is what enters both with the same error: a contribution of type B of the same name, on the same stand (its crystal, its
//! mounting, its readings). Of a difference only what differs of it is left, |u₂ − u₁| (GUM F.1.2.3, correlation 1). A part that was mounted anew
//! between has a misalignment of its own: then the uncertainty without anything in common holds, which is given beside it.

use super::kept::Kept;
use crate::report::finite;
use crate::statistics::uncertainty::{Kind, Part, Quantity, coverage_factor};
use serde_json::{Value, json};

const DAY_S: f64 = 86_400.0;

/// A quantity in one record.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// When its session began.
    pub began: String,
    /// Days from the part's first record.
    pub day: f64,
    /// The stand: maker, kind and number.
    pub stand: String,
    /// All steps of the session were done.
    pub is_whole: bool,
    /// What was found.
    pub found: Quantity,
}

/// The difference of two records.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// Later less earlier, with what is not common to both as its budget.
    pub by: Quantity,
    /// What was taken as common.
    pub common: Vec<String>,
    /// Expanded uncertainty if nothing is common.
    pub expanded_without: f64,
}

impl Change {
    /// From one record to a later one.
    pub fn between(before: &Point, after: &Point) -> Self {
        let same_stand = before.stand == after.stand;
        let twin = |p: &Part, of: &Point| {
            of.found.parts.iter().find(|q| same_stand && p.kind == Kind::B && q.kind == Kind::B && p.of == q.of).cloned()
        };
        let (mut parts, mut all, mut common) = (Vec::new(), Vec::new(), Vec::new());
        for (point, when) in [(before, "before"), (after, "after")] {
            for part in &point.found.parts {
                let alone = Part { of: format!("{}, {when}", part.of), ..part.clone() };
                all.push(alone.clone());
                match twin(part, if when == "before" { after } else { before }) {
                    None => parts.push(alone),
                    Some(other) if when == "after" => {
                        let left = (part.contribution() - other.contribution()).abs();
                        let says = format!("common to both: {}", part.says);
                        parts.push(Part { u: left, sensitivity: 1.0, unit: point.found.unit.clone(), says, ..part.clone() });
                        common.push(part.of.clone());
                    }
                    Some(_) => {}
                }
            }
        }
        let q = &after.found;
        let by = |parts| Quantity::new(&q.name, &q.unit, q.value - before.found.value, parts);
        Self { by: by(parts), common, expanded_without: by(all).expanded() }
    }

    /// It is more than its expanded uncertainty.
    pub fn is_beyond(&self) -> bool {
        self.by.value.abs() > self.by.expanded()
    }

    fn json(&self) -> Value {
        json!({
            "value": finite(self.by.value), "sigma": finite(self.by.sigma()), "dof": finite(self.by.dof()), "U": finite(self.by.expanded()),
            "unit": self.by.unit, "beyond": self.is_beyond(), "common": self.common, "U_if_nothing_is_common": finite(self.expanded_without),
        })
    }
}

/// A quantity over the records.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Its name.
    pub name: String,
    /// By date.
    pub points: Vec<Point>,
    /// Of each point after the first: from the first, and from the one before.
    pub changes: Vec<(Change, Change)>,
    /// Value at day 0 and slope per day.
    pub line: Option<(f64, Quantity)>,
}

/// All quantities of a part.
#[derive(Debug, Clone, PartialEq)]
pub struct Trend {
    /// gyro, accel or drive.
    pub what: String,
    /// The part.
    pub serial: String,
    /// Dates of its records.
    pub dates: Vec<String>,
    /// Quantity by quantity.
    pub series: Vec<Series>,
}

fn maker_kind_number(identity: &str) -> String {
    identity.split(',').take(3).map(str::trim).collect::<Vec<_>>().join(",")
}

/// The trend of these records, which are of one part and by date; of one quantity, or of all.
pub fn trend(records: &[&Kept], quantity: Option<&str>) -> Trend {
    let first_at = records.iter().find_map(|k| k.at());
    let day = |k: &Kept| match (k.at(), first_at) {
        (Some(at), Some(first)) => at.duration_since(first).as_secs_f64() / DAY_S,
        _ => 0.0,
    };
    let mut names: Vec<String> = Vec::new();
    for q in records.iter().flat_map(|k| &k.record.findings.quantities) {
        if !names.contains(&q.name) && quantity.is_none_or(|name| name == q.name) {
            names.push(q.name.clone());
        }
    }
    let series = names.into_iter().map(|name| {
        let point = |k: &&Kept| {
            let r = &k.record;
            let found = r.findings.get(&name)?.clone();
            Some(Point {
                began: r.journal.began.clone(),
                day: day(k),
                stand: maker_kind_number(&r.journal.stand),
                is_whole: r.is_whole(),
                found,
            })
        };
        let points: Vec<Point> = records.iter().filter_map(point).collect();
        let changes =
            (1..points.len()).map(|k| (Change::between(&points[0], &points[k]), Change::between(&points[k - 1], &points[k]))).collect();
        let line = line(&points);
        Series { name, points, changes, line }
    });
    Trend {
        what: records.first().map_or(String::new(), |k| k.record.session.what.name().to_owned()),
        serial: records.first().map_or(String::new(), |k| k.record.session.serial.clone()),
        dates: records.iter().map(|k| k.record.journal.began.clone()).collect(),
        series: series.collect(),
    }
}

/// Weighted least squares over the days. Weights are of what is not common to all; where the points scatter more than their uncertainties say, the slope's
/// is larger by that (Birge ratio).
fn line(points: &[Point]) -> Option<(f64, Quantity)> {
    if points.len() < 3 {
        return None;
    }
    let own = |p: &Point| {
        let common = |part: &&Part| {
            part.kind == Kind::B
                && points.iter().all(|o| o.stand == p.stand && o.found.parts.iter().any(|q| q.kind == Kind::B && q.of == part.of))
        };
        let left: f64 = p.found.parts.iter().filter(|part| !common(part)).map(|part| part.contribution().powi(2)).sum();
        if left > 0.0 { left.sqrt() } else { p.found.sigma() }
    };
    let w: Vec<f64> = points.iter().map(|p| own(p).powi(-2)).collect();
    let sum = |of: &dyn Fn(&Point) -> f64| points.iter().zip(&w).map(|(p, w)| w * of(p)).sum::<f64>();
    let total = sum(&|_| 1.0);
    let (day, value) = (sum(&|p| p.day) / total, sum(&|p| p.found.value) / total);
    let spread = sum(&|p| (p.day - day).powi(2));
    if !(spread.is_finite() && spread / total > 1e-12) {
        return None;
    }
    let slope = sum(&|p| (p.day - day) * (p.found.value - value)) / spread;
    let dof = points.len() as f64 - 2.0;
    let birge = (sum(&|p| (p.found.value - value - slope * (p.day - day)).powi(2)) / dof).sqrt();
    let (u, dof) = if birge > 1.0 { (birge * spread.powf(-0.5), dof) } else { (spread.powf(-0.5), f64::INFINITY) };
    let says = format!("{} records; their scatter is {birge:.2} × what their own uncertainties say", points.len());
    let q = &points[0].found;
    let unit = if q.unit == "1" { "1/d".to_owned() } else { format!("{}/d", q.unit) };
    Some((value - slope * day, Quantity::new(&q.name, &unit, slope, vec![Part::measured("records", u, dof, says)])))
}

impl Trend {
    /// Changes that were looked at.
    pub fn looked_at(&self) -> usize {
        self.series.iter().map(|s| s.changes.len()).sum()
    }

    /// Quantities that have left their first value, as they are in the last record.
    pub fn beyond(&self) -> Vec<&str> {
        let moved = |s: &&Series| s.changes.last().is_some_and(|(from_first, _)| from_first.is_beyond());
        self.series.iter().filter(moved).map(|s| s.name.as_str()).collect()
    }

    /// The answer of `stand records trend --json`.
    pub fn json(&self) -> Value {
        let series = self.series.iter().map(|s| {
            let points = s.points.iter().enumerate().map(|(k, p)| {
                let change = k.checked_sub(1).and_then(|k| s.changes.get(k));
                json!({
                    "began": p.began, "day": finite(p.day), "value": finite(p.found.value), "sigma": finite(p.found.sigma()),
                    "U": finite(p.found.expanded()), "whole": p.is_whole, "stand": p.stand,
                    "from_first": change.map(|(first, _)| first.json()), "from_before": change.map(|(_, before)| before.json()),
                })
            });
            let line = s.line.as_ref().map(|(at_first, slope)| {
                json!({
                    "at_first": finite(*at_first), "per_day": finite(slope.value), "sigma": finite(slope.sigma()), "U": finite(slope.expanded()),
                    "unit": slope.unit, "beyond": slope.value.abs() > slope.expanded(), "k": finite(coverage_factor(slope.dof(), crate::statistics::uncertainty::CONFIDENCE)),
                    "says": slope.parts.first().map(|p| &p.says),
                })
            });
            let unit = s.points.first().map(|p| p.found.unit.clone());
            (s.name.clone(), json!({"unit": unit, "points": points.collect::<Vec<_>>(), "line": line}))
        });
        json!({
            "what": self.what, "serial": self.serial, "records": self.dates, "beyond": self.beyond(),
            "quantities": series.collect::<serde_json::Map<_, _>>(),
        })
    }
}

#[cfg(test)]
mod tests;
