//! A simulated stand as a serial port, which any program can open.
//!
//! [`pty`] is the port: the master's side of a pseudo-terminal, which clients open and close as they like. [`pace`] holds the stand's virtual
//! time to the wall's, [`stand`] joins both to the simulated controller. Unix only.

pub mod controller;
pub mod pacer;
pub mod pty;

pub use controller::serve;
pub use pacer::Pacer;
pub use pty::Pty;
