//! An explanation as an HTML page: the missing effects, the evidence, and the residual before and after.

use super::evidence::{Outcome, grouped, heldout_ratio, p_cell, reason};
use super::plots::{self, Pair};
use super::words::LimitRow;
use super::{sentences, words};
use crate::comparison;
use crate::coordinates::{CoordinateAxis, coordinates};
use crate::html::{Cell, Class, Markup, Page, Table};
use crate::residual_plots::{self, PlotLine};
use crate::{column, fitted_quantity, log_entries, log_warnings, misfits, numbers, unit};
use identification::identify::explain::{Explanation, Stage, Verdict};
use identification::identify::residual::harmonics::Spectrum;
use identification::identify::residual::plot_data::ResidualPlotData;
use identification::recording::PreparedLog;

/// The page.
pub fn explain_html(e: &Explanation) -> String {
    let mut page = Page::new(&words::title(e));
    head(e, &mut page);
    page.section("Residual by stage", |page| {
        page.figure(
            &plots::stages(e),
            "The first bar of each channel is the model as given, with its parameters fitted; each bar below it has one effect more.",
        );
    });
    unexplained(e, &mut page);
    page.section("Candidates", |page| candidates(e, page));
    channels(e, &e.data(), &mut page);
    page.section("Parameters", |page| parameters(e, page));
    page.section("Terms", |page| {
        let shared = comparison::words::GLOSSARY.iter().filter(|(t, _)| matches!(*t, "residual" | "rms" | "noise" | "ratio" | "± 1σ"));
        page.definitions(shared.chain(words::GLOSSARY).copied());
    });
    page.finish()
}

fn head(e: &Explanation, page: &mut Page) {
    let headline = words::headline(e);
    match e.verdict {
        Verdict::Adequate => page.paragraph(Class::Lead, Markup::span(Class::Good, headline)),
        _ => page.paragraph(Class::Lead, headline),
    }
    for k in 0..e.missing.len() {
        page.definitions(
            words::added_effect(e, k)
                .iter()
                .map(|(term, text)| (term.as_str().into(), Markup::with_code(text)))
                .collect::<Vec<(Markup, Markup)>>(),
        );
    }
    if e.verdict == Verdict::Adequate {
        page.heading("Limits of this log");
        page.list(words::not_shown(e));
        let limits = words::detection_limits(e);
        if !limits.is_empty() {
            page.heading("Smallest effects that this log would have shown");
            let mut table = Table::new(["effect", "smallest amplitude", ""]);
            for LimitRow { effect, size, at } in limits {
                table.row([Cell::text(effect), Cell::text(size), Cell::text(at)]);
            }
            page.table(table);
            page.paragraph(Class::Faint, words::DETECTION_LEGEND);
        }
    }
    if let (Some(next), Some(message)) = (&e.next, sentences::next_experiment(e)) {
        page.heading("Next experiment");
        page.text(message);
        page.command(&sentences::command(&next.run));
    }
    if !e.misfits.is_empty() {
        page.heading("Where the model as given fails");
        page.list(misfits::lines(e.model.axis(), &e.misfits));
    }
    page.heading("Input");
    let mut entries = log_entries(&e.log);
    let effects = e.stages.first().map_or(String::new(), |s| s.effects.join(", "));
    let effects = if effects.is_empty() { "none".to_owned() } else { effects };
    entries.push((
        "Model",
        format!("{}; input: {}; effects as given: {effects}", e.model.name(), e.model.axis().column(e.model.input().column())),
    ));
    entries.push(("Computing time", format!("{} s", numbers::significant(e.seconds, 2))));
    page.definitions(entries);
    for line in log_warnings(&e.log) {
        page.paragraph(Class::Warning, line);
    }
    for line in sentences::remarks(e) {
        page.paragraph(Class::Faint, line);
    }
}

/// The shapes of an unexplained residual, with the lines to paste.
fn unexplained(e: &Explanation, page: &mut Page) {
    if e.unexplained.is_empty() {
        return;
    }
    page.section("Unexplained residual", |page| {
        for shape in &e.unexplained {
            page.text(sentences::shape(e.model.axis(), shape));
            if let Some(plot) = plots::shape(e.model.axis(), shape) {
                page.figure(&plot, "Mean in each bin, with its 95 % interval.");
            }
            if let Some(expression) = &shape.expression {
                page.text(Markup::with_code(&words::paste(e)));
                page.command(expression);
            }
        }
    });
}

/// The table of all candidates.
fn candidates(e: &Explanation, page: &mut Page) {
    page.paragraph(
        Class::Faint,
        format!("Every effect that the model lacks, added to the model as given. {} ± is 1 standard uncertainty.", words::TABLE_LEGEND),
    );
    let ratio = |x: Option<f64>| Cell::number(x.map_or("–".to_owned(), |r| numbers::significant(r, 3)));
    let mut table = Table::new(["effect", "ΔBIC", "p", "held-out", "outcome and parameters"]);
    if let Some(given) = e.stages.first() {
        table.row([
            Cell::number("model as given"),
            Cell::number(""),
            Cell::number(""),
            ratio(heldout_ratio(&given.outputs)),
            Cell::text(""),
        ]);
    }
    for c in &e.candidates {
        let outcome = Outcome::of(e, c);
        let class = match outcome {
            Outcome::Added | Outcome::AddedLater => Class::Good,
            Outcome::NotDistinguishable | Outcome::Helps => Class::Warning,
            _ => Class::Mark,
        };
        let text = match reason(e.model.axis(), c, outcome) {
            Some(why) => format!("{}: {why}", outcome.name()),
            None if !c.ambiguous_with.is_empty() => {
                format!("{}; not distinguishable from {} in this log", outcome.name(), words::listed(&c.ambiguous_with))
            }
            None => outcome.name().to_owned(),
        };
        let mut cell = Markup::span(class, text);
        if c.refitted && !c.parameters.is_empty() {
            let values: Vec<String> = c.parameters.iter().map(|p| words::estimate(e.model.axis(), p)).collect();
            cell = cell.then_line(Markup::span(Class::Notes, values.join(", ")));
        }
        table.row([
            Cell::code(&c.effect),
            Cell::number(c.delta_bic.map_or("–".to_owned(), grouped)),
            Cell::number(p_cell(e, c)),
            ratio(heldout_ratio(&c.outputs)),
            Cell::text(cell),
        ]);
    }
    page.table(table);
}

/// Each channel before and after.
fn channels(e: &Explanation, data: &PreparedLog, page: &mut Page) {
    let labels = Labels::of(e);
    let along = coordinates(&e.log, data, &e.explained.channels);
    let plot_data = [&e.given, &e.explained].map(|result| ResidualPlotData::new(&e.log, data, result));
    for (index, ((compared, before), after)) in data.channels.iter().zip(&e.given.channels).zip(&e.explained.channels).enumerate() {
        let pair = Pair { compared, before, after };
        let spectra = plot_data.each_ref().map(|p| p.as_ref().and_then(|p| p.spectrum(index)));
        let axis = e.model.axis();
        let heading = Markup::from(column(axis, before.channel)).then(" ").then(Markup::span(Class::Faint, fitted_quantity(axis, before)));
        page.section(heading, |page| channel(data, &pair, &labels, &along, &spectra, page));
    }
}

/// Labels of the two models in captions.
struct Labels {
    before: Markup,
    after: Markup,
}

impl Labels {
    fn of(e: &Explanation) -> Labels {
        let after = if e.missing.is_empty() { "the same model: no effect was added" } else { "with the missing effects" };
        Labels { before: Markup::swatch("before", "model as given"), after: Markup::swatch("after", after) }
    }

    fn both(&self) -> Markup {
        self.before.clone().then(" ").then(self.after.clone())
    }
}

fn channel(data: &PreparedLog, pair: &Pair, labels: &Labels, along: &[CoordinateAxis], spectra: &[Option<Spectrum>; 2], page: &mut Page) {
    let (before, after) = (pair.before, pair.after);
    page.text(
        Markup::from("rms: ")
            .then(labels.before.clone())
            .then(format!(" {}, ", numbers::significant(before.rms, 3)))
            .then(labels.after.clone())
            .then(format!(
                " {}; noise {} {}.",
                numbers::significant(after.rms, 3),
                numbers::significant(after.noise, 3),
                unit(data.axis, before.channel)
            )),
    );
    let Some(whole) = residual_plots::whole_log(data) else { return };
    let models = [PlotLine { fit: before, class: "before" }, PlotLine { fit: after, class: "after" }];
    let measured = Markup::swatch("measured", "measured").then(" ").then(labels.both());
    let worst = residual_plots::worst_interval(data, before);
    if let Some(plot) = residual_plots::traces(data, pair.compared, &models, worst.unwrap_or(whole), false) {
        let where_ = if worst.is_some() { ", in the 2 s in which the residual of the given model is largest." } else { "." };
        page.figure(&plot, measured.then(where_));
    }
    if let Some(plot) = residual_plots::residuals(data, &models, whole, false) {
        let band = Markup::swatch("band", "± 2 × noise: 95 % of the rows of a complete model");
        page.figure(&plot, Markup::from("Residual: ").then(labels.both()).then(" ").then(band));
    }
    page.heading("Residual over coordinates");
    let note = "Mean residual in each bin, with its 95 % interval. For a complete model 19 of 20 intervals contain zero. ";
    page.paragraph(Class::Faint, Markup::from(note).then(labels.both()));
    page.side_by_side(|page| {
        for a in along {
            if let Some(plot) = residual_plots::over_coordinate(&models, a) {
                page.figure(&plot, "");
            }
        }
    });
    if let [Some(spectrum_before), Some(spectrum_after)] = spectra
        && let Some(plot) = plots::order_spectrum(data.axis, pair, spectrum_before, spectrum_after)
    {
        page.heading("Harmonic orders");
        let note = ". A single large bar is an effect periodic in the angle; the lowest orders also contain slow changes.";
        page.figure(&plot, labels.both().then(note));
    }
}

/// The parameters of the first and the last model.
fn parameters(e: &Explanation, page: &mut Page) {
    let axis = e.model.axis();
    let (Some(first), Some(last)) = (e.stages.first(), e.stages.last()) else { return };
    let head = |what: &str, stage: &Stage| format!("{what} (± {}1σ)", numbers::at_least(stage.sigma_is_lower_bound()));
    let mut table = Table::new(["parameter", &head("model as given, fitted", first), &head("with the missing effects", last)]);
    for p in &last.parameters {
        let before = first.parameters.iter().find(|q| q.name == p.name).map_or("–".to_owned(), |q| words::value(axis, q));
        table.row([Cell::code(&axis.parameter(&p.name)), Cell::number(before), Cell::number(words::value(axis, p))]);
    }
    page.table(table);
}
