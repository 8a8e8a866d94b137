//! Logs, models and identification: from the file of a measurement to the parameters of a drive and the physical effect that its model
//! lacks.
//!
//! Layers, lowest first: [`statistics`], [`files`], [`words`], [`parameters`], [`deadline`] and [`budget`]; [`log`]; [`model`]; [`recording`]; [`identify`]. All of them
//! return data; text, HTML and JSON are made in `stand-report`.

pub mod budget;
pub mod deadline;
pub mod files;
pub mod identify;
pub mod log;
pub mod model;
pub mod parameters;
pub mod recording;
pub mod statistics;
pub mod words;
