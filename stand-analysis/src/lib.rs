//! Analyses of recorded data: data in, data out, no text and no HTML.

pub mod allan;
pub mod calibrate;
pub mod compensate;
pub mod drift;
pub mod fleet;
pub mod observer;
pub mod stability;
