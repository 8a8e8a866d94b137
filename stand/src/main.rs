//! The command `stand`: arguments in, exit status out.
//!
//! Each command parses its arguments, makes one library call and passes the result to [`stand_report`]. Every command that computes takes
//! `--json FILE` (`-`: standard output, which then carries nothing else); commands with plots take `--html FILE`. Exit status: 0 the
//! command finished, whatever the result; 2 the arguments or the input are wrong; 1 any other failure.

mod allan;
mod calibrate;
mod certificate;
mod compare;
mod compensate;
mod console;
mod convert;
mod demonstration;
mod drift;
mod drift_output;
mod drift_run;
mod effects;
mod error;
mod explain;
mod fit;
mod fleet;
mod import;
mod lab;
mod model;
mod observer;
mod output;
mod panel;
mod processor;
mod profile;
mod record;
mod records;
mod schema;
mod settings;
mod shell;
mod signals;
mod sim;
mod sim_serve;
mod stability;
mod stand_file;
mod vibration;

use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};

use error::{CliError, exit_code};

/// Rotary stand: run and record it, compare models with logs, fit parameters, identify missing effects, calibrate sensors
///
/// Without a command: a demonstration on the simulated stand; its files are written to the folder `out`.
#[derive(Debug, Parser)]
#[command(name = "stand", version, about)]
struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Simulate the stand with its firmware and write a log, or serve it as a serial port
    Sim(sim::Sim),
    /// Compare a model with a log, without changing its parameters
    Compare(compare::Compare),
    /// Fit the parameters of a model to a log, with standard uncertainties
    Fit(fit::Fit),
    /// Identify the physical effect that a model lacks, with the evidence
    ///
    /// Several logs are fitted together with one set of parameters. The logs of a folder are explained separately, in parallel; the result
    /// is a table with one line for each log. With --table the table is a Parquet file, subfolders count, and an interrupted run continues.
    Explain(explain::Explain),
    /// Compare the stands of tables that stand explain --table has written
    #[command(subcommand)]
    Fleet(fleet::Fleet),
    /// Calibrate a rate gyro, an accelerometer or the drive: session, calibration record, uncertainty budgets
    Calibrate(Box<calibrate::Calibrate>),
    /// List, show, recompute and trend calibration records
    #[command(subcommand)]
    Records(records::Records),
    /// Write a certificate of a calibration: a page for print, and a Digital Calibration Certificate
    Certificate(Box<certificate::CertificateCommand>),
    /// Write friction and cogging into the firmware's feed-forward compensation
    Compensate(compensate::Compensate),
    /// Save the settings of a stand in a file, or restore them from a file
    #[command(subcommand)]
    Settings(settings::Settings),
    /// Open a command console to a stand over its serial port
    Console(console::Console),
    /// Show a stand on a page of this computer: drive it, record, compare, explain
    Panel(panel::Panel),
    /// Run a profile on a stand and record its measurements
    Record(record::Record),
    /// Measure the drift of a gyroscope with torque pulses of alternating sign, or compute it from logs
    #[command(subcommand)]
    Drift(drift::Drift),
    /// Allan deviation of a sensor at rest: angle random walk, bias instability, other noise coefficients
    Allan(allan::Allan),
    /// Rate stability of the platform over 1°, 10°, 360° and whole turns
    Stability(stability::Stability),
    /// Examine logs, also those of other programs, and accept how they are read
    #[command(subcommand)]
    Log(import::LogCommand),
    /// Convert a log between CSV and Parquet
    Convert(convert::Convert),
    /// Create, show or edit a model file
    #[command(subcommand)]
    Model(model::ModelCommand),
    /// Design and simulate state observers of a gyrotheodolite
    #[command(subcommand)]
    Observer(observer::ObserverCommand),
    /// Compensate the effect of vibration on an azimuth
    #[command(subcommand)]
    Vibration(vibration::VibrationCommand),
    /// The works of the laboratory course: start, check, report, grade
    #[command(subcommand)]
    Lab(lab::LabCommand),
    /// List the catalogue of physical effects, or describe one effect
    Effects(effects::Effects),
    /// Print the JSON schemas of the answers that --json writes
    Schema(schema::SchemaCommand),
    /// Print a completion script for a shell: bash, zsh, fish, PowerShell or elvish
    Completions(shell::Completions),
    /// Print the man page of stand, or write the man pages of all commands to a folder
    Man(shell::ManPages),
}

fn main() -> ExitCode {
    processor::continue_as_faster_build();
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => {
            if error.use_stderr() {
                return exit_code(Err(CliError::Input(error::one_line(&error.to_string()))));
            }
            // A closed pipe after `--help` is not an error of this program.
            let _ = error.print();
            return ExitCode::SUCCESS;
        }
    };
    let result: Result<(), CliError> = match arguments.command {
        None => demonstration::run(),
        Some(Command::Sim(sim)) => sim.run(),
        Some(Command::Compare(compare)) => compare.run(),
        Some(Command::Fit(fit)) => fit.run(),
        Some(Command::Explain(explain)) => explain.run(),
        Some(Command::Fleet(fleet)) => fleet.run(),
        Some(Command::Calibrate(calibrate)) => calibrate.run(),
        Some(Command::Records(records)) => records.run(),
        Some(Command::Certificate(certificate)) => certificate.run(),
        Some(Command::Compensate(compensate)) => compensate.run(),
        Some(Command::Settings(settings)) => settings.run(),
        Some(Command::Console(console)) => console.run(),
        Some(Command::Panel(panel)) => panel.run(),
        Some(Command::Record(record)) => record.run(),
        Some(Command::Drift(drift)) => drift.run(),
        Some(Command::Allan(allan)) => allan.run(),
        Some(Command::Stability(stability)) => stability.run(),
        Some(Command::Log(log)) => log.run(),
        Some(Command::Convert(convert)) => convert.run(),
        Some(Command::Model(model)) => model.run(),
        Some(Command::Observer(observer)) => observer.run(),
        Some(Command::Vibration(vibration)) => vibration.run(),
        Some(Command::Lab(lab)) => lab.run(),
        Some(Command::Effects(effects)) => effects.run(),
        Some(Command::Schema(schema)) => schema.run(),
        Some(Command::Completions(completions)) => completions.run(Arguments::command()),
        Some(Command::Man(man)) => man.run(Arguments::command()),
    };
    exit_code(result)
}
