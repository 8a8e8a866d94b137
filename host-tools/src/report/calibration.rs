//! A calibration told to a person: text for a terminal, and one HTML file that prints.

use crate::calibrate::Curve;
use crate::calibrate::record::Record;
use crate::calibrate::session::Session;
use crate::report::page::{Page, escaped, swatch, with_code};
use crate::report::plot::svg::Drawing;
use crate::report::plot::{Axis, Plot, with_margin};
use crate::report::{plain, significant, with_sigma};
use crate::statistics::Extremes;
use crate::statistics::uncertainty::{CONFIDENCE, Kind, Part, Quantity};

/// Beyond these degrees of freedom the number says nothing.
const MANY: f64 = 1e4;

/// Value with its expanded uncertainty, to two digits of that.
fn shown(q: &Quantity) -> String {
    let unit = if q.unit == "1" { String::new() } else { format!(" {}", q.unit) };
    format!("{}{unit}", with_sigma(q.value, q.expanded()))
}

/// The value to the place of its standard uncertainty, which has a column of its own.
fn value(q: &Quantity) -> String {
    let both = with_sigma(q.value, q.sigma());
    let Some((value, rest)) = both.split_once(" ±") else { return both };
    match (value.strip_prefix('('), rest.split_once(')')) {
        (Some(value), Some((_, power))) => format!("{value}{power}"),
        _ => value.to_owned(),
    }
}

fn heading(record: &Record) -> String {
    let s = &record.session;
    let part: Vec<&str> = [s.sensor.as_str(), s.serial.as_str()].into_iter().filter(|w| !w.is_empty()).collect();
    format!("calibration {} {}", s.what.name(), part.join(" ")).trim_end().to_owned()
}

/// For a terminal.
pub fn text(record: &Record) -> String {
    let mut out = format!(
        "{}: {} of {} steps, begun {}\n",
        heading(record),
        record.journal.steps.len(),
        record.session.steps.len(),
        record.journal.began
    );
    let width = record.findings.quantities.iter().map(|q| q.name.len()).max().unwrap_or(0);
    for q in &record.findings.quantities {
        out += &format!("  {:<width$}  {}", q.name, shown(q));
        out += &if q.dof() < MANY {
            format!("  (k {}, ν {:.0})\n", significant(q.coverage_factor(CONFIDENCE), 3), q.dof())
        } else {
            "\n".to_owned()
        };
    }
    for (name, why) in &record.findings.absent {
        out += &format!("  {name:<width$}  not found: {why}\n");
    }
    for line in record.remarks() {
        out += &format!("{line}\n");
    }
    out + &format!("± is expanded, for {} %. Not an accredited certificate.\n", plain(CONFIDENCE * 100.0, 3))
}

/// One HTML file.
pub fn html(record: &Record) -> String {
    let mut page = Page::new(&heading(record));
    let (j, s) = (&record.journal, &record.session);
    let who = if s.operator.is_empty() { String::new() } else { format!(", by {}", s.operator) };
    page.paragraph("lead", &format!("Begun {}{who}, on {}. {}", j.began, j.stand, Session::statement()));
    if !record.is_whole() {
        page.paragraph("warn", &format!("{} of {} steps are done: the rest is not in these results.", j.steps.len(), s.steps.len()));
    }
    for line in record.remarks() {
        page.push(&format!("<p class=\"warn\">{}</p>", with_code(&line)));
    }
    page.push("<section><h2>Results</h2><div class=\"scroll\"><table><thead><tr><th>quantity</th><th>value</th><th>u</th><th>ν</th><th>k</th><th>U</th><th>unit</th><th></th></tr></thead><tbody>");
    for q in &record.findings.quantities {
        let number = |x: f64, digits: u32| if x.is_finite() { significant(x, digits) } else { "∞".into() };
        page.push(&format!(
            "<tr><td>{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td><td>{}</td><td class=\"says\">{}</td></tr>",
            escaped(&q.name),
            value(q),
            number(q.sigma(), 2),
            if q.dof() < MANY { format!("{:.0}", q.dof().floor()) } else { "∞".into() },
            number(q.coverage_factor(CONFIDENCE), 3),
            number(q.expanded(), 2),
            escaped(if q.unit == "1" { "" } else { &q.unit }),
            with_code(&q.says)
        ));
    }
    for (name, why) in &record.findings.absent {
        page.push(&format!("<tr><td>{}</td><td colspan=\"6\">not found</td><td class=\"says\">{}</td></tr>", escaped(name), escaped(why)));
    }
    page.push("</tbody></table></div></section><section><h2>ResidualPlotData</h2>");
    for curve in record.findings.curves.iter().filter(|c| c.points.len() > 1) {
        page.figure(&picture(curve), &caption(curve));
    }
    page.push("</section><section><h2>Uncertainty</h2>");
    for q in &record.findings.quantities {
        page.push(&budget(q));
    }
    page.push("</section><section><h2>Raw logs</h2><div class=\"scroll\"><table><thead><tr><th>step</th><th>file</th><th>rows</th><th>lost</th><th>SHA-256</th><th>asked and said</th></tr></thead><tbody>");
    for step in &j.steps {
        let asked = step.asked.as_ref().map_or(String::new(), |[ask, said]| format!("{ask} — {said}"));
        page.push(&format!(
            "<tr><td>{}</td><td>{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td><td><code>{}</code></td><td>{}</td></tr>",
            escaped(&step.name),
            escaped(&step.log),
            step.rows,
            step.lost_rows,
            step.sha256,
            escaped(&asked)
        ));
    }
    page.push("</tbody></table></div></section>");
    page.finish()
}

/// `A` or `B`.
pub(super) fn kind(p: &Part) -> &'static str {
    if p.kind == Kind::A { "A" } else { "B" }
}

fn budget(q: &Quantity) -> String {
    let mut table = format!(
        "<h3>{}</h3><div class=\"scroll\"><table><thead><tr><th>of</th><th>type</th><th>u</th><th>unit</th><th>sensitivity</th><th>ν</th><th>contribution</th><th></th></tr></thead><tbody>",
        escaped(&q.name)
    );
    for p in &q.parts {
        table += &format!(
            "<tr><td>{}</td><td>{}</td><td class=\"number\">{}</td><td>{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td><td class=\"says\">{}</td></tr>",
            escaped(&p.of),
            kind(p),
            significant(p.u, 2),
            escaped(if p.unit.is_empty() { &q.unit } else { &p.unit }),
            significant(p.sensitivity, 3),
            if p.dof.is_finite() { format!("{:.0}", p.dof) } else { "∞".into() },
            significant(p.contribution(), 2),
            escaped(&p.says)
        );
    }
    table + "</tbody></table></div>"
}

/// Classes of what is drawn beside the measured points, one after another.
const BESIDE: [&str; 3] = ["second", "third", "fourth"];

fn picture(curve: &Curve) -> Drawing {
    let x = |v: f64| if curve.is_log { v.max(1e-12).log10() } else { v };
    let all = || curve.points.iter().chain(&curve.line).chain(curve.beside.iter().flat_map(|(_, points)| points));
    let range = |of: &dyn Fn(&(f64, f64)) -> f64| all().map(of).min_max();
    let across = range(&|p| x(p.0));
    let axis = if curve.is_log {
        Axis::log((across.0 - 0.03, across.1 + 0.03), &curve.x)
    } else {
        Axis::new(with_margin(across), 10, &curve.x, "")
    };
    let up = range(&|p| p.1);
    let up = if curve.has_bars { (0.0, 1.06 * up.1) } else { with_margin(up) };
    let mut plot = Plot::new(axis, Axis::new(up, 6, &curve.y, ""), 980.0, 280.0);
    plot.level(0.0, "zero");
    if !curve.line.is_empty() {
        plot.lines(&[curve.line.iter().map(|(a, b)| (x(*a), *b)).collect()], "modelled");
    }
    if curve.has_bars {
        curve.points.iter().for_each(|(a, b)| plot.bar((a - 0.4, a + 0.4), *b, "bar loud"));
    } else {
        curve.points.iter().for_each(|(a, b)| plot.dot((x(*a), *b), 2.5, "mean"));
    }
    for ((_, points), class) in curve.beside.iter().zip(BESIDE.iter().cycle()) {
        points.iter().for_each(|(a, b)| plot.dot((x(*a), *b), 2.5, class));
    }
    plot.finish()
}

/// What is what in the picture.
fn caption(curve: &Curve) -> String {
    let name = if curve.name.is_empty() { "measured" } else { &curve.name };
    let mut words = vec![swatch("residual", name)];
    words.extend(curve.beside.iter().zip(BESIDE.iter().cycle()).map(|((name, _), class)| swatch(class, name)));
    if !curve.line.is_empty() {
        words.push(swatch("modelled", if curve.has_bars { "what must be passed to count" } else { "by the result" }));
    }
    format!("{}: {}", escaped(&curve.title), words.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_alone_keeps_its_power_of_ten() {
        let of = |v: f64, u: f64| value(&Quantity::new("x", "1", v, vec![Part::measured("noise", u, 9.0, "")]));
        assert_eq!((of(1.0123, 0.0011), of(2.812e-4, 1.8e-6)), ("1.0123".into(), "2.812 × 10⁻⁴".into()));
        assert_eq!(of(-8.1e-4, 2.8e-4), "−8.1 × 10⁻⁴");
    }

    #[test]
    fn each_series_of_a_picture_has_a_colour_and_its_name() {
        let beside = vec![("falling".to_owned(), vec![(1.0, 2.0)]), ("again".to_owned(), vec![(2.0, 1.0)])];
        let curve = Curve { name: "rising".into(), points: vec![(0.0, 0.0), (1.0, 1.0)], beside, ..Curve::default() };
        let (drawn, caption) = (picture(&curve), caption(&curve));
        for (class, name) in [("second", "falling"), ("third", "again")] {
            assert!(
                drawn.contains(&format!("class=\"{class}\"")) && caption.contains(&format!("swatch {class}\"></span>{name}")),
                "{caption}"
            );
        }
        assert!(caption.contains("rising") && !drawn.contains("bar"));
        assert_eq!(picture(&Curve { has_bars: true, ..curve }).matches("bar loud").count(), 1, "a bar of height 0 is none");
    }
}
