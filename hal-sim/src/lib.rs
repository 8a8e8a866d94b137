//! The board that is not there: the simulated stand.
//!
//! * [`effects`], the physical effects, and [`rig`], the model that is made of them (also what users fit);
//! * [`plant`], the truth, integrated by other means; [`peripherals`], [`board`], [`clock`], [`session`]: the same firmware in virtual time.

pub mod board;
pub mod clock;
pub mod effects;
pub mod faults;
pub mod peripherals;
pub mod plant;
pub mod rig;
pub mod session;
