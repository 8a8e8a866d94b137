//! One integration step: fourth-order Runge-Kutta, with located times of contact changes.

use super::Plant;
use super::motion::{CURRENT, ContactState, FULL, MIN_BRISTLE_TIME_S, MOTOR, OMEGA, TWIST, past_gap};

/// Longest step as a fraction of the fastest time constant.
pub(super) const STEP_OF_FASTEST: f64 = 0.5;
/// Shortest flank contact that is resolved, s.
pub(super) const TOUCH_S: f64 = 2e-5;
/// Largest number of steps per tick.
pub(super) const MAX_STEPS: f64 = 200.0;

impl Plant {
    #[inline]
    pub(super) fn runge_kutta<const N: usize>(&self, s: &[f64; N], contact: ContactState, command_V: f64, t_s: f64, h: f64) -> [f64; N] {
        let k1 = self.derivative(s, contact, command_V, t_s);
        let k2 = self.derivative(&along(s, &k1, 0.5 * h), contact, command_V, t_s + 0.5 * h);
        let k3 = self.derivative(&along(s, &k2, 0.5 * h), contact, command_V, t_s + 0.5 * h);
        let k4 = self.derivative(&along(s, &k3, h), contact, command_V, t_s + h);
        let mut next = *s;
        for k in 0..next.len() {
            next[k] += h / 6.0 * (k1[k] + 2.0 * (k2[k] + k3[k]) + k4[k]);
        }
        next
    }

    /// One step, in which the rotor may stop: the stop time is located, and the rest of the step starts from rest.
    #[inline]
    pub(super) fn step<const N: usize>(&self, state: &mut [f64; N], command_V: f64, mut t_s: f64, mut h: f64) {
        let motor = self.motor::<N>();
        let sticks = self.structure.bristle_N_m_rad.is_none();
        let drops = self.drops && self.structure.inductance_H.is_some();
        let clutch = N == FULL && self.outsiders.slipping_clutch.is_some();
        let corners = drops
            || clutch
            || (N == FULL && (self.outsiders.sector_rub.is_some() || self.structure.shaft.as_ref().is_some_and(|shaft| shaft.gap > 0.0)));
        // Within a step the rotor can stop repeatedly only by chatter, which sticking ends; likewise two masses in a gap.
        for _ in 0..8 {
            let contact = self.contact_state(state, command_V, t_s);
            let direction = contact.slides;
            let held = ContactState { slides: 0.0, ..contact };
            let mut next = self.runge_kutta(state, contact, command_V, t_s, h);
            let mut reach = h;
            if corners && self.changes(state, &next, contact) {
                // A contact starts or ends, a current or a slip ends: the step ends just after that time, and another follows.
                reach = Self::last_of(h, |part| !self.changes(state, &self.runge_kutta(state, contact, command_V, t_s, part), contact));
                next = self.runge_kutta(state, contact, command_V, t_s, reach);
                if drops && next[CURRENT] * state[CURRENT] < 0.0 {
                    next[CURRENT] = 0.0;
                }
                self.catch(&mut next, contact);
            }
            if clutch && contact.slips == 0.0 && self.slip(&next, direction, command_V, t_s + reach) != 0.0 {
                // The clutch opens within the step.
                let closed = |part| self.runge_kutta(state, contact, command_V, t_s, part);
                reach = Self::last_of(reach, |part| self.slip(&closed(part), direction, command_V, t_s + part) == 0.0);
                next = closed(reach);
            }
            if sticks && direction == 0.0 && self.direction(&next, command_V, t_s + reach) != 0.0 {
                // The rotor breaks away within the step, as the current rises or a load starts: locate that time.
                let still = |part| self.runge_kutta(state, held, command_V, t_s, part);
                let free = Self::last_of(reach, |part| self.direction(&still(part), command_V, t_s + part) == 0.0);
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
            // Illinois method (regula falsi) on the length of the step.
            let (mut low, mut high) = (0.0, reach);
            let (mut at_low, mut at_high) = (state[motor], next[motor]);
            if at_low == 0.0 {
                // Motion from rest against the own direction is rounding: the rotor stays at rest.
                *state = self.runge_kutta(state, held, command_V, t_s, h);
                h = 0.0;
                break;
            }
            let mut stopped = next;
            let mut part = reach;
            for _ in 0..20 {
                part = low - at_low * (high - low) / (at_high - at_low);
                stopped = self.runge_kutta(state, contact, command_V, t_s, part);
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
            if clutch && contact.slips == 0.0 {
                stopped[OMEGA] = 0.0;
            }
            *state = stopped;
            t_s += part;
            h -= part;
            if h <= 1e-12 {
                break;
            }
        }
        if h > 1e-12 {
            // Chatter: the rest of the step keeps the present contact state.
            let contact = self.contact_state(state, command_V, t_s);
            *state = self.runge_kutta(state, contact, command_V, t_s, h);
        }
    }

    /// Upper bound of the time in (0, h] at which `so` ceases to hold, by bisection, s.
    pub(super) fn last_of(h: f64, condition: impl Fn(f64) -> bool) -> f64 {
        let (mut low, mut high) = (0.0, h);
        while high - low > 1e-9 {
            let part = 0.5 * (low + high);
            if condition(part) {
                low = part;
            } else {
                high = part;
            }
        }
        high
    }

    /// Joins the rates of both sides of a clutch whose slip has just ended.
    fn catch<const N: usize>(&self, s: &mut [f64; N], contact: ContactState) {
        let (FULL, Some(clutch)) = (N, &self.outsiders.slipping_clutch) else { return };
        if contact.slips * (s[MOTOR] - s[OMEGA]) < 0.0 {
            let varying = self.varying_inertia(s, &self.contributions(s, s[CURRENT], 0.0, self.t_s)).0;
            let share = clutch.motor_inertia_share * self.inertia / (self.inertia + varying);
            // A motor that is held stays at rest.
            let together = if contact.slides == 0.0 { s[MOTOR] } else { share * s[MOTOR] + (1.0 - share) * s[OMEGA] };
            s[MOTOR] = together;
            s[OMEGA] = together;
        }
    }

    /// Whether between the two states a flank contact starts or ends, the current passes zero, a clutch closes, or a sector starts or ends.
    pub(super) fn changes<const N: usize>(&self, from: &[f64; N], to: &[f64; N], contact: ContactState) -> bool {
        if N == FULL && (self.rubs(to) != contact.rubs || (contact.slips != 0.0 && contact.slips * (to[MOTOR] - to[OMEGA]) < 0.0)) {
            return true;
        }
        let side = |s: &[f64; N]| match &self.structure.shaft {
            Some(shaft) if N == FULL && shaft.gap > 0.0 => past_gap(s[TWIST], shaft.gap).partial_cmp(&0.0),
            _ => None,
        };
        side(from) != side(to) || (self.drops && self.structure.inductance_H.is_some() && from[CURRENT] * to[CURRENT] < 0.0)
    }

    /// Steps per tick: by the fastest of winding, shaft and bristle.
    pub(super) fn steps(&self, dt_s: f64) -> f64 {
        let mut fastest_s = f64::INFINITY;
        if let Some(inductance) = self.structure.inductance_H {
            fastest_s = fastest_s.min(inductance / (self.resistance + self.running.series_ohm()));
        }
        if let Some(rotor) = &self.outsiders.fluid_rotor {
            fastest_s = fastest_s.min(rotor.fastest_s(self.inertia));
        }
        if let Some(shaft) = &self.structure.shaft {
            let reduced = self.inertia * shaft.motor_inertia_fraction * (1.0 - shaft.motor_inertia_fraction);
            fastest_s = fastest_s.min((reduced / shaft.stiffness).sqrt() * 0.2).min(0.2 * reduced / shaft.damping.max(1e-12));
            if shaft.gap > 0.0 {
                // Short enough that a flank contact does not start and end within one step.
                fastest_s = fastest_s.min(TOUCH_S);
            }
        }
        if let Some(stiffness) = self.structure.bristle_N_m_rad {
            // Time constant of the bristle: its breakaway angle over the rate. Coulomb torques below 10 µN m are not resolved.
            let (total, _) = self.at(&self.state, self.rubs(&self.state), 0.0, self.t_s);
            let constant_s = total.coulomb_torque.value().max(1e-5) / stiffness / self.state[OMEGA].abs().max(1e-3);
            fastest_s = fastest_s.min(constant_s.max(MIN_BRISTLE_TIME_S)).min((self.inertia / stiffness).sqrt());
        }
        (dt_s / (STEP_OF_FASTEST * fastest_s)).ceil().clamp(1.0, MAX_STEPS)
    }
}

#[inline]
pub(super) fn along<const N: usize>(s: &[f64; N], d: &[f64; N], h: f64) -> [f64; N] {
    let mut next = *s;
    for k in 0..next.len() {
        next[k] += h * d[k];
    }
    next
}
