//! Options that choose a profile and its parameters, shared by all commands that run one.
//!
//! A parameter that the chosen profile does not take is an error.

use clap::Args;
use stand_firmware::profile::{ProfileConfig, ProfileKind};
use stand_firmware::speed_loop::Mode;

use super::error::CliError;
use stand_acquire::profile_choice::{ProfileChoiceError, choose_profile, parameters_of};

/// The setpoint over time.
#[derive(Debug, Clone, Args)]
#[expect(non_snake_case, reason = "the firmware's parameter names, which end with their units")]
pub(super) struct ProfileOptions {
    #[arg(long, default_value = "multi-step", help = format!("Profile: {}; parameters of each are listed below", names()))]
    pub profile: String,
    /// Largest rate (rad/s) or voltage (V) of the profile; default by the mode
    #[arg(long, value_name = "X", allow_negative_numbers = true)]
    pub amplitude: Option<f64>,
    /// Offset added to the profile, rad/s or V
    #[arg(long, value_name = "X", allow_negative_numbers = true)]
    offset: Option<f64>,
    /// Time on each level, s (multi-step: mean time)
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    dwell_s: Option<f64>,
    /// Number of levels on each side of zero
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    levels: Option<f64>,
    /// Duration of one bit, s
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    bit_s: Option<f64>,
    /// Start frequency of the sweep, Hz
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    from_Hz: Option<f64>,
    /// End frequency of the sweep, Hz
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    to_Hz: Option<f64>,
    /// Duration of the sweep, s
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    sweep_s: Option<f64>,
    /// Frequency of the sine, Hz
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    frequency_Hz: Option<f64>,
    /// Largest acceleration between levels, rad/s² (voltage mode: V/s)
    #[arg(long, value_name = "X", allow_negative_numbers = true)]
    acceleration: Option<f64>,
    /// Largest jerk between levels, rad/s³ (voltage mode: V/s²)
    #[arg(long, value_name = "X", allow_negative_numbers = true)]
    jerk: Option<f64>,
    /// Number of repetitions; 0: endless
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    cycles: Option<f64>,
    /// Number of turns
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    turns: Option<f64>,
}

impl ProfileOptions {
    /// The profile of this name with default parameters.
    pub(super) fn default_of(profile: &str) -> Self {
        ProfileOptions {
            profile: profile.to_owned(),
            amplitude: None,
            offset: None,
            dwell_s: None,
            levels: None,
            bit_s: None,
            from_Hz: None,
            to_Hz: None,
            sweep_s: None,
            frequency_Hz: None,
            acceleration: None,
            jerk: None,
            cycles: None,
            turns: None,
        }
    }

    /// The checked profile for control mode `mode`.
    ///
    /// # Errors
    /// The profile is unknown, does not take a given parameter, or rejects its value.
    pub(super) fn config(&self, mode: Mode, seed: u64) -> Result<ProfileConfig, CliError> {
        let given = [
            ("amplitude", self.amplitude),
            ("offset", self.offset),
            ("dwell_s", self.dwell_s),
            ("levels", self.levels),
            ("bit_s", self.bit_s),
            ("from_Hz", self.from_Hz),
            ("to_Hz", self.to_Hz),
            ("sweep_s", self.sweep_s),
            ("frequency_Hz", self.frequency_Hz),
            ("acceleration", self.acceleration),
            ("jerk", self.jerk),
            ("cycles", self.cycles),
            ("turns", self.turns),
        ];
        let given: Vec<(&str, f64)> = given.into_iter().filter_map(|(name, value)| Some((name, value?))).collect();
        choose_profile(&self.profile, mode, seed, &given).map_err(|error| {
            CliError::Input(match error {
                ProfileChoiceError::Kind(message) => format!("--profile: {message}"),
                ProfileChoiceError::NotTaken { parameter, kind } => {
                    format!("{}: not a parameter of profile {kind}, which takes {}", option(&parameter), takes(kind))
                }
                ProfileChoiceError::Value(error) => format!("{}: {error}", option(error.parameter())),
            })
        })
    }
}

/// Names of all profiles.
fn names() -> String {
    let names: Vec<&str> = ProfileKind::ALL.iter().map(|kind| kind.name()).collect();
    names.join(", ")
}

/// Options that a profile takes, without the seed, which is an option of the command.
fn takes(kind: ProfileKind) -> String {
    let options: Vec<String> = parameters_of(kind).into_iter().map(option).collect();
    options.join(" ")
}

/// Option name of a parameter.
fn option(parameter: &str) -> String {
    format!("--{}", parameter.to_lowercase().replace('_', "-"))
}

/// All profiles with their descriptions and parameters, for the end of a help page.
pub(super) fn list() -> String {
    let mut text = "Profiles:\n".to_owned();
    for kind in ProfileKind::ALL {
        text += &format!("  {:<13} {}\n  {:<13}   {}\n", kind.name(), kind.description(), "", takes(kind));
    }
    text
}
