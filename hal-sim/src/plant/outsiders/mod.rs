//! Disturbances that the catalogue does not know: the plant can have them, no model of a user can.
//!
//! With them it is tested what the tools say of something for which they have no name. In: a table `[outsiders.NAME]` of a stand's file.
//! Each is a file here with its parameters, their ranges, and the range from which tests draw what is clearly seen on the default stand.
//! The plant asks them at each step; their corners (the edge of a sector, a clutch that lets go) are located like those of dry friction.
//!
//! Where a drive has two masses, what rubs here rubs on the motor's side, as all dry friction of the plant does.

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
    /// Something rubs in one part of the turn.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sector_rub: Option<SectorRub>,
    /// The supply swings.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hunting_supply: Option<HuntingSupply>,
    /// The platform is driven through a clutch that slips.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slipping_clutch: Option<SlippingClutch>,
    /// A bearing grinds at random.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub grinding_bearing: Option<GrindingBearing>,
}

impl Outsiders {
    /// There is at least one.
    pub fn any(&self) -> bool {
        *self != Self::default()
    }

    /// Checks what a file may have brought.
    ///
    /// # Errors
    /// [`StandError::OutOfRange`] with the key of the first value that cannot be.
    pub fn check(&self) -> Result<(), StandError> {
        self.sector_rub.map_or(Ok(()), |o| o.check())?;
        self.hunting_supply.map_or(Ok(()), |o| o.check())?;
        self.slipping_clutch.map_or(Ok(()), |o| o.check())?;
        self.grinding_bearing.map_or(Ok(()), |o| o.check())
    }
}

/// `value` of `[outsiders.NAME] key` lies in `range`.
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
