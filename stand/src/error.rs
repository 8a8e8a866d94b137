//! Errors of the command line: one line of text each, and the exit status.

use std::path::Path;
use std::process::ExitCode;

use identification::parameters::NamesParameters;
use stand_acquire::connection::ConnectionError;

/// The option that states each parameter of the library.
const OPTIONS: [(&str, &str); 31] = [
    ("angle_gain_V_rad", "--angle-gain"),
    ("columns", "--map"),
    ("element", "--element-error"),
    ("from_s", "--from"),
    ("gain_error", "--gain-error"),
    ("gamma_delay_s", "--gamma-delay-error"),
    ("gamma_gain", "--gamma-gain-error"),
    ("gamma_misalignment_rad", "--gamma-misalignment"),
    ("gamma_offset_rad", "--gamma-offset"),
    ("kind", "--what"),
    ("latitude_deg", "--latitude"),
    ("latitude_error_rad", "--latitude-error"),
    ("level_error_rad", "--level-error"),
    ("limit", "--limit"),
    ("log", "--log"),
    ("measure_cogging", "--measure-cogging"),
    ("model", "--into-model"),
    ("notes", "--note"),
    ("pulse_s", "--pulse"),
    ("quantity", "--quantity"),
    ("rate_rad_s", "--rate"),
    ("regulator", "--regulator"),
    ("sample_rate_Hz", "--sample-rate"),
    ("settle_s", "--settle"),
    ("step_s", "--step"),
    ("to_s", "--to"),
    ("torquer_N_m_A", "--torquer"),
    ("torquer_asymmetry", "--torquer-asymmetry"),
    ("torquer_gain_error", "--torquer-gain-error"),
    ("turn_error_rad", "--turn-error"),
    ("vibration_Hz", "--vibration-hz"),
];

/// Why a command failed.
#[derive(Debug, thiserror::Error)]
pub(super) enum CliError {
    /// The arguments or the input are wrong: exit status 2.
    #[error("{0}")]
    Input(String),
    /// Standard output was closed by its reader: exit status 0.
    #[error("standard output was closed")]
    ClosedPipe,
    /// Any other failure: exit status 1.
    #[error("{0}")]
    Other(String),
}

/// Conversions of library errors that are errors of the input and name parameters.
macro_rules! parameter_errors {
    ($($error:ty),* $(,)?) => {$(
        impl From<$error> for CliError {
            fn from(error: $error) -> Self {
                CliError::of_parameters(&error)
            }
        }
    )*};
}
parameter_errors!(
    identification::recording::prepare::PrepareError,
    stand_analysis::allan::AllanError,
    stand_analysis::compensate::LearnError,
    stand_analysis::observer::ObserverError,
    stand_analysis::observer::recorded::TrackError,
    stand_analysis::observer::vibration_log::VibrationLogError,
    stand_analysis::stability::StabilityError,
    stand_records::apply::ApplyError,
);

/// Conversions of library errors that are errors of the input.
macro_rules! input_errors {
    ($($error:ty),* $(,)?) => {$(
        impl From<$error> for CliError {
            fn from(error: $error) -> Self {
                CliError::Input(error.to_string())
            }
        }
    )*};
}
input_errors!(identification::identify::fit::FitError, hal_sim::plant::StandError,);

impl From<identification::log::LogError> for CliError {
    fn from(error: identification::log::LogError) -> Self {
        match &*error.kind {
            identification::log::LogErrorKind::Write(cause) => CliError::file(&error.path, "write", cause),
            kind if kind.may_be_of_another_program() => CliError::Input(format!(
                "{error}{}; stand log inspect {} shows how a file of another program is read",
                options(kind),
                error.path.display()
            )),
            kind => CliError::Input(format!("{error}{}", options(kind))),
        }
    }
}

impl From<identification::model::ModelError> for CliError {
    fn from(error: identification::model::ModelError) -> Self {
        match &*error.kind {
            identification::model::ModelErrorKind::Write(cause) => CliError::file(Path::new(&error.file), "write", cause),
            _ => CliError::Input(error.to_string()),
        }
    }
}

impl From<stand_acquire::link::LinkError> for CliError {
    fn from(error: stand_acquire::link::LinkError) -> Self {
        if error.is_input_error() { CliError::Input(error.to_string()) } else { CliError::Other(error.to_string()) }
    }
}

impl From<ConnectionError> for CliError {
    fn from(error: ConnectionError) -> Self {
        match error {
            ConnectionError::Link(error) => error.into(),
            rejected @ ConnectionError::Rejected { .. } => CliError::Input(rejected.to_string()),
            other => CliError::Other(other.to_string()),
        }
    }
}

impl From<hal_sim::session::SessionError> for CliError {
    fn from(error: hal_sim::session::SessionError) -> Self {
        match error {
            hal_sim::session::SessionError::Config(error) => CliError::Input(error.to_string()),
            other => CliError::Other(other.to_string()),
        }
    }
}

impl CliError {
    /// An error of the file at `path` while `action` was tried: a wrong name is an input error, a full disk is not.
    pub(super) fn file(path: &Path, action: &str, error: &std::io::Error) -> Self {
        use std::io::ErrorKind;
        let line = format!("{}: cannot {action}: {error}", path.display());
        match error.kind() {
            ErrorKind::NotFound | ErrorKind::IsADirectory | ErrorKind::NotADirectory => CliError::Input(line),
            ErrorKind::PermissionDenied if action == "read" => CliError::Input(line),
            ErrorKind::BrokenPipe => CliError::ClosedPipe,
            _ => CliError::Other(line),
        }
    }

    /// An input error of the library: its message, followed by the options that state the parameters which it names.
    pub(super) fn of_parameters(error: &(impl NamesParameters + std::fmt::Display)) -> Self {
        CliError::Input(format!("{error}{}", options(error)))
    }

    /// An input error in the file at `path`.
    pub(super) fn in_file(path: &Path, message: impl std::fmt::Display) -> Self {
        CliError::Input(format!("{}: {message}", path.display()))
    }
}

/// The options of the parameters that an error names, in parentheses; empty without any.
pub(super) fn options(error: &impl NamesParameters) -> String {
    let option = |name: &str| OPTIONS.iter().find(|(parameter, _)| *parameter == name).map(|(_, option)| *option);
    let named: Vec<&str> = error.parameters().into_iter().filter_map(option).collect();
    if named.is_empty() { String::new() } else { format!(" ({})", named.join(", ")) }
}

/// Prints the error on standard error; the exit status.
pub(super) fn exit_code(result: Result<(), CliError>) -> ExitCode {
    match result {
        Ok(()) | Err(CliError::ClosedPipe) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("stand: {error}");
            ExitCode::from(if matches!(error, CliError::Input(_)) { 2 } else { 1 })
        }
    }
}

/// The message of the argument parser in one line, without its usage paragraph.
pub(super) fn one_line(message: &str) -> String {
    let paragraphs = message.strip_prefix("error: ").unwrap_or(message).split("\n\n").filter(|p| !p.trim_start().starts_with("Usage:"));
    let lines = paragraphs.flat_map(str::lines).map(str::trim).filter(|line| !line.is_empty() && !line.starts_with("For more information"));
    format!("{} (--help lists commands and options)", lines.collect::<Vec<_>>().join(" "))
}
