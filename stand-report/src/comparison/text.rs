//! A comparison or a fit as text for a terminal.

use super::parameters::{Mark, ParameterRow, advice, parameters};
use super::{Comparison, words};
use crate::residual_plots::rms_over_time;
use crate::terminal::{Style, sparkline};
use crate::{column, fitted_quantity, misfits, numbers, unit};
use identification::identify::fit::ChannelFit;
use identification::statistics::Extremes;

/// The whole report; the last paragraph is the conclusion.
pub fn text(c: &Comparison, style: Style) -> String {
    let mut text = format!("{}\n", style.strong(&c.title()));
    let names = c.model.effect_names();
    let effects = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
    let summary = format!(
        "{} rows, {} s at {} ms; effects: {effects}",
        numbers::grouped(c.log.len()),
        numbers::plain(c.log.duration_s(), 4),
        numbers::plain(c.log.median_dt_s() * 1e3, 3),
    );
    text.push_str(&style.faint(&style.wrapped("", "", &summary)));
    text.push('\n');
    for f in &c.result.channels {
        text.push_str(&channel(c, f, style));
        text.push('\n');
    }
    if c.fitted {
        text.push_str(&parameter_table(&parameters(c), c.result.sigma_is_lower_bound(), style));
        text.push('\n');
    }
    // The conclusion contains the first line.
    for line in misfits::lines(c.model.axis(), c.misfits).iter().skip(1) {
        text.push_str(&style.wrapped("• ", "  ", line));
    }
    for line in c.all_warnings() {
        text.push_str(&style.warn(&style.wrapped("! ", "  ", &line)));
    }
    for line in c.all_remarks() {
        text.push_str(&style.faint(&style.wrapped("· ", "  ", &line)));
    }
    if !text.ends_with("\n\n") {
        text.push('\n');
    }
    text.push_str(&style.strong(&style.wrapped("", "", &words::conclusion(c))));
    text
}

/// Columns of the sparkline, at most.
const SPARKLINE_COLUMNS: usize = 56;

/// Figures of a channel, and the rms of its residual over time.
fn channel(c: &Comparison, f: &ChannelFit, style: Style) -> String {
    let ratio = f.rms / f.noise;
    let size = words::size(ratio);
    let at_noise = ratio <= words::MAX_NOISE_RATIO;
    let number = |x: f64| numbers::significant(x, 3);
    let axis = c.model.axis();
    let heading = format!("{}  {}", column(axis, f.channel), fitted_quantity(axis, f));
    let more = if at_noise { format!(" (ratio {})", number(ratio)) } else { String::new() };
    let fits = heading.chars().count() + 2 + size.chars().count() + more.len() <= style.width;
    let painted = if at_noise { style.good(&size) } else { style.warn(&size) };
    let mut text = format!(
        "{}  {}{}{painted}{more}\n",
        style.strong(column(axis, f.channel)),
        style.faint(fitted_quantity(axis, f)),
        if fits { "  " } else { "\n  " }
    );
    let mut items = vec![format!("rms {} {}", number(f.rms), unit(axis, f.channel))];
    items.extend(f.heldout_rms.map(|rms| format!("held-out {}", number(rms))));
    items.push(format!("noise {}", number(f.noise)));
    items.push(format!("fit {} %", number(f.fit_percent)));
    items.push(if f.white() { "white" } else { "not white" }.to_owned());
    let mut line = String::from("  ");
    for item in items {
        if line.trim().chars().count() + 4 + item.chars().count() > style.width {
            text.push_str(line.trim_end());
            text.push('\n');
            line = String::from("  ");
        }
        line.push_str(&item);
        line.push_str("   ");
    }
    text.push_str(line.trim_end());
    text.push('\n');
    let columns = SPARKLINE_COLUMNS.min(style.width.saturating_sub(24)).max(8);
    let over_time = rms_over_time(c.data, &f.residual, columns);
    let largest = over_time.iter().flatten().copied().max_or_zero();
    let scale = style.faint(&format!("0 … {} × noise", number(largest / f.noise)));
    text.push_str(&format!("  {}  {scale}\n", sparkline(&over_time, largest)));
    text
}

fn parameter_table(rows: &[ParameterRow], sigma_is_lower_bound: bool, style: Style) -> String {
    let cells: Vec<[String; 3]> = rows
        .iter()
        .map(|row| {
            let moved = !row.fixed && row.mark() != Mark::NotDetermined && row.start != row.value;
            let change = numbers::change(row.start, row.value);
            let start = match (moved, change.is_empty()) {
                (false, _) => String::new(),
                (true, true) => format!("start {}", numbers::plain(row.start, 4)),
                (true, false) => format!("start {} ({change})", numbers::plain(row.start, 4)),
            };
            [row.name.clone(), row.value_text(), start]
        })
        .collect();
    let width = |k: usize| cells.iter().map(|c| c.get(k).map_or(0, |t| t.chars().count())).max().unwrap_or(0);
    let (names, values) = (width(0), width(1));
    let mut text = format!(
        "{} {}\n",
        style.strong("Parameters"),
        style.faint(&format!("(± is {}1 standard uncertainty)", numbers::at_least(sigma_is_lower_bound)))
    );
    for ([name, value, start], row) in cells.iter().zip(rows) {
        let line = format!("  {name:<names$}  {value:<values$}  {start}");
        let mark = row.mark().text();
        let painted = if row.mark() == Mark::Fixed { style.faint(mark) } else { style.warn(mark) };
        let between = if start.is_empty() || mark.is_empty() { "" } else { ", " };
        if line.chars().count() + between.len() + mark.chars().count() <= style.width {
            text.push_str(format!("{line}{between}{painted}").trim_end());
        } else {
            text.push_str(line.trim_end());
            if !mark.is_empty() {
                text.push_str(&format!("\n      {painted}"));
            }
        }
        text.push('\n');
    }
    for line in advice(rows) {
        text.push_str(&style.warn(&style.wrapped("! ", "  ", &line)));
    }
    text
}
