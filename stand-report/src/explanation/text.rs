//! An explanation as text for a terminal: residual by stage, candidates, and the result.

use super::evidence::{Outcome, grouped, heldout_ratio, p_cell, reason, tried};
use super::words::LimitRow;
use super::{sentences, words};
use crate::coordinates::AxisLabel;
use crate::terminal::{Style, sparkline};
use crate::{column, log_warnings, misfits, numbers};
use identification::identify::explain::{Candidate, Explanation, Shape, Verdict};
use identification::statistics::Extremes;

/// Length of the longest bar, columns.
const BAR_COLUMNS: usize = 34;
/// Ratio of rms to noise that the longest bar stands for, at least: noise alone is drawn as a short bar.
const MIN_BAR_RATIO: f64 = 5.0;
/// Number of candidates that get a line each, at least.
const MIN_CANDIDATE_LINES: usize = 6;

/// The whole report; the result is at the end.
pub fn explain_text(e: &Explanation, style: Style) -> String {
    let mut text = style.strong(&style.wrapped("", "", &words::title(e)));
    text.push_str(&style.faint(&format!(
        "{} rows, {} s at {} ms; computed in {} s",
        numbers::grouped(e.log.len()),
        numbers::plain(e.log.duration_s(), 4),
        numbers::plain(e.log.median_dt_s() * 1e3, 3),
        numbers::significant(e.seconds, 2)
    )));
    text.push_str("\n\n");
    text.push_str(&stages(e, style));
    if !e.misfits.is_empty() {
        text.push_str(&format!("{}\n", style.strong("Where the model as given fails")));
        for line in misfits::lines(e.model.axis(), &e.misfits) {
            text.push_str(&style.wrapped("  • ", "    ", &line));
        }
        text.push('\n');
    }
    text.push_str(&candidates(e, style));
    for line in log_warnings(&e.log) {
        text.push_str(&style.warn(&style.wrapped("! ", "  ", &line)));
    }
    for line in sentences::remarks(e) {
        text.push_str(&style.faint(&style.wrapped("· ", "  ", &line)));
    }
    if !text.ends_with("\n\n") {
        text.push('\n');
    }
    text.push_str(&result(e, style));
    text
}

/// The residual of each channel, stage by stage.
fn stages(e: &Explanation, style: Style) -> String {
    let mut text = format!("{} {}\n", style.strong("Residual by stage"), style.faint("(rms over noise; 1: at noise level)"));
    let labels: Vec<String> = e.stages.iter().map(words::stage).collect();
    let width = labels.iter().map(|l| l.chars().count()).max().unwrap_or(0);
    let channels = e.stages.first().map_or(0, |s| s.outputs.len());
    for channel in 0..channels {
        let outputs: Vec<_> = e.stages.iter().map(|s| s.outputs.get(channel)).collect();
        let longest = outputs.iter().flatten().map(|o| o.ratio()).filter(|r| r.is_finite()).fold(MIN_BAR_RATIO, f64::max);
        if let Some(Some(first)) = outputs.first() {
            text.push_str(&format!("  {}\n", column(e.model.axis(), first.channel)));
        }
        for (label, o) in labels.iter().zip(&outputs) {
            let Some(o) = o else { continue };
            let ratio = o.ratio();
            let bar = bar(ratio / longest);
            let size = numbers::significant(ratio, 3);
            let painted = if words::exceeds_noise(e, o) { style.warn(&bar) } else { style.good(&bar) };
            let pad = " ".repeat(BAR_COLUMNS.saturating_sub(bar.chars().count()));
            text.push_str(&format!("    {label:<width$}  {painted}{pad}  {size}\n"));
        }
    }
    text.push('\n');
    text
}

/// A bar in eighths of a column, at least one eighth long.
fn bar(fraction: f64) -> String {
    const EIGHTHS: [char; 8] = ['▏', '▎', '▍', '▌', '▋', '▊', '▉', '█'];
    let eighths = if fraction.is_finite() { ((fraction.clamp(0.0, 1.0) * (8 * BAR_COLUMNS) as f64).round() as usize).max(1) } else { 1 };
    let mut bar = "█".repeat(eighths / 8);
    if eighths % 8 > 0 {
        bar.extend(EIGHTHS.get(eighths % 8 - 1));
    }
    bar
}

/// The table of the best candidates, and the names of the others by their outcome.
fn candidates(e: &Explanation, style: Style) -> String {
    let mut text = format!("{}\n", style.strong("Candidates"));
    let listed = |(k, c): &(usize, &Candidate)| tried(c) && (*k < MIN_CANDIDATE_LINES || c.refitted);
    let lines: Vec<&Candidate> = e.candidates.iter().enumerate().filter(listed).map(|(_, c)| c).collect();
    let given_label = "model as given";
    let names = lines.iter().map(|c| c.effect.chars().count()).chain([given_label.len()]).max().unwrap_or(0);
    let number = |x: Option<f64>| x.map_or("–".to_owned(), grouped);
    let ratio = |x: Option<f64>| x.map_or("–".to_owned(), |r| numbers::significant(r, 3));
    text.push_str(&style.faint(&format!("  {:<names$}  {:>8}  {:>8}  {:>8}\n", "", "ΔBIC", "p", "held-out")));
    let given = e.stages.first().and_then(|s| heldout_ratio(&s.outputs));
    text.push_str(&format!("  {given_label:<names$}  {:>8}  {:>8}  {:>8}\n", "", "", ratio(given)));
    for c in &lines {
        let outcome = Outcome::of(e, c);
        let (name, bic, p, heldout) = (&c.effect, number(c.delta_bic), p_cell(e, c), ratio(heldout_ratio(&c.outputs)));
        let painted = match outcome {
            Outcome::Added | Outcome::AddedLater => style.good(outcome.name()),
            Outcome::NotDistinguishable | Outcome::Helps => style.warn(outcome.name()),
            _ => style.faint(outcome.name()),
        };
        text.push_str(&format!("  {name:<names$}  {bic:>8}  {p:>8}  {heldout:>8}  {painted}\n"));
        if let Some(why) = reason(e.model.axis(), c, outcome) {
            text.push_str(&style.faint(&style.wrapped("      ", "      ", &why)));
        }
    }
    for outcome in Outcome::ALL {
        let is_other = |c: &&Candidate| tried(c) && Outcome::of(e, c) == outcome && !lines.iter().any(|l| l.effect == c.effect);
        let others: Vec<&str> = e.candidates.iter().filter(is_other).map(|c| c.effect.as_str()).collect();
        if !others.is_empty() {
            text.push_str(&style.faint(&style.wrapped("  ", "  ", &format!("Also {}: {}.", outcome.name(), others.join(", ")))));
        }
    }
    text.push_str(&style.faint(&style.wrapped("  ", "  ", words::TABLE_LEGEND)));
    text.push('\n');
    text
}

/// The result: headline, added effects, unexplained shapes, limits of the log, next experiment.
fn result(e: &Explanation, style: Style) -> String {
    let mut text = style.strong(&style.wrapped("", "", &words::headline(e)));
    for k in 0..e.missing.len() {
        text.push('\n');
        for (n, (term, line)) in words::added_effect(e, k).iter().enumerate() {
            let (first, rest) = if n == 0 { (format!("{}: ", style.strong(term)), "  ") } else { (format!("  {term}: "), "    ") };
            text.push_str(&style.wrapped(&first, rest, line));
        }
    }
    for shape in &e.unexplained {
        text.push_str(&unexplained(e, shape, style));
    }
    if e.verdict == Verdict::Adequate {
        text.push_str("\nLimits of this log:\n");
        for line in words::not_shown(e) {
            text.push_str(&style.wrapped("  • ", "    ", &line));
        }
        text.push_str(&detection_limits(e, style));
    }
    if let (Some(next), Some(message)) = (&e.next, sentences::next_experiment(e)) {
        text.push('\n');
        text.push_str(&style.wrapped("Next experiment: ", "  ", &message));
        text.push_str(&format!("    {}\n", sentences::command(&next.run)));
    }
    text
}

/// The smallest effects that the log would have shown.
fn detection_limits(e: &Explanation, style: Style) -> String {
    let limits = words::detection_limits(e);
    if limits.is_empty() {
        return String::new();
    }
    let effects = limits.iter().map(|l| l.effect.chars().count()).max().unwrap_or(0);
    let sizes = limits.iter().map(|l| l.size.chars().count()).max().unwrap_or(0);
    let mut text = format!("\n{}\n", style.strong("Smallest effects that this log would have shown"));
    for LimitRow { effect, size, at } in &limits {
        let line = format!("  {effect:<effects$}  {size:<sizes$}  {}", style.faint(at));
        text.push_str(&format!("{}\n", line.trim_end()));
    }
    text.push_str(&style.faint(&style.wrapped("  ", "  ", words::DETECTION_LEGEND)));
    text
}

/// The shape of an unexplained residual: sentence, sparkline, lines to paste.
fn unexplained(e: &Explanation, shape: &Shape, style: Style) -> String {
    let mut text = String::from("\n");
    text.push_str(&style.wrapped("", "", &sentences::shape(e.model.axis(), shape)));
    let (low, high) = shape.bins.iter().map(|b| b.mean).min_max();
    if let (Some(first), Some(last)) = (shape.bins.first(), shape.bins.last()) {
        let heights: Vec<Option<f64>> = shape.bins.iter().map(|b| Some(b.mean - low)).collect();
        let (name, unit) = sentences::acts_on(e.model.axis(), shape.acts_on);
        let number = |x: f64| numbers::significant(x, 3);
        text.push_str(&format!("    {}\n", sparkline(&heights, high - low)));
        let AxisLabel { name: coordinate, unit: coordinate_unit } = sentences::along(e.model.axis(), shape);
        let (from, to) = (number(first.at), number(last.at));
        let caption =
            format!("{name} from {} to {} {unit}, over the {coordinate} from {from} to {to} {coordinate_unit}", number(low), number(high));
        text.push_str(&style.faint(&style.wrapped("    ", "    ", &caption)));
    }
    if let Some(expression) = &shape.expression {
        text.push_str(&style.wrapped("", "", &words::paste(e)));
        text.push('\n');
        for line in expression.lines() {
            text.push_str(&format!("    {line}\n"));
        }
    }
    text
}
