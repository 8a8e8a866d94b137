//! Description of a stand as data: drive, effects, sensors, firmware settings. `stand sim --stand FILE` reads it as TOML.
//!
//! ```toml
//! name = "stand 12"
//! [drive]
//! inertia_kg_m2 = 4e-4
//! [effects.coulomb]
//! coulomb_N_m = 1.2e-3
//! [effects."cogging#2"]
//! cogging_N_m = 1e-3
//! cogging_order = 14
//! [outsiders.sector-rub]
//! rub_N_m = 1e-3
//! [sensors]
//! rate_noise_rad_s = 0.02
//! [imu]
//! part = "adxl355"
//! radius_m = 0.04
//! [clock]
//! crystal_ppm = 40.0
//! reference = {}
//! [[faults]]
//! what = "supply-dip"
//! from_s = 2.0
//! for_s = 0.5
//! ```
//! Missing keys have the values of the default stand; a file that names any effect lists all effects of the stand.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

pub use super::error::StandError;
use super::outsiders::Outsiders;
use crate::faults::Faults;
use crate::peripherals::imu::ImuSetup;
use crate::peripherals::{ClockSetup, SensorSetup};
use crate::setup::StandSetup;
use drive_model::{Elastic, ParameterKind};
use stand_firmware::board::Hardware;
use stand_firmware::speed_loop::Settings;

/// Poles of the speed loop with its default gains, rad/s.
const LOOP_POLES_RAD_S: f64 = 80.0;

/// A stand.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Stand {
    /// Name, for the log.
    pub name: String,
    /// Motor, platform, supply.
    pub drive: Drive,
    /// Effects by name (`cogging`, `cogging#2`), with their parameters.
    pub effects: BTreeMap<String, BTreeMap<String, f64>>,
    /// Disturbances outside the catalogue.
    #[serde(skip_serializing_if = "nothing_outside")]
    pub outsiders: Outsiders,
    /// Noise and filters of the sensors.
    pub sensors: SensorSetup,
    /// The sensor under test, if the platform carries one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub imu: Option<ImuSetup>,
    /// Crystal of the controller, and the reference beside it.
    #[serde(skip_serializing_if = "ClockSetup::is_default")]
    pub clock: ClockSetup,
    /// Scales of converters and encoder.
    pub hardware: Hardware,
    /// Settings of the firmware; missing settings follow from the drive.
    pub firmware: Settings,
    /// Faults.
    #[serde(skip_serializing_if = "Faults::is_empty")]
    pub faults: Faults,
}

/// Motor, platform, supply.
///
/// The default is a maxon RE 25 (20 W, graphite brushes, order number 118752; maxon catalogue, RE program) with the platform directly on
/// its shaft, at a supply of 12 V.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[expect(missing_docs, reason = "names and units are in the identifiers")]
pub struct Drive {
    pub inertia_kg_m2: f64,
    pub motor_constant_N_m_A: f64,
    pub resistance_ohm: f64,
    pub supply_V: f64,
    pub thermal_J_K: f64,
    pub thermal_K_W: f64,
    pub ambient_C: f64,
}

impl Default for Drive {
    fn default() -> Self {
        Drive {
            // A platform of 60 mm radius and 0.13 kg (½ m r² = 2.34e-4), the sensor on it, and the rotor's 10.8 g cm² (catalogue).
            inertia_kg_m2: 2.5e-4,
            motor_constant_N_m_A: 2.34e-2, // catalogue: torque constant 23.4 mN m/A
            resistance_ohm: 2.32,          // catalogue: terminal resistance
            supply_V: 12.0,                // the bridge's supply; the winding is made for 24 V
            thermal_J_K: 4.0,              // catalogue: thermal time constant of the winding 12.5 s over 3.1 K/W winding–housing
            thermal_K_W: 17.1,             // catalogue: 3.1 K/W winding–housing and 14 K/W housing–ambient
            ambient_C: 25.0,
        }
    }
}

impl Default for Stand {
    fn default() -> Self {
        let effect = |id: &str, parameters: &[(&str, f64)]| {
            (id.to_owned(), parameters.iter().map(|&(name, value)| (name.to_owned(), value)).collect())
        };
        Stand {
            name: "rotary stand on a maxon RE 25".to_owned(),
            drive: Drive::default(),
            effects: [
                // Catalogue: no-load current 36.9 mA × 23.4 mN m/A = 0.86 mN m, split between Coulomb and viscous friction at 9550 1/min.
                effect("coulomb", &[("coulomb_N_m", 9e-4)]),
                effect("viscous", &[("viscous_N_m_s", 2e-5)]),
                // Catalogue: terminal inductance 0.238 mH.
                effect("inductance", &[("inductance_H", 2.38e-4)]),
            ]
            .into_iter()
            .collect(),
            outsiders: Outsiders::default(),
            sensors: SensorSetup::default(),
            imu: None,
            clock: ClockSetup::default(),
            hardware: Hardware::default(),
            firmware: Settings::default(),
            faults: Faults::default(),
        }
    }
}

impl Stand {
    /// Parses the text of a file.
    ///
    /// # Errors
    /// The first error, with its key.
    pub fn parse(text: &str) -> Result<Self, StandError> {
        let fail = |e: toml::de::Error| {
            let line = e.span().map_or(1, |span| text[..span.start.min(text.len())].matches('\n').count() + 1);
            StandError::Toml(format!("line {line}: {}", e.message().replace('\n', " ")))
        };
        let mut stand: Stand = toml::from_str(text).map_err(fail)?;
        let given: toml::Table = toml::from_str(text).map_err(fail)?;
        let is_given = |key: &str| given.get("firmware").and_then(|f| f.get(key)).is_some();
        let (d, f) = (&stand.drive, &mut stand.firmware);
        let follow = |key: &str, to: &mut f64, value: f64| {
            if !is_given(key) {
                *to = value;
            }
        };
        follow("resistance_ohm", &mut f.resistance_ohm, d.resistance_ohm);
        follow("motor_constant_N_m_A", &mut f.motor_constant_N_m_A, d.motor_constant_N_m_A);
        follow("inertia_kg_m2", &mut f.inertia_kg_m2, d.inertia_kg_m2);
        // Both poles of the loop at LOOP_POLES_RAD_S: J s² + (K²/R + K k/R) s + K c/R.
        let volts = f.inertia_kg_m2 * f.resistance_ohm / f.motor_constant_N_m_A;
        follow("rate_gain_V_s_rad", &mut f.rate_gain_V_s_rad, (2.0 * LOOP_POLES_RAD_S * volts - f.motor_constant_N_m_A).max(0.0));
        follow("position_gain_V_rad", &mut f.position_gain_V_rad, volts * LOOP_POLES_RAD_S * LOOP_POLES_RAD_S);
        let hardware_given = |key: &str| given.get("hardware").and_then(|h| h.get(key)).is_some();
        if !hardware_given("supply_nominal_V") {
            stand.hardware.supply_nominal_V = d.supply_V;
        }
        if !hardware_given("rate_cutoff_Hz") {
            let cutoff = stand.sensors.rate_cutoff_Hz;
            stand.hardware.rate_cutoff_Hz = if cutoff.is_finite() { cutoff } else { 0.0 };
        }
        stand.check()?;
        Ok(stand)
    }

    fn check(&self) -> Result<(), StandError> {
        let d = &self.drive;
        for (key, value) in [
            ("drive.inertia_kg_m2", d.inertia_kg_m2),
            ("drive.motor_constant_N_m_A", d.motor_constant_N_m_A),
            ("drive.resistance_ohm", d.resistance_ohm),
            ("drive.supply_V", d.supply_V),
            ("drive.thermal_J_K", d.thermal_J_K),
            ("drive.thermal_K_W", d.thermal_K_W),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return Err(StandError::OutOfRange { key: key.to_owned(), value, range: "positive".to_owned() });
            }
        }
        if !(d.ambient_C.is_finite() && (-100.0..=200.0).contains(&d.ambient_C)) {
            return Err(StandError::OutOfRange {
                key: "drive.ambient_C".to_owned(),
                value: d.ambient_C,
                range: "from −100 to 200".to_owned(),
            });
        }
        for (key, value, (least, most)) in self.clock.values() {
            if !(least..=most).contains(&value) {
                return Err(StandError::OutOfRange { key: key.to_owned(), value, range: format!("from {least} to {most}") });
            }
        }
        self.check_outside()?;
        self.faults.check()?;
        self.effect_parameters().map(|_| ())
    }

    /// Checks the outsiders, alone and in combination with the effects.
    pub(super) fn check_outside(&self) -> Result<(), StandError> {
        self.outsiders.check()?;
        match (self.outsiders.slipping_clutch, self.shaft()) {
            (Some(_), Some(shaft)) => Err(StandError::TwoCouplings(shaft.to_owned())),
            _ => Ok(()),
        }
    }

    /// The effect that adds a shaft between motor and platform.
    fn shaft(&self) -> Option<&str> {
        self.effects
            .keys()
            .map(String::as_str)
            .find(|name| drive_model::card(stem(name)).is_some_and(|c| c.elastic == Some(Elastic::Shaft)))
    }

    /// The effects with their parameters in the order of the cards; missing values are the start values of the card.
    ///
    /// # Errors
    /// An effect or parameter that the catalogue lacks, or a value out of range.
    pub fn effect_parameters(&self) -> Result<Vec<(&'static str, Vec<f64>)>, StandError> {
        let mut placed = Vec::new();
        // In the order of the catalogue: the sequence in the file has no influence.
        let mut names: Vec<&String> = self.effects.keys().collect();
        let position = |name: &str| drive_model::cards().iter().position(|c| c.id == stem(name));
        names.sort_by_key(|name| position(name));
        for name in names {
            let given = &self.effects[name];
            let card = drive_model::card(stem(name)).ok_or_else(|| StandError::UnknownEffect(name.clone()))?;
            if let Some(parameter) = given.keys().find(|key| !card.parameters.iter().any(|p| p.name == *key)) {
                let has = card.parameters.iter().map(|p| p.name).collect::<Vec<_>>().join(", ");
                return Err(StandError::UnknownParameter { effect: name.clone(), parameter: parameter.clone(), has });
            }
            let mut values = Vec::new();
            for p in card.parameters {
                let value = given.get(p.name).copied().unwrap_or(p.start);
                let whole = p.kind != ParameterKind::HarmonicOrder || value.fract() == 0.0;
                if !(value.is_finite() && value >= p.range.0 && value <= p.range.1 && whole) {
                    let number = if p.kind == ParameterKind::HarmonicOrder { "a whole number" } else { "a number" };
                    let range = format!("{number} from {} to {}", p.range.0, p.range.1);
                    return Err(StandError::OutOfRange { key: format!("effects.{name}.{}", p.name), value, range });
                }
                values.push(value);
            }
            placed.push((card.id, values));
        }
        Ok(placed)
    }

    /// The setup without the plant: scales, sensors, settings of the firmware.
    pub fn setup(&self) -> StandSetup {
        StandSetup {
            hardware: self.hardware,
            sensors: self.sensors,
            settings: self.firmware,
            faults: self.faults,
            imu: self.imu,
            clock: self.clock,
        }
    }
}

fn nothing_outside(outsiders: &Outsiders) -> bool {
    !outsiders.any()
}

/// `cogging` of `cogging#2`.
fn stem(name: &str) -> &str {
    name.split('#').next().unwrap_or(name)
}
