//! Search for missing effects in prediction-error form.
//!
//! In: the given model and the prepared logs. Out: the best models along a beam, with the evidence for each effect. The stages:
//!
//! * [`model`]: a model with its random torque and noise, fitted by homotopy ([`crate::identify::predict`]);
//! * [`screen`]: every effect of the catalogue, scored by its sensitivity in one linearised pass;
//! * [`candidate`]: the best few, fitted;
//! * [`search`]: a beam of models; add, compare, remove what is not needed.

mod candidate;
mod colour;
pub mod explanation;
mod free_form;
mod model;
mod recorded;
mod screen;
mod search;
mod starts;
