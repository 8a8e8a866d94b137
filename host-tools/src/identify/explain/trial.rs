//! What may be missing: which effects of the catalogue can be tried on this log, and from which values.
//!
//! An effect whose absence is its zero ([`Screen::AtZero`], [`Screen::Scan`]) is tried by its sensitivity there, many at once. One whose zero
//! is singular ([`Screen::Probe`]) is tried at a few finite values, each with a run of its own. The values come from the model and the
//! log (resonances that the rows resolve, a part of the largest current), never from one stand's size.

use drive_model::{CATALOGUE, Card, ParameterKind, Screen};

use crate::identify::fit::{Parameters, PreparedLog};
use crate::log::Log;
use crate::model::{Channel, Input, Model};
use crate::statistics::Extremes;

/// An amplitude at which an effect is absent and its phase still has a direction.
const ABSENT: f64 = 1e-12;
/// Rates at which the Stribeck bump is tried, as parts of the largest rate.
const STRIBECK_PARTS: [f64; 6] = [0.005, 0.015, 0.05, 0.15, 0.4, 1.0];
/// Moments at which a load may set in.
const MOMENTS: usize = 24;
/// Time constants of a winding whose temperature is not measured, relative to the card's start.
const HEAT_CAPACITIES: [f64; 3] = [0.1, 1.0, 10.0];
/// Resonances at which a shaft is tried, Hz, with a damping ratio and shares of the inertia at the motor.
const RESONANCES_HZ: [f64; 4] = [5.0, 12.0, 30.0, 70.0];
const SLOWEST_SHAFT_HZ: f64 = 1.0;
const STIFFEST_SHAFT_ROWS: f64 = 0.08;
const STIFFEST_BRISTLE_ROWS: f64 = 0.2;
const SHAFT_DAMPING: f64 = 0.1;
const SHARE: f64 = 0.3;
/// Plays at which backlash is tried, rad, and the resonance of its flanks, Hz.
const GAPS_RAD: [f64; 3] = [0.01, 0.03, 0.08];
const FLANK_HZ: f64 = 50.0;

/// Periods that must be seen before anything is called periodic.
const FEWEST_PERIODS: f64 = 1.5;
/// Turns in which a pendulum's torque bends enough to be no spring.
const LEAST_SWING_TURNS: f64 = 0.25;

/// One effect at one set of values.
#[derive(Debug, Clone)]
pub struct Trial {
    /// The effect.
    pub card: &'static Card,
    /// Values of its parameters, in the card's order.
    pub values: Vec<f64>,
    /// How far each may go.
    pub ranges: Vec<(f64, f64)>,
    /// Which of them move while it is screened.
    pub screened: Vec<bool>,
    /// Which of them move when the model is fitted with it.
    pub fitted: Vec<bool>,
    /// It is absent at these values: its sensitivity says all, and many can be tried in one run.
    pub absent: bool,
    /// What the rate channel must be made from, where the effect depends on it and the log does not say.
    pub rate_from_encoder: Option<bool>,
}

impl Trial {
    /// A shaft: its resonance takes many steps a row.
    pub fn is_costly(&self) -> bool {
        is_shaft(self.card)
    }
}

/// An effect that this log cannot show, and why.
#[derive(Debug, Clone)]
pub struct Unseen {
    /// The effect.
    pub card: &'static Card,
    /// What the person would have to measure.
    pub says: String,
}

/// What the trials need to know of log and model.
pub struct Scene<'a> {
    /// The model to which something is added.
    pub model: &'a Model,
    /// The log.
    pub log: &'a Log,
    /// The log as the model sees it.
    pub record: &'a PreparedLog<'a>,
    /// Orders worth a look, of cogging, ripple and eccentricity, the most promising first.
    pub orders: Orders,
}

/// Orders per turn that are worth an exact look.
#[derive(Debug, Clone, Default)]
pub struct Orders {
    /// Of an additive torque.
    pub cogging: Vec<u32>,
    /// Of the motor constant.
    pub ripple: Vec<u32>,
    /// Of the encoder.
    pub eccentricity: Vec<u32>,
}

/// Everything that can be tried, and what cannot be seen here.
pub fn trials(scene: &Scene) -> (Vec<Trial>, Vec<Unseen>) {
    let (mut trials, mut unseen) = (Vec::new(), Vec::new());
    for card in CATALOGUE.iter().copied() {
        if !may_be_added(scene.model, card) {
            continue;
        }
        match why_unseen(card, scene) {
            Some(says) => unseen.push(Unseen { card, says }),
            None => trials.extend(of(card, scene)),
        }
    }
    (trials, unseen)
}

/// The model lacks it, or a drive may have several of it: each at an order of its own.
pub fn may_be_added(model: &Model, card: &Card) -> bool {
    matches!(card.id, "cogging" | "torque-ripple" | "encoder-eccentricity") || !model.effects().iter().any(|e| e.card.id == card.id)
}

/// The effect without which that of this card does nothing that could be told from it.
fn rests_on(card: &Card) -> Option<&'static str> {
    match card.id {
        "stribeck" | "presliding" | "asymmetric-friction" => Some("coulomb"),
        "viscous-temperature" => Some("viscous"),
        _ => None,
    }
}

/// Another effect of the model rests on that of this card.
pub fn carries_another(model: &Model, card: &Card) -> bool {
    model.effects().iter().any(|e| rests_on(e.card) == Some(card.id))
}

/// Why these columns, or this model, cannot show the effect; `None` where they can.
fn why_unseen(card: &Card, scene: &Scene) -> Option<String> {
    let (model, record) = (scene.model, scene.record);
    let compared = |shows: Channel| record.channels.iter().any(|c| c.channel == shows);
    let has = |id: &str| model.effects().iter().any(|e| e.card.id == id);
    let needs = |what: &str| Some(format!("{} needs {what}", card.title.to_lowercase()));
    let input = model.input();
    let moves = |values: &[f64]| {
        let (low, high) = values.iter().copied().min_max();
        high - low
    };
    match card.id {
        "dead-time" | "supply-droop" if scene.log.voltage() == crate::log::Voltage::Terminal => {
            Some("u_V was measured at the motor's terminals, behind the bridge: nothing is lost before them".to_owned())
        }
        "inductance" | "brush-drop" | "dead-time" | "resistance-temperature" | "supply-droop"
            if input != Input::Voltage && !compared(Channel::Voltage) =>
        {
            needs("the voltage as the model's input (u_V)")
        }
        "torque-ripple" | "magnetic-saturation" if model.index("motor_constant_N_m_A").is_none() => {
            needs("the voltage or the current as the model's input")
        }
        "cogging" | "unbalance" | "torque-ripple" | "cable-spring" | "encoder-eccentricity" | "rate-g-sensitivity"
            if record.theta.is_none() && input != Input::Motion =>
        {
            needs("the platform's angle: record theta_rad")
        }
        "encoder-eccentricity" if !compared(Channel::Angle) => needs("the angle among what is compared"),
        "sensor-lag" | "rate-scale" | "rate-scale-nonlinearity" | "rate-bias" | "rate-bias-temperature" | "rate-g-sensitivity"
            if !compared(Channel::Rate) =>
        {
            needs("a measured rate: record omega_rad_s")
        }
        "current-offset" | "current-scale" if !compared(Channel::Current) || input == Input::Current => {
            needs("a measured current beside the voltage: record i_A")
        }
        "viscous-temperature" if !has("viscous") => needs("viscous friction in the model"),
        "viscous-temperature" | "rate-bias-temperature" => match &record.temp_C {
            None => needs("the winding temperature: record temp_C"),
            Some(t) if moves(t) < 0.5 => {
                Some(format!("the temperature moves by less than half a kelvin: warm the drive to see {}", card.id))
            }
            Some(_) => None,
        },
        "resistance-temperature" => match &record.temp_C {
            Some(t) if moves(t) < 0.5 => {
                Some(format!("the temperature moves by less than half a kelvin: warm the drive to see {}", card.id))
            }
            _ => None,
        },
        "presliding" | "stribeck" if !has("coulomb") && !has("stribeck") => needs("a dry level (coulomb) in the model"),
        "asymmetric-friction" if !has("coulomb") => needs("a dry level (coulomb) in the model: on top of it friction differs by direction"),
        "unbalance" if turns(scene.record) < LEAST_SWING_TURNS => needs("a quarter of a turn at least, to be told from a cable's spring"),
        "encoder-eccentricity" | "rate-g-sensitivity" if turns(scene.record) < FEWEST_PERIODS => needs("a turn and a half at least"),
        "magnetic-saturation" if input == Input::Motion => {
            Some("the motion is prescribed and the current compared: what depends on the current would be explained by itself".to_owned())
        }
        "presliding" | "compliance" | "backlash" | "inductance" | "load-step" | "sensor-lag" | "time-skew" if input == Input::Motion => {
            (card.id != "load-step").then(|| "the motion is prescribed: nothing of it is simulated that this could change".to_owned())
        }
        "compliance" if has("backlash") => Some("backlash has a shaft already".to_owned()),
        "backlash" if has("compliance") => Some("a rival of compliance, not its sequel: exchange the two to try it".to_owned()),
        _ => None,
    }
}

/// The trials of one effect.
fn of(card: &'static Card, scene: &Scene) -> Vec<Trial> {
    let model = scene.model;
    let value = |name: &str| model.value(name);
    let starts: Vec<f64> = card.parameters.iter().map(|p| p.start).collect();
    let n = starts.len();
    let trial = |values: Vec<f64>, screened: Vec<bool>, fitted: Vec<bool>, absent: bool| Trial {
        card,
        values,
        ranges: card.parameters.iter().map(|p| p.range).collect(),
        screened,
        fitted,
        absent,
        rate_from_encoder: None,
    };
    let turns = turns(scene.record);
    let harmonic = |orders: &[u32]| -> Vec<Trial> {
        // What does not come round is no period.
        let orders = orders.iter().filter(|o| f64::from(**o) * turns >= FEWEST_PERIODS);
        orders.map(|&o| trial(vec![ABSENT, f64::from(o), 0.0], vec![true, false, true], vec![true, false, true], true)).collect()
    };
    match card.id {
        "cogging" => harmonic(&scene.orders.cogging),
        "torque-ripple" => harmonic(&scene.orders.ripple),
        "encoder-eccentricity" => {
            let unsaid = scene.log.column_made(Channel::Rate.column()).source == crate::log::Source::Unknown
                && scene.record.channels.iter().any(|c| c.channel == Channel::Rate);
            let mut list = harmonic(&scene.orders.eccentricity);
            if unsaid {
                let derived: Vec<Trial> = list.iter().map(|t| Trial { rate_from_encoder: Some(true), ..t.clone() }).collect();
                for t in &mut list {
                    t.rate_from_encoder = Some(false);
                }
                list.extend(derived);
            }
            list
        }
        "stribeck" => {
            let largest = largest_rate(scene);
            STRIBECK_PARTS
                .iter()
                .map(|part| trial(vec![0.0, (part * largest).clamp(0.001, 100.0)], vec![true, false], vec![true, true], true))
                .collect()
        }
        "load-step" => {
            let (from, to) = (scene.record.t_s[0], scene.record.t_s[scene.record.len() - 1]);
            (1..=MOMENTS)
                .map(|k| from + (to - from) * k as f64 / (MOMENTS + 1) as f64)
                .map(|moment| trial(vec![0.0, moment], vec![true, false], vec![true, true], true))
                .collect()
        }
        "cable-spring" => vec![trial(vec![0.0, 0.0], vec![true, false], vec![true, false], true)],
        "resistance-temperature" => {
            if scene.record.temp_C.is_some() {
                return vec![trial(vec![0.0, starts[1], starts[2]], vec![true, false, false], vec![true, false, false], true)];
            }
            HEAT_CAPACITIES
                .iter()
                .map(|c| trial(vec![0.0, starts[1] * c, starts[2]], vec![true, false, false], vec![true, true, false], true))
                .collect()
        }
        "inductance" => {
            let resistance = value("resistance_ohm").unwrap_or(1.0);
            [0.5, 3.0]
                .iter()
                .map(|rows| trial(vec![resistance * rows * scene.record.dt_s.min(2e-3)], vec![true], vec![true], false))
                .collect()
        }
        "magnetic-saturation" => {
            let largest = largest_current(scene);
            vec![trial(vec![(3.0 * largest).clamp(0.051, 999.0)], vec![true], vec![true], false)]
        }
        "presliding" => {
            let dry = value("coulomb_N_m").or_else(|| value("stribeck_N_m")).unwrap_or(1e-3).abs().max(1e-9);
            let (low, high) = card.parameters[0].range;
            let within = (low, high.min(stiffest_bristle(scene.model, scene.record.dt_s)));
            let list = [0.003, 0.02, 0.1].iter().map(|reach| trial(vec![dry / reach], vec![true], vec![true], false));
            list.map(|t| Trial { ranges: vec![within], ..t }).collect()
        }
        "compliance" => {
            let within = shaft_ranges(scene.model, scene.record.dt_s);
            let list = shafts(scene).into_iter().map(|s| trial(s.to_vec(), vec![true; 3], vec![true; 3], false));
            list.map(|t| Trial { ranges: within.to_vec(), ..t }).collect()
        }
        "backlash" => {
            let Some(flank) = shaft(scene, FLANK_HZ, 1.0) else { return Vec::new() };
            let mut within = vec![card.parameters[0].range];
            within.extend(shaft_ranges(scene.model, scene.record.dt_s));
            let list = GAPS_RAD
                .iter()
                .map(|gap| trial(vec![*gap, flank[0], flank[1], flank[2]], vec![true, false, false, false], vec![true; 4], false));
            list.map(|t| Trial { ranges: within.clone(), ..t }).collect()
        }
        "sensor-lag" | "time-skew" => vec![trial(vec![0.0], vec![true], vec![true], true)],
        _ => {
            // All coefficients at zero; where there are several, each also alone.
            let amplitude = |k: usize| matches!(card.parameters[k].kind, ParameterKind::NonNegative | ParameterKind::Signed);
            let zero: Vec<f64> = (0..n)
                .map(|k| match card.parameters[k].kind {
                    ParameterKind::NonNegative if card.polar => ABSENT,
                    ParameterKind::NonNegative | ParameterKind::Signed | ParameterKind::Phase => 0.0,
                    _ => starts[k],
                })
                .collect();
            let amplitudes: Vec<usize> = (0..n).filter(|&k| amplitude(k)).collect();
            let all: Vec<bool> = (0..n).map(|k| amplitude(k) || card.parameters[k].kind == ParameterKind::Phase).collect();
            let absent = card.screen != Screen::Probe;
            let mut list = vec![trial(zero.clone(), all.clone(), all, absent)];
            if amplitudes.len() > 1 {
                for &alone in &amplitudes {
                    let one: Vec<bool> = (0..n).map(|k| k == alone).collect();
                    list.push(trial(zero.clone(), one.clone(), one, absent));
                }
            }
            list
        }
    }
}

/// Shafts of several resonances, as far as the rows resolve them.
fn shafts(scene: &Scene) -> Vec<[f64; 3]> {
    RESONANCES_HZ.iter().filter(|hz| **hz * scene.record.dt_s < 0.2).filter_map(|&hz| shaft(scene, hz, SHAFT_DAMPING)).collect()
}

/// How far a shaft may go: a resonance beyond what the rows resolve is a stiff shaft, at many times the cost.
fn shaft_ranges(model: &Model, dt_s: f64) -> [(f64, f64); 3] {
    let inertia = model.value("inertia_kg_m2").unwrap_or(1.0);
    let w = std::f64::consts::TAU * SLOWEST_SHAFT_HZ;
    let stiff = std::f64::consts::TAU * STIFFEST_SHAFT_ROWS / dt_s;
    [(0.05 * inertia * w * w, 0.25 * inertia * stiff * stiff), (0.0, 0.5 * inertia * stiff), (0.03, 0.97)]
}

/// The same for a bristle, by the resonance of the rotor on it: a stiffer one is dry friction.
fn stiffest_bristle(model: &Model, dt_s: f64) -> f64 {
    let inertia = model.value("inertia_kg_m2").unwrap_or(1.0);
    let stiff = std::f64::consts::TAU * STIFFEST_BRISTLE_ROWS / dt_s;
    inertia * stiff * stiff
}

/// Keeps shafts and bristles of a model within what the rows resolve, where they begin there.
pub fn keep_in_reach(model: &Model, dt_s: f64, parameters: &mut Parameters) {
    for used in model.effects() {
        let within = match used.card.id {
            "presliding" => vec![(0.0, stiffest_bristle(model, dt_s))],
            _ if is_shaft(used.card) => shaft_ranges(model, dt_s).to_vec(),
            _ => continue,
        };
        // A shaft's own three stand last.
        let first = used.parameters.len().saturating_sub(within.len());
        for (&k, range) in used.parameters[first..].iter().zip(within) {
            let p = &mut parameters.list[k];
            if p.value >= range.0 && p.value <= range.1 {
                p.range = (p.range.0.max(range.0), p.range.1.min(range.1));
            }
        }
    }
}

fn is_shaft(card: &Card) -> bool {
    matches!(card.id, "compliance" | "backlash")
}

/// Stiffness, damping and share of a shaft that resonates at `hz`, J_red (2π f)².
fn shaft(scene: &Scene, hz: f64, damping: f64) -> Option<[f64; 3]> {
    let reduced = scene.model.value("inertia_kg_m2")? * SHARE * (1.0 - SHARE);
    let w = std::f64::consts::TAU * hz;
    Some([reduced * w * w, 2.0 * damping * reduced * w, SHARE])
}

/// Turns between the least and the greatest angle.
pub fn turns(record: &PreparedLog) -> f64 {
    let Some(theta) = record.theta.or((record.driven == Input::Motion).then_some(record.input)) else { return 0.0 };
    let (low, high) = theta.iter().copied().min_max();
    (high - low) / std::f64::consts::TAU
}

fn largest_rate(scene: &Scene) -> f64 {
    let of = |values: &[f64]| values.iter().copied().max_abs();
    if let Some(c) = scene.record.channels.iter().find(|c| c.channel == Channel::Rate) {
        return of(c.measured).max(1e-3);
    }
    let Some(theta) = scene.record.theta.or((scene.record.driven == Input::Motion).then_some(scene.record.input)) else { return 1.0 };
    let lag = scene.record.angle_lag();
    theta.windows(lag + 1).fold(0.0_f64, |m, w| m.max((w[lag] - w[0]).abs() / (lag as f64 * scene.record.dt_s))).max(1e-3)
}

fn largest_current(scene: &Scene) -> f64 {
    let current = scene.record.channels.iter().find(|c| c.channel == Channel::Current).map(|c| c.measured).or(scene.record.current);
    let of = |values: &[f64]| values.iter().copied().max_abs();
    match (current, scene.model.value("resistance_ohm")) {
        (Some(i), _) => of(i),
        (None, Some(resistance)) if scene.record.driven == Input::Voltage => of(scene.record.input) / resistance,
        _ => of(scene.record.input),
    }
}
