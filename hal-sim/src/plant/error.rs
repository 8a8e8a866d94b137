//! Why a stand cannot be built.

use crate::faults::FaultError;

/// Why a stand cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StandError {
    /// Not TOML, or an unknown key.
    #[error("{0}")]
    Toml(String),
    /// Unknown effect.
    #[error("effects.{0}: the catalogue has no effect of this name (`stand effects` lists them)")]
    UnknownEffect(String),
    /// Unknown parameter.
    #[error("effects.{effect}: no parameter `{parameter}`; it has {has}")]
    UnknownParameter {
        /// The effect.
        effect: String,
        /// The given name.
        parameter: String,
        /// The known names.
        has: String,
    },
    /// An invalid fault.
    #[error(transparent)]
    Fault(#[from] FaultError),
    /// A clutch and a shaft.
    #[error("outsiders.slipping-clutch and effects.{0}: between motor and platform there is one of the two")]
    TwoCouplings(String),
    /// A value out of range.
    #[error("{key} = {value}: must be {range}")]
    OutOfRange {
        /// The key.
        key: String,
        /// The given value.
        value: f64,
        /// The allowed range.
        range: String,
    },
}
