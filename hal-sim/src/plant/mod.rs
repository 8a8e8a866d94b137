//! The truth of the simulated stand.
//!
//! The same effects as the model's ([`crate::effects`]), integrated by other means: Runge and Kutta's fourth order, with the instants at
//! which the rotor stops located and sticking held as a constraint, and finer steps where winding, shaft or bristle need them. Nothing of
//! [`crate::rig`] is used here, so that an error of the one is not hidden by the other.
//!
//! In: the voltage asked for, tick by tick. Out: [`PlantPort`], what the sensors' elements see; noise, quantisation and filters are
//! [`crate::peripherals`]'.

mod sensing;
pub mod stand;

use crate::board::PlantPort;
use crate::effects::{self, Acts, Arms, Point, T0_C, Thermal};
use sensing::{Placed, Sensing};
pub use stand::{Stand, StandError};

/// State: rate, current, angle, charge since the last tick; with shaft or bristle also the motor's rate, twist, bristle.
type State = [f64; FULL];
const FULL: usize = 7;
/// What a drive without shaft and bristle needs of it.
const PLAIN: usize = 4;
const OMEGA: usize = 0;
const CURRENT: usize = 1;
const THETA: usize = 2;
const CHARGE: usize = 3;
const MOTOR: usize = 4;
const TWIST: usize = 5;
const BRISTLE: usize = 6;

/// Longest step as a part of the fastest time constant.
const STEP_OF_FASTEST: f64 = 0.5;
/// A bristle that settles faster than this is not followed on its way, s: what it does there no sensor sees.
const QUICKEST_BRISTLE_S: f64 = 5e-6;
/// Shortest touch of a flank that is looked for, s.
const TOUCH_S: f64 = 2e-5;
/// Most steps within one tick.
const MOST_STEPS: f64 = 200.0;

/// What stays as it is within a step: on which side of their corners dry friction and the drop of the brushes are.
#[derive(Clone, Copy)]
struct Way {
    /// Direction in which the rotor slides; 0: it is held.
    slides: f64,
    /// Direction of the current, where a drop opposes it; 0: none flows.
    flows: f64,
}

/// A drive with its effects.
pub struct Plant {
    inertia: f64,
    motor_constant: f64,
    resistance: f64,
    /// Laws that act, and laws that only change what a sensor sees.
    laws: Vec<Placed>,
    seen: Vec<Placed>,
    arms: Arms<f64>,
    thermal: Thermal<f64>,
    /// Some effect eats a voltage.
    drops: bool,
    nominal_V: f64,
    supply_V: f64,
    /// The surroundings above the laws' reference temperature, K.
    ambient_K: f64,
    t_s: f64,
    state: State,
    heat_K: f64,
    mean_current_A: f64,
    sensing: Sensing,
}

impl Plant {
    /// The plant of a stand, at rest and cold, with its index at `theta_rad` before the encoder's zero.
    ///
    /// # Errors
    /// An effect or a parameter that the catalogue does not know, or a value out of its range.
    pub fn new(stand: &Stand, theta_rad: f64) -> Result<Self, StandError> {
        let placed = stand.placed()?;
        let mut arms = Arms::default();
        let (mut laws, mut seen) = (Vec::new(), Vec::new());
        for (id, parameters) in placed {
            let Some(law) = effects::law::<f64>(id) else { continue };
            law.arm(&parameters, &mut arms);
            if law.is_silent() { seen.push((law, parameters)) } else { laws.push((law, parameters)) }
        }
        let thermal = arms.thermal.unwrap_or(Thermal { J_K: stand.drive.thermal_J_K, K_W: stand.drive.thermal_K_W });
        let mut state = [0.0; FULL];
        state[THETA] = theta_rad;
        let sensing = Sensing::new(&arms);
        let mut plant = Plant {
            inertia: stand.drive.inertia_kg_m2,
            motor_constant: stand.drive.motor_constant_N_m_A,
            resistance: stand.drive.resistance_ohm,
            laws,
            seen,
            arms,
            thermal,
            drops: false,
            nominal_V: stand.drive.supply_V,
            supply_V: stand.drive.supply_V,
            ambient_K: stand.drive.ambient_C - T0_C,
            t_s: 0.0,
            state,
            heat_K: stand.drive.ambient_C - T0_C,
            mean_current_A: 0.0,
            sensing,
        };
        plant.drops = plant.acts(&plant.state, 0.0, 0.0, 0.0).drop_V > 0.0;
        plant.sense(0.0);
        Ok(plant)
    }

    /// Energy in the rotor, shaft and bristle, J: what friction may only take from.
    pub fn mechanical_energy_J(&self) -> f64 {
        let s = &self.state;
        let bristle = self.arms.bristle_N_m_rad.map_or(0.0, |stiffness| 0.5 * stiffness * s[BRISTLE].powi(2));
        bristle
            + match &self.arms.shaft {
                None => 0.5 * self.inertia * s[OMEGA].powi(2),
                Some(shaft) => {
                    let wound = past_gap(s[TWIST], shaft.gap);
                    0.5 * self.inertia * (shaft.share * s[MOTOR].powi(2) + (1.0 - shaft.share) * s[OMEGA].powi(2))
                        + 0.5 * shaft.stiffness * wound * wound
                }
            }
    }

    /// Sets the rate, rad/s, of everything that turns.
    pub fn spin(&mut self, omega_rad_s: f64) {
        self.state[OMEGA] = omega_rad_s;
        self.state[MOTOR] = omega_rad_s;
        self.sense(0.0);
    }

    /// Where the rate that friction and winding see stands in a state of N.
    #[inline]
    fn motor<const N: usize>(&self) -> usize {
        if N == FULL && self.arms.shaft.is_some() { MOTOR } else { OMEGA }
    }

    /// Inertia that friction acts on.
    #[inline]
    fn rubbed_inertia<const N: usize>(&self) -> f64 {
        if N == PLAIN { self.inertia } else { self.arms.shaft.as_ref().map_or(self.inertia, |s| self.inertia * s.share) }
    }

    #[inline]
    fn point<const N: usize>(&self, s: &[f64; N], current: f64, asked_V: f64, t_s: f64) -> Point<f64> {
        Point {
            from_s: t_s,
            to_s: t_s,
            theta: s[THETA],
            omega: s[self.motor::<N>()],
            current,
            voltage: asked_V,
            temp_C: self.heat_K + T0_C,
            // The bridge itself follows the supply (`advance`); the law is not to count it twice.
            supply_ratio: 1.0,
            rate_from_encoder: false,
        }
    }

    #[inline(always)]
    fn acts<const N: usize>(&self, s: &[f64; N], current: f64, asked_V: f64, t_s: f64) -> Acts<f64> {
        let x = self.point(s, current, asked_V, t_s);
        let mut acts = Acts::none();
        for (law, parameters) in &self.laws {
            law.act(parameters, &x, &mut acts);
        }
        acts
    }

    /// Laws and current at a state. The current of a winding without inductance follows at once, found with the laws that ask for it.
    #[inline(always)]
    fn at<const N: usize>(&self, s: &[f64; N], asked_V: f64, t_s: f64) -> (Acts<f64>, f64) {
        if self.arms.inductance_H.is_some() {
            return (self.acts(s, s[CURRENT], asked_V, t_s), s[CURRENT]);
        }
        let mut current = s[CURRENT];
        let mut acts = self.acts(s, current, asked_V, t_s);
        let rounds = if self.arms.by_current { 8 } else { 1 };
        for round in 0..rounds {
            let v = asked_V + acts.voltage - self.motor_constant * acts.motor_factor * s[self.motor::<N>()];
            current = past_gap(v, 2.0 * acts.drop_V) / (self.resistance * acts.resistance_factor + acts.series_ohm);
            if round + 1 < rounds {
                acts = self.acts(s, current, asked_V, t_s);
            }
        }
        (acts, current)
    }

    /// Torque on what friction rubs, without the dry part, N m.
    #[inline(always)]
    fn torque<const N: usize>(&self, s: &[f64; N], acts: &Acts<f64>, current: f64) -> f64 {
        let motor_omega = s[self.motor::<N>()];
        let mut torque = self.motor_constant * acts.motor_factor * current + acts.torque - acts.viscous * acts.viscous_factor * motor_omega;
        if N == FULL {
            torque -= self.arms.bristle_N_m_rad.map_or(0.0, |stiffness| stiffness * s[BRISTLE]);
            torque -= self.arms.shaft.as_ref().map_or(0.0, |shaft| through(shaft, s));
        }
        torque
    }

    /// Time derivative while the rotor slides and the current flows this way.
    #[inline(always)]
    fn derivative<const N: usize>(&self, s: &[f64; N], way: Way, asked_V: f64, t_s: f64) -> [f64; N] {
        let (acts, current) = self.at(s, asked_V, t_s);
        let motor = self.motor::<N>();
        let mut d = [0.0; N];
        let bristle = self.arms.bristle_N_m_rad;
        let dry = if bristle.is_some() { 0.0 } else { acts.dry };
        let acceleration =
            if way.slides == 0.0 { 0.0 } else { (self.torque(s, &acts, current) - way.slides * dry) / self.rubbed_inertia::<N>() };
        d[motor] = acceleration;
        d[THETA] = s[OMEGA];
        d[CHARGE] = current;
        if let Some(inductance) = self.arms.inductance_H {
            let v = asked_V + acts.voltage - self.motor_constant * acts.motor_factor * s[motor];
            let resistance = self.resistance * acts.resistance_factor + acts.series_ohm;
            d[CURRENT] =
                if self.drops && way.flows == 0.0 { 0.0 } else { (v - acts.drop_V * way.flows - resistance * current) / inductance };
        }
        if N < FULL {
            return d;
        }
        if let Some(shaft) = &self.arms.shaft {
            d[OMEGA] = through(shaft, s) / (self.inertia - self.rubbed_inertia::<N>());
            d[TWIST] = s[MOTOR] - s[OMEGA];
        }
        if let (Some(stiffness), true) = (bristle, acts.dry > 0.0) {
            let settled = acts.dry / stiffness * s[motor].signum();
            d[BRISTLE] = (settled - s[BRISTLE]) * (s[motor].abs() * stiffness / acts.dry).min(1.0 / QUICKEST_BRISTLE_S);
        }
        d
    }

    #[inline]
    fn runge_kutta<const N: usize>(&self, s: &[f64; N], way: Way, asked_V: f64, t_s: f64, h: f64) -> [f64; N] {
        let k1 = self.derivative(s, way, asked_V, t_s);
        let k2 = self.derivative(&along(s, &k1, 0.5 * h), way, asked_V, t_s + 0.5 * h);
        let k3 = self.derivative(&along(s, &k2, 0.5 * h), way, asked_V, t_s + 0.5 * h);
        let k4 = self.derivative(&along(s, &k3, h), way, asked_V, t_s + h);
        let mut next = *s;
        for k in 0..next.len() {
            next[k] += h / 6.0 * (k1[k] + 2.0 * (k2[k] + k3[k]) + k4[k]);
        }
        next
    }

    /// Which way the rotor slides at this state; 0: the dry level holds it.
    fn direction<const N: usize>(&self, s: &[f64; N], asked_V: f64, t_s: f64) -> f64 {
        let omega = s[self.motor::<N>()];
        if omega != 0.0 {
            return omega.signum();
        }
        let (acts, current) = self.at(s, asked_V, t_s);
        if self.arms.bristle_N_m_rad.is_some() {
            return 1.0;
        }
        let torque = self.torque(s, &acts, current);
        if torque.abs() <= acts.dry { 0.0 } else { torque.signum() }
    }

    /// Which way the current flows or begins to; 0: the drop lets none through.
    fn flow<const N: usize>(&self, s: &[f64; N], asked_V: f64, t_s: f64) -> f64 {
        if s[CURRENT] != 0.0 {
            return s[CURRENT].signum();
        }
        let (acts, _) = self.at(s, asked_V, t_s);
        let v = asked_V + acts.voltage - self.motor_constant * acts.motor_factor * s[self.motor::<N>()];
        if v.abs() <= acts.drop_V { 0.0 } else { v.signum() }
    }

    /// One step, in which the rotor may stop: the instant is located, and what is left begins from rest.
    #[inline]
    fn step<const N: usize>(&self, state: &mut [f64; N], asked_V: f64, mut t_s: f64, mut h: f64) {
        let motor = self.motor::<N>();
        let sticks = self.arms.bristle_N_m_rad.is_none();
        // The drop of the brushes may end a current, not turn it round.
        let drops = self.drops && self.arms.inductance_H.is_some();
        let gap = N == FULL && self.arms.shaft.as_ref().is_some_and(|shaft| shaft.gap > 0.0);
        // A rotor can stop, turn and stop again within a step only by a chatter that rest ends; so can two masses in a gap.
        for _ in 0..8 {
            let direction = self.direction(state, asked_V, t_s);
            let way = Way { slides: direction, flows: if drops { self.flow(state, asked_V, t_s) } else { 0.0 } };
            let held = Way { slides: 0.0, ..way };
            let mut next = self.runge_kutta(state, way, asked_V, t_s, h);
            let mut reach = h;
            if (gap || drops) && self.changes(state, &next) {
                // Contact begins or ends, or a current comes to its end: the step goes just beyond that instant, and another follows.
                reach = Self::last_of(h, |part| !self.changes(state, &self.runge_kutta(state, way, asked_V, t_s, part)));
                next = self.runge_kutta(state, way, asked_V, t_s, reach);
                if drops && next[CURRENT] * state[CURRENT] < 0.0 {
                    next[CURRENT] = 0.0;
                }
            }
            if sticks && direction == 0.0 && self.direction(&next, asked_V, t_s + reach) != 0.0 {
                // It breaks away within the step, as the current rises or a load comes: the first instant at which it is not held.
                let still = |part| self.runge_kutta(state, held, asked_V, t_s, part);
                let free = Self::last_of(reach, |part| self.direction(&still(part), asked_V, t_s + part) == 0.0);
                *state = still(free);
                t_s += free;
                h -= free;
                if h <= 1e-12 {
                    break;
                }
                continue;
            }
            let passed = sticks && direction != 0.0 && next[motor] * direction < 0.0;
            if !passed {
                *state = next;
                t_s += reach;
                h -= reach;
                if h <= 1e-12 {
                    break;
                }
                continue;
            }
            // Illinois' regula falsi on the length of the step.
            let (mut low, mut high) = (0.0, reach);
            let (mut at_low, mut at_high) = (state[motor], next[motor]);
            if at_low == 0.0 {
                // From rest against its own direction: rounding. It stays at rest.
                *state = self.runge_kutta(state, held, asked_V, t_s, h);
                h = 0.0;
                break;
            }
            let mut stopped = next;
            let mut part = reach;
            for _ in 0..20 {
                part = low - at_low * (high - low) / (at_high - at_low);
                stopped = self.runge_kutta(state, way, asked_V, t_s, part);
                let omega = stopped[motor];
                if omega.abs() < 1e-12 || high - low < 1e-12 {
                    break;
                }
                if omega * direction > 0.0 {
                    low = part;
                    at_low = omega;
                    at_high *= 0.5;
                } else {
                    high = part;
                    at_high = omega;
                    at_low *= 0.5;
                }
            }
            stopped[motor] = 0.0;
            *state = stopped;
            t_s += part;
            h -= part;
            if h <= 1e-12 {
                break;
            }
        }
        if h > 1e-12 {
            // Chatter: what is left goes as it goes now.
            let way = Way { slides: self.direction(state, asked_V, t_s), flows: if drops { self.flow(state, asked_V, t_s) } else { 0.0 } };
            *state = self.runge_kutta(state, way, asked_V, t_s, h);
        }
    }

    /// The instant in (0, h] after which `so` is no longer so, from just beyond it, s.
    fn last_of(h: f64, so: impl Fn(f64) -> bool) -> f64 {
        let (mut low, mut high) = (0.0, h);
        while high - low > 1e-9 {
            let part = 0.5 * (low + high);
            if so(part) {
                low = part;
            } else {
                high = part;
            }
        }
        high
    }

    /// Between these states a flank is touched or left, or the current passes zero.
    fn changes<const N: usize>(&self, from: &[f64; N], to: &[f64; N]) -> bool {
        let side = |s: &[f64; N]| match &self.arms.shaft {
            Some(shaft) if N == FULL && shaft.gap > 0.0 => past_gap(s[TWIST], shaft.gap).partial_cmp(&0.0),
            _ => None,
        };
        side(from) != side(to) || (self.drops && self.arms.inductance_H.is_some() && from[CURRENT] * to[CURRENT] < 0.0)
    }

    /// Steps within a tick: by the fastest of winding, shaft and bristle.
    fn steps(&self, dt_s: f64) -> f64 {
        let mut fastest_s = f64::INFINITY;
        if let Some(inductance) = self.arms.inductance_H {
            fastest_s = fastest_s.min(inductance / self.resistance);
        }
        if let Some(shaft) = &self.arms.shaft {
            let reduced = self.inertia * shaft.share * (1.0 - shaft.share);
            fastest_s = fastest_s.min((reduced / shaft.stiffness).sqrt() * 0.2).min(0.2 * reduced / shaft.damping.max(1e-12));
            if shaft.gap > 0.0 {
                // So that a flank is not touched and left again between two steps.
                fastest_s = fastest_s.min(TOUCH_S);
            }
        }
        if let Some(stiffness) = self.arms.bristle_N_m_rad {
            // The bristle's own constant is its breakaway angle over the rate; a dry level of 10 µN m is the least that is looked for.
            let (acts, _) = self.at(&self.state, 0.0, self.t_s);
            let constant_s = acts.dry.max(1e-5) / stiffness / self.state[OMEGA].abs().max(1e-3);
            fastest_s = fastest_s.min(constant_s.max(QUICKEST_BRISTLE_S)).min((self.inertia / stiffness).sqrt());
        }
        (dt_s / (STEP_OF_FASTEST * fastest_s)).ceil().clamp(1.0, MOST_STEPS)
    }

    fn sense(&mut self, dt_s: f64) {
        let x = self.point(&self.state, self.mean_current_A, 0.0, self.t_s);
        self.sensing.take(&self.seen, &x, self.state[OMEGA], self.state[THETA], self.mean_current_A, dt_s);
    }
}

impl PlantPort for Plant {
    fn advance(&mut self, asked_V: f64, dt_s: f64) {
        let steps = self.steps(dt_s);
        let h = dt_s / steps;
        self.state[CHARGE] = 0.0;
        // Duty times the supply as it is now.
        let asked_V = asked_V * (self.supply_V / self.nominal_V);
        let mut state = self.state;
        if self.arms.shaft.is_some() || self.arms.bristle_N_m_rad.is_some() {
            for k in 0..steps as u32 {
                self.step(&mut state, asked_V, self.t_s + f64::from(k) * h, h);
            }
        } else {
            let [omega, current, theta, charge, ..] = state;
            let mut plain: [f64; PLAIN] = [omega, current, theta, charge];
            for k in 0..steps as u32 {
                self.step(&mut plain, asked_V, self.t_s + f64::from(k) * h, h);
            }
            state[..PLAIN].copy_from_slice(&plain);
        }
        self.state = state;
        if self.arms.inductance_H.is_none() {
            // Kept as the start of the search for laws that ask for the current.
            self.state[CURRENT] = self.at(&self.state, asked_V, self.t_s + dt_s).1;
        }
        self.mean_current_A = self.state[CHARGE] / dt_s;
        // Where a law makes the resistance follow the heat, it is the hot one that heats.
        let factor = match self.arms.thermal {
            Some(_) => self.acts(&self.state, self.mean_current_A, asked_V, self.t_s).resistance_factor,
            None => 1.0,
        };
        let loss_W = self.resistance * factor * self.mean_current_A.powi(2);
        self.heat_K += (loss_W - (self.heat_K - self.ambient_K) / self.thermal.K_W) / self.thermal.J_K * dt_s;
        self.t_s += dt_s;
        self.sense(dt_s);
    }

    fn theta_rad(&self) -> f64 {
        self.sensing.theta_rad
    }

    fn rate_rad_s(&self) -> f64 {
        self.sensing.rate_rad_s
    }

    fn mean_current_A(&self) -> f64 {
        self.sensing.current_A
    }

    fn supply_V(&self) -> f64 {
        self.supply_V
    }

    fn temp_C(&self) -> f64 {
        self.heat_K + T0_C
    }

    fn true_theta_rad(&self) -> f64 {
        self.state[THETA]
    }

    fn true_rate_rad_s(&self) -> f64 {
        self.state[OMEGA]
    }
}

#[inline]
fn along<const N: usize>(s: &[f64; N], d: &[f64; N], h: f64) -> [f64; N] {
    let mut next = *s;
    for k in 0..next.len() {
        next[k] += h * d[k];
    }
    next
}

/// What of `x` lies outside a gap of this whole width.
fn past_gap(x: f64, width: f64) -> f64 {
    if x > 0.5 * width {
        x - 0.5 * width
    } else if x < -0.5 * width {
        x + 0.5 * width
    } else {
        0.0
    }
}

/// Torque through a shaft, from motor to platform, N m.
fn through<const N: usize>(shaft: &effects::Shaft<f64>, s: &[f64; N]) -> f64 {
    let wound = past_gap(s[TWIST], shaft.gap);
    if shaft.gap > 0.0 && wound == 0.0 { 0.0 } else { shaft.stiffness * wound + shaft.damping * (s[MOTOR] - s[OMEGA]) }
}
