//! Cycles from logs: columns `angle_sensor_V` and `torquer_A` for one axis, `angle_sensor_x_V`, `torquer_x_A` and so on for three.
//!
//! Options, or else notes of the log, give the scales: `angle_gain_V_rad` (K_k), `torquer_gain_rad_s_A` (K_m/H), `pulse_s` (T),
//! `angle_limit_V`, `latitude_deg`. The columns or notes `turned_deg`, `raised_deg`, `rolled_deg` give the position. Several logs form one
//! measurement.

use super::clipping::clipping;
use super::cycle::{Cycle, CycleDefect};
use super::detection::{DetectedCycle, contrast, cycles_by_current, cycles_by_mark};
use super::error::{DriftError, NoCycleReason, within};
use super::integral::{Integral, amplitude_rad_s, residual_rad_s};
use super::measurement::{DriftWarning, Measurement, SetupUncertainties};
use hal_sim::gyro::Orientation;
use identification::log::Log;
use identification::statistics::Extremes;

/// Columns to read beside the standard ones.
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
/// Time before a cycle from which the zero current is taken, s: the firmware opens the loop 0.5 s before the cycle.
const ZERO_CURRENT_S: f64 = 0.4;
/// Contrast of the current, relative to the greatest, below which an axis of three has no pulse in a cycle.
const MIN_PULSE_RATIO: f64 = 0.05;
/// Successive rows at the greatest value that count as saturation.
const SATURATED_ROWS: usize = 5;
/// Current, relative to the pulses, up to which a row counts as zero current.
const MAX_ZERO_CURRENT_RATIO: f64 = 0.05;
/// Difference of the pulse currents, relative to their size, from which the current was limited.
const MAX_CURRENT_IMBALANCE: f64 = 0.05;
/// Relative deviation of a pulse from a whole number of rows.
const MAX_ROW_MISFIT: f64 = 1e-3;

/// Scales and uncertainties from the options; missing scales are taken from the notes of the log.
#[derive(Debug, Clone, Default)]
pub struct DriftSettings {
    /// K_k, V/rad.
    pub angle_gain_V_rad: Option<f64>,
    /// K_m/H, rad/s/A.
    pub torquer_gain_rad_s_A: Option<f64>,
    /// Duration T of a pulse, s.
    pub pulse_s: Option<f64>,
    /// End of the angle sensor's range, V.
    pub angle_limit_V: Option<f64>,
    /// Latitude, degrees.
    pub latitude_deg: Option<f64>,
    /// Standard uncertainties of the setup.
    pub uncertainties: SetupUncertainties,
}

/// A number by an option or a note; `None` where both are missing.
fn number(log: &Log, option: Option<f64>, note: &'static str, min: f64, max: f64) -> Result<Option<f64>, DriftError> {
    if let Some(value) = option {
        return within(note, value, min, max).map(Some);
    }
    let Some(text) = log.note(note) else { return Ok(None) };
    let word = text.split_whitespace().next().unwrap_or("");
    let name = log.path().display().to_string();
    let value = word.parse().map_err(|_| DriftError::NoteText { log: name.clone(), note: note.to_owned(), text: text.to_owned() })?;
    within(&format!("{name}: note {note}"), value, min, max).map(Some)
}

/// The cycles of one or more logs.
///
/// # Errors
/// A missing column or note, a number out of its range, a log without cycles.
pub fn measurement(logs: &[Log], settings: &DriftSettings) -> Result<Measurement, DriftError> {
    let names: Vec<String> = logs.iter().map(|log| log.path().display().to_string()).collect();
    let mut all = Measurement {
        name: names.join(", "),
        cycles: Vec::new(),
        has_three_axes: false,
        latitude_deg: None,
        uncertainties: settings.uncertainties.checked()?,
        warnings: Vec::new(),
    };
    let mut offset_s = 0.0;
    if logs.len() > 1 {
        all.warnings.push(DriftWarning::UnknownTimesBetweenLogs);
    }
    for log in logs {
        all.latitude_deg = number(log, settings.latitude_deg, "latitude_deg", -90.0, 90.0)?.or(all.latitude_deg);
        all.warnings.extend(log.warnings().iter().cloned().map(DriftWarning::Log));
        let t_s = log.t_s();
        offset_s -= t_s[0];
        add_log(log, settings, offset_s, &mut all)?;
        offset_s += t_s[t_s.len() - 1] + log.median_dt_s();
    }
    Ok(all)
}

fn add_log(log: &Log, settings: &DriftSettings, offset_s: f64, all: &mut Measurement) -> Result<(), DriftError> {
    let name = log.path().display().to_string();
    let missing = |note| DriftError::Note { log: name.clone(), note };
    let gain = number(log, settings.angle_gain_V_rad, "angle_gain_V_rad", 1e-9, 1e12)?.ok_or_else(|| missing("angle_gain_V_rad"))?;
    let torquer = number(log, settings.torquer_gain_rad_s_A, "torquer_gain_rad_s_A", 1e-12, 1e6)?;
    let pulse_s = number(log, settings.pulse_s, "pulse_s", 1e-3, 1e5)?.ok_or_else(|| missing("pulse_s"))?;
    let limit_V = number(log, settings.angle_limit_V, "angle_limit_V", 1e-9, 1e9)?;
    let dt_s = log.median_dt_s();
    let samples = (pulse_s / dt_s).round();
    if !(dt_s > 0.0 && samples >= 1.0) || ((samples * dt_s - pulse_s) / pulse_s).abs() > MAX_ROW_MISFIT {
        return Err(DriftError::PulseRows { log: name, pulse_s, dt_s });
    }
    let samples = samples as usize;
    let three = ["x", "y", "z"].map(|axis| (format!("angle_sensor_{axis}_V"), format!("torquer_{axis}_A")));
    all.has_three_axes |= log.column(&three[0].0).is_some();
    let columns: Vec<(String, String)> =
        if all.has_three_axes { three.to_vec() } else { vec![("angle_sensor_V".to_owned(), "torquer_A".to_owned())] };
    if torquer.is_none() && !all.warnings.contains(&DriftWarning::NoTorquerGain) {
        all.warnings.push(DriftWarning::NoTorquerGain);
    }
    let before = all.cycles.len();
    let column = |column: &str| log.column(column).ok_or_else(|| DriftError::Column { log: name.clone(), column: column.to_owned() });
    let mut of_axes = Vec::new();
    for (volts, amperes) in &columns {
        let (volts, amperes) = (column(volts)?, column(amperes)?);
        let found = match log.column("drift_mark") {
            Some(mark) => cycles_by_mark(mark, amperes, samples),
            None => cycles_by_current(amperes, samples),
        };
        of_axes.push((volts, amperes, found));
    }
    let pulses = |amperes: &[f64], found: &DetectedCycle| contrast(amperes, found.rows.start, samples).abs();
    let greatest = of_axes.iter().flat_map(|(_, i, found)| found.iter().map(|one| pulses(i, one))).max_or_zero();
    for (axis, (volts, amperes, found)) in of_axes.iter().enumerate() {
        let axis_data = AxisData { log, pulse_s, samples, gain, torquer, limit_V, axis, offset_s };
        // The mark is common to all axes, but each axis need not have a pulse.
        for one in found.iter().filter(|one| !all.has_three_axes || pulses(amperes, one) > MIN_PULSE_RATIO * greatest) {
            let number = all.cycles.len() as u32 + 1;
            all.cycles.push(axis_data.cycle(one, number, volts, amperes)?);
        }
    }
    if all.cycles.len() == before {
        let is_constant =
            columns.iter().all(|(_, amperes)| log.column(amperes).is_none_or(|column| column.iter().all(|i| *i == column[0])));
        let reason = is_constant.then_some(NoCycleReason::ConstantCurrent);
        return Err(DriftError::NoCycle { log: name, pulse_s, reason });
    }
    Ok(())
}

/// Scales and log of one axis.
struct AxisData<'a> {
    log: &'a Log,
    pulse_s: f64,
    samples: usize,
    gain: f64,
    torquer: Option<f64>,
    limit_V: Option<f64>,
    axis: usize,
    /// Time of the log's zero since the start of the session, s.
    offset_s: f64,
}

impl AxisData<'_> {
    fn cycle(&self, found: &DetectedCycle, number: u32, volts: &[f64], amperes: &[f64]) -> Result<Cycle, DriftError> {
        let rows = found.rows.clone();
        let angles: Vec<f64> = volts[rows.clone()].iter().map(|v| v / self.gain).collect();
        let integral = Integral::of(&angles, self.pulse_s);
        let empty = Integral { pulse_s: self.pulse_s, switched_rad_s: 0.0, sum_rad_s: 0.0, slope_rad_s: 0.0, span_rad: 0.0 };
        let currents = &amperes[rows.start..(rows.start + 2 * self.samples).min(amperes.len())];
        let zero_A = self.zero_current_A(rows.start, amperes, currents);
        let true_A: Vec<f64> = currents.iter().map(|i| i - zero_A).collect();
        let residual_rad_s = self
            .torquer
            .filter(|_| currents.len() == 2 * self.samples)
            .map(|torquer| residual_rad_s(&true_A.iter().map(|i| i * torquer).collect::<Vec<_>>()));
        let defect =
            self.defect(found, volts, currents).or_else(|| clipping(&angles, &true_A, self.pulse_s, self.torquer).map(CycleDefect::from));
        let t_s = self.log.t_s();
        Ok(Cycle {
            number,
            position: self.position(rows.start)?,
            axis: self.axis,
            sign: found.sign,
            start_s: self.offset_s + t_s[rows.start],
            defect,
            integral: integral.unwrap_or(empty),
            amplitude_rad_s: if found.is_cut { 0.0 } else { amplitude_rad_s(&angles, self.pulse_s) },
            residual_rad_s,
        })
    }

    /// Reading of the current sensor at zero current, A: with the loop open before the cycle.
    fn zero_current_A(&self, start: usize, amperes: &[f64], pulses: &[f64]) -> f64 {
        let greatest = pulses.iter().copied().max_abs();
        let rows = (ZERO_CURRENT_S / self.log.median_dt_s()).round() as usize;
        let before: Vec<f64> =
            amperes[start.saturating_sub(rows)..start].iter().copied().filter(|i| i.abs() < MAX_ZERO_CURRENT_RATIO * greatest).collect();
        // Too few rows: the loop was closed.
        if before.is_empty() || before.len() < rows / 2 { 0.0 } else { before.iter().sum::<f64>() / before.len() as f64 }
    }

    fn defect(&self, found: &DetectedCycle, volts: &[f64], currents: &[f64]) -> Option<CycleDefect> {
        let t_s = &self.log.t_s()[found.rows.clone()];
        let has_gap = t_s.windows(2).any(|w| w[1] - w[0] > identification::log::GAP_INTERVALS * self.log.median_dt_s());
        let cycle = &volts[found.rows.clone()];
        let greatest = cycle.iter().copied().max_abs();
        let is_beyond_limit = self.limit_V.is_some_and(|limit| greatest >= limit);
        // Without a known limit: the greatest value in several successive rows.
        let is_stuck =
            cycle.windows(SATURATED_ROWS).any(|w| w.iter().all(|v| v.abs() >= greatest)) && self.limit_V.is_none() && greatest > 0.0;
        let half = currents.len() / 2;
        let mean = |i: &[f64]| i.iter().sum::<f64>() / i.len().max(1) as f64;
        let (first, second) = (mean(&currents[..half]), mean(&currents[half..]));
        let is_unequal = (first + second).abs() > MAX_CURRENT_IMBALANCE * (first - second).abs() / 2.0;
        match (found.is_cut, has_gap, is_beyond_limit || is_stuck, is_unequal) {
            (true, ..) => Some(CycleDefect::CutShort),
            (_, true, ..) => Some(CycleDefect::SampleLost),
            (_, _, true, _) => Some(CycleDefect::SensorSaturated),
            (_, _, _, true) => Some(CycleDefect::CurrentLimited),
            _ => None,
        }
    }

    fn position(&self, row: usize) -> Result<Orientation, DriftError> {
        let of = |name: &'static str| match self.log.column(name) {
            Some(column) => Ok(column[row]),
            None => number(self.log, None, name, -3600.0, 3600.0).map(|value| value.unwrap_or(0.0)),
        };
        Ok(Orientation {
            turned_rad: of("turned_deg")?.to_radians(),
            raised_rad: of("raised_deg")?.to_radians(),
            rolled_rad: of("rolled_deg")?.to_radians(),
        })
    }
}
