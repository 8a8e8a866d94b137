//! The winding: quasi-static, or with its inductance.

use crate::{Input, Part, Rig, RowInput};
use drive_model::{Contributions, Scalar};

impl<S: Scalar> Rig<S> {
    /// Current over a part of the row at a constant rate: (mean, last), A.
    #[inline]
    pub(super) fn armature(&self, total: &Contributions<S>, motor_constant: S, omega: S, before: S, row: &RowInput, part: Part) -> (S, S) {
        let h = part.length_s;
        let resistance = total.resistance_of(self.base.resistance);
        let u_V = if self.input == Input::Voltage { row.voltage_V(part) } else { 0.0 };
        if row.connected < 1.0 {
            let mean = self.part_time_current(total, motor_constant * omega, resistance, u_V, row.connected);
            return (mean, mean);
        }
        let back_emf = motor_constant * omega;
        let v = total.voltage.get().map_or_else(|| -back_emf, |voltage| voltage - back_emf) + u_V;
        let drop = total.drop_V.get();
        let Some(inductance) = self.structure.inductance_H else {
            let current = past_drop(v, drop) / resistance;
            return (current, current);
        };
        // The drop opposes a flowing current; it cannot drive the current through zero.
        let driving = match drop {
            None => v,
            Some(_) if before == 0.0 => past_drop(v, drop),
            Some(drop_V) => {
                if before > 0.0 {
                    v - drop_V
                } else {
                    v + drop_V
                }
            }
        };
        let target = driving / resistance;
        let x = -(resistance / inductance * h);
        let settled = -x.exp_m1();
        let last = before + (target - before) * settled;
        let mean = target + (before - target) * settled / -x;
        if drop.is_some_and(|drop_V| drop_V > 0.0) && before.re() * last.re() < 0.0 {
            // At zero current, after τ ln(1 − before/target), the drop reverses: the current stays zero, or flows by the voltage beyond the
            // drop.
            let tau = inductance / resistance;
            let zero_s = tau * (-before / target).ln_1p();
            let rest_s = -zero_s + h;
            let beyond = past_drop(v, drop) / resistance;
            let settled = -(-rest_s / tau).exp_m1();
            let charge = target * zero_s + before * tau + beyond * (rest_s - tau * settled);
            return (charge / h, beyond * settled);
        }
        if row.has_constant_voltage() || h == 0.0 {
            return (mean, last);
        }
        let (by_mean, by_last) = course_response(row.voltage_from_V(part), -x);
        (mean + by_mean / resistance, last + by_last / resistance)
    }
}

impl<S: Scalar> Rig<S> {
    /// Mean current of a winding that is connected for the fraction `connected` of the time and open in the rest, A; `u_V` is the mean of
    /// the applied voltage, zero while the winding is open. Discontinuous conduction: the current falls to zero soon after the winding
    /// opens, through the diodes of the bridge, and the back-EMF counts only while it is connected (Mohan, Undeland, Robbins, Power
    /// Electronics, 3rd ed., §7-3). With the supply U = `u_V`/`connected` the heat at stall is that of the RMS voltage U √`connected`. The
    /// diodes block as long as the back-EMF is below the supply.
    fn part_time_current(&self, total: &Contributions<S>, back_emf_V: S, resistance: S, u_V: f64, connected: f64) -> S {
        if connected <= 0.0 {
            return S::zero();
        }
        let v = total.voltage.value() - back_emf_V * connected + u_V;
        past_drop(v, total.drop_V.get().map(|drop_V| drop_V * connected)) / resistance
    }
}

/// Least duration, in time constants of the winding, over which the course of the voltage about its mean matters: its response falls with
/// the third power.
const MIN_TIME_CONSTANTS: f64 = 0.02;

/// Response of a winding to the course of the voltage about its mean, from no current, times the resistance: mean over the time, and at its
/// end. `course`: polynomial of the fraction of the time; `x`: the time in time constants. The solution of y' = x (u − y): the polynomial q
/// with q' = x (u − q), and q(0) e^(−x s) that decays.
fn course_response<S: Scalar>([c0, c1, c2, c3]: [f64; 4], x: S) -> (S, S) {
    let mean = c0 + c1 / 2.0 + c2 / 3.0 + c3 / 4.0;
    let (constant, linear, quadratic, cubic) = if x.re() < MIN_TIME_CONSTANTS {
        // Only a straight line with the first moment of the course.
        let slope = c1 + c2 + 0.9 * c3;
        (-0.5 * slope, slope, 0.0, 0.0)
    } else {
        (c0 - mean, c1, c2, c3)
    };
    let q3 = S::from(cubic);
    let q2 = -(q3 * 3.0 / x) + quadratic;
    let q1 = -(q2 * 2.0 / x) + linear;
    let q0 = -(q1 / x) + constant;
    let decayed = -(-x).exp_m1();
    (q0 + q1 / 2.0 + q2 / 3.0 + q3 / 4.0 - q0 * decayed / x, q1 + q2 + q3 + q0 * decayed)
}

/// A voltage less the drop that opposes it; zero below the drop.
#[inline]
fn past_drop<S: Scalar>(v: S, drop_V: Option<S>) -> S {
    let Some(drop_V) = drop_V else { return v };
    if v > drop_V {
        v - drop_V
    } else if -v > drop_V {
        v + drop_V
    } else {
        S::zero()
    }
}
