//! The sensor under test, whichever of the supported parts answers on the bus.

use super::line::BusLine;
use super::{Adxl355, Drained, InForce, Ism330dhcx, Ready, Sample, SelfTest, Sensor, SensorError, Setup};
use crate::board::{Clock, SensorSpi, Stamped};

/// A part with its driver.
enum Part<D: SensorSpi, C: Clock> {
    Ism330dhcx(Ism330dhcx<D, C>),
    Adxl355(Adxl355<D, C>),
}

/// The supported parts behind one driver; [`Sensor::detect`] selects the part.
pub struct DetectedSensor<D: SensorSpi, C: Clock> {
    /// `None` only while the part is being exchanged.
    part: Option<Part<D, C>>,
}

/// Calls a method of the selected part's driver.
macro_rules! of_part {
    ($self:ident, $part:ident => $call:expr) => {
        match &mut $self.part {
            Some(Part::Ism330dhcx($part)) => $call,
            Some(Part::Adxl355($part)) => $call,
            None => Err(SensorError::Bus),
        }
    };
}

impl<D: SensorSpi, C: Clock> DetectedSensor<D, C> {
    /// The sensor on this bus; sends nothing yet.
    pub fn new(device: D, clock: C) -> Self {
        Self { part: Some(Part::Ism330dhcx(Ism330dhcx::new(device, clock))) }
    }

    /// Selects the driver that `part` makes on the bus.
    fn select(&mut self, part: impl FnOnce(BusLine<D, C>) -> Part<D, C>) {
        self.part = self.part.take().map(|present| {
            part(match present {
                Part::Ism330dhcx(sensor) => sensor.line,
                Part::Adxl355(sensor) => sensor.line,
            })
        });
    }
}

impl<D: SensorSpi, C: Clock> Sensor for DetectedSensor<D, C> {
    fn name(&self) -> &'static str {
        match &self.part {
            Some(Part::Adxl355(sensor)) => sensor.name(),
            Some(Part::Ism330dhcx(sensor)) => sensor.name(),
            None => "",
        }
    }

    /// Asks for the ISM330DHCX first: its read command reads a reserved register of an ADXL355 and changes nothing there. Where neither
    /// part answers, the error is that of the ISM330DHCX; where Analog Devices answers with another part, that of the ADXL355.
    async fn detect(&mut self) -> Result<(), SensorError> {
        self.select(|line| Part::Ism330dhcx(Ism330dhcx::on(line)));
        let Err(error) = self.identify().await else { return Ok(()) };
        if error == SensorError::Bus {
            return Err(error);
        }
        self.select(|line| Part::Adxl355(Adxl355::on(line)));
        match self.identify().await {
            Err(SensorError::Absent { expected: 0xAD, .. } | SensorError::WrongChip { expected: 0xAD, .. }) => {
                self.select(|line| Part::Ism330dhcx(Ism330dhcx::on(line)));
                Err(error)
            }
            answer => answer,
        }
    }

    async fn identify(&mut self) -> Result<(), SensorError> {
        of_part!(self, part => part.identify().await)
    }

    async fn configure(&mut self, wanted: &Setup) -> Result<InForce, SensorError> {
        of_part!(self, part => part.configure(wanted).await)
    }

    async fn ready(&mut self) -> Result<Ready, SensorError> {
        of_part!(self, part => part.ready().await)
    }

    async fn drain(&mut self, samples: &mut [Sample]) -> Result<Drained, SensorError> {
        of_part!(self, part => part.drain(samples).await)
    }

    async fn stamp(&mut self) -> Result<Stamped<u32>, SensorError> {
        of_part!(self, part => part.stamp().await)
    }

    async fn temperature_C(&mut self) -> Result<f32, SensorError> {
        of_part!(self, part => part.temperature_C().await)
    }

    async fn self_test(&mut self) -> Result<SelfTest, SensorError> {
        of_part!(self, part => part.self_test().await)
    }
}
