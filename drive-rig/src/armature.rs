//! The winding: quasi-static, or with its inductance.

use crate::Rig;
use drive_model::{Contributions, Scalar};

impl<S: Scalar> Rig<S> {
    /// Current over `h` at a constant rate: (mean, last), A. `u_V` is the commanded voltage.
    #[inline]
    pub(super) fn armature(&self, total: &Contributions<S>, motor_constant: S, omega: S, before: S, u_V: f64, h: f64) -> (S, S) {
        let resistance = self.base.resistance * total.resistance_factor + total.series_ohm;
        let v = total.voltage - motor_constant * omega + u_V;
        let Some(inductance) = self.structure.inductance_H else {
            let current = past_drop(v, total.drop_V) / resistance;
            return (current, current);
        };
        // The drop opposes a flowing current; it cannot drive the current through zero.
        let driving = if before == 0.0 {
            past_drop(v, total.drop_V)
        } else if before > 0.0 {
            v - total.drop_V
        } else {
            v + total.drop_V
        };
        let target = driving / resistance;
        let x = -(resistance / inductance * h);
        let settled = -x.exp_m1();
        let last = before + (target - before) * settled;
        let mean = target + (before - target) * settled / -x;
        if total.drop_V > 0.0 && before.re() * last.re() < 0.0 {
            // At zero current, after τ ln(1 − before/target), the drop reverses: the current stays zero, or flows by the voltage beyond the drop.
            let tau = inductance / resistance;
            let zero_s = tau * (-before / target).ln_1p();
            let rest_s = -zero_s + h;
            let beyond = past_drop(v, total.drop_V) / resistance;
            let settled = -(-rest_s / tau).exp_m1();
            let charge = target * zero_s + before * tau + beyond * (rest_s - tau * settled);
            return (charge / h, beyond * settled);
        }
        (mean, last)
    }
}

/// A voltage less the drop that opposes it; zero below the drop.
#[inline]
fn past_drop<S: Scalar>(v: S, drop_V: S) -> S {
    if v > drop_V {
        v - drop_V
    } else if -v > drop_V {
        v + drop_V
    } else {
        S::zero()
    }
}
