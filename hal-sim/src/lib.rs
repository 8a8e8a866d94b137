//! The simulated stand: the board, its peripherals, the drive, in virtual time.
//!
//! * [`plant`]: the drive, integrated independently of the model that users fit; [`gyro`] and [`element`]: gyroscopes with torquer and
//!   angle sensor;
//! * [`peripherals`], [`board`], [`clock`], [`session`], [`controller`]: the hardware below the firmware, which runs unchanged; [`faults`]:
//!   what fails, and when.

// The firmware disables interrupts where tasks and interrupt share data: here that is the lock of the standard library.
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
pub mod setup;
