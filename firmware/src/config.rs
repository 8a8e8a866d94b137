//! What is wrong with a configuration, by the parameter's name.
//!
//! Building a configuration can fail and says which number it does not like; running never can.

use core::fmt;

/// A parameter that cannot be worked with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ConfigError {
    /// Not a number, or infinite.
    NonFinite(&'static str),
    /// Outside of what makes sense: name, value, least, greatest.
    OutOfRange(&'static str, f64, f64, f64),
    /// Does not go with the rest: name, what it must be or why it cannot be.
    Unfit(&'static str, &'static str),
}

impl ConfigError {
    /// The name of the parameter.
    pub fn parameter(&self) -> &'static str {
        match self {
            Self::NonFinite(name) | Self::OutOfRange(name, ..) | Self::Unfit(name, _) => name,
        }
    }
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NonFinite(name) => write!(f, "{name} is not a finite number"),
            Self::OutOfRange(name, value, least, greatest) => {
                write!(f, "{name} = {value} is outside {least} … {greatest}")
            }
            Self::Unfit(name, why) => write!(f, "{name} {why}"),
        }
    }
}

impl core::error::Error for ConfigError {}

/// `value` if it is finite and within `[least, greatest]`.
pub fn within(name: &'static str, value: f64, least: f64, greatest: f64) -> Result<f64, ConfigError> {
    if !value.is_finite() {
        Err(ConfigError::NonFinite(name))
    } else if value < least || value > greatest {
        Err(ConfigError::OutOfRange(name, value, least, greatest))
    } else {
        Ok(value)
    }
}
