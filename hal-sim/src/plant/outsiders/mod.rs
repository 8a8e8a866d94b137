//! Disturbances outside the catalogue: the plant can have them, a user model cannot.
//!
//! They test the answers of the tools to an unmodelled cause. Input: a table `[outsiders.NAME]` of a stand file. Each disturbance has a file
//! with its parameters, their ranges, and the range from which tests draw values that are clearly visible on the default stand. The plant
//! evaluates them at each step; contact changes (the edge of a sector, a clutch that opens) are located like those of Coulomb friction.
//!
//! In a drive with two masses the friction acts on the motor side, as all Coulomb friction of the plant.

pub mod grinding_bearing;
pub mod hunting_supply;
pub mod sector_rub;
pub mod slipping_clutch;

use serde::{Deserialize, Serialize};

use super::StandError;
pub use grinding_bearing::GrindingBearing;
pub use hunting_supply::HuntingSupply;
pub use sector_rub::SectorRub;
pub use slipping_clutch::SlippingClutch;

/// The disturbances of a stand; none by default.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct Outsiders {
    /// Additional friction in one sector of the turn.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sector_rub: Option<SectorRub>,
    /// The supply voltage oscillates.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hunting_supply: Option<HuntingSupply>,
    /// A slipping clutch between motor and platform.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slipping_clutch: Option<SlippingClutch>,
    /// Random additional friction of a bearing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub grinding_bearing: Option<GrindingBearing>,
}

impl Outsiders {
    /// Whether there is any.
    pub fn any(&self) -> bool {
        *self != Self::default()
    }

    /// Checks the values of a file.
    ///
    /// # Errors
    /// [`StandError::OutOfRange`] with the key of the first invalid value.
    pub fn check(&self) -> Result<(), StandError> {
        self.sector_rub.map_or(Ok(()), |o| o.check())?;
        self.hunting_supply.map_or(Ok(()), |o| o.check())?;
        self.slipping_clutch.map_or(Ok(()), |o| o.check())?;
        self.grinding_bearing.map_or(Ok(()), |o| o.check())
    }
}

/// Checks that `value` of `[outsiders.NAME] key` is in `range`.
fn within(name: &str, key: &str, value: f64, range: (f64, f64)) -> Result<(), StandError> {
    if value.is_finite() && value >= range.0 && value <= range.1 {
        return Ok(());
    }
    Err(StandError::OutOfRange {
        key: format!("outsiders.{name}.{key}"),
        value,
        range: format!("a number from {} to {}", range.0, range.1),
    })
}
