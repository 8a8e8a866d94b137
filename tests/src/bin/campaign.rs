//! Campaigns: runs the analyses on simulated logs with known truth, compares the results with the accepted ones, prints tables and
//! docs/figures.md.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Parser, Subcommand, ValueEnum};
use stand_tests::campaign::compare::{difference, table};
use stand_tests::campaign::coverage::rows::CoverageRecord;
use stand_tests::campaign::figures::Sources;
use stand_tests::campaign::planted::PlantedRecord;
use stand_tests::campaign::record::{AnswerRecord, COVERAGE, LogRecord, PLANTED, baselines, read, write};
use stand_tests::campaign::run::{Identified, answered, folder, generated, resumed};
use stand_tests::campaign::sets::Set;
use stand_tests::campaign::{coverage, figures, planted};

/// Runs the campaigns behind docs/figures.md. Interrupted runs go on where they were.
#[derive(Parser)]
#[command(version)]
struct Campaign {
    #[command(subcommand)]
    command: Command,
}

/// Sets of logs for `explain`.
#[derive(Clone, Copy, ValueEnum)]
enum SetName {
    Daily,
    Release,
}

impl SetName {
    fn set(self) -> Set {
        match self {
            SetName::Daily => Set::Daily,
            SetName::Release => Set::Release,
        }
    }
}

/// Campaigns with accepted results.
#[derive(Clone, Copy, ValueEnum)]
enum Campaigns {
    /// Answers of `explain` to the daily set
    Daily,
    /// Answers of `explain` to the release set
    Release,
    /// Coverage of the uncertainties of `fit`, `calibrate`, `drift` and `allan`
    Coverage,
    /// Effects planted at the detection limits
    Planted,
}

#[derive(Subcommand)]
enum Command {
    /// Explains the logs of a set, and compares the answers with the accepted ones
    Explain {
        #[arg(long, value_enum, default_value_t = SetName::Daily)]
        set: SetName,
        /// Only logs whose name contains one of these texts
        only: Vec<String>,
        /// Every so many logs of the set
        #[arg(long, default_value_t = 1)]
        every: usize,
        /// Fail where an answer is other than the accepted one
        #[arg(long)]
        check: bool,
    },
    /// Simulates measurements with known truth, counts the 95 % intervals of `fit`, `calibrate`, `drift` and `allan` that contain it, and
    /// compares with the accepted counts
    Coverage {
        /// Only measurements whose name contains one of these texts, for example `drift/steady`
        only: Vec<String>,
        /// Measurements of each condition; other numbers than those of the baseline are not compared
        #[arg(long)]
        cases: Option<u64>,
        /// Fail where a count is other than the accepted one
        #[arg(long)]
        check: bool,
    },
    /// Plants effects at the detection limits of logs with nothing missing, and compares with the accepted results
    Planted {
        /// Number of logs
        #[arg(long, default_value_t = planted::LOGS)]
        logs: u64,
    },
    /// Compares the last run with the accepted results
    Diff {
        #[arg(long = "set", value_enum, default_value_t = Campaigns::Daily)]
        of: Campaigns,
    },
    /// Takes the last run as the accepted results
    Accept {
        #[arg(long = "set", value_enum, default_value_t = Campaigns::Daily)]
        of: Campaigns,
        /// With --set coverage: only conditions whose name begins with one of these texts, for example `allan`; the others keep their
        /// accepted results
        only: Vec<String>,
    },
    /// Prints the table of the accepted results
    Table {
        #[arg(long = "set", value_enum, default_value_t = Campaigns::Daily)]
        of: Campaigns,
    },
    /// Prints docs/figures.md from the accepted results
    Figures,
    /// Makes the logs of a set and keeps their hashes, and which hidden effects are visible: after a change of the simulator
    Logs {
        #[arg(long, value_enum, default_value_t = SetName::Daily)]
        set: SetName,
        /// Only logs whose name contains one of these texts; the others keep their lines
        only: Vec<String>,
    },
    /// Writes the log of a name, with the user's model, into a folder, for `stand explain`
    Write {
        /// Name of the log
        id: String,
        /// The folder
        folder: PathBuf,
    },
}

fn main() -> ExitCode {
    match run(Campaign::parse().command) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(message) => {
            eprintln!("campaign: {message}");
            ExitCode::from(2)
        }
    }
}

/// The files of a set: what the generator made, the accepted answers, the last run.
fn files(set: Set) -> (PathBuf, PathBuf, PathBuf) {
    let name = set.name();
    (
        baselines().join(format!("explain-{name}-logs.csv")),
        baselines().join(format!("explain-{name}.csv")),
        folder().join(format!("explain-{name}.csv")),
    )
}

/// The accepted results and the last run of a campaign that has one file.
fn two_files(name: &str) -> (PathBuf, PathBuf) {
    (baselines().join(name), folder().join(name))
}

fn is_named(only: &[String]) -> impl Fn(&String) -> bool {
    move |id| only.is_empty() || only.iter().any(|text| id.contains(text))
}

fn run(command: Command) -> Result<bool, String> {
    let data = std::env::var_os("STAND_DATA").map(PathBuf::from);
    let data = data.as_deref();
    match command {
        Command::Explain { set, only, every, check } => {
            let set = set.set();
            let (logs, accepted, last) = files(set);
            let ids: Vec<String> = set.ids(data).into_iter().step_by(every.max(1)).filter(is_named(&only)).collect();
            let answers = resumed(&last, &ids, |id| answered(id, data))?;
            let d = difference(&read::<LogRecord>(&logs)?, &read::<AnswerRecord>(&accepted)?, &answers);
            println!("{}", d.text);
            Ok(!check || d.is_empty())
        }
        Command::Coverage { only, cases, check } => {
            let (accepted, last) = two_files(COVERAGE);
            let ids: Vec<String> = coverage::ids(cases).into_iter().filter(is_named(&only)).collect();
            let rows = coverage::rows::rows(&resumed(&last, &ids, coverage::measured)?);
            println!("{}", coverage::rows::table(&rows));
            let c = coverage::changes::changes(&read(&accepted)?, &rows);
            println!("{}", c.text);
            Ok(!check || c.is_empty())
        }
        Command::Planted { logs } => {
            let (accepted, last) = two_files(PLANTED);
            let found = resumed(&last, &planted::ids(logs), planted::planted)?;
            println!("{}", planted::text(&read(&accepted)?, &found));
            Ok(true)
        }
        Command::Diff { of } => diff(of),
        Command::Accept { of, only } => accept(of, &only, data),
        Command::Table { of } => print_table(of).map(|()| true),
        Command::Figures => {
            print!("{}", figures::page(&Sources::committed()?)?);
            Ok(true)
        }
        Command::Logs { set, only } => {
            let set = set.set();
            let (logs, _, _) = files(set);
            let path = folder().join(format!("explain-{}-logs.csv", set.name()));
            let ids: Vec<String> = set.ids(data).into_iter().filter(is_named(&only)).collect();
            if let Some(text) = only.iter().find(|text| !ids.iter().any(|id| id.contains(*text))) {
                return Err(format!("{text}: no log of the set has this in its name"));
            }
            let mut made = resumed(&path, &ids, |id| generated(id, data))?;
            if !only.is_empty() {
                let mut all = read::<LogRecord>(&logs)?;
                for log in &mut all {
                    if let Some(k) = made.iter().position(|made| made.id == log.id) {
                        *log = made.swap_remove(k);
                    }
                }
                made = all;
            }
            write(&logs, &made)?;
            println!("{}", logs.display());
            Ok(true)
        }
        Command::Write { id, folder } => write_log(&id, &folder, data).map(|()| true),
    }
}

fn diff(of: Campaigns) -> Result<bool, String> {
    let of_set = |set: Set| {
        let (logs, accepted, last) = files(set);
        let d = difference(&read::<LogRecord>(&logs)?, &read::<AnswerRecord>(&accepted)?, &read::<AnswerRecord>(&last)?);
        println!("{}", d.text);
        Ok(d.is_empty())
    };
    match of {
        Campaigns::Daily => of_set(Set::Daily),
        Campaigns::Release => of_set(Set::Release),
        Campaigns::Coverage => {
            let (accepted, last) = two_files(COVERAGE);
            let c = coverage::changes::changes(&read(&accepted)?, &coverage::rows::rows(&read(&last)?));
            println!("{}", c.text);
            Ok(c.is_empty())
        }
        Campaigns::Planted => {
            let (accepted, last) = two_files(PLANTED);
            let (accepted, last) = (read(&accepted)?, read(&last)?);
            println!("{}", planted::text(&accepted, &last));
            Ok(accepted == last)
        }
    }
}

/// The records of these names, in their order.
fn complete<R: Identified + Clone>(records: &[R], ids: &[String], command: &str) -> Result<Vec<R>, String> {
    let find = |id: &String| {
        let found = records.iter().find(|record| record.id() == id).cloned();
        found.ok_or_else(|| format!("{id}: not run; run `campaign {command}` to its end"))
    };
    ids.iter().map(find).collect()
}

fn accept(of: Campaigns, only: &[String], data: Option<&Path>) -> Result<bool, String> {
    if !(only.is_empty() || matches!(of, Campaigns::Coverage)) {
        return Err("parts of a set can be accepted of `--set coverage` only".to_owned());
    }
    let of_set = |set: Set| {
        let (_, accepted, last) = files(set);
        let command = format!("explain --set {}", set.name());
        write(&accepted, &complete(&read::<AnswerRecord>(&last)?, &set.ids(data), &command)?).map(|()| accepted)
    };
    let accepted = match of {
        Campaigns::Daily => of_set(Set::Daily)?,
        Campaigns::Release => of_set(Set::Release)?,
        Campaigns::Coverage => {
            let (accepted, last) = two_files(COVERAGE);
            let all = coverage::ids(None);
            let is_chosen = |name: &str| only.is_empty() || only.iter().any(|part| name.starts_with(part.as_str()));
            let chosen: Vec<String> = all.iter().filter(|id| is_chosen(id)).cloned().collect();
            let mut rows = coverage::rows::rows(&complete(&read(&last)?, &chosen, "coverage")?);
            let condition = |row: &CoverageRecord| format!("{}/{}/", row.analysis, row.condition);
            if !only.is_empty() {
                rows.extend(read::<CoverageRecord>(&accepted)?.into_iter().filter(|row| !is_chosen(&condition(row))));
                rows.sort_by_key(|row| all.iter().position(|id| id.starts_with(&condition(row))));
            }
            write(&accepted, &rows)?;
            accepted
        }
        Campaigns::Planted => {
            let (accepted, last) = two_files(PLANTED);
            write(&accepted, &complete::<PlantedRecord>(&read(&last)?, &planted::ids(planted::LOGS), "planted")?)?;
            accepted
        }
    };
    println!("{}", accepted.display());
    Ok(true)
}

fn print_table(of: Campaigns) -> Result<(), String> {
    let of_set = |set: Set| {
        let (logs, accepted, _) = files(set);
        Ok::<_, String>(table(&read(&logs)?, &read(&accepted)?))
    };
    let text = match of {
        Campaigns::Daily => of_set(Set::Daily)?,
        Campaigns::Release => of_set(Set::Release)?,
        Campaigns::Coverage => coverage::rows::table(&read(&two_files(COVERAGE).0)?),
        Campaigns::Planted => planted::counts(&read(&two_files(PLANTED).0)?),
    };
    println!("{text}");
    Ok(())
}

fn write_log(id: &str, folder: &Path, data: Option<&Path>) -> Result<(), String> {
    let case = stand_tests::campaign::case::Case::by_name(id, data)?;
    std::fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    case.log.write(folder.join("log.parquet")).map_err(|e| e.to_string())?;
    case.user.write(folder.join("model.toml")).map_err(|e| e.to_string())?;
    if let Some(truth) = &case.truth {
        truth.write(folder.join("truth.toml")).map_err(|e| e.to_string())?;
    }
    println!(
        "{}: log.parquet, model.toml, truth.toml; hidden: {}",
        folder.display(),
        case.drawn.map_or(case.hidden.join(", "), |drawn| drawn.description())
    );
    Ok(())
}
