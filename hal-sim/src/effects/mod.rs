//! The physical effects: one file each, one line each in the catalogue below.
//!
//! An effect is written once, as physics. The simulated stand ([`crate::plant`]) and the model that users fit
//! ([`crate::rig`]) are both made of these pieces; integrator, noise, quantisation and delays are separate in the two.
//!
//! * A [`Card`] says what the effect is: equation, parameters with unit, range and start value, and an account in plain words.
//! * A [`Law`] is the physics, generic over the scalar: `f64`, or a dual number that carries derivatives.
//! * [`Acts`] is what a law does to the drive, [`Reading`] what a channel shows, [`Arms`] what changes the rig's structure.
//!
//! An effect never calls sign(ω): it reports a *dry level* ([`Acts::dry`]) and the step does the rest. This folder knows nothing
//! else of the house. Adding an effect to the project is adding a file here and a line to the catalogue.

mod card;
mod law;

pub use card::{Account, Card, Coordinate, Kind, Parameter, Room, Screen};
pub use law::{Acts, Arms, Law, Point, Reading, Scalar, Shaft, T0_C, Thermal};

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
