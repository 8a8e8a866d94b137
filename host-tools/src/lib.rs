//! What a person at the stand uses on the host.

pub mod allan;
pub mod calibrate;
pub mod command;
pub mod compensate;
pub mod drift;
pub mod explain;
pub mod expression;
pub mod fit;
pub mod hidden;
pub mod link;
pub mod log;
pub mod model;
pub mod observer;
pub mod pages;
pub mod plausible;
pub mod record;
pub mod report;
pub mod residual;
#[cfg(unix)]
pub mod serve;
pub mod stand;
pub mod uncertainty;
pub mod words;
