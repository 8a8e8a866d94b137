//! The STM32F446 executing the flashed image, instruction by instruction, joined to a plant of `hal-sim`.
//!
//! * [`cpu`]: the core's instruction set (ARMv7E-M with FPv4-SP); [`system_control`]: its own registers;
//! * [`peripherals`], [`soc`]: the chip; [`board`]: what is wired to its pins;
//! * [`image`], [`rtt`]: the ELF file and its log; [`machine`]: the whole, with measurements.
//!
//! Not modelled: analog behaviour beyond codes and noise, errata, bus contention. Nothing here has been compared with a real chip.

pub mod board;
pub mod cpu;
pub mod image;
pub mod log;
pub mod machine;
pub mod peripherals;
pub mod rtt;
pub mod soc;
pub mod system_control;
pub mod time;
