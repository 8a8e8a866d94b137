//! Cycles in one position: commands to the firmware of the stand, and the cycles that it reports.

use crate::connection::{ConnectionError, StandConnection};
use crate::link::reply_number;
use hal_sim::gyro::Orientation;
use stand_firmware::telemetry::RowFrame;

/// The channels of the log.
pub const CHANNELS: [&str; 3] = ["angle_sensor_V", "torquer_A", "drift_mark"];
/// Polling interval, s.
const POLL_S: f64 = 0.2;

/// Settings of the cycles.
#[derive(Debug, Clone, PartialEq)]
pub struct CyclePlan {
    /// Shape of the pulses: RECTangular, TRIangular or SAWTooth.
    pub shape: &'static str,
    /// The second pulse is reversed in time.
    pub reversed: bool,
    /// Signs of the pulses: PLUSminus, MINusplus or BOTH.
    pub sequence: &'static str,
    /// Duration T of a pulse, s.
    pub pulse_s: f64,
    /// Period of which T becomes a multiple, s; 0 for none.
    pub period_s: f64,
    /// Time with the loop closed before each cycle, s.
    pub rest_s: f64,
    /// Cycles in each position.
    pub cycles: u32,
}

/// Scale factors of the gyroscope, from the settings of the stand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GyroscopeScales {
    /// V per code of the angle sensor.
    pub angle_V_per_code: f64,
    /// K_k, V/rad.
    pub angle_gain_V_rad: f64,
    /// K_m/H, rad/s/A.
    pub torquer_gain_rad_s_A: f64,
    /// End of the angle sensor's range, V.
    pub angle_limit_V: f64,
}

/// Interval of the firmware's samples, s.
const SAMPLE_INTERVAL_S: f64 = 1e-3;
/// Period of the board clock, s.
const CLOCK_PERIOD_S: f64 = 1e-7;
/// Points of a trace in one pulse.
const TRACE_POINTS: usize = 100;
/// Most missing rows of a trace, relative.
const MAX_MISSING_ROWS: f64 = 0.05;

/// Angle and current during a cycle, from the rows of the stream.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CycleTrace {
    /// Readings of the angle sensor at the ends of equal intervals, V: one more than intervals. Empty if rows are missing.
    pub angle_V: Vec<f64>,
    /// Mean current of the torquer in each interval, A.
    pub current_A: Vec<f64>,
}

/// A cycle as the firmware reports it: sums over 2 N + 1 codes of the angle sensor, k from −N to N.
#[derive(Debug, Clone, PartialEq)]
pub struct ReportedCycle {
    /// Its number, from 1.
    pub number: u32,
    /// Position of the gyroscope.
    pub position: Orientation,
    /// Sign of the first pulse.
    pub sign: i8,
    /// Begin by the stand's clock, s; from the rows of the stream, else by the polling interval.
    pub start_s: f64,
    /// Setpoint of the pulse rate, rad/s.
    pub rate_rad_s: f64,
    /// Samples N of one pulse.
    pub samples: f64,
    /// Twice the sum of the codes, with trapezoidal weights.
    pub doubled_sum_codes: f64,
    /// Σ k code.
    pub moment_codes: f64,
    /// Greatest minus smallest code.
    pub span_codes: f64,
    /// Drift rate by formula (13) of docs/theory.md §3, corrected by the zero-input cycle, rad/s.
    pub drift_rad_s: f64,
    /// This drift rate, corrected by the measured current of the torquer, rad/s.
    pub corrected_rad_s: f64,
    /// Why the firmware rejected the cycle.
    pub rejection: Option<String>,
    /// Angle and current during the cycle.
    pub trace: CycleTrace,
}

impl ReportedCycle {
    /// Duration T of a pulse, s.
    pub fn pulse_s(&self) -> f64 {
        self.samples * SAMPLE_INTERVAL_S
    }

    /// Sum of the angles times the sampling interval: ∫ θ dt over both pulses, rad s.
    pub fn sum_rad_s(&self, scales: &GyroscopeScales) -> f64 {
        self.doubled_sum_codes / 2.0 * SAMPLE_INTERVAL_S * scales.rad_per_code()
    }

    /// Least-squares slope of the angle, rad/s.
    pub fn slope_rad_s(&self, scales: &GyroscopeScales) -> f64 {
        // Σ k² = N (N + 1)(2 N + 1)/3.
        let n = self.samples;
        self.moment_codes * 3.0 / (n * (n + 1.0) * (2.0 * n + 1.0)) / SAMPLE_INTERVAL_S * scales.rad_per_code()
    }

    /// Range of the angle, rad.
    pub fn span_rad(&self, scales: &GyroscopeScales) -> f64 {
        self.span_codes * scales.rad_per_code()
    }
}

impl GyroscopeScales {
    /// Angle per code of the angle sensor, rad.
    pub fn rad_per_code(&self) -> f64 {
        self.angle_V_per_code / self.angle_gain_V_rad
    }
}

fn first_number(query: &str, reply: &str) -> Result<f64, ConnectionError> {
    let number = reply.split(',').next().and_then(reply_number);
    number.ok_or_else(|| ConnectionError::Reply { query: query.to_owned(), reply: reply.to_owned() })
}

/// Queries the scales.
///
/// # Errors
/// The serial line; an answer that is not a number.
pub async fn scales(stand: &mut impl StandConnection) -> Result<GyroscopeScales, ConnectionError> {
    let mut numbers = [0.0; 4];
    for (number, name) in numbers.iter_mut().zip(["angle_V_per_code", "angle_gain_V_rad", "torquer_gain_rad_s_A", "angle_limit_V"]) {
        let query = format!("SETTings:{name}?");
        *number = first_number(&query, &stand.query(&query).await?)?;
    }
    let [angle_V_per_code, angle_gain_V_rad, torquer_gain_rad_s_A, angle_limit_V] = numbers;
    Ok(GyroscopeScales { angle_V_per_code, angle_gain_V_rad, torquer_gain_rad_s_A, angle_limit_V })
}

/// Sends the settings of the cycles.
///
/// # Errors
/// The serial line; the stand rejects a setting.
pub async fn set_up(stand: &mut impl StandConnection, plan: &CyclePlan) -> Result<(), ConnectionError> {
    let commands = [
        format!("DRIFt:SHAPe {}", plan.shape),
        format!("DRIFt:REVersed {}", if plan.reversed { "ON" } else { "OFF" }),
        format!("DRIFt:DURation {} S", plan.pulse_s),
        format!("DRIFt:PERiod {} S", plan.period_s),
        format!("DRIFt:REST {} S", plan.rest_s),
    ];
    for command in commands {
        stand.command(&command).await?;
    }
    Ok(())
}

/// Sends the rate of the pulses, the number of cycles, and their sequence of signs.
///
/// # Errors
/// The serial line; the stand rejects the rate.
pub async fn set_rate(stand: &mut impl StandConnection, (rate_rad_s, cycles, sequence): (f64, u32, &str)) -> Result<(), ConnectionError> {
    stand.command(&format!("DRIFt:SEQuence {sequence}")).await?;
    stand.command(&format!("DRIFt:RATE {rate_rad_s:e} RAD/S")).await?;
    stand.command(&format!("DRIFt:COUNt {cycles}")).await
}

/// Cycles and rows of one position.
#[derive(Debug, Default)]
pub struct PositionData {
    /// The cycles.
    pub cycles: Vec<ReportedCycle>,
    /// The rows of the stream, if it is on: time, s, then [`CHANNELS`].
    pub rows: Vec<[f64; 4]>,
    /// Time of the session at the end, s.
    pub end_s: f64,
}

impl PositionData {
    /// Adds start and trace of the cycles from the rows, which carry the mark of the firmware: four times the number of the cycle, plus 1
    /// or 2 in its pulses.
    fn add_traces(&mut self) {
        for cycle in &mut self.cycles {
            let is_pulse = |[.., mark]: &[f64; 4]| *mark as u64 / 4 == u64::from(cycle.number) && !(*mark as u64).is_multiple_of(4);
            let Some(first) = self.rows.iter().position(is_pulse) else { continue };
            cycle.start_s = self.rows[first][0];
            let count = 2 * cycle.samples as usize;
            if cycle.rejection.is_some() || count == 0 {
                continue;
            }
            let place = |time_s: f64| ((time_s - cycle.start_s) / SAMPLE_INTERVAL_S).round() as usize;
            let mut samples = vec![None; count + 1];
            for [time_s, angle_V, current_A, _] in self.rows[first..].iter().take_while(|row| place(row[0]) <= count) {
                samples[place(*time_s)] = (angle_V.is_finite() && current_A.is_finite()).then_some((*angle_V, *current_A));
            }
            if samples.iter().filter(|sample| sample.is_none()).count() as f64 <= MAX_MISSING_ROWS * count as f64 {
                cycle.trace = trace(&samples);
            }
        }
    }
}

/// The trace of 2 N + 1 samples of angle and current; a missing sample takes the value before.
fn trace(samples: &[Option<(f64, f64)>]) -> CycleTrace {
    let mut last = samples.iter().flatten().next().copied().unwrap_or((0.0, 0.0));
    let filled: Vec<(f64, f64)> = samples
        .iter()
        .map(|sample| {
            last = sample.unwrap_or(last);
            last
        })
        .collect();
    let group = (filled.len() / 2).div_ceil(TRACE_POINTS).max(1);
    // An even number of intervals: both pulses.
    let intervals = (filled.len() - 1) / group / 2 * 2;
    let current = |k: usize| filled[k * group..(k + 1) * group].iter().map(|(_, current)| current).sum::<f64>() / group as f64;
    CycleTrace { angle_V: (0..=intervals).map(|k| filled[k * group].0).collect(), current_A: (0..intervals).map(current).collect() }
}

/// Runs the cycles in position `number` with pulses of `rate_rad_s`, which was sent before; `begin_s` is the time of the session, for
/// cycles without rows; `on_state` receives the state of the firmware and returns false to interrupt, after which there is no data.
///
/// # Errors
/// The serial line; the stand rejects to start.
pub async fn measure(
    stand: &mut impl StandConnection,
    number: u32,
    position: Orientation,
    rate_rad_s: f64,
    begin_s: f64,
    mut on_state: impl FnMut(&str) -> bool,
) -> Result<Option<PositionData>, ConnectionError> {
    stand.command(&format!("DRIFt:POSition {number}")).await?;
    stand.command("DRIFt:STARt").await?;
    let mut data = PositionData::default();
    let mut last = None;
    let mut elapsed_s = begin_s;
    loop {
        let state = stand.query("DRIFt:STATe?").await?;
        let reply = stand.query("DRIFt:CYCLe?").await?;
        let newest = reply.split(',').next().map(str::to_owned);
        let is_of_position = reply.split(',').nth(1) == Some(number.to_string().as_str());
        // A cycle that exists before the first one of this position belongs to another session.
        if last.is_none() && !state.starts_with("IDLE") && data.cycles.is_empty() && state.contains(",0,") {
            last = newest.clone();
        }
        if is_of_position && newest != last {
            last = newest;
            data.cycles.push(parse_cycle(&reply, position, rate_rad_s, elapsed_s)?);
        }
        if state.starts_with("IDLE") {
            data.end_s = elapsed_s;
            data.rows.extend(stand.wait_s(POLL_S).await?.iter().map(row_values));
            data.add_traces();
            return Ok(Some(data));
        }
        if !on_state(&state) {
            return Ok(None);
        }
        data.rows.extend(stand.wait_s(POLL_S).await?.iter().map(row_values));
        elapsed_s += POLL_S;
    }
}

/// Time of a row, s, and the values of [`CHANNELS`].
fn row_values(row: &RowFrame) -> [f64; 4] {
    let [angle, torquer, mark] = CHANNELS.map(|name| row.value(name).unwrap_or(f64::NAN));
    [row.at as f64 * CLOCK_PERIOD_S, angle, torquer, mark]
}

/// Parses a cycle of the firmware, whose reply does not contain position, rate and begin.
fn parse_cycle(reply: &str, position: Orientation, rate_rad_s: f64, elapsed_s: f64) -> Result<ReportedCycle, ConnectionError> {
    let invalid = || ConnectionError::Reply { query: "DRIFt:CYCLe?".into(), reply: reply.to_owned() };
    let fields: Vec<&str> = reply.split(',').collect();
    let number = |k: usize| fields.get(k).and_then(|field| reply_number(field)).ok_or_else(invalid);
    let samples = number(3)?;
    let verdict = fields.get(12..).ok_or_else(invalid)?.join(",");
    Ok(ReportedCycle {
        number: number(0)? as u32,
        position,
        sign: number(2)? as i8,
        start_s: (elapsed_s - 2.0 * samples * SAMPLE_INTERVAL_S).max(0.0),
        rate_rad_s,
        samples,
        doubled_sum_codes: number(5)?,
        moment_codes: number(7)?,
        span_codes: number(9)? - number(8)?,
        drift_rad_s: number(10)?,
        corrected_rad_s: number(11)?,
        rejection: (verdict != "good").then_some(verdict),
        trace: CycleTrace::default(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trace_has_the_instants_of_the_angle_and_the_means_of_the_current() {
        let samples: Vec<Option<(f64, f64)>> = (0..=1000).map(|k| (k != 7).then_some((f64::from(k), f64::from(k % 5)))).collect();
        let CycleTrace { angle_V, current_A } = trace(&samples);
        assert_eq!((angle_V.len(), current_A.len()), (201, 200));
        assert!(angle_V[10] == 50.0 && current_A[10] == 2.0);
    }

    #[test]
    fn reply_of_the_firmware_is_parsed() {
        let reply = "3,2,-1,5000,-41,82,17,5,7,411,1.5E-6 RAD/S,1.25E-6 RAD/S,good";
        let parse = |reply: &str| parse_cycle(reply, Orientation::default(), 1e-3, 20.0);
        let cycle = parse(reply).unwrap();
        assert_eq!((cycle.number, cycle.sign, cycle.rejection.clone(), cycle.start_s, cycle.span_codes), (3, -1, None, 10.0, 404.0));
        assert_eq!((cycle.drift_rad_s, cycle.corrected_rad_s, cycle.pulse_s()), (1.5e-6, 1.25e-6, 5.0));
        assert_eq!(parse(&reply.replace("good", "emergency stop")).unwrap().rejection.as_deref(), Some("emergency stop"));
        for nonsense in ["NONE", "", "3,2,x", "3,2,-1,5000,-41,82,17,5,7,411,1.5E-6 RAD/S"] {
            assert!(parse(nonsense).is_err(), "{nonsense}");
        }
    }
}
