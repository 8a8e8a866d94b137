//! The trend of a device under test: text, an HTML page, JSON.

use super::{footnote, unit_suffix, with_expanded_u};
use crate::html::{Cell, Class, Markup, Page, Table};
use crate::json::schema_of;
use crate::json::value;
use crate::plot::svg::Drawing;
use crate::plot::{Axis, Plot, with_margin};
use crate::{significant, with_sigma};
use identification::statistics::Extremes;
use identification::statistics::uncertainty::COVERAGE_PROBABILITY;
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;
use stand_records::trend::{Change, Point, Series, Trend, TrendLine};
use std::collections::BTreeMap;

const COMMON_CONTRIBUTIONS: &str = "Contributions of type B with the same source are common to two records of one stand (crystal, mounting, readings) and \
    cancel in their difference. They do not cancel when the device was mounted anew, or when a session assumes other half-widths; the last column holds then.";

/// The change with its sign and expanded uncertainty.
fn change(c: &Change) -> String {
    let sign = if c.difference.value >= 0.0 { "+" } else { "" };
    let both = with_sigma(c.difference.value, c.difference.expanded_u());
    let (open, both) = both.strip_prefix('(').map_or(("", both.as_str()), |rest| ("(", rest));
    format!("{open}{sign}{both}{}", if c.is_significant() { " significant" } else { "" })
}

fn summary(trend: &Trend) -> String {
    let significant = trend.significant();
    let compared = trend.series.iter().filter(|s| !s.changes.is_empty()).count();
    match (compared, significant.is_empty()) {
        (0, _) => "one record: nothing to compare".to_owned(),
        (n, true) => format!("none of {n} quantities has changed significantly since the first record"),
        (n, false) => format!(
            "significant change since the first record: {} ({} of {n} quantities; one of 20 is expected by chance)",
            significant.join(", "),
            significant.len()
        ),
    }
}

fn heading(trend: &Trend) -> String {
    format!("trend {} {}", trend.kind, trend.serial).trim_end().to_owned()
}

fn scatter(line: &TrendLine) -> String {
    format!("{} records; their scatter is {:.2} × what their uncertainties predict", line.records, line.birge_ratio)
}

fn line_text(line: &TrendLine) -> String {
    let significant = if line.is_significant() { ", significant" } else { "" };
    format!("line: {}{significant}; {}", with_expanded_u(&line.slope), scatter(line))
}

/// A trend for a terminal.
pub fn trend_text(trend: &Trend) -> String {
    let mut out = format!("{}: {} records\n{}\n", heading(trend), trend.dates.len(), summary(trend));
    for s in &trend.series {
        out += &format!("\n{}\n", s.name);
        for (k, p) in s.points.iter().enumerate() {
            out += &format!("  {}  {}{}", p.began, with_expanded_u(&p.quantity), if p.is_complete { "" } else { "  (incomplete)" });
            if let Some((first, previous)) = k.checked_sub(1).and_then(|k| s.changes.get(k)) {
                out += &format!("  since the first {}", change(first));
                if k > 1 {
                    out += &format!("; since the previous {}", change(previous));
                }
            }
            out.push('\n');
        }
        if let Some(line) = &s.line {
            out += &format!("  {}\n", line_text(line));
        }
        if let Some(q) = &s.repeatability {
            out += &format!("  standard deviation from session to session (turn-on repeatability): {}\n", with_expanded_u(q));
        }
    }
    let mut common: Vec<&str> = trend.series.iter().flat_map(|s| &s.changes).flat_map(|(c, _)| &c.common).map(String::as_str).collect();
    common.sort_unstable();
    common.dedup();
    if !common.is_empty() {
        out += &format!(
            "\nCommon to the records and not part of a change: {}. For a device mounted anew or another stand see U_if_nothing_is_common in --json.\n",
            common.join(", ")
        );
    }
    out + &format!("{}\n", footnote())
}

fn plot(s: &Series) -> Option<Drawing> {
    let first = s.points.first()?;
    let days = s.points.iter().map(|p| p.day).min_max();
    let ends = |p: &Point| [p.quantity.value - p.quantity.expanded_u(), p.quantity.value + p.quantity.expanded_u()];
    let values = s.points.iter().flat_map(ends).min_max();
    let unit = unit_suffix(&first.quantity.unit);
    let y = if unit.is_empty() { s.name.clone() } else { format!("{},{unit}", s.name) };
    let x = Axis::new(with_margin(days), 10, &format!("days since {}", first.began), "");
    let mut plot = Plot::new(x, Axis::new(with_margin(values), 6, &y, ""), 980.0, 240.0);
    if let Some(line) = &s.line {
        plot.lines(&[[days.0, days.1].map(|d| (d, line.at_first + line.slope.value * d)).to_vec()], "modelled");
    }
    s.points.iter().for_each(|p| plot.whisker(p.day, p.quantity.value, p.quantity.expanded_u()));
    Some(plot.finish())
}

/// A trend as an HTML page.
pub fn trend_html(trend: &Trend) -> String {
    let mut page = Page::new(&heading(trend));
    page.paragraph(Class::Lead, format!("{} records: {}.", trend.dates.len(), summary(trend)));
    page.text(COMMON_CONTRIBUTIONS);
    for s in &trend.series {
        page.section(&s.name, |page| {
            if let (Some(drawing), true) = (plot(s), s.points.len() > 1) {
                let mut caption = Markup::swatch("residual", "records with expanded uncertainty");
                if s.line.is_some() {
                    caption = caption.then(", ").then(Markup::swatch("modelled", "straight line"));
                }
                page.figure(&drawing, caption);
            }
            page.table(table(s));
            if let Some(line) = &s.line {
                page.text(line_text(line));
            }
        });
    }
    page.paragraph(Class::Faint, footnote());
    page.finish()
}

fn table(s: &Series) -> Table {
    let mut table =
        Table::new(["session begun", "value ± U", "since the first ± U", "since the previous ± U", "U since the first, nothing common"]);
    for (k, p) in s.points.iter().enumerate() {
        let changes = k.checked_sub(1).and_then(|k| s.changes.get(k));
        let cell = |c: Option<&Change>| {
            let cell = Cell::number(c.map_or(String::new(), change));
            if c.is_some_and(Change::is_significant) { cell.class(Class::Warning) } else { cell }
        };
        table.row([
            Cell::number(format!("{}{}", p.began, if p.is_complete { "" } else { " (incomplete)" })),
            Cell::number(with_expanded_u(&p.quantity)),
            cell(changes.map(|(first, _)| first)),
            cell(changes.map(|(_, previous)| previous)),
            Cell::number(changes.map_or(String::new(), |(first, _)| significant(first.independent_expanded_u, 2))),
        ]);
    }
    table
}

#[derive(Serialize, JsonSchema)]
struct ChangeEntry<'a> {
    value: f64,
    sigma: f64,
    dof: f64,
    #[serde(rename = "U")]
    expanded_u: f64,
    unit: &'a str,
    beyond: bool,
    common: &'a [String],
    #[serde(rename = "U_if_nothing_is_common")]
    independent_expanded_u: f64,
}

impl<'a> From<&'a Change> for ChangeEntry<'a> {
    fn from(c: &'a Change) -> Self {
        let q = &c.difference;
        Self {
            value: q.value,
            sigma: q.combined_u(),
            dof: q.effective_dof(),
            expanded_u: q.expanded_u(),
            unit: &q.unit,
            beyond: c.is_significant(),
            common: &c.common,
            independent_expanded_u: c.independent_expanded_u,
        }
    }
}

#[derive(Serialize, JsonSchema)]
struct PointEntry<'a> {
    began: &'a str,
    day: f64,
    value: f64,
    sigma: f64,
    #[serde(rename = "U")]
    expanded_u: f64,
    whole: bool,
    stand: &'a str,
    from_first: Option<ChangeEntry<'a>>,
    from_before: Option<ChangeEntry<'a>>,
}

#[derive(Serialize, JsonSchema)]
struct LineEntry<'a> {
    at_first: f64,
    per_day: f64,
    sigma: f64,
    #[serde(rename = "U")]
    expanded_u: f64,
    unit: &'a str,
    beyond: bool,
    k: f64,
    says: String,
}

impl<'a> From<&'a TrendLine> for LineEntry<'a> {
    fn from(line: &'a TrendLine) -> Self {
        let slope = &line.slope;
        Self {
            at_first: line.at_first,
            per_day: slope.value,
            sigma: slope.combined_u(),
            expanded_u: slope.expanded_u(),
            unit: &slope.unit,
            beyond: line.is_significant(),
            k: slope.coverage_factor(COVERAGE_PROBABILITY),
            says: scatter(line),
        }
    }
}

#[derive(Serialize, JsonSchema)]
struct SeriesEntry<'a> {
    unit: Option<&'a str>,
    points: Vec<PointEntry<'a>>,
    line: Option<LineEntry<'a>>,
    repeatability: Option<RepeatabilityEntry>,
}

#[derive(Serialize, JsonSchema)]
struct RepeatabilityEntry {
    value: f64,
    sigma: f64,
    dof: f64,
    #[serde(rename = "U")]
    expanded_u: f64,
}

impl<'a> From<&'a Series> for SeriesEntry<'a> {
    fn from(s: &'a Series) -> Self {
        let point = |(k, p): (usize, &'a Point)| {
            let changes = k.checked_sub(1).and_then(|k| s.changes.get(k));
            PointEntry {
                began: &p.began,
                day: p.day,
                value: p.quantity.value,
                sigma: p.quantity.combined_u(),
                expanded_u: p.quantity.expanded_u(),
                whole: p.is_complete,
                stand: &p.stand,
                from_first: changes.map(|(first, _)| first.into()),
                from_before: changes.map(|(_, previous)| previous.into()),
            }
        };
        Self {
            unit: s.points.first().map(|p| p.quantity.unit.as_str()),
            points: s.points.iter().enumerate().map(point).collect(),
            line: s.line.as_ref().map(Into::into),
            repeatability: s.repeatability.as_ref().map(|q| RepeatabilityEntry {
                value: q.value,
                sigma: q.combined_u(),
                dof: q.effective_dof(),
                expanded_u: q.expanded_u(),
            }),
        }
    }
}

#[derive(Serialize, JsonSchema)]
struct TrendEntry<'a> {
    what: &'a str,
    serial: &'a str,
    records: &'a [String],
    beyond: Vec<&'a str>,
    quantities: BTreeMap<&'a str, SeriesEntry<'a>>,
}

/// The answer of `stand records trend --json`.
pub fn trend_json(trend: &Trend) -> Value {
    value(&TrendEntry {
        what: trend.kind,
        serial: &trend.serial,
        records: &trend.dates,
        beyond: trend.significant(),
        quantities: trend.series.iter().map(|s| (s.name.as_str(), s.into())).collect(),
    })
}

/// Schemas of the answers.
pub(crate) fn schemas() -> Vec<(&'static str, Value)> {
    vec![("records trend", schema_of::<TrendEntry<'_>>())]
}
