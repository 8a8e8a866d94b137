//! Tables of many explanations: how often the correct effect is named, and the effects named instead.

use std::collections::BTreeMap;

use drive_model::cards;

use crate::verdicts::{Outcome, stem};

/// One log: name of its case, hidden effects (or one name outside the catalogue), result.
#[derive(Debug, Clone)]
pub struct Line {
    /// Name of the case.
    pub id: String,
    /// Hidden effects, in short.
    pub hidden: Vec<String>,
    /// Hidden effects with parameters.
    pub description: String,
    /// Result.
    pub outcome: Outcome,
}

fn share(part: usize, of: usize) -> String {
    if of == 0 { "–".to_owned() } else { format!("{part}/{of} ({:.1} %)", 100.0 * part as f64 / of as f64) }
}

fn names(outcome: &Outcome) -> String {
    let mut text = outcome.missing.join(", ");
    if !outcome.ambiguous_with.is_empty() {
        text += &format!(" (or {})", outcome.ambiguous_with.join(", "));
    }
    text
}

/// Logs of another simulator, one line each.
pub fn foreign(lines: &[Line]) -> String {
    let mut text = "| case | verdict | missing | first candidate | ΔBIC | visible | rms/noise before, after | right | s |\n".to_owned();
    text += "|---|---|---|---|---|---|---|---|---|\n";
    let mut right = 0;
    for line in lines {
        let o = &line.outcome;
        let ok = is_right(line);
        right += usize::from(ok);
        let (first, bic) = o.candidates.first().map_or((String::new(), None), |c| (c.0.clone(), c.1));
        text += &format!(
            "| {} | {} | {} | {first} | {} | {} | {:.2}, {:.2} | {} | {:.1} |\n",
            line.id,
            o.verdict,
            names(o),
            bic.map_or(String::new(), |b| format!("{b:.0}")),
            if o.visible.is_empty() { "" } else { "yes" },
            o.ratio_before,
            o.ratio_after,
            if ok { "yes" } else { "**no**" },
            o.seconds
        );
    }
    text + &format!("\nright: {}\n", share(right, lines.len()))
}

/// Correct results. Nothing hidden: adequate. One effect: named first, or one of its family; or no effect named where it is not visible. Several
/// effects: all added. A disturbance outside the catalogue: unknown structure.
pub fn is_right(line: &Line) -> bool {
    match line.hidden.as_slice() {
        [] => line.outcome.verdict == "adequate",
        [one] if cards().iter().any(|c| c.id == one) => {
            let o = &line.outcome;
            o.names_family_first(one) || (o.visible.is_empty() && o.verdict == "adequate")
        }
        [_] => line.outcome.verdict == "unknown-structure",
        several => several.iter().all(|e| line.outcome.adds(e)),
    }
}

/// One hidden effect per log.
pub fn own(lines: &[Line]) -> String {
    let mut text = "| hidden | logs | visible | of these named first | with its family | not visible: adequate | wrong first name | names too many | largest seconds |\n".to_owned();
    text += "|---|---|---|---|---|---|---|---|---|\n";
    let mut confused: BTreeMap<(String, String), Vec<String>> = BTreeMap::new();
    let mut all: Vec<&Line> = Vec::new();
    for card in cards() {
        let of: Vec<&Line> = lines.iter().filter(|l| l.hidden.iter().any(|h| h == card.id)).collect();
        if !of.is_empty() {
            text += &own_line(card.id, &of);
        }
        for line in &of {
            let o = &line.outcome;
            let to = o.missing.first().map_or(o.verdict.clone(), |m| stem(m).to_owned());
            let seen = !o.visible.is_empty();
            if !o.names_family_first(card.id) && (seen || !o.missing.is_empty()) {
                confused.entry((card.id.to_owned(), to)).or_default().push(line.id.clone());
            }
        }
        all.extend(of);
    }
    text += &own_line("**all**", &all);
    text += "\nConfused (visible ones, and whatever was named instead):\n\n";
    for ((hidden, named), ids) in &confused {
        text += &format!("- {hidden} → {named}: {} ({})\n", ids.len(), ids.join(", "));
    }
    text + &added(lines)
}

fn own_line(name: &str, of: &[&Line]) -> String {
    let hidden = |l: &Line| l.hidden.first().cloned().unwrap_or_default();
    let visible: Vec<&&Line> = of.iter().filter(|l| !l.outcome.visible.is_empty()).collect();
    let unseen: Vec<&&Line> = of.iter().filter(|l| l.outcome.visible.is_empty()).collect();
    let first = visible.iter().filter(|l| l.outcome.names_first(&hidden(l))).count();
    let family = visible.iter().filter(|l| l.outcome.names_family_first(&hidden(l))).count();
    let adequate = unseen.iter().filter(|l| l.outcome.verdict == "adequate").count();
    let wrong = of.iter().filter(|l| !l.outcome.missing.is_empty() && !l.outcome.names_family_first(&hidden(l))).count();
    let many = of.iter().filter(|l| l.outcome.missing.len() > 1).count();
    let longest = of.iter().map(|l| l.outcome.seconds).fold(0.0, f64::max);
    format!(
        "| {name} | {} | {} | {} | {} | {} | {wrong} | {many} | {longest:.1} |\n",
        of.len(),
        visible.len(),
        share(first, visible.len()),
        share(family, visible.len()),
        share(adequate, unseen.len())
    )
}

/// Residual after all additions, and coverage of the added parameters' intervals.
fn added(lines: &[Line]) -> String {
    let found: Vec<&Outcome> = lines.iter().map(|l| &l.outcome).filter(|o| !o.missing.is_empty()).collect();
    let mut ratios: Vec<f64> = found.iter().map(|o| o.ratio_after).collect();
    ratios.sort_by(f64::total_cmp);
    let at =
        |part: f64| ratios.get(((ratios.len() as f64 * part) as usize).min(ratios.len().saturating_sub(1))).copied().unwrap_or(f64::NAN);
    let (covered, of) = found.iter().fold((0, 0), |(c, n), o| (c + o.covered(), n + o.deviations.len()));
    let mut text = format!(
        "\nHeld-out rms over noise once everything is added, {} logs: median {:.3}, 95 % below {:.3}, largest {:.3}.\n",
        ratios.len(),
        at(0.5),
        at(0.95),
        at(1.0)
    );
    text += &format!("95 % intervals of rightly added effects cover the truth: {}.\n", share(covered, of));
    let mut by_name: BTreeMap<&str, (usize, usize)> = BTreeMap::new();
    for (name, off) in found.iter().flat_map(|o| &o.deviations) {
        let entry = by_name.entry(name).or_default();
        entry.0 += usize::from(off.abs() < crate::TWO_SIDED_95);
        entry.1 += 1;
    }
    let low = by_name.iter().filter(|(_, (c, n))| (*c as f64) < 0.8 * *n as f64);
    for (name, (c, n)) in low {
        text += &format!("- {name}: {}\n", share(*c, *n));
    }
    text
}

/// Several hidden effects per log.
pub fn several(lines: &[Line]) -> String {
    let mut text = "| hidden at once | logs | all visible ones added | all added | logs with a name that is not there | hidden ones visible | of these added | seconds, largest |\n".to_owned();
    text += "|---|---|---|---|---|---|---|---|\n";
    for n in 2..=5 {
        let of: Vec<&Line> = lines.iter().filter(|l| l.hidden.len() == n).collect();
        if of.is_empty() {
            continue;
        }
        let seen = of.iter().filter(|l| l.outcome.visible.iter().all(|e| l.outcome.adds(e))).count();
        let whole = of.iter().filter(|l| is_right(l)).count();
        let extra = of.iter().filter(|l| !extra(l).is_empty()).count();
        let visible: usize = of.iter().map(|l| l.outcome.visible.len()).sum();
        let found: usize = of.iter().map(|l| l.outcome.visible.iter().filter(|e| l.outcome.adds(e)).count()).sum();
        let longest = of.iter().map(|l| l.outcome.seconds).fold(0.0, f64::max);
        text += &format!(
            "| {n} | {} | {} | {} | {} | {visible} of {} | {} | {longest:.1} |\n",
            of.len(),
            share(seen, of.len()),
            share(whole, of.len()),
            share(extra, of.len()),
            n * of.len(),
            share(found, visible)
        );
    }
    text += "\n| log | hidden (visible in bold) | added, in order | not there |\n|---|---|---|---|\n";
    for line in lines {
        let bold = |e: &String| if line.outcome.visible.contains(e) { format!("**{e}**") } else { e.clone() };
        let hidden: Vec<String> = line.hidden.iter().map(bold).collect();
        text += &format!("| {} | {} | {} | {} |\n", line.id, hidden.join(", "), names(&line.outcome), extra(line).join(", "));
    }
    text + &added(lines)
}

/// Added effects that are not there; the first counts as there where the log does not distinguish it from a hidden one.
pub fn extra(line: &Line) -> Vec<&str> {
    let family =
        |m: &str| line.outcome.ambiguous_with.iter().any(|a| line.hidden.iter().any(|h| stem(a) == h)) && line.outcome.missing[0] == m;
    line.outcome.missing.iter().filter(|m| !line.hidden.iter().any(|h| stem(m) == h) && !family(m)).map(String::as_str).collect()
}

/// Nothing hidden: `group(id)` names the rows of the table.
pub fn nulls(lines: &[Line], group: impl Fn(&str) -> String) -> String {
    let mut text = "| logs of | logs | adequate | an effect named | unknown structure | refused |\n|---|---|---|---|---|---|\n".to_owned();
    let mut groups: BTreeMap<String, Vec<&Line>> = BTreeMap::new();
    for line in lines {
        groups.entry(group(&line.id)).or_default().push(line);
    }
    let all = lines.iter().collect();
    for (name, of) in groups.iter().chain([(&"all".to_owned(), &all)]) {
        let with = |verdict: &str| of.iter().filter(|l| l.outcome.verdict == verdict).count();
        let refused = with("bad-log") + with("error");
        text += &format!(
            "| {name} | {} | {} | {} | {} | {refused} |\n",
            of.len(),
            share(with("adequate"), of.len()),
            share(with("effect-found"), of.len()),
            share(with("unknown-structure"), of.len())
        );
    }
    text += "\nFalse alarms:\n\n";
    for line in lines.iter().filter(|l| l.outcome.verdict != "adequate") {
        let what = if line.outcome.error.is_empty() { names(&line.outcome) } else { line.outcome.error.clone() };
        text += &format!("- {}: {} {what}\n", line.id, line.outcome.verdict);
    }
    text
}

/// One disturbance outside the catalogue per log.
pub fn outsiders(lines: &[Line]) -> String {
    let mut text = "| outside | logs | unknown structure | an effect named, nothing left | adequate | expression proposed | first coordinate | rms/noise before, after (median) |\n".to_owned();
    text += "|---|---|---|---|---|---|---|---|\n";
    let mut groups: BTreeMap<&str, Vec<&Line>> = BTreeMap::new();
    for line in lines {
        groups.entry(line.hidden.first().map_or("", String::as_str)).or_default().push(line);
    }
    for (name, of) in &groups {
        let with = |verdict: &str| of.iter().filter(|l| l.outcome.verdict == verdict).count();
        let mut coordinates: BTreeMap<&str, usize> = BTreeMap::new();
        for line in of {
            *coordinates.entry(&line.outcome.coordinate).or_default() += 1;
        }
        let coordinates: Vec<String> = coordinates.iter().map(|(c, n)| format!("{c} {n}")).collect();
        let median = |of_outcome: fn(&Outcome) -> f64| {
            let mut list: Vec<f64> = of.iter().map(|l| of_outcome(&l.outcome)).collect();
            list.sort_by(f64::total_cmp);
            list[list.len() / 2]
        };
        text += &format!(
            "| {name} | {} | {} | {} | {} | {} | {} | {:.2}, {:.2} |\n",
            of.len(),
            share(with("unknown-structure"), of.len()),
            share(with("effect-found"), of.len()),
            share(with("adequate"), of.len()),
            share(of.iter().filter(|l| l.outcome.drawn).count(), of.len()),
            coordinates.join(", "),
            median(|o| o.ratio_before),
            median(|o| o.ratio_after)
        );
    }
    text += "\n| log | verdict | added | left over noise |\n|---|---|---|---|\n";
    for line in lines {
        let o = &line.outcome;
        text += &format!("| {} | {} | {} | {:.2} |\n", line.id, o.verdict, names(o), o.ratio_after);
    }
    text
}

/// Names of [`csv_record`]'s fields.
pub const CSV_FIELDS: [&str; 18] = [
    "group",
    "engine",
    "id",
    "hidden",
    "verdict",
    "missing",
    "ambiguous_with",
    "visible",
    "right",
    "margin_bic",
    "ratio_before",
    "ratio_after",
    "coordinate",
    "candidates",
    "deviations_sigma",
    "seconds",
    "error",
    "parameters",
];

/// One log as a record of a CSV, for the analysis of failures and for [`crate::campaigns`]. Logs of one group and id are equal.
pub fn csv_record(group: &str, engine: &str, line: &Line) -> [String; 18] {
    let o = &line.outcome;
    let candidates: Vec<String> = o.candidates.iter().map(|(name, bic)| bic.map_or(name.clone(), |b| format!("{name} {b:.0}"))).collect();
    let deviations: Vec<String> = o.deviations.iter().map(|(name, off)| format!("{name} {off:+.4}")).collect();
    [
        group.to_owned(),
        engine.to_owned(),
        line.id.clone(),
        line.hidden.join("; "),
        o.verdict.clone(),
        o.missing.join("; "),
        o.ambiguous_with.join("; "),
        o.visible.join("; "),
        is_right(line).to_string(),
        format!("{:.0}", o.margin),
        format!("{:.4}", o.ratio_before),
        format!("{:.4}", o.ratio_after),
        o.coordinate.clone(),
        candidates.join("; "),
        deviations.join("; "),
        format!("{:.2}", o.seconds),
        o.error.clone(),
        line.description.clone(),
    ]
}
