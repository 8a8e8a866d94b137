//! An explanation for a person at a terminal: how the error fell, what was tried, and what it means.

use super::{sentences, words};
use crate::identify::explain::{Candidate, Explanation, Shape, Verdict};
use crate::report::terminal::{Style, sparkline};
use crate::report::{log_warnings, numbers};
use crate::statistics::Extremes;

/// Widest bar of the staircase, columns.
const BAR: usize = 34;
/// Full length of a bar stands for this ratio at least, so that mere noise is not drawn as much.
const LEAST_SCALE: f64 = 5.0;
/// Candidates that get a line at least, if there are so many.
const LINES: usize = 6;

/// The report, ending in plain words.
pub fn explain_text(e: &Explanation, style: Style) -> String {
    let mut text = format!("{}\n", style.strong(&words::title(e)));
    text.push_str(&style.faint(&format!(
        "{} rows, {} s at {} ms; looked at for {} s",
        numbers::grouped(e.log.len()),
        numbers::plain(e.log.duration_s(), 4),
        numbers::plain(e.log.median_dt_s() * 1e3, 3),
        numbers::significant(e.seconds, 2)
    )));
    text.push_str("\n\n");
    text.push_str(&staircase(e, style));
    if !e.failures.is_empty() {
        text.push_str(&format!("{}\n", style.strong("Where the model fails as it was given")));
        for failure in &e.failures {
            text.push_str(&style.wrapped("  • ", "    ", &failure.says));
        }
        text.push('\n');
    }
    text.push_str(&evidence(e, style));
    for line in log_warnings(&e.log) {
        text.push_str(&style.warn(&style.wrapped("! ", "  ", &line)));
    }
    for line in sentences::remarks(e) {
        text.push_str(&style.faint(&style.wrapped("· ", "  ", &line)));
    }
    if !text.ends_with("\n\n") {
        text.push('\n');
    }
    text.push_str(&plain_words(e, style));
    text
}

/// The error of each channel, stage by stage.
fn staircase(e: &Explanation, style: Style) -> String {
    let heading = if e.missing.is_empty() { "The error after the fit" } else { "How the error fell" };
    let mut text = format!("{} {}\n", style.strong(heading), style.faint("(rms, as a multiple of the noise; 1: only noise is left)"));
    let labels: Vec<String> = e.stages.iter().map(words::stage).collect();
    let width = labels.iter().map(|l| l.chars().count()).max().unwrap_or(0);
    let channels = e.stages.first().map_or(0, |s| s.outputs.len());
    for channel in 0..channels {
        let shown: Vec<_> = e.stages.iter().map(|s| s.outputs.get(channel)).collect();
        let most = shown.iter().flatten().map(|o| o.ratio()).filter(|r| r.is_finite()).fold(LEAST_SCALE, f64::max);
        if let Some(Some(first)) = shown.first() {
            text.push_str(&format!("  {}\n", first.channel.column()));
        }
        for (label, o) in labels.iter().zip(&shown) {
            let Some(o) = o else { continue };
            let ratio = o.ratio();
            let bar = bar(ratio / most);
            let size = numbers::significant(ratio, 3);
            let painted = if words::exceeds_noise(e, o) { style.warn(&bar) } else { style.good(&bar) };
            let pad = " ".repeat(BAR.saturating_sub(bar.chars().count()));
            text.push_str(&format!("    {label:<width$}  {painted}{pad}  {size}\n"));
        }
    }
    text.push('\n');
    text
}

/// A bar in eighths of a column, of at least one.
fn bar(part: f64) -> String {
    const EIGHTHS: [char; 8] = ['▏', '▎', '▍', '▌', '▋', '▊', '▉', '█'];
    let eighths = if part.is_finite() { ((part.clamp(0.0, 1.0) * (8 * BAR) as f64).round() as usize).max(1) } else { 1 };
    let mut bar = "█".repeat(eighths / 8);
    if eighths % 8 > 0 {
        bar.extend(EIGHTHS.get(eighths % 8 - 1));
    }
    bar
}

/// The candidates that are worth a line, and a word on the others.
fn evidence(e: &Explanation, style: Style) -> String {
    let mut text = format!("{}\n", style.strong("What was tried"));
    let worth = |(k, c): &(usize, &Candidate)| words::tried(c) && (*k < LINES || c.refitted);
    let lines: Vec<&Candidate> = e.candidates.iter().enumerate().filter(worth).map(|(_, c)| c).collect();
    let names = lines.iter().map(|c| c.effect.chars().count()).chain(["the model as given".len()]).max().unwrap_or(0);
    let number = |x: Option<f64>| x.map_or("–".to_owned(), words::grouped);
    let ratio = |x: Option<f64>| x.map_or("–".to_owned(), |r| numbers::significant(r, 3));
    text.push_str(&style.faint(&format!("  {:<names$}  {:>8}  {:>8}  {:>8}\n", "", "ΔBIC", "p", "held-out")));
    let given = e.stages.first().and_then(|s| words::heldout(&s.outputs));
    text.push_str(&format!("  {:<names$}  {:>8}  {:>8}  {:>8}\n", "the model as given", "", "", ratio(given)));
    for c in &lines {
        let (fate, why) = words::fate(e, c);
        let (name, bic, p) = (&c.effect, number(c.delta_bic), words::chance(e, c));
        let held = ratio(words::heldout(&c.outputs));
        let fate = match fate {
            "added" | "added later" => style.good(fate),
            "fits as well" | "helps" => style.warn(fate),
            _ => style.faint(fate),
        };
        text.push_str(&format!("  {name:<names$}  {bic:>8}  {p:>8}  {held:>8}  {fate}\n"));
        if let Some(why) = why {
            text.push_str(&style.faint(&style.wrapped("      ", "      ", &why)));
        }
    }
    let rest: Vec<String> =
        e.candidates.iter().filter(|c| words::tried(c) && !lines.iter().any(|l| l.effect == c.effect)).map(|c| c.effect.clone()).collect();
    if !rest.is_empty() {
        text.push_str(&style.faint(&style.wrapped("  ", "  ", &format!("Tried too, with less to say for them: {}.", rest.join(", ")))));
    }
    let gloss = "ΔBIC: how much better it fits, less a charge for each parameter; negative is better, −6 counts. p: probability that chance alone looks as good. held-out: error on rows that the fit never saw, × noise.";
    text.push_str(&style.faint(&style.wrapped("  ", "  ", gloss)));
    text.push('\n');
    text
}

fn plain_words(e: &Explanation, style: Style) -> String {
    let mut text = style.strong(&style.wrapped("", "", &words::headline(e)));
    for k in 0..e.missing.len() {
        text.push('\n');
        for (n, (term, says)) in words::of_effect(e, k).iter().enumerate() {
            let (first, rest) = if n == 0 { (format!("{}: ", style.strong(term)), "  ") } else { (format!("  {term}: "), "    ") };
            text.push_str(&style.wrapped(&first, rest, says));
        }
    }
    for shape in &e.unexplained {
        text.push_str(&unexplained(e, shape, style));
    }
    if e.verdict == Verdict::Adequate {
        text.push_str("\nWhat this log could not have shown:\n");
        for line in words::blind(e) {
            text.push_str(&style.wrapped("  • ", "    ", &line));
        }
    }
    if let (Some(next), Some(message)) = (&e.next, sentences::next_experiment(e)) {
        text.push('\n');
        text.push_str(&style.wrapped("What to measure next: ", "  ", &message));
        text.push_str(&format!("    {}\n", sentences::command(&next.run)));
    }
    text
}

/// The shape of what is left, its sentence and the lines to paste.
fn unexplained(e: &Explanation, shape: &Shape, style: Style) -> String {
    let mut text = String::from("\n");
    text.push_str(&style.wrapped("", "", &sentences::shape(shape)));
    let extent = shape.bins.iter().map(|b| b.mean).min_max();
    if let (Some(first), Some(last)) = (shape.bins.first(), shape.bins.last()) {
        let heights: Vec<Option<f64>> = shape.bins.iter().map(|b| Some(b.mean - extent.0)).collect();
        let (name, unit) = sentences::acts_on(shape.acts_on);
        let number = |x: f64| numbers::significant(x, 3);
        text.push_str(&format!("    {}\n", sparkline(&heights, extent.1 - extent.0)));
        let says = format!(
            "{name} from {} to {} {unit}, over the {} from {} to {}",
            number(extent.0),
            number(extent.1),
            sentences::along(shape),
            number(first.at),
            number(last.at)
        );
        text.push_str(&style.faint(&style.wrapped("    ", "    ", &says)));
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
