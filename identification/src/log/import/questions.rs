//! What the values of the columns say about their units, and what is left for the user to decide.
//!
//! In: a table, and the beliefs from names and statements. Out: beliefs with the units that the values decide, and [`Question`]s. Angles,
//! rates, torques, accelerations and readings of a gyro without a stated unit are asked, because several units are usual; volts, amperes
//! and degrees Celsius are assumed unless the values contradict them.

use super::guess::{Belief, Evidence, quantity_of};
use super::names;
use super::table::{Table, TableColumn};
use super::units::{Quantity, Unit};
use crate::statistics::Extremes;
use crate::statistics::robust::median;

/// Something that the user must decide before a file can be read.
#[derive(Debug, Clone, PartialEq)]
pub enum Question {
    /// No column is known to be the time.
    NoTime {
        /// Interval of the rows that the file states, s, and the words for it.
        stated_interval: Option<(f64, String)>,
    },
    /// A column that counts by one from 0 or 1: a time in `unit`, or the number of the row.
    TimeOrRowNumber {
        /// The column of the file.
        column: String,
        /// Unit in which it gives a usual row rate.
        unit: Option<String>,
        /// Interval of the rows that the file states, s, and the words for it.
        stated_interval: Option<(f64, String)>,
    },
    /// The unit of a column is not certain.
    Unit {
        /// The column of the file.
        column: String,
        /// Its column in the project.
        target: String,
        /// Units that are possible, the most probable first.
        units: Vec<String>,
    },
    /// The file states a unit of something else than what the user states the column to be.
    Size {
        /// The column of the file.
        column: String,
        /// Its column in the project.
        target: String,
        /// Its unit in the file.
        unit: String,
        /// The unit of the project.
        wanted: &'static str,
    },
    /// Units of rate and angle that fit each other.
    RateAndAngle {
        /// The columns of the file.
        rate: String,
        /// The angle.
        angle: String,
        /// Pairs of units, rate first.
        pairs: Vec<(String, String)>,
    },
    /// Counts of an encoder.
    Counts {
        /// The column of the file.
        column: String,
        /// Counts per turn by comparison with the rate.
        per_turn: Option<CountsPerTurn>,
    },
    /// The duty of a bridge: the voltage at `full` is the supply.
    Duty {
        /// The column of the file.
        column: String,
        /// Usual full scale that its values stay within.
        full: u32,
    },
    /// An electrical rate: the mechanical one times the pole pairs of the motor.
    PolePairs {
        /// The column of the file.
        column: String,
    },
    /// Several columns may be the same quantity.
    Which {
        /// The column of the project.
        target: String,
        /// The columns of the file.
        columns: Vec<String>,
    },
}

/// Counts of an encoder per turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CountsPerTurn {
    /// From the rate.
    pub estimate: f64,
    /// The usual number near it.
    pub usual: Option<u32>,
}

/// Row rates of laboratories, Hz: the unit of an unlabelled time gives one of these.
const ROW_RATES_HZ: (f64, f64) = (4.9, 60e3);
/// Begin of the counts of seconds, milliseconds … since 1970 of our time, s.
const EPOCH_S: (f64, f64) = (1e9, 4e9);
/// Range from which whole numbers are counts.
const MIN_WHOLE_RANGE: f64 = 100.0;
/// Largest voltage and current that are believed without a unit.
const MAX_PLAIN_VOLTAGE: f64 = 100.0;
const MAX_PLAIN_CURRENT: f64 = 50.0;
/// Deviation of the slope of angle over integrated rate at which the units fit.
const MAX_SLOPE_DEVIATION: f64 = 0.1;
/// Square of the correlation from which the slope says something.
const MIN_SLOPE_CORRELATION: f64 = 0.8;
/// Relative distance to a usual number of counts per turn.
const MAX_COUNTS_DEVIATION: f64 = 0.02;

/// Full scales of a duty: a fraction, per cent, timers of 8, 10, 12 and 16 bits.
const FULL_DUTIES: [u32; 6] = [1, 100, 255, 1023, 4095, 65_535];

const ANGLES: [&str; 3] = ["rad", "deg", "rev"];
const RATES: [&str; 4] = ["rad/s", "rpm", "deg/s", "rev/s"];
/// Rates in whole numbers.
const WHOLE_RATES: [&str; 4] = ["rpm", "deg/s", "counts/s:N", "rad/s"];

/// Decides the units that the values decide, and returns what is left to the user.
pub fn settle(table: &Table, list: &mut [Belief]) -> Vec<Question> {
    let mut questions: Vec<Question> = which(list);
    questions.extend(list.iter().filter(|b| b.evidence == Evidence::OtherUnit).filter_map(|b| {
        let (target, unit) = (b.target.clone()?, b.unit.as_ref()?.text.clone());
        let wanted = quantity_of(&target)?.si();
        Some(Question::Size { column: b.source.clone(), target, unit, wanted })
    }));
    questions.extend(time(table, list));
    questions.extend(motion(table, list));
    let setpoints = [("rate_cmd_rad_s", "omega_rad_s"), ("theta_cmd_rad", "theta_rad")];
    for (setpoint, reading) in setpoints {
        let unit = list.iter().find(|b| b.target.as_deref() == Some(reading)).and_then(|b| b.unit.clone());
        let cmd = list.iter_mut().find(|b| b.target.as_deref() == Some(setpoint) && b.evidence == Evidence::LikeTheReading);
        match (cmd, unit) {
            (Some(cmd), Some(unit)) => cmd.unit = Some(unit),
            (Some(cmd), None) => questions.push(unit_question(cmd, if setpoint == "theta_cmd_rad" { &ANGLES } else { &RATES })),
            (None, _) => {}
        }
    }
    for (belief, column) in list.iter().zip(&table.columns).filter(|(b, _)| b.is_duty && b.evidence == Evidence::NameOnly) {
        let largest = finite(column).max_abs();
        let full = FULL_DUTIES.into_iter().find(|full| largest <= f64::from(*full)).unwrap_or(FULL_DUTIES[FULL_DUTIES.len() - 1]);
        questions.push(Question::Duty { column: belief.source.clone(), full });
    }
    for (belief, column) in list.iter_mut().zip(&table.columns).filter(|(b, _)| b.evidence == Evidence::NameOnly && !b.is_duty) {
        let Some(quantity) = belief.target.as_deref().and_then(quantity_of) else { continue };
        let (low, high) = finite(column).min_max();
        let largest = low.abs().max(high.abs());
        let whole = column.is_whole() && high - low > MIN_WHOLE_RANGE;
        let units: &[&str] = match quantity {
            Quantity::Voltage if whole || largest > MAX_PLAIN_VOLTAGE => &["V", "mV"],
            Quantity::Current if whole || largest > MAX_PLAIN_CURRENT => &["mA", "A"],
            Quantity::Torque if is_force(&belief.source) => &["N", "mN"],
            Quantity::Torque => &["N m", "mN m", "N cm"],
            Quantity::Acceleration => &["m/s²", "g"],
            Quantity::Rate if is_of_dut(belief) => &["rad/s", "deg/s"],
            Quantity::Temperature if low > 200.0 => &["K", "°C"],
            _ => continue,
        };
        questions.push(unit_question(belief, units));
    }
    questions
}

/// Whole numbers over a wide range.
pub fn may_be_counts(column: &TableColumn) -> bool {
    let (low, high) = finite(column).min_max();
    column.is_whole() && high - low > MIN_WHOLE_RANGE
}

fn is_of_dut(belief: &Belief) -> bool {
    belief.target.as_deref() == Some("gyro_rad_s")
}

fn is_force(name: &str) -> bool {
    let words = super::names::words(name);
    ["force", "kraft", "сила", "зусилля"].iter().any(|w| words.iter().any(|word| word == w))
}

fn finite(column: &TableColumn) -> impl Iterator<Item = f64> {
    column.values.iter().map(|v| v + column.origin).filter(|v| v.is_finite())
}

/// Asks for a unit; the first is believed until then.
fn unit_question(belief: &mut Belief, units: &[&str]) -> Question {
    belief.unit = units.first().and_then(|u| Unit::parse(u)).or(belief.unit.clone());
    belief.alternatives = units.iter().skip(1).map(|u| (*u).to_owned()).collect();
    let units = units.iter().map(|u| (*u).to_owned()).collect();
    Question::Unit { column: belief.source.clone(), target: belief.target.clone().unwrap_or_default(), units }
}

/// Columns with the same evidence for the same quantity.
fn which(list: &[Belief]) -> Vec<Question> {
    let with_rivals = list.iter().filter(|b| !b.rivals.is_empty() && b.evidence != Evidence::Stated && b.target.is_some());
    with_rivals
        .map(|b| Question::Which {
            target: b.target.clone().unwrap_or_default(),
            columns: std::iter::once(&b.source).chain(&b.rivals).cloned().collect(),
        })
        .collect()
}

/// Decides the unit of a time without one.
fn time(table: &Table, list: &mut [Belief]) -> Option<Question> {
    let stated_interval = table.stated_interval.clone();
    let Some(k) = list.iter().position(|b| b.target.as_deref() == Some("t_s")) else {
        return Some(Question::NoTime { stated_interval });
    };
    let (column, belief) = (&table.columns[k], &mut list[k]);
    if !belief.lacks_unit() {
        return None;
    }
    let step = median(column.values.windows(2).map(|w| w[1] - w[0]).filter(|d| *d > 0.0))?;
    let first = column.values.iter().copied().find(|v| v.is_finite())? + column.origin;
    let all = ["s", "ms", "us", "ns"].into_iter().filter_map(Unit::parse);
    let is_epoch = |u: &Unit| (EPOCH_S.0..EPOCH_S.1).contains(&(first * u.scale));
    let rate_is_usual = |u: &Unit| (ROW_RATES_HZ.0..=ROW_RATES_HZ.1).contains(&(1.0 / (step * u.scale)));
    let mut possible: Vec<Unit> = all.clone().filter(|u| is_epoch(u) && rate_is_usual(u)).collect();
    if possible.is_empty() {
        possible = all.filter(rate_is_usual).collect();
    }
    let whole = column.is_whole();
    // Whole numbers are rarely seconds.
    possible.sort_by_key(|u| whole == (u.scale == 1.0));
    if belief.evidence == Evidence::NameOnly {
        belief.evidence = Evidence::NameAndValues;
    }
    belief.unit = possible.first().cloned().or_else(|| Some(Unit::si(Quantity::Time)));
    let ones = column.values.windows(2).filter(|w| w[1] - w[0] == 1.0).count();
    if whole && (first == 0.0 || first == 1.0) && ones + 1 >= column.values.len() {
        let unit = possible.first().map(|u| u.text.clone());
        belief.alternatives = possible.iter().skip(1).map(|u| u.text.clone()).collect();
        return Some(Question::TimeOrRowNumber { column: belief.source.clone(), unit, stated_interval });
    }
    match possible.len() {
        1 => {
            belief.alternatives = Vec::new();
            None
        }
        0 => Some(unit_question(belief, &["s", "ms", "us", "min"])),
        _ => {
            let texts: Vec<&str> = possible.iter().map(|u| u.text.as_str()).collect();
            Some(unit_question(belief, &texts))
        }
    }
}

/// Decides the units of rate and angle by each other, as far as they do.
fn motion(table: &Table, list: &mut [Belief]) -> Vec<Question> {
    let position = |target: &str| list.iter().position(|b| b.target.as_deref() == Some(target));
    let (t, theta, omega) = (position("t_s"), position("theta_rad"), position("omega_rad_s"));
    let open = |k: Option<usize>| k.filter(|k| list[*k].lacks_unit());
    let mut questions = Vec::new();
    // An electrical rate is compared with nothing until its pole pairs are known.
    let electrical = open(omega).filter(|k| names::is_electrical_rate(&list[*k].source));
    questions.extend(electrical.map(|k| Question::PolePairs { column: list[k].source.clone() }));
    let omega = omega.filter(|_| electrical.is_none());
    let (open_theta, open_omega) = (open(theta), open(omega));
    let counts = open_theta.filter(|k| may_be_counts(&table.columns[*k]));
    let slope = match (t, theta, omega) {
        (Some(t), Some(theta), Some(omega)) => {
            let values = |k: usize| table.columns[k].values.as_slice();
            let scale = list[t].unit.as_ref().map_or(1.0, |u| u.scale);
            angle_over_rate_integral(values(t), values(theta), values(omega)).map(|slope| slope / scale)
        }
        _ => None,
    };
    if let Some(k) = counts {
        // Angle in counts = slope × integral of the rate in its unit.
        let rate = omega.filter(|_| open_omega.is_none()).and_then(|o| list[o].unit.as_ref());
        let per_turn = slope.zip(rate).map(|(slope, rate)| {
            let estimate = slope.abs() * std::f64::consts::TAU / rate.scale.abs();
            CountsPerTurn { estimate, usual: usual_counts(estimate) }
        });
        list[k].alternatives = vec!["counts:N".to_owned(), "deg".to_owned()];
        questions.push(Question::Counts { column: list[k].source.clone(), per_turn });
        questions.extend(open_omega.map(|o| unit_question(&mut list[o], &RATES)));
        return questions;
    }
    let choices = |open: Option<usize>, k: Option<usize>, units: &[&str]| -> Vec<Unit> {
        match (open, k) {
            (Some(_), _) => units.iter().filter_map(|u| Unit::parse(u)).collect(),
            (None, Some(k)) => list[k].unit.clone().into_iter().collect(),
            (None, None) => Vec::new(),
        }
    };
    let (angles, rates) = (choices(open_theta, theta, &ANGLES), choices(open_omega, omega, &RATES));
    let deviation = |angle: &Unit, rate: &Unit| slope.map_or(f64::INFINITY, |s| (s * angle.scale / rate.scale - 1.0).abs());
    let mut fitting: Vec<(&Unit, &Unit)> = rates.iter().flat_map(|r| angles.iter().map(move |a| (a, r))).collect();
    fitting.retain(|(a, r)| deviation(a, r) < MAX_SLOPE_DEVIATION);
    match (open_theta, open_omega) {
        (None, None) => {}
        (Some(k), Some(o)) if fitting.len() > 1 => {
            let pairs: Vec<(String, String)> = fitting.iter().map(|(a, r)| (r.text.clone(), a.text.clone())).collect();
            let believed = [(k, fitting[0].0.clone()), (o, fitting[0].1.clone())];
            for ((k, unit), others) in
                believed.into_iter().zip([pairs.iter().map(|p| p.1.clone()).collect(), pairs.iter().map(|p| p.0.clone()).collect()])
            {
                let others: Vec<String> = others;
                list[k].alternatives = others.into_iter().filter(|o| *o != unit.text).collect();
                list[k].unit = Some(unit);
            }
            questions.push(Question::RateAndAngle { rate: list[o].source.clone(), angle: list[k].source.clone(), pairs });
        }
        (open_theta, open_omega) => {
            for (k, all, found) in [
                (open_omega, &RATES[..], fitting.iter().map(|f| f.1.clone()).collect::<Vec<_>>()),
                (open_theta, &ANGLES[..], fitting.iter().map(|f| f.0.clone()).collect()),
            ] {
                let Some(k) = k else { continue };
                match &found[..] {
                    [unit] => {
                        list[k].unit = Some(unit.clone());
                        list[k].evidence = Evidence::RateAgainstAngle;
                        list[k].alternatives = Vec::new();
                    }
                    [] => {
                        let whole = Some(k) == open_omega && may_be_counts(&table.columns[k]);
                        questions.push(unit_question(&mut list[k], if whole { &WHOLE_RATES } else { all }));
                    }
                    several => {
                        let texts: Vec<&str> = several.iter().map(|u| u.text.as_str()).collect();
                        questions.push(unit_question(&mut list[k], &texts));
                    }
                }
            }
        }
    }
    questions
}

/// Ratio of the measured rate to the derivative of the angle, both in SI by their believed units, where both are stated and the ratio is
/// not 1.
pub fn rate_over_derivative(table: &Table, list: &[Belief]) -> Option<f64> {
    let find = |target: &str| list.iter().position(|b| b.target.as_deref() == Some(target));
    let (t, theta, omega) = (find("t_s")?, find("theta_rad")?, find("omega_rad_s")?);
    let scale = |k: usize| list[k].unit.as_ref().map_or(1.0, |u| u.scale);
    let values = |k: usize| table.columns[k].values.as_slice();
    let slope = angle_over_rate_integral(values(t), values(theta), values(omega))?;
    let ratio = scale(omega) * scale(t) / (slope * scale(theta));
    (ratio.is_finite() && (ratio - 1.0).abs() > MAX_SLOPE_DEVIATION).then_some(ratio)
}

/// A usual number of counts per turn near the estimate: pulses of catalogues, once or four times, and powers of two.
fn usual_counts(estimate: f64) -> Option<u32> {
    const PULSES: [u32; 22] = [7, 11, 12, 13, 16, 20, 24, 48, 64, 100, 200, 250, 256, 360, 400, 500, 512, 600, 720, 900, 1250, 4500];
    let decimal = [
        1000, 1024, 1500, 1800, 2000, 2048, 2500, 3600, 4000, 4096, 5000, 8000, 8192, 10_000, 16_384, 20_000, 32_768, 36_000, 40_000,
        65_536,
    ];
    let all = PULSES.iter().chain(&decimal).flat_map(|n| [*n, 4 * n]);
    let distance = |n: &u32| (estimate / f64::from(*n) - 1.0).abs();
    all.filter(|n| distance(n) < MAX_COUNTS_DEVIATION).min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

/// Regression of the angle's increments on the integral of the rate over windows, in the units of the file; `None` without motion. Windows
/// with a jump of the angle or the time (a wrapped angle, an overflow, a restart) do not count.
fn angle_over_rate_integral(t: &[f64], theta: &[f64], omega: &[f64]) -> Option<f64> {
    let rows = (t.len() / 100).max(5);
    let longest = 20.0 * median(t.windows(2).map(|w| w[1] - w[0]))?;
    let increments: Vec<f64> = theta.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|d| d.is_finite()).collect();
    let jump = 10.0 * crate::statistics::robust::quantile(increments, 0.98)?;
    let (mut products, mut squares, mut angles) = (0.0, 0.0, 0.0);
    for start in (0..t.len().saturating_sub(rows + 1)).step_by(rows) {
        let inside = start..start + rows;
        let is_smooth = inside.clone().all(|k| {
            let step = t[k + 1] - t[k];
            step > 0.0 && step < longest && (jump == 0.0 || (theta[k + 1] - theta[k]).abs() <= jump)
        });
        let turned = theta[start + rows] - theta[start];
        let integral: f64 = inside.map(|k| 0.5 * (omega[k] + omega[k + 1]) * (t[k + 1] - t[k])).sum();
        if is_smooth && turned.is_finite() && integral.is_finite() {
            products += turned * integral;
            squares += integral * integral;
            angles += turned * turned;
        }
    }
    let related = squares > 0.0 && angles > 0.0 && products * products > MIN_SLOPE_CORRELATION * squares * angles;
    related.then(|| products / squares)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_of_encoders_are_recognised() {
        assert_eq!(usual_counts(20_031.0), Some(20_000));
        assert_eq!(usual_counts(8190.0), Some(8192));
        assert_eq!(usual_counts(1999.0), Some(2000));
        assert_eq!(usual_counts(1730.0), None);
    }

    #[test]
    fn slope_ignores_wraps_and_restarts() {
        let t: Vec<f64> = (0..4000).map(|k| 1e-3 * f64::from(k % 2000)).collect();
        let omega: Vec<f64> = t.iter().map(|t| 30.0 * (2.0 * t).cos()).collect();
        let theta: Vec<f64> = t.iter().map(|t| (15.0 * (2.0 * t).sin()).to_degrees().rem_euclid(360.0)).collect();
        let slope = angle_over_rate_integral(&t, &theta, &omega).expect("motion");
        assert!((slope - 180.0 / std::f64::consts::PI).abs() < 0.1, "{slope}");
    }
}
