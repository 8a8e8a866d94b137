//! A model fitted to the logs, and what its residual is like.
//!
//! In: logs and a model. Out: a [`FittedModel`]: values, residual, evidence. [`join_logs`] makes one log of several, [`given`] fits the
//! given model, [`trial`] is an effect to be added to one. [`fitted_model`] (with [`descent`], [`stiffness`]) fits; [`likelihood`] whitens
//! the residual, [`adequacy`] judges whether it is noise, [`motion`] takes from the log what effects are functions of.

pub mod adequacy;
pub mod descent;
mod fitted_model;
pub mod given;
pub mod join_logs;
pub mod likelihood;
pub mod motion;
pub mod stiffness;
#[cfg(test)]
pub(crate) mod test_rotor;
pub mod trial;

pub use fitted_model::FittedModel;
