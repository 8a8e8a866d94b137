//! A comparison or a fit as text for a terminal.

use super::Comparison;
use super::words::{self, ParameterRow};
use crate::identify::fit::ChannelFit;
use crate::report::residual::rms_over_time;
use crate::report::terminal::{Style, sparkline};
use crate::report::{numbers, quantity, unit};

/// The report of a comparison or a fit, ending in a sentence.
pub fn text(c: &Comparison, style: Style) -> String {
    let mut text = format!("{}\n", style.strong(&c.title));
    text.push_str(&style.faint(&format!(
        "{} rows, {} s at {} ms; {} ({})",
        numbers::grouped(c.log.len()),
        numbers::plain(c.log.duration_s(), 4),
        numbers::plain(c.log.median_dt_s() * 1e3, 3),
        c.model.name(),
        effects(c),
    )));
    text.push_str("\n\n");
    for f in &c.held.channels {
        text.push_str(&channel(c, f, style));
        text.push('\n');
    }
    if c.fitted {
        text.push_str(&parameter_table(&words::parameters(c), style));
        text.push('\n');
    }
    // The first is in the last words.
    for failure in c.failures.iter().skip(1) {
        text.push_str(&style.wrapped("• ", "  ", &failure.says));
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

fn effects(c: &Comparison) -> String {
    let names = c.model.effect_names();
    if names.is_empty() { "no effects".to_owned() } else { names.join(", ") }
}

/// Columns of the sparkline.
const SPARK_COLUMNS: usize = 56;

fn channel(c: &Comparison, f: &ChannelFit, style: Style) -> String {
    let ratio = f.rms / f.noise;
    let says = words::size(ratio);
    let says = if ratio <= words::AS_SMALL { style.good(&says) } else { style.warn(&says) };
    let unit = unit(f.channel);
    let number = |x: f64| numbers::significant(x, 3);
    let plain = format!("{}  {}", f.channel.column(), quantity(f.channel));
    let more = if ratio <= words::AS_SMALL { format!(" (ratio {})", number(ratio)) } else { String::new() };
    let between = if plain.chars().count() + 2 + words::size(ratio).chars().count() + more.len() > style.width { "\n  " } else { "  " };
    let mut text = format!("{}  {}{between}{says}{more}\n", style.strong(f.channel.column()), style.faint(quantity(f.channel)));
    let mut items = vec![format!("rms {} {unit}", number(f.rms))];
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
    let columns = SPARK_COLUMNS.min(style.width.saturating_sub(24)).max(8);
    let over_time = rms_over_time(c.record, &f.residual, columns);
    let most = over_time.iter().flatten().fold(0.0_f64, |m, v| m.max(*v));
    text.push_str(&format!("  {}  {}\n", sparkline(&over_time, most), style.faint(&format!("0 … {} × noise", number(most / f.noise)))));
    text
}

fn parameter_table(rows: &[ParameterRow], style: Style) -> String {
    let cells: Vec<[String; 3]> = rows
        .iter()
        .map(|row| {
            let moved = !row.fixed && row.undetermined.is_none() && row.start != row.value;
            let from = if moved {
                format!("from {} {}", numbers::plain(row.start, 4), bracketed(&numbers::change(row.start, row.value)))
            } else {
                String::new()
            };
            [row.name.clone(), row.value_text(), from.trim_end().to_owned()]
        })
        .collect();
    let width = |k: usize| cells.iter().map(|c| c.get(k).map_or(0, |t| t.chars().count())).max().unwrap_or(0);
    let (names, values) = (width(0), width(1));
    let mut text = String::new();
    for ([name, value, from], row) in cells.iter().zip(rows) {
        let line = format!("  {name:<names$}  {value:<values$}  {from}");
        let mark = if row.mark() == "fixed" { style.faint(row.mark()) } else { style.warn(row.mark()) };
        let between = if from.is_empty() || row.mark().is_empty() { "" } else { ", " };
        if line.chars().count() + between.len() + row.mark().chars().count() <= style.width {
            text.push_str(format!("{line}{between}{mark}").trim_end());
        } else {
            text.push_str(line.trim_end());
            if !row.mark().is_empty() {
                text.push_str(&format!("\n      {mark}"));
            }
        }
        text.push('\n');
    }
    for advice in rows.iter().filter_map(ParameterRow::advice) {
        text.push_str(&style.warn(&style.wrapped("! ", "  ", &advice)));
    }
    text
}

fn bracketed(text: &str) -> String {
    if text.is_empty() { String::new() } else { format!("({text})") }
}
