//! The physical effects of a drive and of its sensors: one file each in [`effects`], one line each in the catalogue.
//!
//! An effect is written once, as physics. The simulated plant (`hal-sim`) and the model that users fit (`drive-rig`) are both composed of
//! these effects; integration, noise, quantisation and delays are separate in the two.
//!
//! * A [`Card`] describes an effect: equation, parameters with unit, range and start value, and a description for the user.
//! * A [`Law`] is the physics, generic over the scalar: `f64`, or a dual number that carries derivatives.
//! * [`Contributions`] is the contribution of a law to the drive, [`Reading`] to a channel, [`Structure`] to the structure of the rig.
//!
//! An effect never computes sign(ω): it reports a Coulomb friction level ([`Contributions::dry`]) and the integration step handles sticking. This crate
//! depends on no firmware, HAL or async crate. To add an effect, add a file to `effects/` and a line to the catalogue in `effects/mod.rs`.

mod card;
pub mod effects;
mod law;

pub use card::{Card, Coordinate, Description, Domain, Parameter, ParameterKind, Screen};
pub use effects::{CATALOGUE, card, law};
pub use law::{Contributions, Law, Point, Reading, Scalar, Shaft, Structure, T0_C, Thermal};
