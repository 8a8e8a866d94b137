//! A small motor model in place of the registers: it supplies encoder counts, edges and an index to the control law.
//!
//! Single pole, no noise. The model exercises every path through the tick; it does not reproduce the stand's dynamics.

use core::f64::consts::TAU;
use stand_firmware::board::{CONTROL_HZ, CurrentCode, Drive, EncoderCount, Hardware, Sensed, SupplyCode, TickIo};
use stand_firmware::speed_loop::Settings;

/// A disturbance of the stand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Disturbance {
    /// None.
    None,
    /// An external drive turns the platform at this rate, rad/s.
    ExternallyDriven(f64),
    /// The platform is blocked.
    Blocked,
    /// The index pulse is missing.
    NoIndex,
    /// Emergency stop is pressed.
    Stop,
    /// The encoder gives no edges.
    NoEdges,
    /// The supply is at half of its nominal voltage.
    LowSupply,
    /// One tick of this many is skipped.
    LosesTicks(u64),
}

/// The simulated stand as the interrupt sees it.
pub struct Motor {
    hardware: Hardware,
    settings: Settings,
    /// The disturbance in force.
    pub disturbance: Disturbance,
    sensed: Sensed,
    index: Option<EncoderCount>,
    drive: Drive,
    /// Angle, counts.
    angle: f64,
    rate_rad_s: f64,
    supply_V: f64,
    /// Encoder position at which the edges stopped.
    stuck: Option<f64>,
    tick: u64,
}

impl Motor {
    /// A motor at rest.
    pub fn new(hardware: Hardware, settings: Settings) -> Self {
        Self {
            hardware,
            settings,
            disturbance: Disturbance::None,
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

    /// Advances one tick and prepares the sensor values of the next tick. Returns its number.
    pub fn pass(&mut self) -> u64 {
        let (h, s) = (&self.hardware, &self.settings);
        let dt_s = 1.0 / CONTROL_HZ as f64;
        let volts = f64::from(self.drive.counts()) * h.volt_per_duty();
        // An external drive may cause any current; the model uses none.
        let turned = matches!(self.disturbance, Disturbance::ExternallyDriven(_));
        let current_A = if turned { 0.0 } else { (volts - s.motor_constant_N_m_A * self.rate_rad_s) / s.resistance_ohm };
        match self.disturbance {
            Disturbance::ExternallyDriven(rate_rad_s) => self.rate_rad_s = rate_rad_s,
            Disturbance::Blocked => self.rate_rad_s = 0.0,
            _ => self.rate_rad_s += (s.motor_constant_N_m_A * current_A / s.inertia_kg_m2) * dt_s,
        }
        let before = self.angle;
        self.angle += self.rate_rad_s * dt_s / TAU * h.counts_per_turn;
        let turn = |counts: f64| (counts / h.counts_per_turn) as i64 - i64::from(counts < 0.0);
        self.index = (turn(before) != turn(self.angle) && self.disturbance != Disturbance::NoIndex).then(|| {
            let at = turn(before).max(turn(self.angle)) as f64 * h.counts_per_turn;
            EncoderCount(at as i64 as u16)
        });
        self.tick += match self.disturbance {
            Disturbance::LosesTicks(every) if self.tick % every == 0 => 2,
            _ => 1,
        };
        // The edge's age assumes a constant rate over the tick.
        let steps = h.edge_timer_Hz * dt_s;
        self.supply_V = if self.disturbance == Disturbance::LowSupply { 0.5 } else { 1.0 } * h.supply_nominal_V;
        let frozen = (self.disturbance == Disturbance::NoEdges).then(|| *self.stuck.get_or_insert(before));
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
            is_stale: false,
            stop: self.disturbance == Disturbance::Stop,
            announced_stall: false,
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
