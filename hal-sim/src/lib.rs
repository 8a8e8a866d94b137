//! The board that is not there: the simulated stand.
//!
//! * [`gyro`], stabilisers on the torquer's and the angle sensor's wires;
//! * [`plant`], the truth, integrated by other means; [`peripherals`], [`board`], [`clock`], [`session`]: the same firmware in virtual time.

// The firmware holds interrupts off where tasks and interrupt share: here that is the standard library's lock.
use critical_section as _;

pub mod board;
pub mod clock;
pub mod controller;
pub mod element;
pub mod faults;
pub mod gyro;
pub mod peripherals;
pub mod plant;
pub mod session;
