//! Simulates the default stand with and without an effect, in one experiment, without noise.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use drive_model::{Abscissa, Card, Coordinate, Demonstration, Motion, Output, Parameter, ParameterKind};
use hal_sim::board::PlantPort;
use hal_sim::plant::{Plant, Stand, StandError};

use super::demonstration::demonstration;

/// Step of the simulation and of the loop, s.
const TICK_S: f64 = 1e-4;
/// Settling time before the first row, s.
const SETTLE_S: f64 = 0.3;
/// Number of rows of a trace, at most.
const MAX_ROWS: f64 = 8000.0;
/// Number of ticks of a row, at least.
const MIN_ROW_TICKS: u64 = 10;
/// Bandwidth of the loop, rad/s: much higher than the frequencies of all effects.
const BANDWIDTH_RAD_S: f64 = 600.0;
/// Interval over which the rate of the encoder is averaged, s.
const ENCODER_RATE_S: f64 = 0.02;

/// One run.
#[derive(Debug, Clone, Default)]
pub struct Trace {
    /// Time, s.
    pub t_s: Vec<f64>,
    /// The plotted quantity.
    pub output: Vec<f64>,
    /// The horizontal axis of the difference.
    pub abscissa: Vec<f64>,
}

/// Two runs of the same demonstration.
#[derive(Debug, Clone)]
pub struct SimulatedPair {
    /// The demonstration.
    pub demonstration: Demonstration,
    /// The default stand without the effect.
    pub without: Trace,
    /// The default stand with the effect.
    pub with: Trace,
    /// The parameters of the effect, in the order of the card.
    pub parameters: Vec<f64>,
}

impl SimulatedPair {
    /// With minus without, row by row.
    pub fn difference(&self) -> Vec<f64> {
        self.with.output.iter().zip(&self.without.output).map(|(a, b)| a - b).collect()
    }
}

/// Typical value of a parameter on the default stand: the middle of its simulated range.
fn typical(p: &Parameter, demonstration: &Demonstration) -> f64 {
    match p.kind {
        ParameterKind::HarmonicOrder | ParameterKind::Periodicity => p.start,
        ParameterKind::Phase => 0.7,
        ParameterKind::EventTime => 0.4 * demonstration.duration_s,
        _ if p.simulated_range.1 > 0.0 => 0.5 * (p.simulated_range.0 + p.simulated_range.1),
        _ => p.start,
    }
}

/// Simulates the stand with and without the effect of `card`.
///
/// # Errors
/// A typical value of the catalogue is outside its own range.
pub fn simulated_pair(card: &'static Card) -> Result<SimulatedPair, StandError> {
    let demonstration = demonstration(card);
    let parameters: Vec<f64> = card.parameters.iter().map(|p| typical(p, &demonstration)).collect();
    let mut stand = Stand::default();
    for (effect, parameter, value) in demonstration.added {
        let one = |(name, value): (&str, f64)| BTreeMap::from([(name.to_owned(), value)]);
        stand.effects.insert((*effect).to_owned(), one((parameter, *value)));
    }
    stand.effects.remove(card.id);
    let without = run(&stand, &demonstration)?;
    // The plant's clock includes the settling time; the trace begins after it.
    let on_plant_clock = |p: &Parameter, value: f64| if p.kind == ParameterKind::EventTime { value + SETTLE_S } else { value };
    let given = card.parameters.iter().zip(&parameters).map(|(p, value)| (p.name.to_owned(), on_plant_clock(p, *value)));
    stand.effects.insert(card.id.to_owned(), given.collect());
    let with = run(&stand, &demonstration)?;
    Ok(SimulatedPair { demonstration, without, with, parameters })
}

/// PI control of the true rate.
struct RateLoop {
    gain: f64,
    integral_V: f64,
    motor_constant: f64,
    supply_V: f64,
}

impl RateLoop {
    fn new(stand: &Stand) -> Self {
        let d = &stand.drive;
        let gain = BANDWIDTH_RAD_S * d.inertia_kg_m2 * d.resistance_ohm / d.motor_constant_N_m_A;
        RateLoop { gain, integral_V: 0.0, motor_constant: d.motor_constant_N_m_A, supply_V: d.supply_V }
    }

    fn voltage(&mut self, setpoint: f64, rate: f64) -> f64 {
        let error = setpoint - rate;
        self.integral_V = (self.integral_V + 0.1 * BANDWIDTH_RAD_S * self.gain * error * TICK_S).clamp(-self.supply_V, self.supply_V);
        (self.motor_constant * setpoint + self.gain * error + self.integral_V).clamp(-self.supply_V, self.supply_V)
    }
}

fn run(stand: &Stand, demonstration: &Demonstration) -> Result<Trace, StandError> {
    let mut plant = Plant::new(stand, 0.0)?;
    let mut control = RateLoop::new(stand);
    let row_ticks = ((demonstration.duration_s / MAX_ROWS / TICK_S).ceil() as u64).max(MIN_ROW_TICKS);
    let rows = (demonstration.duration_s / (row_ticks as f64 * TICK_S)).round() as u64;
    let settle = (SETTLE_S / (row_ticks as f64 * TICK_S)).ceil() as u64;
    if let Some(rate) = demonstration.motion.rate_rad_s(-(settle as f64) * row_ticks as f64 * TICK_S) {
        plant.spin(rate);
    }
    let mut trace = Trace::default();
    let mut past: Vec<f64> = Vec::new();
    let mut reversal = Reversal::default();
    let encoder_rows = (ENCODER_RATE_S / (row_ticks as f64 * TICK_S)).round().max(1.0);
    for row in 0..settle + rows {
        let t_s = (row as f64 - settle as f64) * row_ticks as f64 * TICK_S;
        let (theta, rate, true_rate) = (plant.theta_rad(), plant.rate_rad_s(), plant.true_rate_rad_s());
        let (mut volts, mut current) = (0.0, 0.0);
        for tick in 0..row_ticks {
            let now = t_s + tick as f64 * TICK_S;
            let command_V = match demonstration.motion.rate_rad_s(now) {
                Some(setpoint) => control.voltage(setpoint, plant.true_rate_rad_s()),
                None => demonstration.motion.open_loop_V(now),
            };
            plant.advance(command_V, TICK_S);
            volts += command_V / row_ticks as f64;
            current += plant.mean_current_A() / row_ticks as f64;
        }
        past.push(theta);
        let drive = if matches!(demonstration.motion, Motion::VoltageSteps(..)) { volts } else { true_rate };
        let since = reversal.since(t_s, drive);
        if row < settle {
            continue;
        }
        trace.t_s.push(t_s);
        trace.output.push(match demonstration.output {
            Output::Current => current,
            Output::Voltage => volts,
            Output::Rate => rate,
            Output::EncoderRate => {
                let before = past.iter().rev().nth(encoder_rows as usize).copied().unwrap_or(theta);
                (theta - before) / (encoder_rows * row_ticks as f64 * TICK_S)
            }
        });
        trace.abscissa.push(match demonstration.abscissa {
            Abscissa::TotalAngle => plant.true_theta_rad(),
            Abscissa::Coordinate(Coordinate::Theta) => plant.true_theta_rad().rem_euclid(TAU),
            Abscissa::Coordinate(Coordinate::Omega) => true_rate,
            Abscissa::Coordinate(Coordinate::Current) => current,
            Abscissa::Coordinate(Coordinate::Temperature) => plant.temp_C(),
            Abscissa::Coordinate(Coordinate::Time | Coordinate::Log) => t_s,
            // Mean over the row that follows.
            Abscissa::Coordinate(Coordinate::Acceleration) => (plant.true_rate_rad_s() - true_rate) / (row_ticks as f64 * TICK_S),
            Abscissa::Coordinate(Coordinate::History) => since,
        });
    }
    Ok(trace)
}

/// Time since the last change of a sign.
#[derive(Default)]
struct Reversal {
    sign: f64,
    at_s: f64,
}

impl Reversal {
    fn since(&mut self, t_s: f64, value: f64) -> f64 {
        if value != 0.0 && value.signum() != self.sign {
            self.sign = value.signum();
            self.at_s = t_s;
        }
        t_s - self.at_s
    }
}
