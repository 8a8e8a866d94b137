//! The chip's peripherals, register by register, after RM0390 (STM32F446, revision 7). Each register access returns `None` where the
//! register or the requested function is not modelled, which ends the simulation with an error that names the address.

pub mod adc;
pub mod advanced_timer;
pub mod dac;
pub mod dma;
pub mod flash;
pub mod general_timer;
pub mod gpio;
pub mod rcc;
pub mod spi;
pub mod up_counter;
pub mod usart;
pub mod watchdog;
