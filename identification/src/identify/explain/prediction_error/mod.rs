//! Search for missing effects in prediction-error form.
//!
//! In: the given model and the prepared logs. Out: the best models along a beam, with the evidence for each effect. The stages:
//!
//! * [`model`]: a model with its random torque and noise, fitted by homotopy ([`crate::identify::predict`]);
//! * [`screen`]: every effect of the catalogue, scored by its sensitivity in one linearised pass;
//! * [`starts`]: orders, periods and times at which an effect is tried, by the gradient of the likelihood;
//! * [`candidate`] ([`colour`], [`recorded`], [`free_form`]): the best few, fitted; coloured noise and conventions of the recording compete with them;
//! * [`search`]: a beam of models; add, compare, remove what is not needed;
//! * [`explanation`] ([`free_run`]): stages as free runs, candidates, verdict.

mod candidate;
mod colour;
pub mod explanation;
mod free_form;
mod free_run;
mod model;
mod recorded;
mod screen;
mod search;
mod starts;
