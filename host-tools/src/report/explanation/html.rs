//! An explanation as one HTML file: what is missing, the evidence, and the error before and after.

use super::plots::{self, Pair};
use super::{sentences, words};
use crate::identify::explain::{Explanation, Verdict};
use crate::identify::fit::PreparedLog;
use crate::identify::fit::prepare::prepare;
use crate::identify::residual::harmonics::Spectrum;
use crate::identify::residual::plot_data::ResidualPlotData;
use crate::report::page::{Page, escaped, swatch, with_code};
use crate::report::residual::{Along, coordinates};
use crate::report::{log_warnings, numbers, quantity, unit};

/// The page, which needs nothing else.
pub fn explain_html(e: &Explanation) -> String {
    let mut page = Page::new(&words::title(e));
    head(e, &mut page);
    page.push("<section><h2>How the error fell</h2>");
    page.figure(&plots::staircase(e), "The first bar of each channel is the model as it was given, with its parameters fitted; below it the model with one effect more each.");
    page.push("</section>");
    unexplained(e, &mut page);
    evidence(e, &mut page);
    match prepare(&e.log, &e.model, true) {
        Ok((record, _)) => channels(e, &record, &mut page),
        Err(error) => page.paragraph("warn", &format!("No pictures of the channels: {error}")),
    }
    parameters(e, &mut page);
    glossary(&mut page);
    page.finish()
}

fn head(e: &Explanation, page: &mut Page) {
    let class = if e.verdict == Verdict::Adequate { "lead good" } else { "lead" };
    page.paragraph(class, &words::headline(e));
    for k in 0..e.missing.len() {
        page.push("<dl>");
        for (term, says) in words::of_effect(e, k) {
            page.push(&format!("<dt>{}</dt><dd>{}</dd>", escaped(&term), escaped(&says)));
        }
        page.push("</dl>");
    }
    if e.verdict == Verdict::Adequate {
        page.push("<h3>What this log could not have shown</h3><ul>");
        for line in words::blind(e) {
            page.push(&format!("<li>{}</li>", escaped(&line)));
        }
        page.push("</ul>");
    }
    if let (Some(next), Some(message)) = (&e.next, sentences::next_experiment(e)) {
        page.push("<h3>What to measure next</h3>");
        page.paragraph("", &message);
        page.push(&format!("<pre class=\"command\">{}</pre>", escaped(&sentences::command(&next.run))));
    }
    if !e.failures.is_empty() {
        page.push("<h3>Where the model failed as it was given</h3><ul>");
        for failure in &e.failures {
            page.push(&format!("<li>{}</li>", escaped(&failure.says)));
        }
        page.push("</ul>");
    }
    page.push("<h3>What it was made from</h3><dl>");
    let mut entry = |term: &str, text: &str| page.push(&format!("<dt>{term}</dt><dd>{}</dd>", escaped(text)));
    let (rows, length) = (numbers::grouped(e.log.len()), numbers::plain(e.log.duration_s(), 4));
    entry("Log", &format!("{}: {rows} rows, {length} s at {} ms", e.log.path().display(), numbers::plain(e.log.median_dt_s() * 1e3, 3)));
    for (key, term) in [("date", "Recorded"), ("stand", "Stand"), ("profile", "Profile")] {
        if let Some(note) = e.log.note(key) {
            entry(term, note);
        }
    }
    let effects = e.stages.first().map_or(String::new(), |s| s.effects.join(", "));
    let effects = if effects.is_empty() { "none".to_owned() } else { effects };
    entry("Model", &format!("{}, driven by {}; effects as given: {effects}", e.model.name(), e.model.input().column()));
    entry("Work", &format!("{} s", numbers::significant(e.seconds, 2)));
    page.push("</dl>");
    for line in log_warnings(&e.log) {
        page.paragraph("warn", &line);
    }
    for line in sentences::remarks(e) {
        page.paragraph("faint", &line);
    }
}

/// The shapes of what is left, with the lines to paste.
fn unexplained(e: &Explanation, page: &mut Page) {
    if e.unexplained.is_empty() {
        return;
    }
    page.push("<section><h2>What no effect explains</h2>");
    for shape in &e.unexplained {
        page.paragraph("", &sentences::shape(shape));
        if let Some(plot) = plots::shape(shape) {
            page.figure(&plot, "Mean in each bin, with its 95 % interval.");
        }
        if let Some(expression) = &shape.expression {
            page.push(&format!("<p>{}</p><pre class=\"command\">{}</pre>", with_code(&words::paste(e)), escaped(expression)));
        }
    }
    page.push("</section>");
}

/// Every candidate of the catalogue.
fn evidence(e: &Explanation, page: &mut Page) {
    page.push("<section><h2>What was tried</h2>");
    page.push("<p class=\"faint\">Every effect that the model lacks, added to the model as it was given. ΔBIC: how much better it fits, less a charge for each parameter; negative is better, −6 counts. p: probability that chance alone looks as good. held-out: error on rows that the fit never saw, × noise.</p>");
    page.push("<div class=\"scroll\"><table><thead><tr><th>effect</th><th>ΔBIC</th><th>p</th><th>held-out</th><th>what came of it, and its parameters</th></tr></thead><tbody>");
    let cell = |text: &str| format!("<td class=\"number\">{}</td>", escaped(text));
    let ratio = |x: Option<f64>| x.map_or("–".to_owned(), |r| numbers::significant(r, 3));
    if let Some(given) = e.stages.first() {
        page.push(&format!(
            "<tr><td class=\"number\">the model as given</td>{}{}{}<td></td></tr>",
            cell(""),
            cell(""),
            cell(&ratio(words::heldout(&given.outputs)))
        ));
    }
    for c in &e.candidates {
        let (fate, why) = words::fate(e, c);
        let class = match fate {
            "added" | "added later" => "good",
            "fits as well" | "helps" => "warn",
            _ => "mark",
        };
        let (bic, p) = (c.delta_bic.map_or("–".to_owned(), words::grouped), words::chance(e, c));
        let sizes: Vec<String> = if c.refitted { c.parameters.iter().map(words::estimate).collect() } else { Vec::new() };
        let fate = match why {
            Some(why) => format!("{fate}: {why}"),
            None if !c.ambiguous_with.is_empty() => format!("{fate}; this log cannot tell it from {}", words::listed(&c.ambiguous_with)),
            None => fate.to_owned(),
        };
        let sizes =
            if sizes.is_empty() { String::new() } else { format!("<br/><span class=\"notes\">{}</span>", escaped(&sizes.join(", "))) };
        page.push(&format!(
            "<tr><td class=\"number\"><code>{}</code></td>{}{}{}<td><span class=\"{class}\">{}</span>{sizes}</td></tr>",
            escaped(&c.effect),
            cell(&bic),
            cell(&p),
            cell(&ratio(words::heldout(&c.outputs))),
            escaped(&fate)
        ));
    }
    page.push("</tbody></table></div></section>");
}

/// Measured beside modelled, and the residual, before and after.
fn channels(e: &Explanation, record: &PreparedLog, page: &mut Page) {
    let added = !e.missing.is_empty();
    let along = coordinates(&e.log, record, &e.explained.channels);
    let pictures = [&e.given, &e.explained].map(|held| ResidualPlotData::of(&e.log, record, held));
    for (index, ((compared, before), after)) in record.channels.iter().zip(&e.given.channels).zip(&e.explained.channels).enumerate() {
        let pair = Pair { compared, before, after };
        page.push(&format!("<section><h2>{} <span class=\"faint\">{}</span></h2>", before.channel.column(), quantity(before.channel)));
        let spectra = pictures.each_ref().map(|p| p.as_ref().and_then(|p| p.orders(index)));
        channel(record, &pair, added, &along, &spectra, page);
        page.push("</section>");
    }
}

fn channel(record: &PreparedLog, pair: &Pair, added: bool, along: &[Along], spectra: &[Option<Spectrum>; 2], page: &mut Page) {
    let (as_given, explained) = (
        swatch("before", "the model as given"),
        swatch("after", if added { "with what was missing" } else { "the same: nothing was added" }),
    );
    let size = |f: &crate::identify::fit::ChannelFit| numbers::significant(f.rms, 3);
    let words = format!("{} {}, {} {}", as_given, size(pair.before), explained, size(pair.after));
    page.push(&format!("<p>rms: {words}; noise {} {}.</p>", numbers::significant(pair.after.noise, 3), unit(pair.before.channel)));
    let Some(whole) = plots::whole(record) else { return };
    let both = format!("{as_given} {explained}");
    if let Some(stretch) = plots::worst(record, pair.before)
        && let Some(plot) = plots::traces(record, pair, stretch)
    {
        page.figure(&plot, &format!("{} {both}, where the given model is worst.", swatch("measured", "measured")));
    } else if let Some(plot) = plots::traces(record, pair, whole) {
        page.figure(&plot, &format!("{} {both}.", swatch("measured", "measured")));
    }
    if let Some(plot) = plots::residuals(record, pair, whole) {
        page.figure(
            &plot,
            &format!("What each leaves: {both}. Between the two grey lines (± 2 × noise) lie 95 % of the rows, if nothing is missing."),
        );
    }
    page.push("<h3>What the residual depends on</h3>");
    page.push(&format!("<p class=\"faint\">Mean residual in each bin with its 95 % interval: {both}. Of a complete model all lie on zero, but for one bin in twenty.</p><div class=\"pair\">"));
    for a in along {
        if let Some(plot) = plots::over(pair, a) {
            page.figure(&plot, "");
        }
    }
    page.push("</div>");
    if let [Some(before), Some(after)] = spectra
        && let Some(plot) = plots::order_spectrum(pair, before, after)
    {
        page.push("<h3>Orders: what repeats so many times per turn</h3>");
        page.figure(&plot, &format!("{both}. A line that stands out is something that comes again at the same angles; the lowest orders also collect what is slow."));
    }
}

/// The parameters of the model at the end.
fn parameters(e: &Explanation, page: &mut Page) {
    let (Some(first), Some(last)) = (e.stages.first(), e.stages.last()) else { return };
    page.push("<section><h2>Parameters</h2><div class=\"scroll\"><table><thead><tr><th>parameter</th><th>as given, fitted</th><th>with what was missing</th></tr></thead><tbody>");
    for p in &last.parameters {
        let before = first.parameters.iter().find(|q| q.name == p.name).map_or("–".to_owned(), words::value);
        page.push(&format!(
            "<tr><td><code>{}</code></td><td class=\"number\">{}</td><td class=\"number\">{}</td></tr>",
            escaped(&p.name),
            escaped(&before),
            escaped(&words::value(p))
        ));
    }
    page.push("</tbody></table></div></section>");
}

fn glossary(page: &mut Page) {
    page.push("<section><h2>What the words mean</h2><dl>");
    for (term, says) in crate::report::comparison::words::GLOSSARY
        .iter()
        .filter(|(t, _)| matches!(*t, "residual" | "rms" | "noise" | "ratio" | "± sigma"))
        .chain(words::GLOSSARY)
    {
        page.push(&format!("<dt>{}</dt><dd>{}</dd>", escaped(term), escaped(says)));
    }
    page.push("</dl></section>");
}
