//! The sensor under test, at the level of its registers: ST's ISM330DHCX (data sheet DS13012, application note AN5398).
//!
//! In: what the platform does where the sensor rides on it, and bytes over SPI. Out: bytes. The chip has an oscillator of its own, which is
//! off by some of a per cent; at its own pace it samples, stamps, fills its FIFO and raises its flags. Gyro and accelerometer are low-passed
//! (first order, at the cutoff that the registers select), noisy and rounded to codes. What cannot be seen through the registers that the
//! stand uses is not there: interrupts on pins, the other buses, the embedded functions.
//!
//! z is the platform's axis, x points outward, y along the motion. It costs nothing while it is switched off by its registers.

mod chip;
mod element;
mod fifo;
mod mounting;
mod ramp;
mod registers;

pub use chip::{Chip, Fault};
pub use element::GyroElement;
pub use mounting::{Imu, ImuSetup, Lying, Mounted};
