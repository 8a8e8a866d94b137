//! A calibration record as one HTML page, suited for printing.

use super::text::heading;
use super::{definition, remarks, statement, stored, with_sigma, words};
use crate::html::{Cell, Class, Markup, Page, Table};
use crate::plot::svg::Drawing;
use crate::plot::{Axis, Plot, with_margin};
use crate::significant;
use identification::statistics::Extremes;
use identification::statistics::uncertainty::{COVERAGE_PROBABILITY, Evaluation, Quantity};
use stand_analysis::calibrate::{Curve, FrequencyPoint};
use stand_records::record::CalibrationRecord;
use stand_records::stored_record::StoredQuantity;

/// Width and height of a plot, px.
const PLOT_SIZE: (f64, f64) = (980.0, 280.0);

/// The value with the digits that its standard uncertainty carries.
pub fn value_text<B, M>(q: &Quantity<B, M>) -> String {
    let both = with_sigma(q.value, q.combined_u());
    let Some((value, rest)) = both.split_once(" ±") else { return both };
    match (value.strip_prefix('('), rest.split_once(')')) {
        (Some(value), Some((_, power))) => format!("{value}{power}"),
        _ => value.to_owned(),
    }
}

/// The page of a record.
pub fn html(record: &CalibrationRecord) -> String {
    let texts = stored(record);
    let header = &texts.header;
    let mut page = Page::new(&heading(header));
    let operator = if header.operator.is_empty() { String::new() } else { format!(", by {}", header.operator) };
    page.paragraph(Class::Lead, format!("Begun {}{operator}, on {}. {}", header.began, header.stand, statement()));
    if !header.is_complete {
        let (done, all) = (header.steps.len(), header.session.steps.len());
        page.paragraph(Class::Warning, format!("{done} of {all} steps are done; these results do not contain the others."));
    }
    for line in remarks(header) {
        page.paragraph(Class::Warning, Markup::with_code(&line));
    }
    page.section("Results", |page| {
        let mut table = Table::new(["quantity", "value", "u", "ν", "k", "U", "unit", ""]);
        for q in &texts.quantities {
            let number = |x: f64, digits: u32| Cell::number(if x.is_finite() { significant(x, digits) } else { "∞".into() });
            table.row([
                Cell::text(&q.name),
                Cell::number(value_text(q)),
                number(q.combined_u(), 2),
                Cell::number(words::degrees_of_freedom(q.effective_dof())),
                number(q.coverage_factor(COVERAGE_PROBABILITY), 3),
                number(q.expanded_u(), 2),
                Cell::text(if q.unit == "1" { "" } else { &q.unit }),
                Cell::text(Markup::with_code(&definition(q))),
            ]);
        }
        for absent in &header.absent {
            let empty = || Cell::text("");
            let reason = Cell::text(Markup::with_code(&absent.reason));
            table.row([Cell::text(&absent.name), Cell::text("not found"), empty(), empty(), empty(), empty(), empty(), reason]);
        }
        page.table(table);
    });
    page.section("Curves", |page| {
        for curve in record.findings.curves.iter().filter(|c| c.points.len() > 1) {
            page.figure(&plot(curve), caption(curve));
        }
    });
    if !record.findings.frequency_response.is_empty() {
        page.section("Frequency response", |page| page.table(frequency_response(&record.findings.frequency_response)));
    }
    page.section("Uncertainty budgets", |page| {
        for q in &texts.quantities {
            page.heading(&q.name);
            page.table(budget(q));
        }
    });
    page.section("Raw logs", |page| {
        let mut table = Table::new(["step", "file", "rows", "lost", "SHA-256", "instruction and answer"]);
        for step in &header.steps {
            let instruction = step.instruction.as_ref().map_or(String::new(), |[instruction, answer]| format!("{instruction} — {answer}"));
            table.row([
                Cell::text(&step.name),
                Cell::text(&step.log),
                Cell::number(step.rows.to_string()),
                Cell::number(step.lost_rows.to_string()),
                Cell::code(&step.sha256),
                Cell::text(instruction),
            ]);
        }
        page.table(table);
    });
    page.finish()
}

/// Gain and phase with U(f).
fn frequency_response(points: &[FrequencyPoint]) -> Table {
    let mut table = Table::new(["frequency, Hz", "mean rate, rad/s", "amplitude, rad/s", "gain", "U", "phase, °", "U, °"]);
    for p in points {
        let number = |x: f64, digits: u32| Cell::number(significant(x, digits));
        table.row([
            number(p.frequency_Hz, 4),
            number(p.mean_rad_s, 3),
            number(p.amplitude_rad_s, 3),
            number(p.gain, 5),
            number(p.gain_U, 2),
            number(p.phase_deg, 5),
            number(p.phase_U_deg, 2),
        ]);
    }
    table
}

/// `A` or `B`.
pub(super) fn evaluation(evaluation: Evaluation) -> &'static str {
    match evaluation {
        Evaluation::A => "A",
        Evaluation::B => "B",
    }
}

fn budget(q: &StoredQuantity) -> Table {
    let mut table = Table::new(["source", "type", "u", "unit", "sensitivity", "ν", "contribution to u", ""]);
    for c in &q.contributions {
        table.row([
            Cell::text(&c.source),
            Cell::text(evaluation(c.evaluation)),
            Cell::number(significant(c.u, 2)),
            Cell::text(if c.unit.is_empty() { &q.unit } else { &c.unit }),
            Cell::number(significant(c.sensitivity, 3)),
            Cell::number(if c.dof.is_finite() { format!("{:.0}", c.dof) } else { "∞".into() }),
            Cell::number(significant(c.contribution(), 2)),
            Cell::text(&c.basis),
        ]);
    }
    table
}

/// Style classes of the other series, in their order.
const SERIES_CLASSES: [&str; 3] = ["second", "third", "fourth"];

fn plot(curve: &Curve) -> Drawing {
    let style = words::curve_style(curve.kind);
    let x = |v: f64| if style.is_log { v.max(1e-12).log10() } else { v };
    let all = || curve.points.iter().chain(&curve.line).chain(curve.other_series.iter().flat_map(|(_, points)| points));
    let horizontal = all().map(|p| x(p.0)).min_max();
    let axis = if style.is_log {
        Axis::log((horizontal.0 - 0.03, horizontal.1 + 0.03), style.x)
    } else {
        Axis::new(with_margin(horizontal), 10, style.x, "")
    };
    let vertical = all().map(|p| p.1).min_max();
    let vertical = if style.has_bars { (0.0, 1.06 * vertical.1) } else { with_margin(vertical) };
    let mut plot = Plot::new(axis, Axis::new(vertical, 6, style.y, ""), PLOT_SIZE.0, PLOT_SIZE.1);
    plot.level(0.0, "zero");
    if !curve.line.is_empty() {
        plot.lines(&[curve.line.iter().map(|(a, b)| (x(*a), *b)).collect()], "modelled");
    }
    if style.has_bars {
        curve.points.iter().for_each(|(a, b)| plot.bar((a - 0.4, a + 0.4), *b, "bar loud"));
    } else {
        curve.points.iter().for_each(|(a, b)| plot.dot((x(*a), *b), 2.5, "mean"));
    }
    for ((_, points), class) in curve.other_series.iter().zip(SERIES_CLASSES.iter().cycle()) {
        points.iter().for_each(|(a, b)| plot.dot((x(*a), *b), 2.5, class));
    }
    plot.finish()
}

/// Title and legend of a plot.
fn caption(curve: &Curve) -> Markup {
    let style = words::curve_style(curve.kind);
    let mut legend = vec![Markup::swatch("residual", style.points)];
    let classes = SERIES_CLASSES.iter().cycle();
    legend.extend(curve.other_series.iter().zip(classes).map(|((kind, _), class)| Markup::swatch(class, words::series(*kind))));
    if !curve.line.is_empty() {
        legend.push(Markup::swatch("modelled", style.line));
    }
    Markup::from(format!("{}: ", style.title)).then(Markup::joined(legend, ", "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use identification::statistics::uncertainty::Contribution;
    use stand_analysis::calibrate::{CurveKind, SeriesKind};

    #[test]
    fn value_keeps_its_power_of_ten() {
        let of = |v: f64, u: f64| value_text(&Quantity::<(), ()>::new("x", "1", v, vec![Contribution::type_a("noise", u, 9.0, ())]));
        assert_eq!((of(1.0123, 0.0011), of(2.812e-4, 1.8e-6)), ("1.0123".into(), "2.812 × 10⁻⁴".into()));
        assert_eq!(of(-8.1e-4, 2.8e-4), "−8.1 × 10⁻⁴");
    }

    #[test]
    fn each_series_has_a_colour_and_a_name() {
        let other_series = vec![(SeriesKind::FromFasterRate, vec![(1.0, 2.0)]), (SeriesKind::BackEmf, vec![(2.0, 1.0)])];
        let curve = Curve { other_series, ..Curve::new(CurveKind::RateTorque, vec![(0.0, 0.0), (1.0, 1.0)], Vec::new()) };
        let (drawn, caption) = (plot(&curve), format!("{:?}", caption(&curve)));
        for (class, name) in [("second", "approached from a faster rate"), ("third", "back-EMF")] {
            assert!(drawn.svg().contains(&format!("class=\"{class}\"")) && caption.contains(class) && caption.contains(name), "{caption}");
        }
        assert!(caption.contains("approached from a slower rate") && !drawn.svg().contains("bar"));
        let bars = plot(&Curve { kind: CurveKind::TorqueSpectrum, ..curve });
        assert_eq!(bars.svg().matches("bar loud").count(), 1, "a bar of height 0 is not drawn");
    }
}
