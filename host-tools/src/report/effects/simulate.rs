//! The default stand with and without an effect, under one experiment, without noise.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use drive_model::{Card, Coordinate, Parameter, ParameterKind};
use hal_sim::board::PlantPort;
use hal_sim::plant::{Plant, Stand, StandError};

use super::experiment::{Experiment, Motion, Over, Shown};

/// Tick of the simulation and of the loop, s.
const TICK_S: f64 = 1e-4;
/// Runs before the first row, so that what is shown has settled, s.
const SETTLE_S: f64 = 0.3;
/// Most rows of a trace.
const MOST_ROWS: f64 = 8000.0;
/// Ticks of the shortest row.
const ROW_TICKS: u64 = 10;
/// Where the loop puts its pole, rad/s: stiff beside all that an effect does.
const LOOP_RAD_S: f64 = 600.0;
/// Length over which the encoder's rate is taken, s.
const ENCODER_S: f64 = 0.02;

/// One run.
#[derive(Debug, Clone, Default)]
pub struct Trace {
    /// Time, s.
    pub t_s: Vec<f64>,
    /// What is looked at.
    pub shown: Vec<f64>,
    /// The coordinate of the lower plot.
    pub over: Vec<f64>,
}

/// Two runs of the same experiment.
#[derive(Debug, Clone)]
pub struct Beside {
    /// The experiment.
    pub experiment: Experiment,
    /// The default stand without the effect.
    pub without: Trace,
    /// The same with it.
    pub with: Trace,
    /// What it was given, in the card's order.
    pub parameters: Vec<f64>,
}

impl Beside {
    /// With minus without, row by row.
    pub fn difference(&self) -> Vec<f64> {
        self.with.shown.iter().zip(&self.without.shown).map(|(a, b)| a - b).collect()
    }
}

/// A typical size of a parameter on the default stand: the middle of what the stand hides.
fn typical(p: &Parameter, experiment: &Experiment) -> f64 {
    match p.kind {
        ParameterKind::HarmonicOrder => p.start,
        ParameterKind::Phase => 0.7,
        ParameterKind::EventTime => 0.4 * experiment.seconds,
        _ if p.simulated_range.1 > 0.0 => 0.5 * (p.simulated_range.0 + p.simulated_range.1),
        _ => p.start,
    }
}

/// Simulates the experiment that shows `card`, with and without it.
///
/// # Errors
/// The catalogue's typical size is out of its own range.
pub fn beside(card: &'static Card) -> Result<Beside, StandError> {
    let experiment = Experiment::of(card);
    let parameters: Vec<f64> = card.parameters.iter().map(|p| typical(p, &experiment)).collect();
    let mut stand = Stand::default();
    for (effect, parameter, value) in experiment.besides {
        let one = |(name, value): (&str, f64)| BTreeMap::from([(name.to_owned(), value)]);
        stand.effects.insert((*effect).to_owned(), one((parameter, *value)));
    }
    stand.effects.remove(card.id);
    let without = run(&stand, &experiment)?;
    // The plant's clock runs while it settles; the picture's begins after that.
    let on_its_clock = |p: &Parameter, value: f64| if p.kind == ParameterKind::EventTime { value + SETTLE_S } else { value };
    let given = card.parameters.iter().zip(&parameters).map(|(p, value)| (p.name.to_owned(), on_its_clock(p, *value)));
    stand.effects.insert(card.id.to_owned(), given.collect());
    let with = run(&stand, &experiment)?;
    Ok(Beside { experiment, without, with, parameters })
}

/// A stiff loop that knows the true rate.
struct Loop {
    gain: f64,
    sum_V: f64,
    motor_constant: f64,
    supply_V: f64,
}

impl Loop {
    fn new(stand: &Stand) -> Self {
        let d = &stand.drive;
        let gain = LOOP_RAD_S * d.inertia_kg_m2 * d.resistance_ohm / d.motor_constant_N_m_A;
        Loop { gain, sum_V: 0.0, motor_constant: d.motor_constant_N_m_A, supply_V: d.supply_V }
    }

    fn volts(&mut self, wanted: f64, is: f64) -> f64 {
        let error = wanted - is;
        self.sum_V = (self.sum_V + 0.1 * LOOP_RAD_S * self.gain * error * TICK_S).clamp(-self.supply_V, self.supply_V);
        (self.motor_constant * wanted + self.gain * error + self.sum_V).clamp(-self.supply_V, self.supply_V)
    }
}

fn run(stand: &Stand, experiment: &Experiment) -> Result<Trace, StandError> {
    let mut plant = Plant::new(stand, 0.0)?;
    let mut control = Loop::new(stand);
    let row_ticks = ((experiment.seconds / MOST_ROWS / TICK_S).ceil() as u64).max(ROW_TICKS);
    let rows = (experiment.seconds / (row_ticks as f64 * TICK_S)).round() as u64;
    let settle = (SETTLE_S / (row_ticks as f64 * TICK_S)).ceil() as u64;
    if let Some(rate) = experiment.motion.rate_rad_s(-(settle as f64) * row_ticks as f64 * TICK_S) {
        plant.spin(rate);
    }
    let mut trace = Trace::default();
    let mut past: Vec<f64> = Vec::new();
    let mut reversal = Reversal::default();
    let encoder_rows = (ENCODER_S / (row_ticks as f64 * TICK_S)).round().max(1.0);
    for row in 0..settle + rows {
        let t_s = (row as f64 - settle as f64) * row_ticks as f64 * TICK_S;
        let (theta, rate, true_rate) = (plant.theta_rad(), plant.rate_rad_s(), plant.true_rate_rad_s());
        let (mut volts, mut current) = (0.0, 0.0);
        for tick in 0..row_ticks {
            let now = t_s + tick as f64 * TICK_S;
            let asked = match experiment.motion.rate_rad_s(now) {
                Some(wanted) => control.volts(wanted, plant.true_rate_rad_s()),
                None => experiment.motion.open_V(now),
            };
            plant.advance(asked, TICK_S);
            volts += asked / row_ticks as f64;
            current += plant.mean_current_A() / row_ticks as f64;
        }
        past.push(theta);
        let drive = if matches!(experiment.motion, Motion::Steps(..)) { volts } else { true_rate };
        let since = reversal.since(t_s, drive);
        if row < settle {
            continue;
        }
        trace.t_s.push(t_s);
        trace.shown.push(match experiment.shown {
            Shown::Current => current,
            Shown::Voltage => volts,
            Shown::Rate => rate,
            Shown::EncoderRate => {
                let before = past.iter().rev().nth(encoder_rows as usize).copied().unwrap_or(theta);
                (theta - before) / (encoder_rows * row_ticks as f64 * TICK_S)
            }
        });
        trace.over.push(match experiment.over {
            Over::ManyTurns => plant.true_theta_rad(),
            Over::Coordinate(Coordinate::Theta) => plant.true_theta_rad().rem_euclid(TAU),
            Over::Coordinate(Coordinate::Omega) => true_rate,
            Over::Coordinate(Coordinate::Current) => current,
            Over::Coordinate(Coordinate::Temperature) => plant.temp_C(),
            Over::Coordinate(Coordinate::Time) => t_s,
            // Over the row that follows.
            Over::Coordinate(Coordinate::Acceleration) => (plant.true_rate_rad_s() - true_rate) / (row_ticks as f64 * TICK_S),
            Over::Coordinate(Coordinate::History) => since,
        });
    }
    Ok(trace)
}

/// Time since the sign of something changed.
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
