//! A profile by its name and by named parameters, as people and programs choose one.
//!
//! In: the name of the profile, the control mode, a seed, and parameters by the names of the firmware's table [`PARAMETERS`]. Out: the
//! checked configuration; what is not given has the usual value of the mode.

use hal_sim::session::SessionRequest;
use stand_firmware::config::ConfigError;
use stand_firmware::profile::{PARAMETERS, Parameter, Profile, ProfileConfig, ProfileKind};
use stand_firmware::speed_loop::Mode;

/// Why there is no profile.
#[derive(Debug, thiserror::Error)]
pub enum ProfileChoiceError {
    /// There is no profile of this name.
    #[error("profile: {0}")]
    Kind(String),
    /// The profile does not take the parameter.
    #[error("{parameter}: not a parameter of profile {kind}, which takes {}", parameters_of(*kind).join(" "))]
    NotTaken {
        /// The parameter.
        parameter: String,
        /// The profile.
        kind: ProfileKind,
    },
    /// The value of a parameter is rejected.
    #[error("{parameter}: {0}", parameter = .0.parameter())]
    Value(#[from] ConfigError),
}

/// Parameters that a profile takes, without the seed, which is an argument of its own.
pub fn parameters_of(kind: ProfileKind) -> Vec<&'static str> {
    PARAMETERS.iter().map(|p| p.name).filter(|name| kind.parameters().contains(name) && *name != "seed").collect()
}

/// The checked profile of this name. The parameter `amplitude` has the usual value of the mode where it is not given.
///
/// # Errors
/// The profile is unknown, does not take a given parameter, or rejects its value.
pub fn choose_profile(name: &str, mode: Mode, seed: u64, given: &[(&str, f64)]) -> Result<ProfileConfig, ProfileChoiceError> {
    const AMPLITUDE: &str = "amplitude";
    let kind: ProfileKind = name.parse().map_err(|e: <ProfileKind as std::str::FromStr>::Err| ProfileChoiceError::Kind(e.to_string()))?;
    let of_user = given.iter().find(|(name, _)| *name == AMPLITUDE).map(|(_, value)| *value);
    let mut config = SessionRequest::usual_profile(mode, kind, of_user.unwrap_or_else(|| SessionRequest::usual_amplitude(mode)), seed);
    for (name, value) in given.iter().filter(|(name, _)| *name != AMPLITUDE) {
        match Parameter::of_name(name).filter(|_| kind.parameters().contains(name)) {
            Some(parameter) => parameter.set(&mut config, *value)?,
            None => return Err(ProfileChoiceError::NotTaken { parameter: (*name).to_owned(), kind }),
        }
    }
    Profile::for_mode(&config, mode)?;
    Ok(config)
}
