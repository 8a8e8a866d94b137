//! The sensor under test, at register level: ST ISM330DHCX (data sheet DS13012, application note AN5398) or Analog Devices ADXL355.
//!
//! Input: the motion at its position, and bytes over SPI. Output: bytes. The chip has an oscillator of its own, with an error of some
//! tenths of a percent, for samples, time stamps, FIFO and flags. Gyroscope and accelerometer are low-passed (first order, at
//! the cutoff that the registers select), noisy and rounded to codes. Not simulated, because the stand does not use them: interrupt
//! pins, the other buses, the embedded functions.
//!
//! z is the axis of the platform, x points outward, y along the motion. A sensor that its registers switch off costs no time.

mod adxl355;
mod chip;
mod element;
mod fault;
mod fifo;
mod ism330dhcx;
mod mounting;
mod ramp;
mod registers;

pub use chip::{Chip, Part};
pub use element::GyroElement;
pub use fault::Fault;
pub use mounting::{Imu, ImuSetup, Mounting, SensorOrientation};
