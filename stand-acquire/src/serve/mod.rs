//! A simulated stand as a serial port, which any program can open, or as a TCP port.
//!
//! [`line`] is the port: the master side of a pseudo-terminal ([`pty`]), or a socket ([`tcp`]); clients come and go at any time. [`pacer`]
//! synchronises virtual with real time; [`controller`] connects both to the simulated controller, [`chip`] to the emulated chip;
//! [`simulated`] runs the first behind a pseudo-terminal on a thread. Unix only.

pub mod chip;
pub mod controller;
pub mod line;
pub mod pacer;
pub mod pty;
pub mod simulated;
pub mod tcp;

pub use chip::serve_chip;
pub use controller::serve;
pub use line::{ServedLine, ServedLineError};
pub use pacer::Pacer;
pub use pty::Pty;
pub use simulated::SimulatedStand;
pub use tcp::TcpPort;
