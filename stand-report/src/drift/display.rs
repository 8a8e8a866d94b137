//! Units in which a drift measurement is displayed, and the names of its quantities in the standards.

use crate::units::{Dimension, RateUnit, Scale, Units};

/// Line that relates the words of this page to the standard.
pub(super) const OWN_DRIFT_NAMES: &str =
    "own drift: systematic drift rate of IEEE Std 528, here the mean over the session; drift by g: acceleration-sensitive drift rate";

/// Units without a choice of the user.
const DEFAULTS: Units =
    Units { rate: Some(RateUnit::DegH), random_walk: None, density: None, acceleration: None, acceleration_density: None, ratio: None };

/// Factor from SI and symbol of each kind of result.
#[derive(Debug, Clone, PartialEq)]
pub struct Display {
    /// Drift rates and biases.
    pub rate: Scale,
    /// Drift per g.
    pub per_g: Scale,
    /// Trend.
    pub ramp: Scale,
    /// Random walk.
    pub walk: Scale,
    /// Azimuths.
    pub angle: Scale,
    /// Small ratios.
    pub percent: Scale,
    /// Scale factors.
    pub one: Scale,
    /// Lags.
    pub milliseconds: Scale,
}

impl Display {
    /// Of a drift measurement.
    pub fn new(units: Units) -> Self {
        Self::with(units.or(DEFAULTS))
    }

    /// Of the platform method, in SI units by default.
    pub fn for_platform(units: Units) -> Self {
        Self::with(units)
    }

    fn with(units: Units) -> Self {
        let fixed = |factor: f64, unit: &str| Scale { factor, unit: unit.to_owned() };
        Self {
            rate: units.scale(Dimension::Rate),
            per_g: units.scale(Dimension::RatePerG),
            ramp: units.scale(Dimension::RateRamp),
            walk: units.scale(Dimension::RateRandomWalk),
            angle: fixed(1_f64.to_degrees(), "°"),
            percent: match units.ratio {
                Some(_) => units.scale(Dimension::Ratio),
                None => fixed(100.0, "%"),
            },
            one: units.scale(Dimension::Ratio),
            milliseconds: fixed(1e3, "ms"),
        }
    }
}
