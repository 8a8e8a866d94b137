//! The tasks' half of the board: the second encoder input with its times, the converters' ring, the line to the sensor under test.

use crate::analog::{self, Slow, Sweeps};
use crate::encoder::{Encoder, IndexTime, Look};
use crate::sensor_bus::SensorBus;
use crate::tick::BoardClock;
use crate::torquer::Torquer;
use core::sync::atomic::{AtomicU32, Ordering};
use stand_firmware::board::{
    Board, Clock, CurrentSum, Edge, EdgeTime, EncoderCount, GyroSample, RateCode, Stamped, SupplyCode, TemperatureCode, Ticks, TorquerStep,
};

/// How often the measurement has looked at its encoder, for the watchdog.
static LOOKS: AtomicU32 = AtomicU32::new(0);

/// How often the measurement has looked since power-on, wrapping.
pub fn looks() -> u32 {
    LOOKS.load(Ordering::Relaxed)
}

/// The tasks' half.
pub struct StandBoard {
    encoder: Encoder,
    index_time: IndexTime,
    bus: Option<SensorBus>,
    sweeps: Sweeps,
    torquer: Torquer,
    /// The edge timer with its wraps counted, as it was last seen; it goes round in 48 s and is looked at each millisecond.
    edge_time: EdgeTime,
    /// The last edge, and what the timer had caught for it.
    last_edge: Option<(u32, Edge)>,
    /// The sweep at which the converters were last seen, and when it was a new one.
    sweep: usize,
    sweep_at: Ticks,
}

impl StandBoard {
    /// The tasks' half of these.
    pub fn new(encoder: Encoder, index_time: IndexTime, bus: SensorBus) -> Self {
        Self {
            encoder,
            index_time,
            bus: Some(bus),
            sweeps: Sweeps::default(),
            torquer: Torquer::default(),
            edge_time: EdgeTime::default(),
            last_edge: None,
            sweep: 0,
            sweep_at: Ticks::default(),
        }
    }

    fn look(&mut self) -> Look {
        let look = self.encoder.look();
        let passed = look.now.wrapping_sub(self.edge_time.0 as u32);
        self.edge_time = EdgeTime(self.edge_time.0 + u64::from(passed));
        look
    }

    /// The newest sweep; if none has come since the last look, it is as old as it was.
    fn slow(&mut self) -> Stamped<Slow> {
        let sweep = analog::under_way();
        if sweep != self.sweep {
            self.sweep = sweep;
            self.sweep_at = BoardClock.now();
        }
        Stamped { value: analog::slow(), at: self.sweep_at }
    }
}

impl Board for StandBoard {
    type Clock = BoardClock;
    type SensorBus = SensorBus;

    fn clock(&self) -> BoardClock {
        BoardClock
    }

    fn encoder(&mut self) -> Stamped<EncoderCount> {
        LOOKS.fetch_add(1, Ordering::Relaxed);
        let value = self.look().count;
        Stamped { value, at: BoardClock.now() }
    }

    fn edge(&mut self) -> Option<Edge> {
        let look = self.look();
        let caught = look.edge?;
        match self.last_edge {
            // The timer may have gone round since then: what was known of this edge stays so.
            Some((known, edge)) if known == caught && edge.count == look.count => Some(edge),
            _ => {
                let edge = Edge { count: look.count, at: self.edge_time.when(caught) };
                self.last_edge = Some((caught, edge));
                Some(edge)
            }
        }
    }

    fn index(&mut self) -> Option<Edge> {
        self.look();
        // Both are caught from the same wire; a time without a count, or a count without a time, is a wire that is off.
        let (count, caught) = (self.encoder.index(), self.index_time.take());
        Some(Edge { count: count?, at: self.edge_time.when(caught?) })
    }

    fn current(&mut self) -> Stamped<CurrentSum> {
        let value = self.sweeps.current();
        Stamped { value, at: BoardClock.now() }
    }

    fn rate(&mut self) -> Option<Stamped<RateCode>> {
        None
    }

    fn supply(&mut self) -> Option<Stamped<SupplyCode>> {
        let Stamped { value, at } = self.slow();
        Some(Stamped { value: SupplyCode(u32::from(value.supply)), at })
    }

    fn temperature(&mut self) -> Option<Stamped<TemperatureCode>> {
        let Stamped { value, at } = self.slow();
        celsius(value.temperature).map(|degrees| Stamped { value: TemperatureCode((degrees * 100.0) as i32), at })
    }

    fn gyro(&mut self) -> Option<Stamped<GyroSample>> {
        self.torquer.sample(BoardClock.now())
    }

    fn torque(&mut self, at: Ticks, step: TorquerStep) {
        self.torquer.give(at, step);
    }

    fn sensor_bus(&mut self) -> Option<SensorBus> {
        self.bus.take()
    }
}

/// 10 kΩ NTC (Vishay NTCLE100E3103, B25/85 = 3977 K), to ground under 10 kΩ; `None` if the wire is off.
fn celsius(code: u16) -> Option<f32> {
    const B_K: f32 = 3977.0;
    const T0_K: f32 = 298.15;
    if !(20..=4075).contains(&code) {
        return None;
    }
    let ratio = f32::from(code) / (4096.0 - f32::from(code));
    Some(1.0 / (1.0 / T0_K + libm::logf(ratio) / B_K) - 273.15)
}
