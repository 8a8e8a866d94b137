//! Allan analysis as text for a terminal.

use super::Display;
use super::words::{CONDITIONS, density, facts, name, note, title, value};
use crate::uncertainty::FOOTNOTE;
use crate::{grouped, significant};
use stand_analysis::allan::MAX_RELATIVE_TAU;
use stand_analysis::allan::answer::{Answer, WHITE};
use stand_analysis::allan::units::PROCESSES;

/// Coefficients with their standard uncertainties, remarks, and a table of the curve.
pub fn text(answer: &Answer, display: &Display) -> String {
    let mut out = title(answer) + "\n";
    for (p, process) in PROCESSES.iter().enumerate() {
        out += &format!("  {:<18} {}  {}\n", name(answer, process), process.letter, value(answer, display, p));
        if let (WHITE, Some(density)) = (p, density(answer, display)) {
            out += &format!("  {:<21} {density}\n", "");
        }
    }
    out += &format!("  {FOOTNOTE}\n  {CONDITIONS}\n");
    for line in facts(answer, display).into_iter().chain(answer.notes.iter().map(|found| note(found, display))) {
        out += &line;
        out.push('\n');
    }
    let (scale, unit) = (display.deviation().factor, &display.deviation().unit);
    out += &format!("\n{:>10}  {:>11}  {:>25}  {:>11}  {:>10}  {:>8}\n", "τ, s", format!("OADEV, {unit}"), "68 %", "ADEV", "terms", "dof");
    for p in &answer.points {
        let number = |x: f64| significant(x * scale, 4);
        let between = format!("{} … {}", number(p.within_68[0]), number(p.within_68[1]));
        let beyond = if p.tau_s > MAX_RELATIVE_TAU * answer.duration_s() { "  beyond T/10" } else { "" };
        out += &format!(
            "{:>10}  {:>11}  {between:>25}  {:>11}  {:>10}  {:>8}{beyond}\n",
            significant(p.tau_s, 4),
            number(p.oadev),
            number(p.adev),
            grouped(p.terms),
            significant(p.degrees, 3)
        );
    }
    out
}
