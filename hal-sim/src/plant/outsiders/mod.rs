//! Disturbances outside the catalogue: the plant can have them, a user model cannot.
//!
//! They test the answers of the tools to an unmodelled cause. Input: a table `[outsiders.NAME]` of a stand file. Each disturbance has a
//! file with its parameters, their ranges, and the range from which tests draw values that are clearly visible on the default stand. The
//! plant evaluates them at each step; contact changes (the edge of a sector, a clutch that opens) are located like those of Coulomb
//! friction.
//!
//! In a drive with two masses the friction acts on the motor side, as all Coulomb friction of the plant.

pub mod bad_contact;
pub mod bad_lines;
pub mod ball_defect;
pub mod fluid_rotor;
pub mod grinding_bearing;
pub mod hunting_supply;
mod random_path;
pub mod sagging_converter;
pub mod sector_rub;
pub mod slipping_clutch;
pub mod sticky_rate_sensor;
pub mod wandering_load;

use bad_contact::Contact;
use sagging_converter::Sag;
use serde::{Deserialize, Serialize};

use super::StandError;
pub use bad_contact::BadContact;
pub use bad_lines::BadLines;
pub use ball_defect::BallDefect;
pub use fluid_rotor::FluidRotor;
pub use grinding_bearing::GrindingBearing;
pub use hunting_supply::HuntingSupply;
use random_path::RandomPath;
pub use sagging_converter::SaggingConverter;
pub use sector_rub::SectorRub;
pub use slipping_clutch::SlippingClutch;
pub use sticky_rate_sensor::StickyRateSensor;
pub use wandering_load::WanderingLoad;

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
    /// Friction pulses of a damaged rolling element.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ball_defect: Option<BallDefect>,
    /// A series resistance that comes and goes at random.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bad_contact: Option<BadContact>,
    /// A second rotor that a fluid couples.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fluid_rotor: Option<FluidRotor>,
    /// A load torque that is a random walk.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wandering_load: Option<WanderingLoad>,
    /// A converter that sags under its recent output.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sagging_converter: Option<SaggingConverter>,
    /// A rate sensor with hysteresis.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sticky_rate_sensor: Option<StickyRateSensor>,
    /// A sector of the encoder with bad lines.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bad_lines: Option<BadLines>,
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
        self.grinding_bearing.map_or(Ok(()), |o| o.check())?;
        self.ball_defect.map_or(Ok(()), |o| o.check())?;
        self.bad_contact.map_or(Ok(()), |o| o.check())?;
        self.fluid_rotor.map_or(Ok(()), |o| o.check())?;
        self.wandering_load.map_or(Ok(()), |o| o.check())?;
        self.sagging_converter.map_or(Ok(()), |o| o.check())?;
        self.sticky_rate_sensor.map_or(Ok(()), |o| o.check())?;
        self.bad_lines.map_or(Ok(()), |o| o.check())
    }
}

/// The disturbances with a state of their own, from tick to tick.
#[derive(Debug, Clone, Default)]
pub struct Running {
    grinding: Option<RandomPath>,
    wandering: Option<RandomPath>,
    contact: Option<Contact>,
    sag: Option<Sag>,
}

impl Running {
    /// The states at time 0.
    pub fn new(outsiders: &Outsiders) -> Self {
        Running {
            grinding: outsiders.grinding_bearing.map(|o| o.path()),
            wandering: outsiders.wandering_load.map(|o| o.path()),
            contact: outsiders.bad_contact.as_ref().map(Contact::new),
            sag: outsiders.sagging_converter.as_ref().map(Sag::new),
        }
    }

    /// Starts a tick of length `dt_s` with its command; `t_s` must not decrease.
    pub fn tick(&mut self, command_V: f64, t_s: f64, dt_s: f64) {
        for path in [&mut self.grinding, &mut self.wandering].into_iter().flatten() {
            path.tick(t_s, dt_s);
        }
        if let Some(contact) = &mut self.contact {
            contact.tick(t_s, dt_s);
        }
        if let Some(sag) = &mut self.sag {
            sag.tick(command_V, t_s);
        }
    }

    /// Additional Coulomb torque at a time within the tick, N m.
    pub fn coulomb_N_m(&self, t_s: f64) -> f64 {
        self.grinding.as_ref().map_or(0.0, |path| path.at(t_s))
    }

    /// Additional torque at a time within the tick, N m.
    pub fn torque_N_m(&self, t_s: f64) -> f64 {
        self.wandering.as_ref().map_or(0.0, |path| path.at(t_s))
    }

    /// Additional resistance in series with the winding in this tick, Ω.
    pub fn series_ohm(&self) -> f64 {
        self.contact.as_ref().map_or(0.0, Contact::series_ohm)
    }

    /// Output voltage of the converter over the command at a time within the tick.
    pub fn voltage_factor(&self, t_s: f64) -> f64 {
        self.sag.as_ref().map_or(1.0, |sag| sag.factor(t_s))
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
