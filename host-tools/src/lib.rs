//! The host side of the rotary stand: logs, models, identification, sessions and analyses behind the command `stand`.
//!
//! Layers, lowest first: [`statistics`], [`files`] and [`words`]; [`log`] and [`model`]; [`acquire`] and [`identify`]; the analyses [`allan`], [`calibrate`],
//! [`compensate`], [`drift`] and [`observer`], which return data; [`report`], which makes text, HTML and JSON of them; [`command`].

pub mod acquire;
pub mod allan;
pub mod calibrate;
pub mod command;
pub mod compensate;
pub mod drift;
pub mod files;
pub mod identify;
pub mod log;
pub mod model;
pub mod observer;
pub mod report;
pub mod statistics;
pub mod words;
