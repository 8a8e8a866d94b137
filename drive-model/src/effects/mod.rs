//! The catalogue: every effect, a file each.

use crate::{Card, Law, Scalar};

macro_rules! catalogue {
    ($($file:ident::$law:ident,)*) => {
        $(pub mod $file;)*

        /// Every effect, in the catalogue's order (which decides between rivals that a log cannot tell apart).
        pub const CATALOGUE: &[&Card] = &[$(&$file::CARD),*];

        /// The law of an effect by its identifier; `None` where the catalogue has no such effect.
        pub fn law<S: Scalar>(id: &str) -> Option<Box<dyn Law<S>>> {
            $(if id == $file::CARD.id {
                return Some(Box::new($file::$law));
            })*
            None
        }
    };
}

catalogue! {
    viscous::Viscous,
    coulomb::Coulomb,
    asymmetric_friction::AsymmetricFriction,
    load::Load,
    stribeck::Stribeck,
    presliding::Presliding,
    quadratic_drag::QuadraticDrag,
    viscous_temperature::ViscousTemperature,
    cogging::Cogging,
    unbalance::Unbalance,
    torque_ripple::TorqueRipple,
    cable_spring::CableSpring,
    load_step::LoadStep,
    compliance::Compliance,
    backlash::Backlash,
    inductance::Inductance,
    brush_drop::BrushDrop,
    dead_time::DeadTime,
    resistance_temperature::ResistanceTemperature,
    supply_droop::SupplyDroop,
    magnetic_saturation::MagneticSaturation,
    encoder_eccentricity::EncoderEccentricity,
    sensor_lag::SensorLag,
    time_skew::TimeSkew,
    rate_scale::RateScale,
    rate_scale_nonlinearity::RateScaleNonlinearity,
    rate_bias::RateBias,
    rate_bias_temperature::RateBiasTemperature,
    rate_g_sensitivity::RateGSensitivity,
    current_offset::CurrentOffset,
    current_scale::CurrentScale,
}

/// The card of an effect by its identifier.
pub fn card(id: &str) -> Option<&'static Card> {
    CATALOGUE.iter().copied().find(|c| c.id == id)
}
