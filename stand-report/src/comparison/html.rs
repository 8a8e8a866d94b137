//! A comparison or a fit as an HTML page: tables and plots.

use super::parameters::{Mark, ParameterRow, advice, parameters};
use super::{Comparison, channel_plots, misfit_plots, words};
use crate::coordinates::coordinates;
use crate::html::{Cell, Class, Markup, Page, Table};
use crate::{column, fitted_quantity, log_entries, misfits, numbers, unit};
use identification::identify::residual::plot_data::ResidualPlotData;

/// The page.
pub fn html(c: &Comparison) -> String {
    let mut page = Page::new(&c.title());
    head(c, &mut page);
    misfits::section(c.model.axis(), c.misfits, &mut page);
    page.section("Residuals", |page| residuals(c, page));
    if c.fitted {
        page.section("Parameters", |page| parameter_table(&parameters(c), c.result.sigma_is_lower_bound(), page));
    }
    let along = coordinates(c.log, c.data, &c.result.channels);
    let plot_data = ResidualPlotData::new(c.log, c.data, c.result);
    for (index, (compared, fit)) in c.data.channels.iter().zip(&c.result.channels).enumerate() {
        let axis = c.model.axis();
        let heading = Markup::from(column(axis, fit.channel)).then(" ").then(Markup::span(Class::Faint, fitted_quantity(axis, fit)));
        page.section(heading, |page| {
            page.text(words::channel(axis, fit));
            channel_plots::whole_log(c.data, compared, fit, page);
            channel_plots::close_up(c.data, compared, fit, page);
            channel_plots::distribution(c.data, fit, page);
            channel_plots::over_coordinates(fit, &along, page);
            if let Some(p) = &plot_data {
                misfit_plots::all(p, index, axis, fit, page);
            }
        });
    }
    page.section("Terms", |page| {
        let used = words::GLOSSARY.iter().filter(|(term, _)| c.fitted || !matches!(*term, "± 1σ" | "not determined" | "correlation"));
        page.definitions(used.copied());
    });
    page.finish()
}

fn head(c: &Comparison, page: &mut Page) {
    page.paragraph(Class::Lead, Markup::with_code(&words::conclusion(c)));
    let names = c.model.effect_names();
    let effects = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
    let mut entries = log_entries(c.log);
    entries.push(("Model", format!("{}; input: {}; effects: {effects}", c.model.name(), c.model.axis().column(c.model.input().column()))));
    let steps = if c.fitted { format!(", {} steps", c.result.steps) } else { String::new() };
    entries.push(("Computing time", format!("{} s{steps}", numbers::significant(c.seconds, 2))));
    page.definitions(entries);
    let axis = c.model.axis();
    let notes: Vec<String> = c.log.notes().iter().map(|(key, value)| format!("{}: {value}", axis.file_note(key))).collect();
    if !notes.is_empty() {
        page.details("Notes of the log", Class::Notes, notes.join(" · "));
    }
    for line in c.all_warnings() {
        page.paragraph(Class::Warning, line);
    }
    for line in c.all_remarks() {
        page.paragraph(Class::Faint, line);
    }
}

fn residuals(c: &Comparison, page: &mut Page) {
    let mut table = Table::new(["channel", "rms", "held-out", "noise", "ratio", "χ²/n", "fit", "white", ""]);
    for f in &c.result.channels {
        let ratio = f.rms / f.noise;
        let number = |x: f64| Cell::number(numbers::significant(x, 3));
        table.row([
            Cell::text(format!("{}, {}", column(c.model.axis(), f.channel), unit(c.model.axis(), f.channel))),
            number(f.rms),
            number(f.heldout_rms.unwrap_or(f64::NAN)),
            number(f.noise),
            number(ratio),
            number(f.chi2_per_n()),
            Cell::number(format!("{} %", numbers::significant(f.fit_percent, 4))),
            Cell::text(if f.white() { "yes" } else { "no" }),
            Cell::text(words::size(ratio)).class(if ratio <= words::MAX_NOISE_RATIO { Class::Good } else { Class::Warning }),
        ]);
    }
    page.table(table);
}

fn parameter_table(rows: &[ParameterRow], sigma_is_lower_bound: bool, page: &mut Page) {
    let mut table = Table::new(["parameter", &format!("value ± {}1σ", numbers::at_least(sigma_is_lower_bound)), "start", "change", ""]);
    for row in rows {
        let change = if row.fixed { String::new() } else { numbers::change(row.start, row.value) };
        let name = Markup::code(&row.name).then_line(Markup::span(Class::Faint, row.description));
        table.row([
            Cell::text(name),
            Cell::number(row.value_text()),
            Cell::number(numbers::plain(row.start, 4)),
            Cell::number(change),
            Cell::text(row.mark().text()).class(if row.mark() == Mark::Fixed { Class::Mark } else { Class::Warning }),
        ]);
    }
    page.table(table);
    for line in advice(rows) {
        page.paragraph(Class::Warning, Markup::with_code(&line));
    }
}
