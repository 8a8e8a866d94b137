//! A session of cycles on a stand: what is told to its firmware, and the cycles that come of it.
//!
//! The stand is a simulated one or one behind a port ([`Stand`]).

use super::answer::CycleLine;
use super::integral::Integral;
use crate::acquire::connection::{ConnectionError, StandConnection};
use hal_sim::gyro::Place;
use stand_firmware::telemetry::RowFrame;

/// The channels of the log.
pub const CHANNELS: [&str; 3] = ["angle_sensor_V", "torquer_A", "drift_mark"];
/// How often is looked, s: a lead alone is half a second.
const LOOK_S: f64 = 0.2;

/// What is told to the firmware.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// RECTangular, TRIangular or SAWTooth.
    pub shape: &'static str,
    /// The second pulse runs backwards.
    pub reversed: bool,
    /// PLUSminus, MINusplus or BOTH.
    pub sequence: &'static str,
    /// T, s.
    pub pulse_s: f64,
    /// Of which it is a multiple, s; 0: none.
    pub period_s: f64,
    /// With the loop closed before each cycle, s.
    pub rest_s: f64,
    /// Cycles in each position.
    pub cycles: u32,
}

/// What the stand's settings say of the gyro.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scales {
    /// V per code of the angle sensor.
    pub angle_V_per_code: f64,
    /// K_k, V/rad.
    pub angle_gain_V_rad: f64,
    /// K_m/H, rad/s/A.
    pub torquer_gain_rad_s_A: f64,
    /// End of the sensor's range, V.
    pub angle_limit_V: f64,
}

fn first_number(query: &str, reply: &str) -> Result<f64, ConnectionError> {
    let word = reply.split([' ', ',']).next().unwrap_or_default();
    word.parse().map_err(|_| ConnectionError::Reply { query: query.to_owned(), says: reply.to_owned() })
}

/// Asks for the scales.
///
/// # Errors
/// The line; a firmware that does not have them.
pub async fn scales(stand: &mut impl StandConnection) -> Result<Scales, ConnectionError> {
    let mut numbers = [0.0; 4];
    for (number, name) in numbers.iter_mut().zip(["angle_V_per_code", "angle_gain_V_rad", "torquer_gain_rad_s_A", "angle_limit_V"]) {
        let query = format!("SETTings:{name}?");
        *number = first_number(&query, &stand.query(&query).await?)?;
    }
    let [angle_V_per_code, angle_gain_V_rad, torquer_gain_rad_s_A, angle_limit_V] = numbers;
    Ok(Scales { angle_V_per_code, angle_gain_V_rad, torquer_gain_rad_s_A, angle_limit_V })
}

/// Tells the plan.
///
/// # Errors
/// The line; the stand refuses.
pub async fn set_up(stand: &mut impl StandConnection, plan: &Plan) -> Result<(), ConnectionError> {
    let orders = [
        format!("DRIFt:SHAPe {}", plan.shape),
        format!("DRIFt:REVersed {}", if plan.reversed { "ON" } else { "OFF" }),
        format!("DRIFt:SEQuence {}", plan.sequence),
        format!("DRIFt:DURation {} S", plan.pulse_s),
        format!("DRIFt:PERiod {} S", plan.period_s),
        format!("DRIFt:REST {} S", plan.rest_s),
        format!("DRIFt:COUNt {}", plan.cycles),
    ];
    for order in orders {
        stand.command(&order).await?;
    }
    Ok(())
}

/// Tells the rate of the pulses.
///
/// # Errors
/// The line; the stand refuses.
pub async fn set_rate(stand: &mut impl StandConnection, rate_rad_s: f64) -> Result<(), ConnectionError> {
    stand.command(&format!("DRIFt:RATE {rate_rad_s:e} RAD/S")).await
}

/// What one position gave.
#[derive(Debug, Default)]
pub struct Position {
    /// Its cycles.
    pub cycles: Vec<CycleLine>,
    /// The rows of the stream, where one is on.
    pub rows: Vec<RowFrame>,
}

/// Measures in one position, which the firmware knows by `number`, with pulses of the rate that it was told; `tell` hears how far it is.
///
/// # Errors
/// The line; the stand refuses.
pub async fn measure(
    stand: &mut impl StandConnection,
    scales: &Scales,
    number: u32,
    place: Place,
    rate_rad_s: f64,
    mut tell: impl FnMut(&str),
) -> Result<Position, ConnectionError> {
    stand.command(&format!("DRIFt:POSition {number}")).await?;
    stand.command("DRIFt:STARt").await?;
    let mut position = Position::default();
    let mut last = None;
    let mut elapsed_s = 0.0;
    loop {
        let state = stand.query("DRIFt:STATe?").await?;
        let says = stand.query("DRIFt:CYCLe?").await?;
        let known = says.split(',').next().map(str::to_owned);
        let is_ours = says.split(',').nth(1) == Some(number.to_string().as_str());
        // What was measured before is another session's.
        if last.is_none() && !state.starts_with("IDLE") && position.cycles.is_empty() && state.contains(",0,") {
            last = known.clone();
        }
        if is_ours && known != last {
            last = known;
            position.cycles.push(CycleLine { amplitude_rad_s: rate_rad_s, ..cycle(&says, scales, place, elapsed_s)? });
        }
        if state.starts_with("IDLE") {
            return Ok(position);
        }
        tell(&state);
        position.rows.extend(stand.wait_s(LOOK_S).await?);
        elapsed_s += LOOK_S;
    }
}

/// A cycle by the firmware's words, which do not say its amplitude.
fn cycle(says: &str, scales: &Scales, place: Place, elapsed_s: f64) -> Result<CycleLine, ConnectionError> {
    let wrong = || ConnectionError::Reply { query: "DRIFt:CYCLe?".into(), says: says.to_owned() };
    let fields: Vec<&str> = says.split(',').collect();
    let number =
        |k: usize| fields.get(k).and_then(|field| field.split(' ').next()).and_then(|word| word.parse::<f64>().ok()).ok_or_else(wrong);
    let samples = number(3)?;
    let (sum2, moment, span) = (number(5)?, number(7)?, number(9)? - number(8)?);
    let (raw, corrected) = (number(10)?, number(11)?);
    let dt_s = 1e-3;
    let pulse_s = samples * dt_s;
    let rad = scales.angle_V_per_code / scales.angle_gain_V_rad;
    let verdict = fields.get(12..).ok_or_else(wrong)?.join(",");
    Ok(CycleLine {
        number: number(0)? as u32,
        place,
        axis: 0,
        sign: number(2)? as i8,
        start_s: (elapsed_s - 2.0 * pulse_s).max(0.0),
        integral: Integral {
            pulse_s,
            // (13) as the firmware tells it, zero-input cycle taken off.
            switched_rad_s: -raw * pulse_s * pulse_s,
            sum_rad_s: sum2 / 2.0 * dt_s * rad,
            slope_rad_s: moment * 3.0 / (samples * (samples + 1.0) * (2.0 * samples + 1.0)) / dt_s * rad,
            span_rad: span * rad,
        },
        amplitude_rad_s: 0.0,
        residual_rad_s: Some(raw - corrected),
        bad: (verdict != "good").then_some(verdict),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cycle_is_read_from_the_firmwares_words_and_nonsense_is_told() {
        let scales = Scales { angle_V_per_code: 1e-3, angle_gain_V_rad: 100.0, torquer_gain_rad_s_A: 0.02, angle_limit_V: 1.6 };
        let says = "3,2,-1,5000,-41,82,17,5,7,411,1.5E-6 RAD/S,1.25E-6 RAD/S,good";
        let cycle = super::cycle(says, &scales, Place::default(), 20.0).unwrap();
        assert_eq!((cycle.number, cycle.sign, cycle.bad.clone(), cycle.start_s), (3, -1, None, 10.0));
        assert!((cycle.integral.drift_rad_s() - 1.5e-6).abs() < 1e-15 && (cycle.rate_rad_s() - 1.25e-6).abs() < 1e-15);
        assert!((cycle.integral.span_rad - 404e-5).abs() < 1e-12);
        let bad = super::cycle(&says.replace("good", "emergency stop"), &scales, Place::default(), 0.0).unwrap();
        assert_eq!(bad.bad.as_deref(), Some("emergency stop"));
        for nonsense in ["NONE", "", "3,2,x", "3,2,-1,5000,-41,82,17,5,7,411,1.5E-6 RAD/S"] {
            assert!(super::cycle(nonsense, &scales, Place::default(), 0.0).is_err(), "{nonsense}");
        }
    }
}
