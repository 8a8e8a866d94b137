//! A simulated stand as a serial port, which any program can open.
//!
//! [`pty`] is the port: the master side of a pseudo-terminal, which clients open and close at any time. [`pacer`] synchronises virtual with real
//! time; [`controller`] connects both to the simulated controller, [`chip`] to the emulated chip. Unix only.

pub mod chip;
pub mod controller;
pub mod pacer;
pub mod pty;

pub use chip::serve_chip;
pub use controller::serve;
pub use pacer::Pacer;
pub use pty::Pty;
