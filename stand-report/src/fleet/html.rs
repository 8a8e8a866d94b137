//! The evaluation of a fleet as a page.

use super::words::{adjusted, counted, distance, fraction, headline, limits, since, size, values};
use crate::html::{Cell, Class, Markup, Page, Table};
use crate::plot::svg::Drawing;
use crate::plot::{Axis, HALF_WIDTH, Plot, with_margin};
use crate::{significant, with_sigma};
use identification::statistics::Extremes;
use stand_analysis::fleet::change::ParameterChange;
use stand_analysis::fleet::evaluation::FleetEvaluation;
use stand_analysis::fleet::outlier::ParameterSpread;
use stand_analysis::fleet::significance::FAMILYWISE_P;

/// Rows of a table on the page. The JSON has all.
const MAX_ROWS: usize = 40;
/// Differences that are not significant on the page.
const MAX_INSIGNIFICANT: usize = 10;
/// Stands of a plot whose names are written beside their points, at most.
const MAX_LABELS: usize = 6;

/// The page. `tables`: names of the files.
pub fn html(tables: &str, e: &FleetEvaluation) -> String {
    let mut page = Page::new(&format!("Fleet report of {tables}"));
    page.paragraph(Class::Lead, headline(e));
    page.text(size(e));
    for limit in limits(e) {
        page.paragraph(Class::Warning, limit);
    }
    page.section("Stands that have changed", |page| changes(page, e));
    page.section("Effects and verdicts", |page| findings(page, e));
    page.section("Effects common to a batch", |page| batches(page, e));
    page.section("Outliers among the stands", |page| outliers(page, e));
    page.section("Logs without an explanation", |page| failed(page, e));
    page.section("Method", method);
    page.finish()
}

fn changes(page: &mut Page, e: &FleetEvaluation) {
    if e.parameter_changes.is_empty() {
        page.text("No stand has a usable log both before and since the date.");
        return;
    }
    let count = e.parameter_changes.iter().filter(|c| c.is_significant()).count();
    let (before, logs_since) = e.logs_by_period;
    page.text(format!(
        "{} before {}, {logs_since} since. {} of {} differences of parameters are significant.",
        counted(before, "log"),
        since(e),
        count,
        e.parameter_changes.len()
    ));
    let mut table = Table::new(["stand", "parameter", "before ± 1σ", "since ± 1σ", "difference/σ", "logs", "adjusted p", ""]);
    let shown = count + MAX_INSIGNIFICANT;
    for c in e.parameter_changes.iter().take(shown) {
        let [before, since] = values(c);
        let cells = [
            Cell::number(&c.stand),
            Cell::code(&c.parameter),
            Cell::number(before),
            Cell::number(since),
            Cell::number(format!("{:+.1}", c.z()).replace('-', "−")),
            Cell::number(format!("{} + {}", c.logs.0, c.logs.1)),
            Cell::number(adjusted(c.adjusted_p)),
            if c.is_significant() { Cell::text("changed").class(Class::Warning) } else { Cell::text("") },
        ];
        table.row(cells);
    }
    page.table(table);
    more(page, e.parameter_changes.len(), shown);
    page.side_by_side(|page| {
        let mut parameters: Vec<&str> = e.parameter_changes.iter().map(|c| c.parameter.as_str()).collect();
        parameters.sort_unstable();
        parameters.dedup();
        for parameter in parameters {
            let of: Vec<&ParameterChange> = e.parameter_changes.iter().filter(|c| c.parameter == parameter).collect();
            let caption = Markup::from("Each point is a stand; ")
                .then(Markup::code(parameter))
                .then(" before and since the date, bars: ± 1σ of the difference");
            page.figure(&change_plot(&of), caption);
        }
    });
}

/// Difference over the value before.
fn change_plot(changes: &[&ParameterChange]) -> Drawing {
    let (name, unit) = changes.first().map_or(("", ""), |c| (c.parameter.as_str(), c.unit.as_str()));
    let befores = changes.iter().map(|c| c.before.value).min_max();
    let ends = changes.iter().flat_map(|c| [c.difference() - c.u(), c.difference() + c.u(), 0.0]).min_max();
    let x = Axis::new(with_margin(befores), 5, "before the date", unit);
    let mut plot = Plot::new(x, Axis::new(with_margin(ends), 5, &format!("change of {name}"), unit), HALF_WIDTH, 230.0);
    plot.level(0.0, "zero");
    for c in changes {
        plot.whisker(c.before.value, c.difference(), c.u());
    }
    for c in changes.iter().filter(|c| c.is_significant()).take(MAX_LABELS) {
        plot.label((c.before.value, c.difference()), &c.stand);
    }
    plot.finish()
}

fn findings(page: &mut Page, e: &FleetEvaluation) {
    page.side_by_side(|page| {
        for (head, counts) in [("verdict", &e.verdicts), ("effect", &e.effects)] {
            let mut table = Table::new([head, "logs", "%"]);
            let mut sorted: Vec<(&String, &usize)> = counts.iter().collect();
            sorted.sort_by_key(|(_, count)| std::cmp::Reverse(**count));
            for (name, count) in sorted {
                let percent = 100.0 * *count as f64 / e.logs.max(1) as f64;
                table.row([Cell::code(name), Cell::number(count.to_string()), Cell::number(significant(percent, 2))]);
            }
            page.table(table);
        }
    });
    if e.finding_changes.is_empty() {
        page.text("No effect and no verdict of a stand is more frequent since the date.");
        return;
    }
    page.heading(format!("More frequent since {}", since(e)));
    let mut table = Table::new(["stand", "effect or verdict", "logs before", "logs since", "adjusted p", ""]);
    for c in e.finding_changes.iter().take(MAX_ROWS) {
        table.row([
            Cell::number(&c.stand),
            Cell::code(&c.finding),
            Cell::number(fraction(c.before)),
            Cell::number(fraction(c.since)),
            Cell::number(adjusted(Some(c.adjusted_p))),
            if c.is_significant() { Cell::text("new").class(Class::Warning) } else { Cell::text("not significant").class(Class::Mark) },
        ]);
    }
    page.table(table);
    more(page, e.finding_changes.len(), MAX_ROWS);
}

fn batches(page: &mut Page, e: &FleetEvaluation) {
    if e.batch_effects.is_empty() {
        page.text("There are no two batches to compare, or no effect in a batch.");
        return;
    }
    let mut table = Table::new(["batch", "effect", "stands of the batch", "other stands", "adjusted p", ""]);
    for b in e.batch_effects.iter().take(MAX_ROWS) {
        table.row([
            Cell::text(&b.batch),
            Cell::code(&b.effect),
            Cell::number(fraction(b.inside)),
            Cell::number(fraction(b.outside)),
            Cell::number(adjusted(Some(b.adjusted_p))),
            if b.is_significant() {
                Cell::text("common to the batch").class(Class::Warning)
            } else {
                Cell::text("not significant").class(Class::Mark)
            },
        ]);
    }
    page.table(table);
    more(page, e.batch_effects.len(), MAX_ROWS);
}

fn outliers(page: &mut Page, e: &FleetEvaluation) {
    let mut table = Table::new(["stand", "parameter", "mean ± 1σ", "median of the stands", "unit", "distance/σ", "adjusted p"]);
    let mut count = 0;
    for (spread, s) in e.spreads.iter().flat_map(|spread| spread.stands.iter().filter(|s| s.is_significant()).map(move |s| (spread, s))) {
        count += 1;
        table.row([
            Cell::number(&s.stand),
            Cell::code(&spread.parameter),
            Cell::number(with_sigma(s.mean.value, s.mean.u)),
            Cell::number(with_sigma(spread.median, spread.scale)),
            Cell::number(&spread.unit),
            Cell::number(distance(s)),
            Cell::number(adjusted(s.adjusted_p)),
        ]);
    }
    if count > 0 {
        page.table(table);
    } else {
        page.text("No stand is an outlier.");
    }
    page.side_by_side(|page| {
        for spread in &e.spreads {
            let caption = Markup::code(&spread.parameter)
                .then(" of the stands in the order of their values; line and band: median ± robust standard deviation; bars: ± 1σ");
            page.figure(&spread_plot(spread), caption);
        }
    });
}

fn spread_plot(spread: &ParameterSpread) -> Drawing {
    let mut stands: Vec<_> = spread.stands.iter().collect();
    stands.sort_by(|a, b| a.mean.value.total_cmp(&b.mean.value));
    let ends = stands.iter().flat_map(|s| [s.mean.value - s.mean.u, s.mean.value + s.mean.u]);
    let range = ends.chain([spread.median - spread.scale, spread.median + spread.scale]).min_max();
    let x = Axis::new((0.0, stands.len() as f64 + 1.0), 5, "stand, in the order of the values", "");
    let mut plot = Plot::new(x, Axis::new(with_margin(range), 5, &spread.parameter, &spread.unit), HALF_WIDTH, 230.0);
    plot.band(spread.median - spread.scale, spread.median + spread.scale, "band");
    plot.level(spread.median, "zero");
    for (k, s) in stands.iter().enumerate() {
        plot.whisker(k as f64 + 1.0, s.mean.value, s.mean.u);
    }
    for (k, s) in stands.iter().enumerate().filter(|(_, s)| s.is_significant()).take(MAX_LABELS) {
        plot.label((k as f64 + 1.0, s.mean.value), &s.stand);
    }
    plot.finish()
}

fn failed(page: &mut Page, e: &FleetEvaluation) {
    if e.failed.is_empty() {
        page.text("Every log has an explanation.");
        return;
    }
    let mut table = Table::new(["log", "verdict", "reason"]);
    for (path, verdict, reason) in e.failed.iter().take(MAX_ROWS) {
        table.row([Cell::code(path), Cell::number(verdict), Cell::text(reason)]);
    }
    page.table(table);
    more(page, e.failed.len(), MAX_ROWS);
}

fn more(page: &mut Page, all: usize, shown: usize) {
    if all > shown {
        page.paragraph(Class::Faint, format!("{} more in the JSON.", all - shown));
    }
}

fn method(page: &mut Page) {
    page.text(format!(
        "Each kind of test keeps a probability of {FAMILYWISE_P} of any false alarm (procedure of Holm over all stands and parameters, or effects). A missing mark is no proof: few logs show only large changes."
    ));
    page.definitions([
        (
            "Change of a parameter",
            "Difference of the weighted means before and since the date over its combined standard uncertainty, by Student's t. The uncertainty contains the variation from log to log of one stand, estimated from all stands together (Mandel, Paule 1970), which must be as large in every stand.",
        ),
        ("New effect or verdict", "Fisher's exact test, one-sided, of the logs since the date against those before."),
        ("Effect of a batch", "Fisher's exact test, one-sided, of the stands of the batch against all others. A stand has an effect if at least half of its logs do."),
        (
            "Outlier",
            "Distance from the median of the stands over √(u² + τ² + π s²/(2 n)); s is the scaled median absolute deviation (ISO 13528), τ² = s² less the median u². Student's t with 0.37 (n − 1) degrees of freedom. Logs since the date, and logs without a date.",
        ),
        ("Logs used", "Verdicts adequate, effect-found and partly-explained; for effects and verdicts unknown-structure too. Phases, harmonic orders and times are not compared."),
    ]);
}
