//! What the columns of another program's table probably are: by their names, their units and their values.
//!
//! Nothing is used without consent: the user accepts a [`Belief`] or states something else.

use super::table::Table;
use super::units::{Quantity, Unit, split_name};
use crate::log::known;
use crate::statistics::Extremes;

/// Why a column is believed to be something.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Evidence {
    /// The user or an import file states it.
    Stated,
    /// Its name is that of a column of the project.
    OwnName,
    /// Name and unit say it.
    NameAndUnit,
    /// The name says the quantity; no unit is stated, that of the project is assumed.
    NameOnly,
    /// The name says the quantity; the values suggest the unit.
    NameAndValues,
    /// The name says the quantity; the unit makes the rate the derivative of the angle.
    RateAgainstAngle,
    /// The unit says the quantity, and no other column has it.
    UnitOnly,
    /// The first column increases evenly: a time.
    IncreasesEvenly,
    /// Nothing is known: it can be used in expressions.
    Unknown,
}

/// What a column is believed to be.
#[derive(Debug, Clone, PartialEq)]
pub struct Belief {
    /// Name in the file.
    pub source: String,
    /// Name of the column of the project, or of the user's own; `None`: not used.
    pub target: Option<String>,
    /// Unit of the numbers in the file; `None` for a column of the user's own.
    pub unit: Option<Unit>,
    /// Why.
    pub evidence: Evidence,
    /// The unit is not certain: these fit the values too.
    pub alternatives: Vec<String>,
}

/// Words that name a quantity, with the project's column; a word alone or among others in the name.
const NAMES: &[(&str, &[&str])] = &[
    ("t_s", &["t", "time", "timestamp", "zeit", "ts", "sec", "seconds", "millis", "micros", "час", "время", "xvalue"]),
    ("supply_V", &["supply", "vbus", "vdc", "udc", "vbat", "battery", "bus", "vsupply", "vs", "vcc"]),
    (
        "u_V",
        &[
            "u",
            "v",
            "voltage",
            "volt",
            "volts",
            "uin",
            "vin",
            "um",
            "vm",
            "va",
            "ua",
            "vmot",
            "umot",
            "spannung",
            "armature",
            "напруга",
            "напряжение",
        ],
    ),
    ("i_A", &["i", "current", "curr", "amps", "iq", "im", "ia", "imot", "strom", "струм", "ток"]),
    ("torque_N_m", &["torque", "tau", "moment", "drehmoment", "force", "kraft", "trq", "момент", "сила"]),
    (
        "omega_rad_s",
        &[
            "omega",
            "w",
            "speed",
            "velocity",
            "vel",
            "rate",
            "rpm",
            "drehzahl",
            "dq",
            "qdot",
            "thetadot",
            "spd",
            "wm",
            "швидкість",
            "скорость",
            "оберти",
        ],
    ),
    ("theta_rad", &["theta", "angle", "pos", "position", "phi", "encoder", "enc", "q", "winkel", "ang", "кут", "угол", "положення"]),
    ("temp_C", &["temp", "temperature", "winding", "tmotor", "температура"]),
    ("gyro_rad_s", &["gyro", "gyroscope", "gyr", "gz"]),
    ("accel_x_m_s2", &["ax", "accx", "accelx"]),
    ("accel_y_m_s2", &["ay", "accy", "accely"]),
];
/// Words that make a rate or an angle a setpoint.
const SETPOINT: &[&str] =
    &["ref", "reference", "cmd", "command", "set", "setpoint", "target", "desired", "des", "sp", "soll", "sollwert", "goal"];

/// Row rates of laboratories, Hz: the unit of an unlabelled time gives one of these.
const ROW_RATES_HZ: (f64, f64) = (4.9, 60e3);
/// Range from which whole numbers are counts.
const MIN_WHOLE_RANGE: f64 = 100.0;
/// Deviation of the slope of angle over integrated rate at which the units fit.
const MAX_SLOPE_DEVIATION: f64 = 0.1;
/// Square of the correlation from which the slope says something.
const MIN_SLOPE_CORRELATION: f64 = 0.8;
/// Relative spread of the steps of a column that increases evenly.
const MAX_STEP_SPREAD: f64 = 0.5;

/// Beliefs about all columns of a table, in their order.
pub fn beliefs(table: &Table) -> Vec<Belief> {
    let mut list: Vec<Belief> = table
        .columns
        .iter()
        .map(|column| {
            if column.is_text() {
                return Belief {
                    source: column.name.clone(),
                    target: None,
                    unit: None,
                    evidence: Evidence::Unknown,
                    alternatives: Vec::new(),
                };
            }
            by_name(&column.name, &column.unit, column.is_date)
        })
        .collect();
    time(table, &mut list);
    by_unit(&mut list);
    without_repetition(&mut list);
    whole_numbers(table, &mut list);
    for belief in &mut list {
        if belief.evidence == Evidence::Unknown && belief.target.is_none() {
            let column = table.columns.iter().find(|c| c.name == belief.source);
            belief.target = column.filter(|c| !c.is_text()).map(|c| own_name(&c.name));
        }
    }
    list
}

/// Whole numbers without a unit are counts or a coarse unit, not the unit of the project: the user must say which.
fn whole_numbers(table: &Table, list: &mut [Belief]) {
    for (belief, column) in list.iter_mut().zip(&table.columns).filter(|(b, _)| b.evidence == Evidence::NameOnly) {
        let (low, high) = column.values.iter().copied().filter(|v| v.is_finite()).min_max();
        if column.values.iter().all(|v| v.fract() == 0.0 || v.is_nan()) && high - low > MIN_WHOLE_RANGE {
            let units: &[&str] = match belief.target.as_deref().and_then(quantity_of) {
                Some(Quantity::Angle) => &["counts:N", "deg"],
                Some(Quantity::Rate) => &["rpm", "counts/s:N", "deg/s"],
                Some(Quantity::Current) => &["mA"],
                Some(Quantity::Voltage) => &["mV"],
                _ => &[],
            };
            belief.alternatives = units.iter().map(|u| (*u).to_owned()).collect();
        }
    }
}

/// Where rate or angle has no unit, the one that makes the rate the derivative of the angle.
pub fn rate_against_angle(table: &Table, list: &mut [Belief]) {
    let position = |target: &str| list.iter().position(|b| b.target.as_deref() == Some(target));
    let (Some(t), Some(theta), Some(omega)) = (position("t_s"), position("theta_rad"), position("omega_rad_s")) else { return };
    let open = [theta, omega].map(|k| list[k].evidence == Evidence::NameOnly);
    let is_open = |k: usize| if k == theta { open[0] } else { open[1] };
    let unit = |k: usize| list[k].unit.clone();
    let (Some(theta_unit), Some(omega_unit), Some(time_unit)) = (unit(theta), unit(omega), unit(t)) else { return };
    let values = |k: usize| table.columns[k].values.as_slice();
    let Some(slope) = angle_over_rate_integral(values(t), values(theta), values(omega)) else { return };
    // In the units of the file: d(angle) = slope × rate × time.
    let fits = |theta: &Unit, omega: &Unit| (slope * theta.scale / (omega.scale * time_unit.scale) - 1.0).abs() < MAX_SLOPE_DEVIATION;
    if (!is_open(theta) && !is_open(omega)) || fits(&theta_unit, &omega_unit) {
        return;
    }
    let choices = |k: usize, own: &Unit, others: &[&str]| -> Vec<Unit> {
        let others = others.iter().filter_map(|u| Unit::parse(u));
        if is_open(k) { std::iter::once(own.clone()).chain(others).collect() } else { vec![own.clone()] }
    };
    let (angles, rates) = (choices(theta, &theta_unit, &["deg", "rev"]), choices(omega, &omega_unit, &["rpm", "deg/s", "rev/s"]));
    let pairs = angles.iter().flat_map(|a| rates.iter().map(move |r| (a, r)));
    let fitting: Vec<(&Unit, &Unit)> = pairs.filter(|(a, r)| fits(a, r)).collect();
    let Some((angle, rate)) = fitting.first() else { return };
    for (k, unit, other) in [(theta, angle, fitting.get(1).map(|f| f.0)), (omega, rate, fitting.get(1).map(|f| f.1))] {
        if is_open(k) {
            list[k].alternatives = other.filter(|o| o.text != unit.text).map(|o| o.text.clone()).into_iter().collect();
            list[k].unit = Some((*unit).clone());
            list[k].evidence = Evidence::RateAgainstAngle;
        }
    }
}

/// Regression of the angle's increments on the integral of the rate over windows, in the units of the file; `None` without motion.
fn angle_over_rate_integral(t: &[f64], theta: &[f64], omega: &[f64]) -> Option<f64> {
    let rows = (t.len() / 100).max(5);
    let (mut products, mut squares, mut angles) = (0.0, 0.0, 0.0);
    for start in (0..t.len().saturating_sub(rows + 1)).step_by(rows) {
        let turned = theta[start + rows] - theta[start];
        let integral: f64 = (start..start + rows).map(|k| 0.5 * (omega[k] + omega[k + 1]) * (t[k + 1] - t[k])).sum();
        if turned.is_finite() && integral.is_finite() {
            products += turned * integral;
            squares += integral * integral;
            angles += turned * turned;
        }
    }
    let related = squares > 0.0 && angles > 0.0 && products * products > MIN_SLOPE_CORRELATION * squares * angles;
    related.then(|| products / squares)
}

/// A name that an expression can use.
pub fn own_name(name: &str) -> String {
    let mut own: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    while own.contains("__") {
        own = own.replace("__", "_");
    }
    let own = own.trim_matches('_');
    if own.is_empty() || own.starts_with(|c: char| c.is_ascii_digit()) { format!("column_{own}") } else { own.to_owned() }
}

/// The quantity of a column of the project, from its unit.
pub fn quantity_of(target: &str) -> Option<Quantity> {
    Unit::parse(known(target)?.unit).map(|u| u.quantity)
}

fn words(name: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut before_lower = false;
    for letter in name.chars() {
        if !letter.is_alphanumeric() {
            words.push(String::new());
        } else {
            if letter.is_uppercase() && before_lower {
                words.push(String::new());
            }
            if let Some(word) = words.last_mut() {
                word.extend(letter.to_lowercase());
            }
        }
        before_lower = letter.is_lowercase();
    }
    words.retain(|w| !w.is_empty());
    words
}

fn by_name(name: &str, unit_row: &str, is_date: bool) -> Belief {
    let belief = |target: Option<&str>, unit, evidence| Belief {
        source: name.to_owned(),
        target: target.map(str::to_owned),
        unit,
        evidence,
        alternatives: Vec::new(),
    };
    if is_date {
        return belief(Some("t_s"), Some(Unit::si(Quantity::Time)), Evidence::NameAndUnit);
    }
    if known(name).is_some() && unit_row.is_empty() {
        return belief(Some(name), quantity_of(name).map(Unit::si), Evidence::OwnName);
    }
    let (base, in_name) = split_name(name);
    let unit = Unit::parse(unit_row).or(in_name);
    // A name that is itself a unit: `rpm`, `deg`.
    let unit = unit.or_else(|| Unit::parse(name).filter(|u| name.len() > 1 && u.quantity != Quantity::Time));
    let words = words(&base);
    let joined = words.concat();
    let setpoint = words.iter().any(|w| SETPOINT.contains(&w.as_str()));
    let named = |list: &[&str]| list.contains(&joined.as_str()) || words.iter().any(|w| list.contains(&w.as_str()));
    let fits = |target: &str| unit.as_ref().is_none_or(|u| quantity_of(target) == Some(u.quantity));
    let found = NAMES.iter().filter(|(_, list)| named(list)).map(|(target, _)| *target).find(|target| fits(target));
    match (found, unit) {
        (Some("omega_rad_s"), unit) if setpoint => belief(Some("rate_cmd_rad_s"), unit, Evidence::NameAndUnit),
        (Some("theta_rad"), unit) if setpoint => belief(Some("theta_cmd_rad"), unit, Evidence::NameAndUnit),
        (Some(_), _) if setpoint => belief(None, None, Evidence::Unknown),
        (Some(target), Some(unit)) => belief(Some(target), Some(unit), Evidence::NameAndUnit),
        (Some(target), None) => belief(Some(target), quantity_of(target).map(Unit::si), Evidence::NameOnly),
        (None, Some(unit)) if !setpoint => belief(None, Some(unit), Evidence::UnitOnly),
        (None, _) => belief(None, None, Evidence::Unknown),
    }
}

/// Finds the time column, and the unit of a time without one.
fn time(table: &Table, list: &mut [Belief]) {
    let increases = |k: usize| {
        let t = &table.columns[k].values;
        t.len() > 2 && t.iter().all(|v| v.is_finite()) && t.windows(2).all(|w| w[1] > w[0])
    };
    if !list.iter().any(|b| b.target.as_deref() == Some("t_s"))
        && let Some(first) = (0..list.len()).find(|&k| matches!(list[k].evidence, Evidence::Unknown | Evidence::UnitOnly) && increases(k))
        && first == 0
        && steps_are_even(&table.columns[first].values)
        && list[first].unit.as_ref().is_none_or(|u| u.quantity == Quantity::Time)
    {
        let evidence = Evidence::IncreasesEvenly;
        list[first] = Belief { target: Some("t_s".to_owned()), unit: list[first].unit.clone(), evidence, ..list[first].clone() };
    }
    for (belief, column) in list.iter_mut().zip(&table.columns) {
        let is_unlabelled = belief.target.as_deref() == Some("t_s")
            && (belief.evidence == Evidence::NameOnly || (belief.evidence == Evidence::IncreasesEvenly && belief.unit.is_none()));
        if !is_unlabelled {
            continue;
        }
        let steps: Vec<f64> = column.values.windows(2).map(|w| w[1] - w[0]).filter(|d| *d > 0.0).collect();
        let Some(step) = crate::statistics::robust::median(steps) else { continue };
        let whole = column.values.iter().all(|v| v.fract() == 0.0);
        let possible = ["s", "ms", "us", "ns"].into_iter().filter_map(Unit::parse).filter(|u| {
            let rate_hz = 1.0 / (step * u.scale);
            rate_hz >= ROW_RATES_HZ.0 && rate_hz <= ROW_RATES_HZ.1
        });
        let possible: Vec<Unit> = possible.collect();
        // Fractions are seconds, if these fit: nobody counts tenths of a millisecond.
        let unit = possible.iter().find(|u| whole != (u.scale == 1.0)).or(possible.first()).cloned();
        belief.alternatives =
            if whole { possible.iter().filter(|p| Some(*p) != unit.as_ref()).map(|p| p.text.clone()).collect() } else { Vec::new() };
        if belief.evidence == Evidence::NameOnly {
            belief.evidence = Evidence::NameAndValues;
        }
        belief.unit = unit.or_else(|| Some(Unit::si(Quantity::Time)));
    }
}

fn steps_are_even(values: &[f64]) -> bool {
    let steps: Vec<f64> = values.windows(2).map(|w| w[1] - w[0]).collect();
    let Some(median) = crate::statistics::robust::median(steps.iter().copied()) else { return false };
    let even = steps.iter().filter(|s| (*s - median).abs() <= MAX_STEP_SPREAD * median).count();
    even as f64 > 0.9 * steps.len() as f64
}

/// A column whose name says nothing is what its unit says, if no other column is that.
fn by_unit(list: &mut [Belief]) {
    for k in 0..list.len() {
        let Some(unit) = list[k].unit.clone().filter(|_| list[k].evidence == Evidence::UnitOnly) else { continue };
        let target = match unit.quantity {
            Quantity::Time => "t_s",
            Quantity::Angle => "theta_rad",
            Quantity::Rate => "omega_rad_s",
            Quantity::Voltage => "u_V",
            Quantity::Current => "i_A",
            Quantity::Torque => "torque_N_m",
            Quantity::Temperature => "temp_C",
            Quantity::Acceleration => "accel_x_m_s2",
        };
        let alone = list
            .iter()
            .enumerate()
            .filter(|(other, b)| *other != k && b.unit.as_ref().is_some_and(|u| u.quantity == unit.quantity))
            .count()
            == 0;
        if alone {
            list[k].target = Some(target.to_owned());
        } else {
            list[k].evidence = Evidence::Unknown;
        }
    }
}

/// Each column of the project once: the first with the best evidence.
fn without_repetition(list: &mut [Belief]) {
    let rank = |e: Evidence| match e {
        Evidence::Stated => 0,
        Evidence::OwnName => 1,
        Evidence::NameAndUnit => 2,
        Evidence::NameAndValues | Evidence::RateAgainstAngle | Evidence::NameOnly => 3,
        Evidence::UnitOnly => 4,
        Evidence::IncreasesEvenly => 5,
        Evidence::Unknown => 6,
    };
    for k in 0..list.len() {
        let Some(target) = list[k].target.clone() else { continue };
        let best = (0..list.len()).filter(|&o| list[o].target.as_ref() == Some(&target)).min_by_key(|&o| (rank(list[o].evidence), o));
        if best != Some(k) {
            list[k].target = None;
            list[k].evidence = Evidence::Unknown;
        }
    }
}
