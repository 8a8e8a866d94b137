//! The report in one HTML file: plots and tables, for a browser or for paper.

use super::words::{self, ParameterRow};
use super::{Comparison, channel_plots, failure_plots};
use crate::identify::residual::plot_data::ResidualPlotData;
use crate::report::page::{Page, escaped, swatch, with_code};
use crate::report::residual::coordinates;
use crate::report::{numbers, quantity, unit};

/// The report of a comparison or a fit as one file that needs nothing else.
pub fn html(c: &Comparison) -> String {
    let mut page = Page::new(&c.title);
    head(c, &mut page);
    where_it_fails(c, &mut page);
    summary(c, &mut page);
    if c.fitted {
        parameters(&words::parameters(c), &mut page);
    }
    let along = coordinates(c.log, c.record, &c.held.channels);
    let pictures = ResidualPlotData::of(c.log, c.record, c.held);
    for (index, (compared, fitness)) in c.record.channels.iter().zip(&c.held.channels).enumerate() {
        page.push("<section>");
        page.push(&format!("<h2>{} <span class=\"faint\">{}</span></h2>", escaped(fitness.channel.column()), quantity(fitness.channel)));
        page.paragraph("", &words::channel(fitness));
        channel_plots::overview(c.record, compared, fitness, &mut page);
        channel_plots::close_up(c.record, compared, fitness, &mut page);
        channel_plots::noise_like(c.record, fitness, &mut page);
        channel_plots::over_coordinates(fitness, &along, &mut page);
        if let Some(p) = &pictures {
            failure_plots::pictures(p, index, fitness, &mut page);
        }
        page.push("</section>");
    }
    glossary(&mut page);
    page.finish()
}

fn head(c: &Comparison, page: &mut Page) {
    page.push(&format!("<p class=\"lead\">{}</p>", with_code(&words::conclusion(c))));
    let names = c.model.effect_names();
    let effects = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
    let log = format!(
        "{}: {} rows, {} s at {} ms",
        c.log.path().display(),
        numbers::grouped(c.log.len()),
        numbers::plain(c.log.duration_s(), 4),
        numbers::plain(c.log.median_dt_s() * 1e3, 3)
    );
    page.push("<dl>");
    let mut entry = |term: &str, text: &str| page.push(&format!("<dt>{term}</dt><dd>{}</dd>", escaped(text)));
    entry("Log", &log);
    for (key, term) in [("date", "Recorded"), ("stand", "Stand"), ("profile", "Profile")] {
        if let Some(note) = c.log.note(key) {
            entry(term, note);
        }
    }
    entry("Model", &format!("{}, driven by {}; effects: {effects}", c.model.name(), c.model.input().column()));
    entry(
        "Work",
        &format!("{} s{}", numbers::significant(c.seconds, 2), if c.fitted { format!(", {} steps", c.held.steps) } else { String::new() }),
    );
    page.push("</dl>");
    let notes: Vec<String> = c.log.notes().iter().map(|(key, value)| format!("{key}: {value}")).collect();
    if !notes.is_empty() {
        page.push(&format!(
            "<details><summary class=\"faint\">Notes of the log</summary><p class=\"notes\">{}</p></details>",
            escaped(&notes.join(" · "))
        ));
    }
    for line in c.all_warnings() {
        page.paragraph("warn", &line);
    }
    for line in c.all_remarks() {
        page.paragraph("faint", &line);
    }
}

/// The failures as a table; nothing where there are none.
fn where_it_fails(c: &Comparison, page: &mut Page) {
    if c.failures.is_empty() {
        return;
    }
    page.push("<section><h2>Where it fails</h2>");
    page.push("<p class=\"faint\">The coordinate that accounts for most stands first; each share is what it accounts for beyond those before it. Nothing is listed that chance would give once in a thousand logs.</p>");
    page.push("<div class=\"scroll\"><table><thead><tr><th>channel</th><th>over</th><th>share of the residual</th><th>order</th><th>by chance</th><th></th></tr></thead><tbody>");
    for f in &c.failures {
        page.push(&format!(
            "<tr><td>{}</td><td>{}</td><td class=\"number\">{} %</td><td class=\"number\">{}</td><td class=\"number\">10{}</td><td>{}</td></tr>",
            f.output.column(),
            f.coordinate.name(),
            numbers::significant(100.0 * f.share, 2),
            f.order.map_or(String::new(), |n| n.to_string()),
            numbers::superscript(f.log10_p.ceil().max(-1e6) as i32),
            escaped(&f.says)
        ));
    }
    page.push("</tbody></table></div></section>");
}

fn summary(c: &Comparison, page: &mut Page) {
    page.push("<div class=\"scroll\"><table><thead><tr><th>channel</th><th>rms</th><th>held-out</th><th>noise</th><th>ratio</th><th>χ²/n</th><th>fit</th><th>white</th><th></th></tr></thead><tbody>");
    for f in &c.held.channels {
        let ratio = f.rms / f.noise;
        let number = |x: f64| format!("<td class=\"number\">{}</td>", numbers::significant(x, 3));
        let class = if ratio <= words::AS_SMALL { "good" } else { "warn" };
        page.push(&format!(
            "<tr><td>{}, {}</td>{}{}{}{}{}<td class=\"number\">{} %</td><td>{}</td><td class=\"{class}\">{}</td></tr>",
            f.channel.column(),
            unit(f.channel),
            number(f.rms),
            number(f.heldout_rms.unwrap_or(f64::NAN)),
            number(f.noise),
            number(ratio),
            number(f.chi2_per_n()),
            numbers::significant(f.fit_percent, 4),
            if f.white() { "yes" } else { "no" },
            words::size(ratio)
        ));
    }
    page.push("</tbody></table></div>");
}

fn parameters(rows: &[ParameterRow], page: &mut Page) {
    page.push("<section><h2>Parameters</h2><div class=\"scroll\"><table><thead><tr><th>parameter</th><th>value ± sigma</th><th>start</th><th>change</th><th></th></tr></thead><tbody>");
    for row in rows {
        let class = if row.mark() == "fixed" { "mark" } else { "warn" };
        let change = if row.fixed { String::new() } else { numbers::change(row.start, row.value) };
        page.push(&format!(
            "<tr><td><code>{}</code><br/><span class=\"faint\">{}</span></td><td class=\"number\">{}</td><td class=\"number\">{}</td><td class=\"number\">{change}</td><td class=\"{class}\">{}</td></tr>",
            escaped(&row.name),
            escaped(row.says),
            escaped(&row.value_text()),
            numbers::plain(row.start, 4),
            row.mark()
        ));
    }
    page.push("</tbody></table></div>");
    for advice in rows.iter().filter_map(ParameterRow::advice) {
        page.paragraph("warn", &advice);
    }
    page.push("</section>");
}

fn glossary(page: &mut Page) {
    page.push("<section><h2>What the numbers mean</h2><dl>");
    for (term, says) in words::GLOSSARY {
        page.push(&format!("<dt>{term}</dt><dd>{says}</dd>"));
    }
    page.push("</dl></section>");
}

/// Caption of measured beside modelled.
pub(super) fn two_traces() -> String {
    format!("{} {}", swatch("measured", "measured"), swatch("modelled", "modelled"))
}
