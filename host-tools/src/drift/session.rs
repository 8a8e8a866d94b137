//! Measurement of cycles on a stand: commands to its firmware, and the cycles that the firmware reports.

use super::cycle::{Cycle, CycleDefect};
use super::integral::Integral;
use crate::acquire::connection::{ConnectionError, StandConnection};
use hal_sim::gyro::Place;
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

/// GyroscopeScales of the gyroscope in the settings of the stand.
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

fn first_number(query: &str, reply: &str) -> Result<f64, ConnectionError> {
    let word = reply.split([' ', ',']).next().unwrap_or_default();
    word.parse().map_err(|_| ConnectionError::Reply { query: query.to_owned(), reply: reply.to_owned() })
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
/// The serial line; the stand refuses a setting.
pub async fn set_up(stand: &mut impl StandConnection, plan: &CyclePlan) -> Result<(), ConnectionError> {
    let commands = [
        format!("DRIFt:SHAPe {}", plan.shape),
        format!("DRIFt:REVersed {}", if plan.reversed { "ON" } else { "OFF" }),
        format!("DRIFt:SEQuence {}", plan.sequence),
        format!("DRIFt:DURation {} S", plan.pulse_s),
        format!("DRIFt:PERiod {} S", plan.period_s),
        format!("DRIFt:REST {} S", plan.rest_s),
        format!("DRIFt:COUNt {}", plan.cycles),
    ];
    for command in commands {
        stand.command(&command).await?;
    }
    Ok(())
}

/// Sends the rate of the pulses.
///
/// # Errors
/// The serial line; the stand refuses the rate.
pub async fn set_rate(stand: &mut impl StandConnection, rate_rad_s: f64) -> Result<(), ConnectionError> {
    stand.command(&format!("DRIFt:RATE {rate_rad_s:e} RAD/S")).await
}

/// Cycles and rows of one position.
#[derive(Debug, Default)]
pub struct PositionData {
    /// The cycles.
    pub cycles: Vec<Cycle>,
    /// The rows of the stream, if it is on.
    pub rows: Vec<RowFrame>,
}

/// Runs the cycles in position `number` with pulses of `rate_rad_s`, which was sent before; `on_state` receives the state of the firmware.
///
/// # Errors
/// The serial line; the stand refuses to start.
pub async fn measure(
    stand: &mut impl StandConnection,
    scales: &GyroscopeScales,
    number: u32,
    position: Place,
    rate_rad_s: f64,
    mut on_state: impl FnMut(&str),
) -> Result<PositionData, ConnectionError> {
    stand.command(&format!("DRIFt:POSition {number}")).await?;
    stand.command("DRIFt:STARt").await?;
    let mut data = PositionData::default();
    let mut last = None;
    let mut elapsed_s = 0.0;
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
            data.cycles.push(Cycle { amplitude_rad_s: rate_rad_s, ..parse_cycle(&reply, scales, position, elapsed_s)? });
        }
        if state.starts_with("IDLE") {
            return Ok(data);
        }
        on_state(&state);
        data.rows.extend(stand.wait_s(POLL_S).await?);
        elapsed_s += POLL_S;
    }
}

/// Parses a cycle of the firmware; its answer does not contain the amplitude.
fn parse_cycle(reply: &str, scales: &GyroscopeScales, position: Place, elapsed_s: f64) -> Result<Cycle, ConnectionError> {
    let invalid = || ConnectionError::Reply { query: "DRIFt:CYCLe?".into(), reply: reply.to_owned() };
    let fields: Vec<&str> = reply.split(',').collect();
    let number =
        |k: usize| fields.get(k).and_then(|field| field.split(' ').next()).and_then(|word| word.parse::<f64>().ok()).ok_or_else(invalid);
    let samples = number(3)?;
    let (sum2, moment, span) = (number(5)?, number(7)?, number(9)? - number(8)?);
    let (raw, corrected) = (number(10)?, number(11)?);
    let dt_s = 1e-3;
    let pulse_s = samples * dt_s;
    let rad = scales.angle_V_per_code / scales.angle_gain_V_rad;
    let verdict = fields.get(12..).ok_or_else(invalid)?.join(",");
    Ok(Cycle {
        number: number(0)? as u32,
        position,
        axis: 0,
        sign: number(2)? as i8,
        start_s: (elapsed_s - 2.0 * pulse_s).max(0.0),
        integral: Integral {
            pulse_s,
            // Formula (13) by the firmware, corrected by the zero-input cycle.
            switched_rad_s: -raw * pulse_s * pulse_s,
            sum_rad_s: sum2 / 2.0 * dt_s * rad,
            slope_rad_s: moment * 3.0 / (samples * (samples + 1.0) * (2.0 * samples + 1.0)) / dt_s * rad,
            span_rad: span * rad,
        },
        amplitude_rad_s: 0.0,
        residual_rad_s: Some(raw - corrected),
        defect: (verdict != "good").then_some(CycleDefect::Firmware(verdict)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cycle_of_the_firmware_is_parsed() {
        let scales = GyroscopeScales { angle_V_per_code: 1e-3, angle_gain_V_rad: 100.0, torquer_gain_rad_s_A: 0.02, angle_limit_V: 1.6 };
        let reply = "3,2,-1,5000,-41,82,17,5,7,411,1.5E-6 RAD/S,1.25E-6 RAD/S,good";
        let cycle = parse_cycle(reply, &scales, Place::default(), 20.0).unwrap();
        assert_eq!((cycle.number, cycle.sign, cycle.defect.clone(), cycle.start_s), (3, -1, None, 10.0));
        assert!((cycle.integral.drift_rad_s() - 1.5e-6).abs() < 1e-15 && (cycle.rate_rad_s() - 1.25e-6).abs() < 1e-15);
        assert!((cycle.integral.span_rad - 404e-5).abs() < 1e-12);
        let bad = parse_cycle(&reply.replace("good", "emergency stop"), &scales, Place::default(), 0.0).unwrap();
        assert_eq!(bad.defect, Some(CycleDefect::Firmware("emergency stop".into())));
        for nonsense in ["NONE", "", "3,2,x", "3,2,-1,5000,-41,82,17,5,7,411,1.5E-6 RAD/S"] {
            assert!(parse_cycle(nonsense, &scales, Place::default(), 0.0).is_err(), "{nonsense}");
        }
    }
}
