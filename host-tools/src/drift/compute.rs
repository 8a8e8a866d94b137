//! A log becomes cycles: columns `angle_sensor_V` and `torquer_A` of one axis, or `angle_sensor_x_V`, `torquer_x_A` and so on of three.
//!
//! Notes say what the columns mean, options come before them: `angle_gain_V_rad` (K_k), `torquer_gain_rad_s_A` (K_m/H), `pulse_s` (T),
//! `angle_limit_V`, `latitude_deg`; the place by the columns or notes `turned_deg`, `raised_deg`, `rolled_deg`. Several logs are one measurement.

use super::DriftError;
use super::answer::{CycleLine, Measured};
use super::error::within;
use super::find::{Found, by_current, by_mark, contrast};
use super::integral::{Integral, amplitude_rad_s, residual_rad_s};
use crate::log::Log;
use crate::statistics::Extremes;
use hal_sim::gyro::Place;

/// Columns that the reader is told of.
pub const COLUMNS: [&str; 10] = [
    "angle_sensor_x_V",
    "angle_sensor_y_V",
    "angle_sensor_z_V",
    "torquer_x_A",
    "torquer_y_A",
    "torquer_z_A",
    "drift_mark",
    "turned_deg",
    "raised_deg",
    "rolled_deg",
];
/// Time before a cycle in which the current at rest is looked for, s: the firmware opens the loop half a second before.
const LEAD_S: f64 = 0.4;
/// An axis of three whose current's halves differ by less than this share of the greatest has no pulse in that cycle.
const NO_PULSE: f64 = 0.05;
/// Rows of one code at the end of the range that are a saturation.
const STUCK_ROWS: usize = 5;

/// What the options say; what they do not, the notes do.
#[derive(Debug, Clone, Default)]
pub struct Given {
    /// K_k, V/rad.
    pub angle_gain_V_rad: Option<f64>,
    /// K_m/H, rad/s/A.
    pub torquer_gain_rad_s_A: Option<f64>,
    /// T, s.
    pub pulse_s: Option<f64>,
    /// End of the angle sensor's range, V.
    pub angle_limit_V: Option<f64>,
    /// Latitude, degrees.
    pub latitude_deg: Option<f64>,
    /// Standard error of the turn, rad.
    pub turn_error_rad: f64,
    /// Of the level, rad.
    pub level_error_rad: f64,
    /// Of K_k, relative.
    pub gain_error: f64,
}

/// A number of the options, else of a note; `None` where neither has it.
fn number(log: &Log, given: Option<f64>, note: &'static str, least: f64, most: f64) -> Result<Option<f64>, DriftError> {
    if let Some(value) = given {
        return within(note, value, least, most).map(Some);
    }
    let Some(text) = log.note(note) else { return Ok(None) };
    let word = text.split_whitespace().next().unwrap_or("");
    let name = log.path().display().to_string();
    let value = word.parse().map_err(|_| DriftError::NoteText { log: name.clone(), note: note.to_owned(), text: text.to_owned() })?;
    within(&format!("{name}: note {note}"), value, least, most).map(Some)
}

/// The cycles of these logs.
///
/// # Errors
/// What is missing or makes no sense, in one line.
pub fn measured(logs: &[Log], given: &Given) -> Result<Measured, DriftError> {
    let names: Vec<String> = logs.iter().map(|log| log.path().display().to_string()).collect();
    let mut all = Measured {
        name: names.join(", "),
        cycles: Vec::new(),
        has_three_axes: false,
        latitude_deg: None,
        turn_error_rad: within("--turn-error", given.turn_error_rad, 0.0, 1.0)?,
        level_error_rad: within("--level-error", given.level_error_rad, 0.0, 1.0)?,
        gain_error: within("--gain-error", given.gain_error, 0.0, 1.0)?,
        warnings: Vec::new(),
    };
    for log in logs {
        all.latitude_deg = number(log, given.latitude_deg, "latitude_deg", -90.0, 90.0)?.or(all.latitude_deg);
        all.warnings.extend(log.warnings().iter().cloned());
        take(log, given, &mut all)?;
    }
    Ok(all)
}

fn take(log: &Log, given: &Given, all: &mut Measured) -> Result<(), DriftError> {
    let name = log.path().display().to_string();
    let missing = |note, option| DriftError::Note { log: name.clone(), note, option };
    let gain =
        number(log, given.angle_gain_V_rad, "angle_gain_V_rad", 1e-9, 1e12)?.ok_or_else(|| missing("angle_gain_V_rad", "--angle-gain"))?;
    let torquer = number(log, given.torquer_gain_rad_s_A, "torquer_gain_rad_s_A", 1e-12, 1e6)?;
    let pulse_s = number(log, given.pulse_s, "pulse_s", 1e-3, 1e5)?.ok_or_else(|| missing("pulse_s", "--pulse"))?;
    let limit_V = number(log, given.angle_limit_V, "angle_limit_V", 1e-9, 1e9)?;
    let dt_s = log.median_dt_s();
    let samples = (pulse_s / dt_s).round();
    if !(dt_s > 0.0 && samples >= 1.0) || ((samples * dt_s - pulse_s) / pulse_s).abs() > 1e-3 {
        return Err(DriftError::Log { log: name, says: format!("pulses of {pulse_s} s are no whole number of rows of {dt_s} s") });
    }
    let samples = samples as usize;
    let three = ["x", "y", "z"].map(|axis| (format!("angle_sensor_{axis}_V"), format!("torquer_{axis}_A")));
    all.has_three_axes |= log.column(&three[0].0).is_some();
    let columns: Vec<(String, String)> =
        if all.has_three_axes { three.to_vec() } else { vec![("angle_sensor_V".to_owned(), "torquer_A".to_owned())] };
    if torquer.is_none() {
        let warning = "K_m/H is not known (note torquer_gain_rad_s_A): nothing is corrected by the current";
        if !all.warnings.iter().any(|line| line == warning) {
            all.warnings.push(warning.to_owned());
        }
    }
    let before = all.cycles.len();
    let column = |column: &str| log.column(column).ok_or_else(|| DriftError::Column { log: name.clone(), column: column.to_owned() });
    let mut of_axes = Vec::new();
    for (volts, amperes) in &columns {
        let (volts, amperes) = (column(volts)?, column(amperes)?);
        let found = match log.column("drift_mark") {
            Some(mark) => by_mark(mark, amperes, samples),
            None => by_current(amperes, samples),
        };
        of_axes.push((volts, amperes, found));
    }
    let pulses = |amperes: &[f64], found: &Found| contrast(amperes, found.rows.start, samples).abs();
    let greatest = of_axes.iter().flat_map(|(_, i, found)| found.iter().map(|one| pulses(i, one))).max_or_zero();
    for (axis, (volts, amperes, found)) in of_axes.iter().enumerate() {
        let about = About { log, pulse_s, samples, gain, torquer, limit_V, axis };
        // The mark is of all axes, the pulses need not be.
        for one in found.iter().filter(|one| !all.has_three_axes || pulses(amperes, one) > NO_PULSE * greatest) {
            let number = all.cycles.len() as u32 + 1;
            all.cycles.push(about.cycle(one, number, volts, amperes)?);
        }
    }
    if all.cycles.len() == before {
        let still = columns.iter().all(|(_, amperes)| log.column(amperes).is_none_or(|column| column.iter().all(|i| *i == column[0])));
        let why = if still { ": the torquer's current does not change" } else { "" };
        return Err(DriftError::NoCycle { log: name, pulse_s, why: why.to_owned() });
    }
    Ok(())
}

/// What is the same for all cycles of a column.
struct About<'a> {
    log: &'a Log,
    pulse_s: f64,
    samples: usize,
    gain: f64,
    torquer: Option<f64>,
    limit_V: Option<f64>,
    axis: usize,
}

impl About<'_> {
    fn cycle(&self, found: &Found, number: u32, volts: &[f64], amperes: &[f64]) -> Result<CycleLine, DriftError> {
        let rows = found.rows.clone();
        let angles: Vec<f64> = volts[rows.clone()].iter().map(|v| v / self.gain).collect();
        let whole = Integral::of(&angles, self.pulse_s);
        let nothing = Integral { pulse_s: self.pulse_s, switched_rad_s: 0.0, sum_rad_s: 0.0, slope_rad_s: 0.0, span_rad: 0.0 };
        let currents = &amperes[rows.start..(rows.start + 2 * self.samples).min(amperes.len())];
        let residual_rad_s = self.torquer.filter(|_| currents.len() == 2 * self.samples).map(|torquer| {
            let at_rest = self.at_rest(rows.start, amperes, currents);
            residual_rad_s(&currents.iter().map(|i| (i - at_rest) * torquer).collect::<Vec<_>>())
        });
        let t_s = self.log.t_s();
        Ok(CycleLine {
            number,
            place: self.place(rows.start)?,
            axis: self.axis,
            sign: found.sign,
            start_s: t_s[rows.start],
            bad: self.bad(found, volts, currents),
            integral: whole.unwrap_or(nothing),
            amplitude_rad_s: if found.is_cut { 0.0 } else { amplitude_rad_s(&angles, self.pulse_s) },
            residual_rad_s,
        })
    }

    /// Current while the loop is open and nothing is given, A: what the sensor shows at none.
    fn at_rest(&self, start: usize, amperes: &[f64], pulses: &[f64]) -> f64 {
        let most = pulses.iter().copied().max_abs();
        let rows = (LEAD_S / self.log.median_dt_s()).round() as usize;
        let lead: Vec<f64> = amperes[start.saturating_sub(rows)..start].iter().copied().filter(|i| i.abs() < 0.05 * most).collect();
        // A few rows of a closed loop are no rest.
        if lead.is_empty() || lead.len() < rows / 2 { 0.0 } else { lead.iter().sum::<f64>() / lead.len() as f64 }
    }

    fn bad(&self, found: &Found, volts: &[f64], currents: &[f64]) -> Option<String> {
        let t_s = &self.log.t_s()[found.rows.clone()];
        let gap = t_s.windows(2).any(|w| w[1] - w[0] > crate::log::GAP_INTERVALS * self.log.median_dt_s());
        let cycle = &volts[found.rows.clone()];
        let most = cycle.iter().copied().max_abs();
        let beyond = self.limit_V.is_some_and(|limit| most >= limit);
        // The greatest value several times in a row: a sensor that follows a pulse does not rest there.
        let stuck = cycle.windows(STUCK_ROWS).any(|w| w.iter().all(|v| v.abs() >= most)) && self.limit_V.is_none() && most > 0.0;
        let half = currents.len() / 2;
        let mean = |i: &[f64]| i.iter().sum::<f64>() / i.len().max(1) as f64;
        let (first, second) = (mean(&currents[..half]), mean(&currents[half..]));
        let unequal = (first + second).abs() > 0.05 * (first - second).abs() / 2.0;
        let reason = match (found.is_cut, gap, beyond || stuck, unequal) {
            (true, ..) => "cut short",
            (_, true, ..) => "sample lost",
            (_, _, true, _) => "angle sensor saturated",
            (_, _, _, true) => "current limited",
            _ => return None,
        };
        Some(reason.to_owned())
    }

    fn place(&self, row: usize) -> Result<Place, DriftError> {
        let of = |name: &'static str| match self.log.column(name) {
            Some(column) => Ok(column[row]),
            None => number(self.log, None, name, -3600.0, 3600.0).map(|value| value.unwrap_or(0.0)),
        };
        Ok(Place {
            turned_rad: of("turned_deg")?.to_radians(),
            raised_rad: of("raised_deg")?.to_radians(),
            rolled_rad: of("rolled_deg")?.to_radians(),
        })
    }
}
