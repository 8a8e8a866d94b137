//! The parameters of a fit: values, uncertainties, and advice on those that are not usable.

use super::Comparison;
use crate::numbers;

/// Correlation below which two parameters are not reported as trading off.
const MIN_REPORTED_CORRELATION: f64 = 0.5;
/// Distance outside the physical range, in standard uncertainties, that counts as within the uncertainty.
const MAX_SIGMAS_OUT_OF_RANGE: f64 = 2.0;
/// Distance to a bound, relative to the parameter's start value, within which the parameter is at the bound.
const BOUND_TOLERANCE: f64 = 1e-9;

/// Whether the log determines a parameter.
#[derive(Debug, Clone, PartialEq)]
pub enum Determination {
    /// It does.
    Determined,
    /// Only a combination with another parameter: its name and the correlation of the two estimates.
    OnlyWith(String, f64),
    /// No output depends on it enough.
    NotVisible,
}

/// One parameter of the model after a fit.
pub struct ParameterRow {
    /// Name in the model file.
    pub name: String,
    /// Its meaning, from the catalogue; empty for a parameter of the user's own.
    pub description: &'static str,
    /// Unit; empty for a parameter of the user's own.
    pub unit: &'static str,
    /// Value in the model as given.
    pub start: f64,
    /// Value after the fit.
    pub value: f64,
    /// Standard uncertainty (1σ); 0 where the parameter was not fitted.
    pub sigma: f64,
    /// Was not fitted.
    pub fixed: bool,
    /// Is at the end of its range.
    pub at_bound: bool,
    /// Distance of an unbounded estimate from the bound, in its standard uncertainties, where the fit holds the parameter at its bound.
    pub bound_excess_sigmas: Option<f64>,
    /// Is outside its physical range.
    pub out_of_range: bool,
    /// Is outside the range by no more than the uncertainty explains.
    pub within_uncertainty: bool,
    /// Whether the log determines it.
    pub determination: Determination,
}

/// What the reader must know about a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// Nothing special.
    None,
    /// Was not fitted.
    Fixed,
    /// The log does not determine it.
    NotDetermined,
    /// Outside its physical range by less than two standard uncertainties.
    ZeroWithinUncertainty,
    /// Outside its physical range.
    OutOfRange,
    /// At the end of its range.
    AtBound,
    /// Held at the end of its range; without the bound the estimate would be significantly outside.
    ForcedToBound,
}

impl Mark {
    /// The mark in a few words; empty for [`Mark::None`].
    pub fn text(self) -> &'static str {
        match self {
            Mark::None => "",
            Mark::Fixed => "fixed",
            Mark::NotDetermined => "not determined",
            Mark::ZeroWithinUncertainty => "out of range by less than 2σ",
            Mark::OutOfRange => "outside its physical range",
            Mark::AtBound | Mark::ForcedToBound => "at its bound",
        }
    }
}

impl ParameterRow {
    /// Value ± standard uncertainty, with unit.
    pub fn value_text(&self) -> String {
        let number = match self.determination {
            Determination::Determined => numbers::with_sigma(self.value, self.sigma),
            _ => numbers::significant(self.value, 3),
        };
        if self.unit.is_empty() || self.unit == "1" { number } else { format!("{number} {}", self.unit) }
    }

    /// The mark of the parameter.
    pub fn mark(&self) -> Mark {
        if self.determination != Determination::Determined {
            Mark::NotDetermined
        } else if self.out_of_range {
            if self.within_uncertainty { Mark::ZeroWithinUncertainty } else { Mark::OutOfRange }
        } else if self.bound_excess_sigmas.is_some_and(|excess| excess > MAX_SIGMAS_OUT_OF_RANGE) {
            Mark::ForcedToBound
        } else if self.at_bound {
            Mark::AtBound
        } else if self.fixed {
            Mark::Fixed
        } else {
            Mark::None
        }
    }
}

/// What to do about parameters that are not usable, a sentence or two for each kind; parameters of the same kind share them.
pub fn advice(rows: &[ParameterRow]) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for row in rows {
        if let Determination::OnlyWith(other, r) = &row.determination {
            lines.push(format!(
                "{} is not determined by this log: only its combination with {other} is (correlation {}). Fix one of the two, `{{ value = …, fixed = true }}`, or record an experiment that separates them.",
                row.name,
                numbers::significant(*r, 3)
            ));
        }
    }
    let (names, be) = named(rows, |row| row.determination == Determination::NotVisible);
    if !names.is_empty() {
        lines.push(format!(
            "{names} {be} not determined by this log: the outputs hardly depend on {them}. Fix {them}, `{{ value = …, fixed = true }}`, or record an experiment that excites {them}.",
            them = if be == "is" { "it" } else { "them" }
        ));
    }
    for row in rows.iter().filter(|row| row.mark() == Mark::OutOfRange) {
        lines.push(format!(
            "{} = {} is outside its physical range: the model lacks an effect, and this parameter compensates for it. Do not use this fit; find the missing effect first.",
            row.name,
            row.value_text()
        ));
    }
    for row in rows.iter().filter(|row| row.mark() == Mark::ForcedToBound) {
        lines.push(format!(
            "{} = {} is held at its bound: without the bound the estimate would be outside its physical range by {} standard uncertainties. The model lacks an effect, and this parameter compensates for it. Do not use this fit; find the missing effect first.",
            row.name,
            row.value_text(),
            numbers::significant(row.bound_excess_sigmas.unwrap_or(0.0), 2)
        ));
    }
    let (names, be) = named(rows, |row| row.mark() == Mark::ZeroWithinUncertainty);
    if !names.is_empty() {
        lines.push(format!("{names} {be} outside the physical range by less than 2σ: no effect of this size is visible in this log."));
    }
    let (names, be) = named(rows, |row| row.mark() == Mark::AtBound);
    if !names.is_empty() {
        lines.push(format!(
            "{names} {be} at the end of the range: the effect is not visible in this log; consider removing it from the model."
        ));
    }
    lines
}

/// Names of the rows that `select` takes, and the verb for them.
fn named(rows: &[ParameterRow], select: impl Fn(&ParameterRow) -> bool) -> (String, &'static str) {
    let names: Vec<&str> = rows.iter().filter(|row| select(row)).map(|row| row.name.as_str()).collect();
    (names.join(", "), if names.len() > 1 { "are" } else { "is" })
}

/// The parameters of a fit, in the model's order.
pub fn parameters(c: &Comparison) -> Vec<ParameterRow> {
    let result = c.result;
    let sigmas = result.sigmas.iter().copied().chain(std::iter::repeat(0.0));
    result
        .parameters
        .list
        .iter()
        .zip(sigmas)
        .map(|(p, sigma)| {
            let given = c.model.parameter(&p.name);
            let info = given.and_then(|g| g.info);
            let start = given.map_or(f64::NAN, |g| g.value);
            let tolerance = BOUND_TOLERANCE * info.map_or(1.0, |i| i.start.abs()).max(f64::MIN_POSITIVE);
            let (low, high) = p.range;
            let is_order = p.kind == drive_model::ParameterKind::HarmonicOrder;
            // A phase is periodic: the ends of its range are not bounds.
            let bounded = !p.fixed && p.kind != drive_model::ParameterKind::Phase && !is_order;
            let held = result.at_bound.iter().find(|b| b.parameter == p.name);
            let slack = MAX_SIGMAS_OUT_OF_RANGE * sigma;
            let determination = match result.unidentifiable.iter().find(|u| u.parameter == p.name).map(|u| &u.partner) {
                None => Determination::Determined,
                Some(Some((other, r))) if r.abs() > MIN_REPORTED_CORRELATION => {
                    Determination::OnlyWith(c.model.axis().parameter(other), *r)
                }
                Some(_) => Determination::NotVisible,
            };
            ParameterRow {
                name: c.model.axis().parameter(&p.name),
                description: info.map_or("", |i| c.model.axis().quantity(i.description)),
                unit: info.map_or("", |i| c.model.axis().unit(i.unit)),
                start,
                value: p.value,
                sigma,
                fixed: p.fixed || is_order,
                bound_excess_sigmas: held.map(|b| b.excess_sigmas),
                at_bound: held.is_some() || bounded && ((p.value - low).abs() <= tolerance || (p.value - high).abs() <= tolerance),
                out_of_range: bounded && (p.value < low - tolerance || p.value > high + tolerance),
                within_uncertainty: p.value > low - slack && p.value < high + slack,
                determination,
            }
        })
        .collect()
}
