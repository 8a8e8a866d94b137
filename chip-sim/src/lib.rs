//! Simulator of the STM32F446RE that runs the flashed image instruction by instruction.
pub mod cpu;
