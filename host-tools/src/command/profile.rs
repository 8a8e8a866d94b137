//! The words that choose a profile and its parameters, for every command that runs one.
//!
//! The firmware's own table says which there are ([`PARAMETERS`]); a parameter that the chosen profile does not take is refused, not ignored.

use clap::Args;
use hal_sim::session::SessionRequest;
use stand_firmware::profile::{PARAMETERS, Parameter, Profile, ProfileConfig, ProfileKind};
use stand_firmware::speed_loop::Mode;

use super::error::CliError;

/// What is asked for over time.
#[derive(Debug, Clone, Args)]
#[expect(non_snake_case, reason = "the firmware's names, which carry units")]
pub(super) struct ProfileWords {
    #[arg(long, default_value = "multi-step", help = format!("{}; below what each takes", names()))]
    pub profile: String,
    /// Largest rate (rad/s) or voltage (V) of the profile; what suits the stand if not given
    #[arg(long, value_name = "X", allow_negative_numbers = true)]
    pub amplitude: Option<f64>,
    /// Added to all values, rad/s or V
    #[arg(long, value_name = "X", allow_negative_numbers = true)]
    offset: Option<f64>,
    /// Time on each level, s (multi-step: its mean)
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    dwell_s: Option<f64>,
    /// Levels on each side of zero
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    levels: Option<f64>,
    /// Length of one bit, s
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    bit_s: Option<f64>,
    /// Lowest frequency, Hz
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    from_Hz: Option<f64>,
    /// Highest frequency, Hz
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    to_Hz: Option<f64>,
    /// Time from the lowest to the highest frequency, s
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    sweep_s: Option<f64>,
    /// Frequency of the sine, Hz
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    frequency_Hz: Option<f64>,
    /// Greatest change per second on the way to a level, rad/s² or V/s
    #[arg(long, value_name = "X", allow_negative_numbers = true)]
    acceleration: Option<f64>,
    /// Greatest change of the acceleration per second, rad/s³ or V/s²
    #[arg(long, value_name = "X", allow_negative_numbers = true)]
    jerk: Option<f64>,
    /// How often it goes round before it ends; 0: without end
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    cycles: Option<f64>,
    /// Whole turns
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    turns: Option<f64>,
}

impl ProfileWords {
    /// The profile of this name with its usual parameters.
    pub(super) fn usual(profile: &str) -> Self {
        ProfileWords {
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

    /// The profile, checked, for a stand that is regulated by `mode`.
    ///
    /// # Errors
    /// No such profile; a parameter that it does not take; a value that it cannot work with.
    pub(super) fn config(&self, mode: Mode, seed: u64) -> Result<ProfileConfig, CliError> {
        let kind: ProfileKind = self.profile.parse().map_err(|e| CliError::Input(format!("--profile: {e}")))?;
        let amplitude = self.amplitude.unwrap_or_else(|| SessionRequest::usual_amplitude(mode));
        let mut config = SessionRequest::usual_profile(mode, kind, amplitude, seed);
        let given = [
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
        for (name, value) in given {
            let (Some(value), Some(parameter)) = (value, Parameter::of_name(name)) else { continue };
            if !kind.parameters().contains(&name) {
                return Err(CliError::Input(format!("{}: the profile {kind} takes {} and not this", option(name), takes(kind))));
            }
            parameter.set(&mut config, value).map_err(|e| CliError::Input(format!("{}: {e}", option(name))))?;
        }
        Profile::for_mode(&config, mode).map_err(|e| CliError::Input(format!("{}: {e}", option(e.parameter()))))?;
        Ok(config)
    }
}

/// All names.
fn names() -> String {
    let names: Vec<&str> = ProfileKind::ALL.iter().map(|kind| kind.name()).collect();
    names.join(", ")
}

/// The options that a profile takes; the seed is the command's.
fn takes(kind: ProfileKind) -> String {
    let words: Vec<String> =
        PARAMETERS.iter().filter(|p| kind.parameters().contains(&p.name) && p.name != "seed").map(|p| option(p.name)).collect();
    words.join(" ")
}

/// A parameter's option.
fn option(parameter: &str) -> String {
    format!("--{}", parameter.to_lowercase().replace('_', "-"))
}

/// All profiles, what each does and takes: for the end of a help page.
pub(super) fn list() -> String {
    let mut text = "Profiles:\n".to_owned();
    for kind in ProfileKind::ALL {
        text += &format!("  {:<13} {}\n  {:<13}   {}\n", kind.name(), kind.says(), "", takes(kind));
    }
    text
}
