//! Campaigns of `explain`: runs a set of logs, compares the answers with the accepted ones, prints tables.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Parser, Subcommand, ValueEnum};
use stand_tests::campaign::compare::{difference, table};
use stand_tests::campaign::planted;
use stand_tests::campaign::record::{AnswerRecord, LogRecord, baselines, read, write};
use stand_tests::campaign::run::{answered, folder, generated, resumed};
use stand_tests::campaign::sets::Set;

/// Runs the campaigns behind docs/figures.md. Interrupted runs go on where they were.
#[derive(Parser)]
#[command(version)]
struct Campaign {
    #[command(subcommand)]
    command: Command,
}

#[derive(Clone, Copy, ValueEnum)]
enum SetName {
    Daily,
    Release,
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
    /// Compares the last run of a set with the accepted answers
    Diff {
        #[arg(long, value_enum, default_value_t = SetName::Daily)]
        set: SetName,
    },
    /// Takes the last run of a set as the accepted answers
    Accept {
        #[arg(long, value_enum, default_value_t = SetName::Daily)]
        set: SetName,
    },
    /// Prints the table of the accepted answers of a set
    Table {
        #[arg(long, value_enum, default_value_t = SetName::Daily)]
        set: SetName,
    },
    /// Makes the logs of a set and keeps their hashes, and which hidden effects are visible: after a change of the simulator
    Logs {
        #[arg(long, value_enum, default_value_t = SetName::Daily)]
        set: SetName,
    },
    /// Plants effects at the detection limits of logs with nothing missing, and compares with the accepted results
    Planted {
        /// Number of logs
        #[arg(long, default_value_t = 120)]
        logs: u64,
        /// Take the results as accepted
        #[arg(long)]
        accept: bool,
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

fn set_of(name: SetName) -> Set {
    match name {
        SetName::Daily => Set::Daily,
        SetName::Release => Set::Release,
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

fn run(command: Command) -> Result<bool, String> {
    let data = std::env::var_os("STAND_DATA").map(PathBuf::from);
    let data = data.as_deref();
    match command {
        Command::Explain { set, only, every, check } => {
            let set = set_of(set);
            let (logs, accepted, last) = files(set);
            let is_named = |id: &String| only.is_empty() || only.iter().any(|text| id.contains(text));
            let ids: Vec<String> = set.ids(data).into_iter().step_by(every.max(1)).filter(is_named).collect();
            let answers = resumed(&last, &ids, |id| answered(id, data))?;
            let d = difference(&read::<LogRecord>(&logs)?, &read::<AnswerRecord>(&accepted)?, &answers);
            println!("{}", d.text);
            Ok(!check || d.is_empty())
        }
        Command::Diff { set } => {
            let (logs, accepted, last) = files(set_of(set));
            let d = difference(&read::<LogRecord>(&logs)?, &read::<AnswerRecord>(&accepted)?, &read::<AnswerRecord>(&last)?);
            println!("{}", d.text);
            Ok(d.is_empty())
        }
        Command::Accept { set } => {
            let set = set_of(set);
            let (_, accepted, last) = files(set);
            let new = read::<AnswerRecord>(&last)?;
            let find = |id: &String| {
                new.iter()
                    .find(|answer| answer.id == *id)
                    .cloned()
                    .ok_or_else(|| format!("{id}: not answered; run `campaign explain --set {}` to its end", set.name()))
            };
            write(&accepted, &set.ids(data).iter().map(find).collect::<Result<Vec<_>, _>>()?)?;
            println!("{}", accepted.display());
            Ok(true)
        }
        Command::Table { set } => {
            let (logs, accepted, _) = files(set_of(set));
            println!("{}", table(&read(&logs)?, &read(&accepted)?));
            Ok(true)
        }
        Command::Logs { set } => {
            let set = set_of(set);
            let (logs, _, _) = files(set);
            let path = folder().join(format!("explain-{}-logs.csv", set.name()));
            write(&logs, &resumed(&path, &set.ids(data), |id| generated(id, data))?)?;
            println!("{}", logs.display());
            Ok(true)
        }
        Command::Planted { logs, accept } => {
            let found = resumed(&folder().join("planted.csv"), &planted::ids(logs), planted::planted)?;
            let path = baselines().join("planted.csv");
            println!("{}", planted::text(&read(&path)?, &found));
            if accept { write(&path, &found).map(|()| true) } else { Ok(true) }
        }
        Command::Write { id, folder } => write_log(&id, &folder, data).map(|()| true),
    }
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
