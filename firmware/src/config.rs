//! Checks of configuration parameters.
//!
//! Making a configuration can fail and names the invalid parameter; running with a configuration cannot fail.

use crate::text::Significant;
use core::fmt;

/// An invalid parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ConfigError {
    /// It is NaN or infinite: its name.
    NonFinite(&'static str),
    /// It is outside its range: name, value, minimum, maximum.
    OutOfRange(&'static str, f64, f64, f64),
    /// It conflicts with another parameter: name, and the requirement.
    Unfit(&'static str, &'static str),
}

impl ConfigError {
    /// Name of the parameter.
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
                let (side, limit) = if value < least { ("below the minimum", least) } else { ("above the maximum", greatest) };
                write!(f, "{name} = {} is {side} of {}", Significant(*value, 6), Significant(*limit, 6))
            }
            Self::Unfit(name, requirement) => write!(f, "{name} {requirement}"),
        }
    }
}

impl core::error::Error for ConfigError {}

/// Returns `value` if it is finite and within `[least, greatest]`.
///
/// # Errors
/// It is not.
#[inline(never)]
pub fn within(name: &'static str, value: f64, least: f64, greatest: f64) -> Result<f64, ConfigError> {
    if !value.is_finite() {
        Err(ConfigError::NonFinite(name))
    } else if value < least || value > greatest {
        Err(ConfigError::OutOfRange(name, value, least, greatest))
    } else {
        Ok(value)
    }
}

/// Name, minimum and maximum of a number.
pub type Range = (&'static str, f64, f64);

/// Checks that each value is finite and within its range; see [`all_within`].
///
/// # Errors
/// A value is not; names the first.
#[inline(never)]
pub fn in_ranges(ranges: &[Range], values: &[f64]) -> Result<(), ConfigError> {
    ranges.iter().zip(values).try_for_each(|(&(name, least, greatest), value)| within(name, *value, least, greatest).map(|_| ()))
}

/// Checks fields of a structure against a table: `all_within!(of self, "prefix of the names"; field: minimum, maximum; …)`.
macro_rules! all_within {
    (of $of:expr, $prefix:literal; $($name:ident: $least:expr, $greatest:expr;)*) => {
        $crate::config::in_ranges(
            const { &[$((concat!($prefix, stringify!($name)), $least, $greatest)),*] },
            &[$(f64::from($of.$name)),*],
        )
    };
}
pub(crate) use all_within;
