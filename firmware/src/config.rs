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

/// `value` if it is finite and within `[least, greatest]`. Double precision is a call for each comparison, so they are here only.
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

/// Name, least and greatest of a number.
pub type Range = (&'static str, f64, f64);

/// That each value is finite and within the range of its place; the first that is not is told. For tables: see [`all_within`].
#[inline(never)]
pub fn in_ranges(ranges: &[Range], values: &[f64]) -> Result<(), ConfigError> {
    ranges.iter().zip(values).try_for_each(|(&(name, least, greatest), value)| within(name, *value, least, greatest).map(|_| ()))
}

/// Checks fields of a structure against a table: `all_within!(of self, "name's beginning"; field: least, greatest; …)`. One check after the
/// other in code is longer.
macro_rules! all_within {
    (of $of:expr, $prefix:literal; $($name:ident: $least:expr, $greatest:expr;)*) => {
        $crate::config::in_ranges(
            const { &[$((concat!($prefix, stringify!($name)), $least, $greatest)),*] },
            &[$(f64::from($of.$name)),*],
        )
    };
}
pub(crate) use all_within;
