//! Files of other programs (`stand_tests::programs`): nothing about them is believed wrongly, what is not certain is asked, and their
//! numbers arrive.

use std::path::Path;

use identification::log::Log;
use identification::log::import::{self, Inspection, Statements};
use stand_report::{inspection as report, log_warning};
use stand_tests::draw::Drawn;
use stand_tests::programs::{ForeignFile, corpus};

/// The options as the command reads them.
fn statements(words: &[&str]) -> Statements {
    let mut s = Statements::default();
    for pair in words.chunks(2) {
        let [option, value] = pair else { panic!("an option without a value: {words:?}") };
        let split = || value.split_once('=').map(|(a, b)| (a.to_owned(), b.to_owned())).expect("NAME=VALUE");
        match *option {
            "--map" => s.columns.push(split()),
            "--unit" => s.units.push(split()),
            "--note" => s.notes.push(split()),
            "--sample-rate" => s.sample_rate_Hz = value.parse().ok(),
            other => panic!("no option {other}"),
        }
    }
    s
}

/// What arrives of a file beside what the log has.
fn check(file: &ForeignFile, own: &Log, folder: &Path) -> Result<(), String> {
    let path = folder.join(file.name);
    std::fs::write(&path, &file.bytes).map_err(|e| e.to_string())?;
    let shown = import::inspect(&path, &Statements::default()).map_err(|e| e.to_string())?;
    let known = |inspection: &Inspection, column: &str| inspection.mapping.columns.values().any(|c| c.is == column);
    // Without the statements, something is asked, or a column that they name is not known: nothing is believed in its place.
    if !file.stated.is_empty() && report::open_question(&shown).is_none() {
        let read_wrong = file
            .columns
            .iter()
            .filter(|(column, _)| known(&shown, column))
            .find_map(|(column, tolerance)| arrives(&path, &shown, own, file, column, *tolerance).err());
        if let Some(wrong) = read_wrong {
            return Err(format!("a wrong belief is not asked: {wrong}\n{}", report::text(&shown)));
        }
    }
    let stated = import::inspect(&path, &statements(file.stated)).map_err(|e| e.to_string())?;
    if let Some(open) = report::open_question(&stated) {
        return Err(format!("open: {open}\n{}", report::text(&stated)));
    }
    for (column, tolerance) in file.columns {
        arrives(&path, &stated, own, file, column, *tolerance)?;
    }
    let text = report::text(&shown);
    stated.mapping.write_beside(&path).map_err(|e| e.to_string())?;
    let log = Log::read(&path).map_err(|e| e.to_string())?;
    let said: Vec<String> = log.warnings().iter().map(log_warning).collect();
    std::fs::remove_file(import::file_of(&path)).map_err(|e| e.to_string())?;
    if !(text + &said.join(" ")).contains(file.said) {
        return Err(format!("“{}” is not said: {}\n{said:?}", file.said, report::text(&shown)));
    }
    Ok(())
}

fn arrives(path: &Path, inspection: &Inspection, own: &Log, file: &ForeignFile, column: &str, tolerance: f64) -> Result<(), String> {
    inspection.mapping.write_beside(path).map_err(|e| e.to_string())?;
    let read = Log::read(path);
    std::fs::remove_file(import::file_of(path)).map_err(|e| e.to_string())?;
    let read = read.map_err(|e| e.to_string())?;
    let (begin, rows) = file.rows;
    let wanted = own.column(column).ok_or("no such column in the log")?.get(begin..begin + rows).ok_or("too few rows")?;
    let found = read.column(column).ok_or_else(|| format!("{column} does not arrive"))?;
    if found.len() < rows {
        return Err(format!("{column}: {} of {rows} rows arrive", found.len()));
    }
    // A clock may begin anywhere.
    let zero = |v: &[f64]| if column == "t_s" { v.first().copied().unwrap_or(0.0) } else { 0.0 };
    let (wanted_zero, found_zero) = (zero(wanted), zero(found));
    let largest = wanted.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let (worst, row) = wanted
        .iter()
        .zip(found)
        .enumerate()
        .map(|(row, (a, b))| ((a - wanted_zero - (b - found_zero)).abs(), row))
        .fold((0.0, 0), |m, d| if d.0 > m.0 { d } else { m });
    if worst > tolerance * largest { Err(format!("{column}: row {} is off by {worst:e} of {largest:e}", row + 1)) } else { Ok(()) }
}

fn log() -> Log {
    Drawn::by_name("nulls/voltage/multi-step/7001").expect("a log of the table").log()
}

#[test]
fn files_of_other_programs_arrive_or_are_asked() {
    let folder = tempfile::tempdir().expect("a folder");
    let own = log();
    let files = corpus(&own);
    assert!(files.len() > 45, "{}", files.len());
    let failed: Vec<String> =
        files.iter().filter_map(|file| check(file, &own, folder.path()).err().map(|e| format!("{}: {e}", file.name))).collect();
    assert!(failed.is_empty(), "{} of {}:\n{}", failed.len(), files.len(), failed.join("\n"));
}
