//! A compensation written into a stand, as text and JSON.

use std::path::Path;

use serde_json::{Value, json};
use stand_firmware::compensation::Compensation;

use super::finite;
use crate::compensate::Ripple;
use crate::compensate::serial_stand::InForce;

/// A compensation written into the file of a simulated stand, with its effect on the ripple.
pub struct FileCompensation<'a> {
    /// The stand's file.
    pub path: &'a Path,
    /// Source of the compensation: `model` or `measured`.
    pub source: &'static str,
    /// The compensation.
    pub compensation: &'a Compensation,
    /// Torques of the model that are not compensated.
    pub left_out: &'a [String],
    /// Ripple before and after, for each rate.
    pub ripple: &'a [[Ripple; 2]],
}

impl FileCompensation<'_> {
    /// The result as text.
    pub fn text(&self) -> String {
        let c = self.compensation;
        let mut text = format!("{}: [firmware.compensation] written\n", self.path.display());
        text += &format!("  Coulomb friction {} N m, viscous friction {} N m s/rad\n", short(c.coulomb_N_m), short(c.viscous_N_m_s));
        for harmonic in c.harmonics.as_slice() {
            let (order, torque, phase) = (harmonic.order, short(harmonic.torque_N_m), harmonic.phase_rad);
            text += &format!("  harmonic {order:>3}: {torque} N m, phase {phase:.4} rad from the index\n");
        }
        for line in self.left_out {
            text += &format!("  not compensated: {line}\n");
        }
        text += "\nRipple of the true rate of the simulated stand (amplitude of each harmonic; standard deviation over 1°):\n";
        text += "     rate                        before       after   reduction\n";
        for [before, after] in self.ripple {
            let degrees = before.rate_rad_s.to_degrees();
            for ((order, was), (_, is)) in before.orders.iter().zip(&after.orders) {
                text +=
                    &format!("{degrees:>5.0} °/s  harmonic {order:>3}  {:>9} rad/s {:>11} {:>8.0} ×\n", short(*was), short(*is), was / is);
            }
            let (was, is) = (before.one_degree, after.one_degree);
            text += &format!(
                "{degrees:>5.0} °/s  over 1°       {:>9} %     {:>11} {:>8.1} ×\n",
                short(100.0 * was),
                short(100.0 * is),
                was / is
            );
        }
        text
    }

    /// The result as JSON.
    pub fn json(&self) -> Value {
        let ripple = self.ripple.iter().map(|[before, after]| {
            let orders = before.orders.iter().zip(&after.orders).map(|((order, was), (_, is))| {
                json!({ "order": order, "before_rad_s": finite(*was), "after_rad_s": finite(*is), "factor": finite(was / is) })
            });
            json!({
                "rate_rad_s": before.rate_rad_s,
                "orders": orders.collect::<Vec<_>>(),
                "one_degree": { "before": finite(before.one_degree), "after": finite(after.one_degree) },
            })
        });
        let c = self.compensation;
        let harmonics = c.harmonics.as_slice().iter();
        json!({
            "stand": self.path.display().to_string(),
            "source": self.source,
            "compensation": {
                "coulomb_N_m": c.coulomb_N_m,
                "coulomb_fade_rad_s": c.coulomb_fade_rad_s,
                "viscous_N_m_s": c.viscous_N_m_s,
                "winding_lag_s": c.winding_lag_s,
                "harmonics": harmonics
                    .map(|h| json!({ "order": h.order, "torque_N_m": h.torque_N_m, "phase_rad": h.phase_rad }))
                    .collect::<Vec<_>>(),
            },
            "left_out": self.left_out,
            "ripple": ripple.collect::<Vec<_>>(),
        })
    }
}

/// A compensation in force on the stand behind `port`, as text.
pub fn serial_text(port: &str, result: &InForce, saved: bool) -> String {
    let flash = if saved { " and saved in its flash" } else { "; SETTings:SAVE saves it" };
    let mut text = format!("{port}: the compensation is in force{flash}\n");
    result.lines.iter().for_each(|line| text += &format!("  {line}\n"));
    result.left_out.iter().for_each(|line| text += &format!("  not compensated: {line}\n"));
    text
}

/// A compensation in force on the stand behind `port`, as JSON; `source`: `model` or `measured`.
pub fn serial_json(port: &str, source: &str, result: &InForce, saved: bool) -> Value {
    json!({ "port": port, "source": source, "in_force": result.lines, "saved": saved, "left_out": result.left_out })
}

/// A number with three digits.
fn short(x: f64) -> String {
    if x != 0.0 && !(1e-3..1e4).contains(&x.abs()) { format!("{x:.2e}") } else { format!("{x:.4}") }
}
