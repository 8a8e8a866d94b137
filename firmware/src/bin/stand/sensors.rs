//! Board access of the tasks ([`Board`]): second encoder input with edge times, ADC ring, SPI bus of the sensor under test.

use crate::analog::{self, SlowChannels, Sweeps};
use crate::encoder::{Encoder, Reading, RisingEdges};
use crate::sensor_bus::SensorBus;
use crate::tick::BoardClock;
use crate::torquer::Torquer;
use core::sync::atomic::{AtomicU32, Ordering};
use stand_firmware::board::{
    Board, Clock, CurrentSum, Edge, EdgeTime, EncoderCount, GyroSample, RateCode, Stamped, SupplyCode, TemperatureCode, Ticks, TorquerStep,
};

/// Number of encoder readings of the measurement loop, for the watchdog.
static ENCODER_READINGS: AtomicU32 = AtomicU32::new(0);

/// Number of encoder readings of the measurement loop since power-on, wrapping.
pub fn encoder_readings() -> u32 {
    ENCODER_READINGS.load(Ordering::Relaxed)
}

/// Hardware that the tasks own.
pub struct StandBoard {
    encoder: Encoder,
    index_time: RisingEdges,
    clock_reference: RisingEdges,
    bus: Option<SensorBus>,
    sweeps: Sweeps,
    torquer: Torquer,
    /// Edge timer at the last reading, extended to 64 bits; the timer wraps after 48 s and is read each millisecond.
    edge_time: EdgeTime,
    /// The last edge with its captured time.
    last_edge: Option<(u32, Edge)>,
    /// Number of the last sweep, and the time when it was new.
    sweep: usize,
    sweep_at: Ticks,
}

impl StandBoard {
    /// Board access with this hardware.
    pub fn new(encoder: Encoder, index_time: RisingEdges, clock_reference: RisingEdges, bus: SensorBus) -> Self {
        Self {
            encoder,
            index_time,
            clock_reference,
            bus: Some(bus),
            sweeps: Sweeps::default(),
            torquer: Torquer::default(),
            edge_time: EdgeTime::default(),
            last_edge: None,
            sweep: 0,
            sweep_at: Ticks::default(),
        }
    }

    #[inline(never)] // for the size of the image
    fn read(&mut self) -> Reading {
        let reading = self.encoder.read();
        let passed = reading.now.wrapping_sub(self.edge_time.0 as u32);
        self.edge_time = EdgeTime(self.edge_time.0 + u64::from(passed));
        reading
    }

    /// The newest sweep; its time stamp is unchanged where no sweep came since the last call.
    fn slow_channels(&mut self) -> Stamped<SlowChannels> {
        let sweep = analog::sweep_in_progress();
        if sweep != self.sweep {
            self.sweep = sweep;
            self.sweep_at = BoardClock.now();
        }
        Stamped { value: analog::slow_channels(), at: self.sweep_at }
    }
}

impl Board for StandBoard {
    type Clock = BoardClock;
    type SensorBus = SensorBus;

    fn clock(&self) -> BoardClock {
        BoardClock
    }

    fn encoder(&mut self) -> Stamped<EncoderCount> {
        ENCODER_READINGS.fetch_add(1, Ordering::Relaxed);
        let value = self.read().count;
        Stamped { value, at: BoardClock.now() }
    }

    fn edge(&mut self) -> Option<Edge> {
        let reading = self.read();
        let caught = reading.edge?;
        match self.last_edge {
            // The timer may have wrapped since this edge: its known time stays.
            Some((known, edge)) if known == caught && edge.count == reading.count => Some(edge),
            _ => {
                let edge = Edge { count: reading.count, at: self.edge_time.when(caught) };
                self.last_edge = Some((caught, edge));
                Some(edge)
            }
        }
    }

    fn index(&mut self) -> Option<Edge> {
        // Both are captured from the same signal. One without the other means a broken wire.
        let (count, caught) = (self.encoder.index(), self.index_time.take());
        // After the captures: they must not be later than the extended time.
        self.read();
        Some(Edge { count: count?, at: self.edge_time.when(caught?) })
    }

    fn reference_pulse(&mut self) -> Option<EdgeTime> {
        let caught = self.clock_reference.take()?;
        self.read();
        Some(self.edge_time.when(caught))
    }

    fn current(&mut self) -> Stamped<CurrentSum> {
        let value = self.sweeps.current();
        Stamped { value, at: BoardClock.now() }
    }

    fn rate(&mut self) -> Option<Stamped<RateCode>> {
        None
    }

    fn supply(&mut self) -> Option<Stamped<SupplyCode>> {
        let Stamped { value, at } = self.slow_channels();
        Some(Stamped { value: SupplyCode(u32::from(value.supply)), at })
    }

    fn temperature(&mut self) -> Option<Stamped<TemperatureCode>> {
        let Stamped { value, at } = self.slow_channels();
        celsius(value.temperature).map(|degrees| Stamped { value: TemperatureCode((degrees * 100.0) as i32), at })
    }

    fn gyro(&mut self) -> Option<Stamped<GyroSample>> {
        self.torquer.sample(BoardClock.now())
    }

    fn torque(&mut self, at: Ticks, step: TorquerStep) {
        self.torquer.set_output(at, step);
    }

    fn sensor_bus(&mut self) -> Option<SensorBus> {
        self.bus.take()
    }
}

/// 10 kΩ NTC (Vishay NTCLE100E3103, B25/85 = 3977 K), between input and ground, with 10 kΩ to the reference; `None`: wire broken or
/// shorted.
fn celsius(code: u16) -> Option<f32> {
    const B_K: f32 = 3977.0;
    const T0_K: f32 = 298.15;
    if !(20..=4075).contains(&code) {
        return None;
    }
    let ratio = f32::from(code) / (4096.0 - f32::from(code));
    Some(1.0 / (1.0 / T0_K + libm::logf(ratio) / B_K) - 273.15)
}
