//! The host side of the rotary stand: sessions, analyses and reports behind the command `stand`, on the library `identification`.
//!
//! Layers, lowest first: [`acquire`]; the analyses [`allan`], [`calibrate`], [`compensate`], [`drift`], [`fleet`], [`observer`] and [`stability`], which return data;
//! [`lab`], the works of the laboratory course;
//! [`report`], which makes text, HTML and JSON of them and of [`identify`]; [`panel`], which serves a page; [`command`].

pub mod acquire;
pub mod allan;
pub mod calibrate;
pub mod command;
pub mod compensate;
pub mod drift;
pub mod fleet;
pub mod lab;
pub mod observer;
pub mod panel;
pub mod report;
pub mod stability;

pub use identification::{budget, deadline, files, identify, log, model, statistics, words};
