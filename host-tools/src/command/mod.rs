//! The command line: words in, exit status out.
//!
//! Every command that computes takes `--json FILE` (`-` for standard output, and then nothing else is printed there) and, where there is
//! something to see, `--html FILE`. Exit status: 0 it did its job, whatever it found; 2 the words or the input are wrong; 1 anything else.

mod allan;
mod calibrate;
mod calibrate_into;
mod compensate;
mod compensate_port;
mod console;
mod drift;
mod effects;
mod error;
mod explain;
mod explain_folder;
mod hold;
mod model;
mod observer;
mod output;
mod profile;
mod record;
mod records;
mod sim;
mod sim_serve;
mod story;
mod vibration;

use std::ffi::OsString;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

use error::{CliError, exit_code};

/// The rotary stand: run it, log it, hold a model against the log, see where it fails.
#[derive(Debug, Parser)]
#[command(name = "stand", version, about, disable_help_subcommand = true)]
struct Words {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run the firmware on the simulated stand, in virtual time, and write its log
    Sim(sim::Sim),
    /// Hold a model against a log, unchanged: where does it fail?
    Compare(hold::Compare),
    /// Fit a model's parameters to a log, with their uncertainties
    Fit(hold::Fit),
    /// Find the effect that a model lacks, with the evidence for it
    ///
    /// Several logs are fitted together, as one measurement with one set of parameters. A folder is another thing: each of its logs is
    /// explained by itself, over all cores, and a table says what came of each.
    Explain(explain::Explain),
    /// Calibrate a sensor on the platform, or the drive itself: a session, its record, each quantity with its uncertainty
    Calibrate(Box<calibrate::Calibrate>),
    /// Records of calibrations: listed, shown, computed again, followed over time
    #[command(subcommand)]
    Records(records::Records),
    /// Write what was learnt into the firmware's compensation, and see the ripple fall
    Compensate(compensate::Compensate),
    /// Talk to a stand over its serial line
    Console(console::Console),
    /// Run a profile on a stand and record what it measures
    Record(record::Record),
    /// A gyro's drift by pulses of alternating sign: measure it, or work it out from a log
    #[command(subcommand)]
    Drift(drift::Drift),
    /// The noise of a sensor at rest: Allan deviation, angle random walk, bias instability and the others
    Allan(allan::Allan),
    /// Make, show or change a model file
    #[command(subcommand)]
    Model(model::ModelCommand),
    /// State observers of a gyrotheodolite: gains, errors, frequency response
    #[command(subcommand)]
    Observer(observer::ObserverCommand),
    /// What vibration does to an azimuth
    #[command(subcommand)]
    Vibration(vibration::VibrationCommand),
    /// The catalogue of physical effects, or the account of one
    Effects(effects::Effects),
}

/// Runs the command of these words and gives its exit status.
pub fn run(words: impl IntoIterator<Item = OsString>) -> ExitCode {
    let words = match Words::try_parse_from(words) {
        Ok(words) => words,
        Err(error) => {
            if error.use_stderr() {
                return exit_code(Err(CliError::Input(error::in_one_line(&error.to_string()))));
            }
            // A closed pipe behind `--help` is no error of ours.
            let _ = error.print();
            return ExitCode::SUCCESS;
        }
    };
    let done: Result<(), CliError> = match words.command {
        None => story::run(),
        Some(Command::Sim(sim)) => sim.run(),
        Some(Command::Compare(compare)) => compare.run(),
        Some(Command::Fit(fit)) => fit.run(),
        Some(Command::Explain(explain)) => explain.run(),
        Some(Command::Calibrate(calibrate)) => calibrate.run(),
        Some(Command::Records(records)) => records.run(),
        Some(Command::Compensate(compensate)) => compensate.run(),
        Some(Command::Console(console)) => console.run(),
        Some(Command::Record(record)) => record.run(),
        Some(Command::Drift(drift)) => drift.run(),
        Some(Command::Allan(allan)) => allan.run(),
        Some(Command::Model(model)) => model.run(),
        Some(Command::Observer(observer)) => observer.run(),
        Some(Command::Vibration(vibration)) => vibration.run(),
        Some(Command::Effects(effects)) => effects.run(),
    };
    exit_code(done)
}
