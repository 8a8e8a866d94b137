//! The physical effects of a drive and of its sensors: one file each in [`effects`], one line each in the catalogue.
//!
//! Each effect is written once. The simulated plant (`hal-sim`) and the model that users fit (`drive-rig`) are both composed of these
//! effects; integration, noise, quantisation and delays are implemented separately in the two.
//!
//! * A [`Card`] describes an effect as data: equation, parameters, conditions, rivals, experiments, text for the user. No program outside
//!   the effect's own file compares its identifier with a literal.
//! * A [`Law`] is the physics, generic over the scalar: `f64`, or a dual number that carries derivatives.
//! * A law adds [`Contributions`] to the drive, changes a [`Reading`] of the channels, or sets the [`Structure`] of the drive.
//!
//! A law never computes sign(ω): it sets the Coulomb torque ([`Contributions::coulomb_torque`]) and the integration step handles sticking.
//! This crate depends on no firmware, HAL or async crate. To add an effect, add a file to `effects/` and a line to the catalogue in
//! `effects/mod.rs`; or add it from another crate by [`extend`].

mod card;
mod catalogue;
mod coordinate;
pub mod effects;
mod experiment;
mod law;
mod portable;
mod scalar;
mod screening;

pub use card::{Card, Compensation, Description, Domain, Parameter, ParameterKind, Rival};
pub use catalogue::{ExtendError, card, cards, extend, law};
pub use coordinate::Coordinate;
pub use experiment::{Abscissa, Demonstration, Motion, Output, StandRun};
pub use law::{Contributions, Factor, Law, LawScalar, LawSource, MAX_COLUMNS, Point, Reading, Shaft, Structure, Sum, T0_C, Thermal};
pub use portable::Portable;
pub use scalar::{Dual, Scalar};
pub use screening::{Elastic, HarmonicSource, PeriodOf, Requirement, Screening};
