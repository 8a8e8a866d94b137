//! A fleet for the terminal.

use super::words::{adjusted, counted, distance, finding, fraction, headline, limits, since, size, values};
use stand_analysis::fleet::evaluation::FleetEvaluation;
use stand_analysis::fleet::run::FleetRun;

/// Lines of a list that are printed.
const MAX_LINES: usize = 20;

/// The computation of a table: verdicts and counts. The last line says how many logs are done.
pub fn run_text(table: &str, run: &FleetRun) -> String {
    let mut counts = std::collections::BTreeMap::<&str, usize>::new();
    run.rows.iter().for_each(|row| *counts.entry(&row.verdict).or_default() += 1);
    let mut text: String = counts.iter().map(|(verdict, count)| format!("{verdict:<17}  {count}\n")).collect();
    text += &format!(
        "{table}: {} of {} done, {} of them computed now, {} without an explanation\n",
        run.rows.len(),
        counted(run.logs, "log"),
        run.computed,
        run.failed()
    );
    text
}

/// The evaluation.
pub fn text(e: &FleetEvaluation) -> String {
    let mut text = format!("{}\n{}\n", size(e), headline(e));
    for limit in limits(e) {
        text += &format!("  {limit}\n");
    }
    let changes = e.parameter_changes.iter().filter(|c| c.is_significant()).map(|c| {
        let [before, since] = values(c);
        format!(
            "{}: {} {before} → {since} {} ({:.1} standard uncertainties, p {})",
            c.stand,
            c.parameter,
            c.unit,
            c.z().abs(),
            adjusted(c.adjusted_p)
        )
    });
    text += &list(&format!("Parameters changed since {}", since(e)), changes);
    let findings = e
        .finding_changes
        .iter()
        .map(|c| format!("{}{}", finding(c), if c.is_significant() { String::new() } else { "; not significant".to_owned() }));
    text += &list(&format!("New effects and verdicts since {}", since(e)), findings);
    let batches = e.batch_effects.iter().filter(|b| b.is_significant());
    let batches = batches.map(|b| {
        let (inside, outside) = (fraction(b.inside), fraction(b.outside));
        format!("batch {}: {} in {inside} stands, {outside} of the others (p {})", b.batch, b.effect, adjusted(Some(b.adjusted_p)))
    });
    text += &list("Effects common to a batch", batches);
    let outliers = e.spreads.iter().flat_map(|spread| spread.stands.iter().filter(|s| s.is_significant()).map(move |s| (spread, s)));
    let outliers = outliers.map(|(spread, s)| {
        format!("{}: {} {} standard uncertainties from the median (p {})", s.stand, spread.parameter, distance(s), adjusted(s.adjusted_p))
    });
    text += &list("Outliers among the stands", outliers);
    text += &list("Logs without an explanation", e.failed.iter().map(|(path, verdict, reason)| format!("{path}: {verdict}: {reason}")));
    text
}

fn list(heading: &str, lines: impl Iterator<Item = String>) -> String {
    let lines: Vec<String> = lines.collect();
    if lines.is_empty() {
        return String::new();
    }
    let more = lines.len().saturating_sub(MAX_LINES);
    let shown: String = lines.iter().take(MAX_LINES).map(|line| format!("  {line}\n")).collect();
    let rest = if more > 0 { format!("  and {more} more\n") } else { String::new() };
    format!("\n{heading}\n{shown}{rest}")
}
