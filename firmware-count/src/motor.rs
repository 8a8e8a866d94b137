//! A small motor in the place of the registers, so that the law meets counts, edges and an index as they come on a stand.
//!
//! One pole, no noise: what it must show is every way through the tick, not how a stand moves.

use core::f64::consts::TAU;
use stand_firmware::board::{CONTROL_HZ, CurrentCode, Drive, EncoderCount, Hardware, Sensed, SupplyCode, TickIo};
use stand_firmware::speed_loop::Settings;

/// What is wrong with the stand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wrong {
    /// Nothing.
    Nothing,
    /// It is turned from outside, rad/s.
    Turned(f64),
    /// It cannot turn.
    Jammed,
    /// Its index does not come.
    NoIndex,
    /// Somebody asks for an emergency stop.
    Stop,
    /// Its encoder gives no edge any more.
    NoEdges,
    /// The supply is half of what it is to be.
    LowSupply,
    /// A tick in so many is left out.
    LosesTicks(u64),
}

/// The stand, and what the interrupt sees of it.
pub struct Motor {
    hardware: Hardware,
    settings: Settings,
    /// What is wrong now.
    pub wrong: Wrong,
    sensed: Sensed,
    index: Option<EncoderCount>,
    drive: Drive,
    /// Angle, counts.
    angle: f64,
    rate_rad_s: f64,
    supply_V: f64,
    /// Where the encoder stopped.
    stuck: Option<f64>,
    tick: u64,
}

impl Motor {
    /// At rest.
    pub fn new(hardware: Hardware, settings: Settings) -> Self {
        Self {
            hardware,
            settings,
            wrong: Wrong::Nothing,
            sensed: Sensed::default(),
            index: None,
            drive: Drive::Off,
            angle: 0.5,
            rate_rad_s: 0.0,
            supply_V: hardware.supply_nominal_V,
            stuck: None,
            tick: 0,
        }
    }

    /// Lets a tick pass and puts in place what the next one senses; returns its number.
    pub fn pass(&mut self) -> u64 {
        let (h, s) = (&self.hardware, &self.settings);
        let dt_s = 1.0 / CONTROL_HZ as f64;
        let volts = f64::from(self.drive.counts()) * h.volt_per_duty();
        // What turns it from outside may hold any current; here it holds none.
        let turned = matches!(self.wrong, Wrong::Turned(_));
        let current_A = if turned { 0.0 } else { (volts - s.motor_constant_N_m_A * self.rate_rad_s) / s.resistance_ohm };
        match self.wrong {
            Wrong::Turned(rate_rad_s) => self.rate_rad_s = rate_rad_s,
            Wrong::Jammed => self.rate_rad_s = 0.0,
            _ => self.rate_rad_s += (s.motor_constant_N_m_A * current_A / s.inertia_kg_m2) * dt_s,
        }
        let before = self.angle;
        self.angle += self.rate_rad_s * dt_s / TAU * h.counts_per_turn;
        let turn = |counts: f64| (counts / h.counts_per_turn) as i64 - i64::from(counts < 0.0);
        self.index = (turn(before) != turn(self.angle) && self.wrong != Wrong::NoIndex).then(|| {
            let at = turn(before).max(turn(self.angle)) as f64 * h.counts_per_turn;
            EncoderCount(at as i64 as u16)
        });
        self.tick += match self.wrong {
            Wrong::LosesTicks(every) if self.tick % every == 0 => 2,
            _ => 1,
        };
        // The edge's age as if it had come straight to where it is.
        let steps = h.edge_timer_Hz * dt_s;
        self.supply_V = if self.wrong == Wrong::LowSupply { 0.5 } else { 1.0 } * h.supply_nominal_V;
        let frozen = (self.wrong == Wrong::NoEdges).then(|| *self.stuck.get_or_insert(before));
        let (from, to) = frozen.map_or((before as i64, self.angle as i64), |at| (at as i64, at as i64));
        let edge_age = if from == to {
            self.sensed.edge_age.saturating_add(steps as u32)
        } else {
            let boundary = if to > from { to } else { to + 1 } as f64;
            ((self.angle - boundary) / (self.angle - before) * steps) as u32
        };
        self.sensed = Sensed {
            tick: self.tick,
            encoder: EncoderCount(to as u16),
            edge_age,
            current: CurrentCode((h.current_zero_code + current_A / h.current_A_per_code) as i32),
            supply: SupplyCode((self.supply_V / h.supply_V_per_code) as u32),
            stop: self.wrong == Wrong::Stop,
        };
        self.tick
    }
}

impl TickIo for Motor {
    #[inline]
    fn sense(&mut self) -> Sensed {
        self.sensed
    }

    #[inline]
    fn index(&mut self) -> Option<EncoderCount> {
        self.index.take()
    }

    #[inline]
    fn drive(&mut self, out: Drive) {
        self.drive = out;
    }
}
