//! A small motor in the place of the registers, so that the law meets counts, edges and an index as they come on a stand.
//!
//! One pole, no noise: what it must show is every way through the tick, not how a stand moves.

use core::f64::consts::TAU;
use stand_firmware::board::{CONTROL_HZ, Drive, EncoderCount, Hardware, Sensed, TickIo};
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
            tick: 0,
        }
    }

    /// Lets a tick pass and puts in place what the next one senses; returns its number.
    pub fn pass(&mut self) -> u64 {
        let (h, s) = (&self.hardware, &self.settings);
        let dt_s = 1.0 / CONTROL_HZ as f64;
        let volts = f64::from(self.drive.counts()) * h.volt_per_duty();
        let current_A = (volts - s.motor_constant_N_m_A * self.rate_rad_s) / s.resistance_ohm;
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
        self.sensed = Sensed { tick: self.tick, encoder: EncoderCount(self.angle as i64 as u16), ..Sensed::default() };
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
