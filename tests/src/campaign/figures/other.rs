//! Planted effects, limits of the firmware, and commands that measure the rest.

use super::super::judge::upper_limit;
use super::super::planted::{Fate, PlantedRecord};
use super::{Sources, grouped, table};

/// Limits of firmware/budget.toml: key, what is limited, unit.
const LIMITS: [(&str, &str, &str); 10] = [
    ("image_bytes", "flash of the image", "bytes"),
    ("static_ram_bytes", "static RAM", "bytes"),
    ("stack_frame_bytes", "largest stack frame of a function", "bytes"),
    ("whole_handler_instructions", "control interrupt (10 kHz), worst case", "instructions"),
    ("whole_handler_cycles", "control interrupt, worst case; 18 000 between two", "cycles"),
    ("tick_latency_cycles", "control interrupt, delay of its start", "cycles"),
    ("cpu_load_percent", "CPU load", "%"),
    ("stack_free_percent", "stack that stays free, at least", "%"),
    ("row_instructions", "a row of the measurement (1 kHz)", "instructions"),
    ("observer_step_instructions", "a step of an observer with seven states", "instructions"),
];

/// Measurements without committed results: command, what it prints.
const OTHER: [(&str, &str); 13] = [
    (
        "cargo bench -p stand-tests --bench foreign_cases",
        "fits of the true effects to the logs of another simulator: χ²/n, largest deviation (`STAND_DATA`)",
    ),
    (
        "cargo test -p stand-tests --test identification real_records -- --include-ignored --nocapture",
        "records of real drives, compared with what their authors published (`STAND_DATA`)",
    ),
    (
        "cargo run -p stand-tests --example where_it_fails -- 60",
        "residual analysis: coordinate found first, false entries of 120 logs with nothing missing",
    ),
    ("cargo bench -p stand-tests --bench sensor -- 300 1", "errors of a sensor under test: named, missed, false names"),
    ("cargo bench -p stand-tests --bench voltage_slope", "shaft and play under the speed loop, with and without the column `u_slope_V`"),
    ("cargo bench -p stand-tests --bench fits", "time of a fit; an hour-long log"),
    ("cargo bench -p stand-tests --bench sizes", "time and memory of `import`, `compare`, `fit`, `explain` by size of the log"),
    ("cargo bench -p stand-tests --bench allan", "time of the Allan deviation beside allantools; memory of long logs"),
    ("cargo bench -p stand-tests --bench drift_monte_carlo", "errors of the three-axis drift measurement beside [theory.md](theory.md)"),
    ("cargo bench -p hal-sim --bench times_real_time", "speed of the simulated stand, times real time"),
    (
        "LAB_SEEDS=200 cargo test -p stand --test lab honest_student -- --include-ignored --nocapture",
        "laboratory course: attempts of a scripted student that fail a work",
    ),
    ("scripts/build-firmware.sh", "flash, RAM, stack frames and call graphs of the firmware image"),
    (
        "cargo test -p chip-sim --test chip budget -- --include-ignored --nocapture",
        "instructions and cycles of interrupt, measurement and observer on the [emulated chip](emulated-chip.md#costs)",
    ),
];

/// The sections.
///
/// # Errors
/// A limit of the firmware has no description.
pub fn sections(sources: &Sources) -> Result<String, String> {
    Ok([planted(&sources.planted), budget(&sources.budget)?, commands()].join("\n"))
}

fn planted(records: &[PlantedRecord]) -> String {
    let count = |fate: Fate| records.iter().filter(|record| record.fate() == fate).count();
    let [named, wrong, missed] = [Fate::Named, Fate::OtherName, Fate::Missed].map(count);
    let all = named + wrong + missed;
    let percent = |of: f64| format!("{:.0} %", 100.0 * of);
    let row = vec![
        all.to_string(),
        format!("{named} ({})", percent(named as f64 / all.max(1) as f64)),
        wrong.to_string(),
        missed.to_string(),
        percent(upper_limit(wrong + missed, all)),
    ];
    let lines: Vec<Vec<String>> = records
        .iter()
        .filter(|record| matches!(record.fate(), Fate::OtherName | Fate::Missed))
        .map(|r| {
            vec![format!("`{}`", r.id), r.effect.clone(), format!("{:.2e}", r.size), format!("`{}`", r.verdict), r.missing.0.join(", ")]
        })
        .collect();
    format!(
        "\
## Detection limits

Where nothing is missing, `explain` states for each effect the smallest amplitude that it would have found with a probability of 95 % ([explaining.md](explaining.md#detection-limits)). An effect is planted at that limit, the effects in turn, the log is simulated again and explained. The aim is 95 % found.

{}
Not found (amplitude in the unit of the effect's parameter):

{}",
        table(&["planted", "named, or not distinguishable from what is named", "another name", "nothing named", "not found: upper 95 % limit"], &[row]),
        table(&["log", "planted", "amplitude", "verdict", "named"], &lines)
    )
}

fn budget(limits: &toml::Table) -> Result<String, String> {
    let file = "firmware/budget.toml";
    if let Some(key) = limits.keys().find(|key| LIMITS.iter().all(|(name, ..)| name != key)) {
        return Err(format!("{file}: {key} has no description"));
    }
    let row = |(key, title, unit): &(&str, &str, &str)| {
        let value = limits.get(*key).and_then(toml::Value::as_integer).and_then(|value| u64::try_from(value).ok());
        let value = value.ok_or_else(|| format!("{file}: no number {key}"))?;
        Ok(vec![(*title).to_owned(), grouped(value), (*unit).to_owned()])
    };
    let rows = LIMITS.iter().map(row).collect::<Result<Vec<_>, String>>()?;
    Ok(format!(
        "## Limits of the firmware\n\nFrom `{file}`. The build, and tests on the emulated chip, fail beyond them.\n\n{}",
        table(&["quantity", "limit", "unit"], &rows)
    ))
}

fn commands() -> String {
    let rows: Vec<Vec<String>> = OTHER.iter().map(|(command, prints)| vec![format!("`{command}`"), (*prints).to_owned()]).collect();
    format!(
        "## Other measurements\n\nNo results of these are committed: they depend on the machine, need records that are not part of this repository, or belong to another page.\n\n{}",
        table(&["command", "prints"], &rows)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_without_description_is_an_error() {
        let complete: toml::Table = LIMITS.iter().map(|(key, ..)| ((*key).to_owned(), toml::Value::Integer(1200))).collect();
        assert!(budget(&complete).is_ok_and(|text| text.contains("| static RAM | 1 200 | bytes |")));
        let mut more = complete.clone();
        more.insert("new_limit".to_owned(), toml::Value::Integer(1));
        assert!(budget(&more).is_err_and(|e| e.contains("new_limit")));
    }
}
