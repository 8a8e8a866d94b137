//! Words about rate stability.

use crate::significant;
use crate::units::{Dimension, RateUnit, RatioUnit, Scale, Units};
use stand_analysis::stability::{Verdict, Width, WidthResult};

/// Standard that defines the quantity.
pub(super) const STANDARD: &str = "IEEE 1554, rate table";

/// Units without a choice of the user.
const DEFAULTS: Units = Units {
    rate: Some(RateUnit::RadS),
    random_walk: None,
    density: None,
    acceleration: None,
    acceleration_density: None,
    ratio: Some(RatioUnit::Ppm),
};

/// Units of rate and relative deviation.
pub(super) fn scales(units: Units) -> (Scale, Scale) {
    let units = units.or(DEFAULTS);
    (units.scale(Dimension::Rate), units.scale(Dimension::Ratio))
}

/// Name of a width.
pub(super) fn width(width: Width) -> String {
    match width {
        Width::Degrees(degrees) => format!("{degrees}°"),
        Width::Turn => "whole turns".to_owned(),
    }
}

/// Comparison with the limit.
pub(super) fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Within => "within the limit",
        Verdict::Exceeds => "exceeds the limit",
        Verdict::Undecided => "undecided: the limit lies within the uncertainty or below the resolution",
    }
}

/// Resolution of the encoder over the width, and whether the scatter exceeds it.
pub(super) fn resolution(found: &WidthResult, ratio: &Scale) -> String {
    if found.resolution == 0.0 {
        return String::new();
    }
    let shown = format!("resolution of the encoder {} {}", significant(found.resolution * ratio.factor, 2), ratio.unit);
    if found.is_resolved() { shown } else { format!("{shown}: not resolved") }
}
