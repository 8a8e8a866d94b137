//! Records told to a person: a list, one record with its budgets, a trend.

use super::calibration as page;
use crate::calibrate::kept::{Checked, Kept, SAME};
use crate::calibrate::trend::{Change, Series, Trend};
use crate::report::page::{Page, escaped, swatch};
use crate::report::plot::{Axis, Plot, with_margin};
use crate::report::{significant, with_sigma};
use crate::statistics::Extremes;
use crate::statistics::uncertainty::Quantity;

const COMMON: &str = "What two records of one stand have in common by the same line of type B (its crystal, its mounting, its readings) does not enter \
    their difference; a part that was mounted anew, or a session that believes other half-widths, is another matter: then the last column holds.";

fn unit(of: &str) -> String {
    if of == "1" { String::new() } else { format!(" {of}") }
}

/// A line for each record.
pub fn list(kept: &[Kept], passed: &[String]) -> String {
    let mut out = String::new();
    for k in kept {
        let r = &k.record;
        let serial = if r.session.serial.is_empty() { "–" } else { &r.session.serial };
        let steps = format!("{} of {} steps", r.journal.steps.len(), r.session.steps.len());
        let state = if r.is_whole() { "whole" } else { &steps };
        let broken = match r.journal.interruptions.len() {
            0 => String::new(),
            1 => ", broken off once".to_owned(),
            n => format!(", broken off {n} times"),
        };
        let results = r.findings.quantities.len();
        out += &format!(
            "{}  {:<5}  {serial:<10}  {state}, {results} results{broken}  {}\n",
            r.journal.began,
            r.session.what.name(),
            k.path.display()
        );
    }
    if kept.is_empty() {
        out += "no records here\n";
    }
    passed.iter().for_each(|why| out += &format!("passed over: {why}\n"));
    out
}

/// One record from its JSON alone, and what its logs say today.
pub fn show(kept: &Kept, checked: &Checked) -> String {
    let mut out = page::text(&kept.record);
    for q in &kept.record.findings.quantities {
        out += &format!("\n{}  {}{}\n", q.name, with_sigma(q.value, q.sigma()), unit(&q.unit));
        let width = q.parts.iter().map(|p| p.of.chars().count()).max().unwrap_or(0);
        for p in &q.parts {
            out +=
                &format!("  {:<width$}  {}  {:>12}{}  {}\n", p.of, page::kind(p), significant(p.contribution(), 2), unit(&q.unit), p.says);
        }
    }
    out.push('\n');
    for (log, wrong) in &checked.logs {
        out += &format!("{log}: {}\n", wrong.as_deref().unwrap_or("as it was recorded, by its SHA-256"));
    }
    out + &match &checked.again {
        Ok(apart) if *apart <= SAME => "computed again from these logs: the same results\n".to_owned(),
        Ok(apart) => format!(
            "computed again from these logs: NOT the same results; the greatest difference is {} of a value\n",
            significant(*apart, 2)
        ),
        Err(why) => format!("not computed again: {why}\n"),
    }
}

fn change(c: &Change) -> String {
    let sign = if c.by.value >= 0.0 { "+" } else { "" };
    let shown = with_sigma(c.by.value, c.by.expanded());
    let (open, shown) = shown.strip_prefix('(').map_or(("", shown.as_str()), |rest| ("(", rest));
    format!("{open}{sign}{shown}{}", if c.is_beyond() { " beyond the uncertainty" } else { "" })
}

fn value(q: &Quantity) -> String {
    format!("{}{}", with_sigma(q.value, q.expanded()), unit(&q.unit))
}

fn verdict(trend: &Trend) -> String {
    let beyond = trend.beyond();
    let quantities = trend.series.iter().filter(|s| !s.changes.is_empty()).count();
    match (quantities, beyond.is_empty()) {
        (0, _) => "one record: nothing to compare yet".to_owned(),
        (n, true) => format!("none of {n} quantities has moved beyond the uncertainty since the first record"),
        (n, false) => format!(
            "beyond the uncertainty since the first record: {} ({} of {n} quantities; one of 20 is by chance)",
            beyond.join(", "),
            beyond.len()
        ),
    }
}

fn heading(trend: &Trend) -> String {
    format!("trend {} {}", trend.what, trend.serial).trim_end().to_owned()
}

fn line(s: &Series) -> Option<String> {
    let (_, slope) = s.line.as_ref()?;
    let beyond = if slope.value.abs() > slope.expanded() { ", beyond the uncertainty" } else { "" };
    Some(format!("line: {}{beyond}; {}", value(slope), slope.parts.first().map_or("", |p| &p.says)))
}

/// A trend for a terminal.
pub fn trend_text(trend: &Trend) -> String {
    let mut out = format!("{}: {} records\n{}\n", heading(trend), trend.dates.len(), verdict(trend));
    for s in &trend.series {
        out += &format!("\n{}\n", s.name);
        for (k, p) in s.points.iter().enumerate() {
            out += &format!("  {}  {}{}", p.began, value(&p.found), if p.is_whole { "" } else { "  (not whole)" });
            if let Some((first, before)) = k.checked_sub(1).and_then(|k| s.changes.get(k)) {
                out += &format!("  from the first {}", change(first));
                if k > 1 {
                    out += &format!("; from the one before {}", change(before));
                }
            }
            out.push('\n');
        }
        line(s).into_iter().for_each(|line| out += &format!("  {line}\n"));
    }
    let mut common: Vec<&str> = trend.series.iter().flat_map(|s| &s.changes).flat_map(|(c, _)| &c.common).map(String::as_str).collect();
    common.sort_unstable();
    common.dedup();
    if !common.is_empty() {
        out += &format!(
            "\ncommon to both and not in a change: {} (a part mounted anew, or another stand: see U_if_nothing_is_common in --json)\n",
            common.join(", ")
        );
    }
    out + "± is expanded, for 95 %. Not an accredited certificate.\n"
}

fn picture(s: &Series) -> Option<crate::report::plot::svg::Drawing> {
    let range = |of: &mut dyn Iterator<Item = f64>| of.min_max();
    let first = s.points.first()?;
    let days = range(&mut s.points.iter().map(|p| p.day));
    let values = range(&mut s.points.iter().flat_map(|p| [p.found.value - p.found.expanded(), p.found.value + p.found.expanded()]));
    let y = format!("{}{}", s.name, if first.found.unit == "1" { String::new() } else { format!(", {}", first.found.unit) });
    let x = Axis::new(with_margin(days), 10, &format!("days from {}", first.began), "");
    let mut plot = Plot::new(x, Axis::new(with_margin(values), 6, &y, ""), 980.0, 240.0);
    if let Some((at_first, slope)) = &s.line {
        plot.lines(&[[days.0, days.1].map(|d| (d, at_first + slope.value * d)).to_vec()], "modelled");
    }
    s.points.iter().for_each(|p| plot.whisker(p.day, p.found.value, p.found.expanded()));
    Some(plot.finish())
}

/// A trend as one HTML file.
pub fn trend_html(trend: &Trend) -> String {
    let mut page = Page::new(&heading(trend));
    page.paragraph("lead", &format!("{} records: {}.", trend.dates.len(), verdict(trend)));
    page.paragraph("", COMMON);
    for s in &trend.series {
        page.push(&format!("<section><h2>{}</h2>", escaped(&s.name)));
        if let (Some(drawn), true) = (picture(s), s.points.len() > 1) {
            let caption = format!(
                "{} with its expanded uncertainty{}",
                swatch("residual", "each record"),
                if s.line.is_some() { format!(", {}", swatch("modelled", "straight line")) } else { String::new() }
            );
            page.figure(&drawn, &caption);
        }
        page.push("<div class=\"scroll\"><table><thead><tr><th>session begun</th><th>value</th><th>from the first</th><th>from the one before</th><th>U from the first if nothing is common</th></tr></thead><tbody>");
        for (k, p) in s.points.iter().enumerate() {
            let changes = k.checked_sub(1).and_then(|k| s.changes.get(k));
            let cell = |c: Option<&Change>| {
                let class = if c.is_some_and(Change::is_beyond) { "number warn" } else { "number" };
                format!("<td class=\"{class}\">{}</td>", c.map_or(String::new(), |c| escaped(&change(c))))
            };
            page.push(&format!(
                "<tr><td class=\"number\">{}{}</td><td class=\"number\">{}</td>{}{}<td class=\"number\">{}</td></tr>",
                escaped(&p.began),
                if p.is_whole { "" } else { " (not whole)" },
                escaped(&value(&p.found)),
                cell(changes.map(|(first, _)| first)),
                cell(changes.map(|(_, before)| before)),
                changes.map_or(String::new(), |(first, _)| significant(first.expanded_without, 2))
            ));
        }
        page.push("</tbody></table></div>");
        line(s).into_iter().for_each(|line| page.paragraph("", &line));
        page.push("</section>");
    }
    page.paragraph("faint", "± is expanded, for 95 %. This is not an accredited certificate.");
    page.finish()
}
