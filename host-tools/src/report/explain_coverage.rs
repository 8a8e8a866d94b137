//! What a log went through: rates, turns, currents, warming. What it did not go through it cannot show.

use std::f64::consts::TAU;

use super::digits;
use crate::log::Log;

/// Length over which a rate is made from the angle, s.
const ANGLE_S: f64 = 0.02;
/// Part of the largest rate that counts as slow, and as turning at all.
const SLOW_PART: f64 = 0.1;
const TURNING_PART: f64 = 0.01;
/// Part of the largest rate that the smaller direction must reach.
const BOTH_PART: f64 = 0.05;
/// Fewer slow rows than this part of all, or fewer turns, show no ripple over the angle.
const ENOUGH_SLOW: f64 = 0.05;
const ENOUGH_TURNS: f64 = 2.0;
/// A winding that warms by less shows nothing of its temperature, K.
const ENOUGH_WARMING_K: f64 = 3.0;

/// What a log went through. A quantity that it has no column for is `None`.
#[derive(Debug, Clone, PartialEq)]
pub struct Coverage {
    /// Lowest and highest rate, rad/s.
    pub rates_rad_s: Option<(f64, f64)>,
    /// Part of the turning rows at less than a tenth of the largest rate.
    pub slow: Option<f64>,
    /// Turns between the outermost angles.
    pub turns: Option<f64>,
    /// Largest current, A.
    pub current_A: Option<f64>,
    /// Span of the winding's temperature, K.
    pub warming_K: Option<f64>,
    /// Length without gaps, s.
    pub duration_s: f64,
}

impl Coverage {
    /// Looks through a log.
    pub fn of(log: &Log) -> Coverage {
        let rates = rates(log);
        let rates_rad_s = rates.as_deref().and_then(range);
        let largest = rates_rad_s.map_or(0.0, |(low, high)| high.max(-low));
        let slow = rates.as_deref().map(|rates| {
            let turning = rates.iter().filter(|w| w.abs() > TURNING_PART * largest).count();
            let slow = rates.iter().filter(|w| w.abs() > TURNING_PART * largest && w.abs() < SLOW_PART * largest).count();
            slow as f64 / turning.max(1) as f64
        });
        let span = |name: &str| log.column(name).and_then(range).map(|(low, high)| high - low);
        // A mean over a second, so that the sensor's noise is no warming.
        let second = ((1.0 / log.median_dt_s()).round() as usize).max(1);
        let smooth = |values: &[f64]| values.chunks(second).map(|c| c.iter().sum::<f64>() / c.len() as f64).collect::<Vec<f64>>();
        Coverage {
            rates_rad_s,
            slow,
            turns: span("theta_rad").map(|s| s / TAU),
            current_A: log.column("i_A").and_then(range).map(|(low, high)| high.max(-low)),
            warming_K: log.column("temp_C").and_then(|t| range(&smooth(t))).map(|(low, high)| high - low),
            duration_s: log.segments().iter().map(|rows| rows.len() as f64 * log.median_dt_s()).sum(),
        }
    }

    /// It turns both ways, as far as is known.
    pub fn both_ways(&self) -> bool {
        self.rates_rad_s.is_none_or(|(low, high)| high.min(-low) > BOTH_PART * high.max(-low))
    }

    /// It turns slowly enough, and far enough, that a ripple over the angle shows; `true` where that is not known.
    pub fn slow_turns(&self) -> bool {
        self.slow.is_none_or(|s| s >= ENOUGH_SLOW) && self.turns.is_none_or(|t| t >= ENOUGH_TURNS)
    }

    /// What it went through, as a sentence.
    pub fn says(&self) -> String {
        let mut parts = vec![format!("{} s", digits::plain(self.duration_s, 3))];
        if let Some((low, high)) = self.rates_rad_s {
            parts.push(format!("rates from {} to {} rad/s", digits::significant(low, 2), digits::significant(high, 2)));
        }
        if let Some(turns) = self.turns {
            parts.push(format!("{} turns", digits::significant(turns, 2)));
        }
        if let Some(current) = self.current_A {
            parts.push(format!("currents up to {} A", digits::significant(current, 2)));
        }
        if let Some(kelvin) = self.warming_K {
            parts.push(format!("a winding that warms by {} K", digits::significant(kelvin, 2)));
        }
        format!("The log went through {}; of what lies outside it says nothing.", parts.join(", "))
    }

    /// What it did not go through, and what stays hidden for that reason: a sentence each.
    pub fn blind(&self) -> Vec<String> {
        let mut list = Vec::new();
        if !self.both_ways() {
            list.push(
                "It turns one way only: dry friction, a load and friction that differs by direction are one constant torque there."
                    .to_owned(),
            );
        }
        if self.turns.is_none() {
            list.push("It has no angle (theta_rad): nothing that repeats with the turn can be seen.".to_owned());
        } else if !self.slow_turns() {
            list.push(
                "It hardly has slow whole turns: a small cogging or unbalance averages out at high rates and stays unseen.".to_owned(),
            );
        }
        match self.warming_K {
            None => list.push("It has no winding temperature (temp_C): warming cannot be told from other slow changes.".to_owned()),
            Some(k) if k < ENOUGH_WARMING_K => {
                list.push(format!(
                    "The winding warms by only {} K: hardly anything of temperature can be seen.",
                    digits::significant(k, 2)
                ));
            }
            Some(_) => {}
        }
        if self.current_A.is_none() {
            list.push("It has no current (i_A): a lost voltage and a braking torque look alike.".to_owned());
        }
        list
    }
}

/// The rate, measured or from the angle.
fn rates(log: &Log) -> Option<Vec<f64>> {
    if let Some(rates) = log.column("omega_rad_s") {
        return Some(rates.to_vec());
    }
    let theta = log.column("theta_rad")?;
    let lag = ((ANGLE_S / log.median_dt_s()).round() as usize).max(1);
    let later = theta.get(lag..)?.iter().zip(log.t_s().get(lag..)?);
    Some(theta.iter().zip(log.t_s()).zip(later).map(|((a, t), (b, u))| (b - a) / (u - t)).collect())
}

fn range(values: &[f64]) -> Option<(f64, f64)> {
    values.iter().filter(|v| v.is_finite()).fold(None, |range, &v| {
        let (low, high) = range.unwrap_or((v, v));
        Some((v.min(low), v.max(high)))
    })
}
