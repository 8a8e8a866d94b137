//! Dynamics of a state: laws, current, torque, time derivative, and the contact state of friction, brushes, clutch and gap.

use super::Plant;
use drive_model::{Contributions, MAX_COLUMNS, Point, Sum, T0_C};

/// Time constant below which a bristle is not resolved, s: no sensor shows it.
pub(super) const MIN_BRISTLE_TIME_S: f64 = 5e-6;

/// State: rate, current, angle, charge since the last tick; with shaft, clutch or bristle also motor rate, twist, bristle deflection, rate
/// of a second rotor.
pub(super) type StateVector = [f64; FULL];
pub(super) const FULL: usize = 8;
/// Number of states of a drive without shaft, clutch, bristle and outsiders.
pub(super) const PLAIN: usize = 4;
pub(super) const OMEGA: usize = 0;
pub(super) const CURRENT: usize = 1;
pub(super) const THETA: usize = 2;
pub(super) const CHARGE: usize = 3;
pub(super) const MOTOR: usize = 4;
pub(super) const TWIST: usize = 5;
pub(super) const BRISTLE: usize = 6;
pub(super) const FLUID: usize = 7;

/// The discrete state that is constant within a step: contact of dry friction, brushes, clutch and sector.
#[derive(Clone, Copy)]
pub(super) struct ContactState {
    /// Direction of sliding of the rotor; 0: sticking.
    pub(super) slides: f64,
    /// Direction of the current against a voltage drop; 0: no current flows.
    pub(super) flows: f64,
    /// Direction in which the motor slips ahead of the platform in a clutch; 0: closed, or no clutch.
    pub(super) slips: f64,
    /// The platform is in a sector that rubs.
    pub(super) rubs: bool,
}

impl Plant {
    /// Index of the rate at the friction and the winding, in a state of N.
    #[inline]
    pub(super) fn motor<const N: usize>(&self) -> usize {
        if N == FULL && (self.structure.shaft.is_some() || self.outsiders.slipping_clutch.is_some()) { MOTOR } else { OMEGA }
    }

    /// Inertias on the motor side and on the platform side of a shaft or an open clutch; without one, the whole inertia and 0.
    #[inline]
    fn constant_inertias<const N: usize>(&self) -> (f64, f64) {
        let share = match (&self.structure.shaft, &self.outsiders.slipping_clutch) {
            _ if N == PLAIN => None,
            (Some(shaft), _) => Some(shaft.motor_inertia_fraction),
            (None, clutch) => clutch.as_ref().map(|clutch| clutch.motor_inertia_share),
        };
        share.map_or((self.inertia, 0.0), |share| (self.inertia * share, self.inertia * (1.0 - share)))
    }

    /// The part of the inertia that varies with the angle, kg m², and the torque −½ J′ ω² that acts on the platform with it, N m.
    #[inline(always)]
    pub(super) fn varying_inertia<const N: usize>(&self, s: &[f64; N], total: &Contributions<f64>) -> (f64, f64) {
        // A body that is put on the platform does not change with the angle.
        let drive = self.inertia - self.added;
        (drive * total.inertia_variation.value(), -0.5 * drive * total.inertia_slope.value() * s[OMEGA] * s[OMEGA])
    }

    #[inline]
    pub(super) fn point<const N: usize>(&self, s: &[f64; N], current: f64, command_V: f64, t_s: f64) -> Point<f64> {
        Point {
            from_s: t_s,
            to_s: t_s,
            start_s: 0.0,
            theta: s[THETA],
            theta_measured: false,
            omega: s[self.motor::<N>()],
            current,
            voltage: command_V,
            temp_C: self.heat_K + T0_C,
            // The bridge already follows the supply (`advance`); the law must not apply it again.
            supply_ratio: 1.0,
            rate_from_encoder: false,
            reference_angle: false,
            columns: [0.0; MAX_COLUMNS],
        }
    }

    #[inline(always)]
    pub(super) fn contributions<const N: usize>(&self, s: &[f64; N], current: f64, command_V: f64, t_s: f64) -> Contributions<f64> {
        let x = self.point(s, current, command_V, t_s);
        let mut total = Contributions::none();
        for (law, parameters) in &self.laws {
            law.contribute(parameters, &x, &mut total);
        }
        if N == FULL {
            total.series_ohm += self.running.series_ohm();
        }
        total
    }

    /// The platform is in a sector that rubs.
    #[inline]
    pub(super) fn rubs<const N: usize>(&self, s: &[f64; N]) -> bool {
        N == FULL && self.outsiders.sector_rub.is_some_and(|rub| rub.holds(s[THETA]))
    }

    /// Output voltage of the bridge.
    #[inline(always)]
    pub(super) fn bridge_V<const N: usize>(&self, command_V: f64, t_s: f64) -> f64 {
        if N < FULL {
            return command_V;
        }
        let hunting = self.outsiders.hunting_supply.map_or(1.0, |hunting| hunting.factor(t_s));
        command_V * hunting * self.running.voltage_factor(t_s)
    }

    /// Contributions and current at a state, with the output of the bridge. The Coulomb torque is that under the present motor torque.
    #[inline(always)]
    pub(super) fn at<const N: usize>(&self, s: &[f64; N], rubs: bool, bridge_V: f64, t_s: f64) -> (Contributions<f64>, f64) {
        let (mut total, current) = self.inside(s, bridge_V, t_s);
        if N == FULL {
            if let (true, Some(rub)) = (rubs, &self.outsiders.sector_rub) {
                total.coulomb_torque += rub.rub_N_m;
                total.viscous += rub.rub_N_m_s;
            }
            total.coulomb_torque +=
                self.running.coulomb_N_m(t_s) + self.outsiders.ball_defect.map_or(0.0, |ball| ball.coulomb_N_m(s[THETA]));
            total.torque += self.running.torque_N_m(t_s);
        }
        (total, current)
    }

    /// Contributions of the catalogue's laws. The current of a winding without inductance follows algebraically; laws that depend on it are
    /// iterated.
    #[inline(always)]
    fn inside<const N: usize>(&self, s: &[f64; N], command_V: f64, t_s: f64) -> (Contributions<f64>, f64) {
        let (mut total, current) = self.electrical(s, command_V, t_s);
        let coulomb_N_m = total.coulomb_torque_under(total.motor_factor.times(self.motor_constant) * current);
        total.coulomb_torque = Sum::NONE;
        total.coulomb_torque += coulomb_N_m;
        (total, current)
    }

    #[inline(always)]
    fn electrical<const N: usize>(&self, s: &[f64; N], command_V: f64, t_s: f64) -> (Contributions<f64>, f64) {
        if self.structure.inductance_H.is_some() {
            return (self.contributions(s, s[CURRENT], command_V, t_s), s[CURRENT]);
        }
        let mut current = s[CURRENT];
        let mut total = self.contributions(s, current, command_V, t_s);
        let rounds = if self.structure.needs_current { 8 } else { 1 };
        for round in 0..rounds {
            let v = command_V + total.voltage.value() - total.motor_factor.times(self.motor_constant) * s[self.motor::<N>()];
            current = past_gap(v, 2.0 * total.drop_V.value()) / total.resistance_of(self.resistance);
            if round + 1 < rounds {
                total = self.contributions(s, current, command_V, t_s);
            }
        }
        (total, current)
    }

    /// Torque on the inertia with friction, without the Coulomb torque, N m.
    #[inline(always)]
    pub(super) fn torque<const N: usize>(&self, s: &[f64; N], total: &Contributions<f64>, current: f64) -> f64 {
        let motor_omega = s[self.motor::<N>()];
        let mut torque = total.motor_factor.times(self.motor_constant) * current + total.torque.value()
            - total.viscous_N_m_s().unwrap_or(0.0) * motor_omega;
        if N == FULL {
            torque -= self.structure.bristle_N_m_rad.map_or(0.0, |stiffness| stiffness * s[BRISTLE]);
            torque -= self.structure.shaft.as_ref().map_or(0.0, |shaft| through(shaft, s));
            torque += self.outsiders.fluid_rotor.map_or(0.0, |rotor| rotor.torque_N_m(motor_omega - s[FLUID]));
        }
        torque
    }

    /// Time derivative in a given contact state.
    #[inline(always)]
    pub(super) fn derivative<const N: usize>(&self, s: &[f64; N], contact: ContactState, command_V: f64, t_s: f64) -> [f64; N] {
        let bridge_V = self.bridge_V::<N>(command_V, t_s);
        let (total, current) = self.at(s, contact.rubs, bridge_V, t_s);
        let motor = self.motor::<N>();
        let mut d = [0.0; N];
        let bristle = self.structure.bristle_N_m_rad;
        let dry = if bristle.is_some() { 0.0 } else { total.coulomb_torque.value() };
        let torque = self.torque(s, &total, current) - contact.slides * dry;
        let (motor_inertia, platform_inertia) = self.constant_inertias::<N>();
        let (varying, reaction) = self.varying_inertia(s, &total);
        let has_shaft = N == FULL && self.structure.shaft.is_some();
        d[motor] = if contact.slides == 0.0 {
            0.0
        } else if has_shaft {
            torque / motor_inertia
        } else {
            (torque + reaction) / (motor_inertia + platform_inertia + varying)
        };
        d[THETA] = s[OMEGA];
        d[CHARGE] = current;
        if let Some(inductance) = self.structure.inductance_H {
            let v = bridge_V + total.voltage.value() - total.motor_factor.times(self.motor_constant) * s[motor];
            let resistance = total.resistance_of(self.resistance);
            d[CURRENT] = if self.drops && contact.flows == 0.0 {
                0.0
            } else {
                (v - total.drop_V.value() * contact.flows - resistance * current) / inductance
            };
        }
        if N < FULL {
            return d;
        }
        if let Some(rotor) = &self.outsiders.fluid_rotor {
            d[FLUID] = -rotor.torque_N_m(s[motor] - s[FLUID]) / rotor.fluid_kg_m2;
        }
        if let Some(clutch) = &self.outsiders.slipping_clutch {
            let carried = contact.slips * clutch.clutch_N_m;
            if contact.slips == 0.0 {
                d[OMEGA] = d[motor];
            } else {
                d[motor] = if contact.slides == 0.0 { 0.0 } else { (torque - carried) / motor_inertia };
                d[OMEGA] = (carried + reaction) / (platform_inertia + varying);
            }
        }
        if let Some(shaft) = &self.structure.shaft {
            d[OMEGA] = (through(shaft, s) + reaction) / (platform_inertia + varying);
            d[TWIST] = s[MOTOR] - s[OMEGA];
        }
        let coulomb_N_m = total.coulomb_torque.value();
        if let (Some(stiffness), true) = (bristle, coulomb_N_m > 0.0) {
            let settled = coulomb_N_m / stiffness * s[motor].signum();
            d[BRISTLE] = (settled - s[BRISTLE]) * (s[motor].abs() * stiffness / coulomb_N_m).min(1.0 / MIN_BRISTLE_TIME_S);
        }
        d
    }

    /// Direction of sliding at this state; 0: the Coulomb torque holds the rotor.
    pub(super) fn direction<const N: usize>(&self, s: &[f64; N], command_V: f64, t_s: f64) -> f64 {
        let omega = s[self.motor::<N>()];
        if omega != 0.0 {
            return omega.signum();
        }
        let (total, current) = self.at(s, self.rubs(s), self.bridge_V::<N>(command_V, t_s), t_s);
        if self.structure.bristle_N_m_rad.is_some() {
            return 1.0;
        }
        let mut torque = self.torque(s, &total, current);
        if let (FULL, Some(clutch)) = (N, &self.outsiders.slipping_clutch) {
            let ahead = s[MOTOR] - s[OMEGA];
            torque -= if ahead == 0.0 { 0.0 } else { ahead.signum() * clutch.clutch_N_m };
        }
        if torque.abs() <= total.coulomb_torque.value() { 0.0 } else { torque.signum() }
    }

    /// Direction of the current; 0: the voltage drop blocks it.
    pub(super) fn flow<const N: usize>(&self, s: &[f64; N], command_V: f64, t_s: f64) -> f64 {
        if s[CURRENT] != 0.0 {
            return s[CURRENT].signum();
        }
        let bridge_V = self.bridge_V::<N>(command_V, t_s);
        let (total, _) = self.at(s, self.rubs(s), bridge_V, t_s);
        let v = bridge_V + total.voltage.value() - total.motor_factor.times(self.motor_constant) * s[self.motor::<N>()];
        if v.abs() <= total.drop_V.value() { 0.0 } else { v.signum() }
    }

    /// Direction of slip of the clutch, for this direction of sliding; 0: closed.
    pub(super) fn slip<const N: usize>(&self, s: &[f64; N], slides: f64, command_V: f64, t_s: f64) -> f64 {
        let (FULL, Some(clutch)) = (N, &self.outsiders.slipping_clutch) else { return 0.0 };
        let ahead = s[MOTOR] - s[OMEGA];
        if ahead != 0.0 {
            return ahead.signum();
        }
        if slides == 0.0 {
            return 0.0;
        }
        let (total, current) = self.at(s, self.rubs(s), self.bridge_V::<N>(command_V, t_s), t_s);
        let dry = if self.structure.bristle_N_m_rad.is_some() { 0.0 } else { total.coulomb_torque.value() };
        let (motor_inertia, platform_inertia) = self.constant_inertias::<N>();
        let (varying, reaction) = self.varying_inertia(s, &total);
        let platform_inertia = platform_inertia + varying;
        let torque = self.torque(s, &total, current) - slides * dry;
        let carried = (torque + reaction) * platform_inertia / (motor_inertia + platform_inertia) - reaction;
        if carried.abs() <= clutch.clutch_N_m { 0.0 } else { carried.signum() }
    }

    /// The contact state at this state.
    pub(super) fn contact_state<const N: usize>(&self, s: &[f64; N], command_V: f64, t_s: f64) -> ContactState {
        let slides = self.direction(s, command_V, t_s);
        // The brush drop can end a current, not reverse it.
        let flows = if self.drops && self.structure.inductance_H.is_some() { self.flow(s, command_V, t_s) } else { 0.0 };
        ContactState { slides, flows, slips: self.slip(s, slides, command_V, t_s), rubs: self.rubs(s) }
    }
}

/// The part of `x` outside a gap of this total width.
pub(super) fn past_gap(x: f64, width: f64) -> f64 {
    if x > 0.5 * width {
        x - 0.5 * width
    } else if x < -0.5 * width {
        x + 0.5 * width
    } else {
        0.0
    }
}

/// Torque through a shaft, from motor to platform, N m.
pub(super) fn through<const N: usize>(shaft: &drive_model::Shaft<f64>, s: &[f64; N]) -> f64 {
    let wound = past_gap(s[TWIST], shaft.gap);
    if shaft.gap > 0.0 && wound == 0.0 { 0.0 } else { shaft.stiffness * wound + shaft.damping * (s[MOTOR] - s[OMEGA]) }
}
