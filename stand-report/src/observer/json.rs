//! Observer results as JSON. A number that is not finite is `null`.

use nalgebra::Complex;
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use super::words::{vibration_source, warning};
use crate::json::schema_of;
use crate::json::value;
use crate::uncertainty::EstimateJson;
use stand_analysis::observer::bode::{MAX_GAIN_ERROR_DB, MAX_PHASE_ERROR_DEG};
use stand_analysis::observer::bode::{evaluate, object_response};
use stand_analysis::observer::moment::{Harmonic, Random};
use stand_analysis::observer::vibration::{Compensated, Correction, VibrationQuantity};
use stand_analysis::observer::{Bode, Design, Discrete, Integral, Plant, SideBySide, Simulated, Trace, Warning};

/// Points of a frequency response in the answer.
const CURVE_POINTS_PER_DECADE: usize = 50;
/// Rows of a simulation in the answer, about; the plot of the page has all rows.
const TRACE_ROWS: usize = 100;

#[derive(Serialize, JsonSchema)]
struct DesignJson<'a> {
    model: &'a str,
    states: &'static [&'static str],
    kind: &'static str,
    poles: Vec<PoleJson>,
    gains: &'a [f64],
    integral: Option<IntegralJson>,
    discrete: Option<DiscreteJson<'a>>,
    observability: ObservabilityJson,
    warnings: Vec<String>,
}

#[derive(Serialize, JsonSchema)]
struct PoleJson {
    re: f64,
    im: f64,
}

#[derive(Serialize, JsonSchema)]
struct IntegralJson {
    row: usize,
    gain: f64,
    moment_per_integral: f64,
    stable_below: Option<f64>,
}

#[derive(Serialize, JsonSchema)]
struct DiscreteJson<'a> {
    step_s: f64,
    gains: &'a [f64],
    phi: &'a [Vec<f64>],
    gamma: &'a [f64],
    last_state: Option<&'static str>,
}

#[derive(Serialize, JsonSchema)]
struct ObservabilityJson {
    rank: usize,
    condition: f64,
}

/// The answer of `stand observer design --json`.
pub fn design_json(design: &Design) -> Value {
    let plant = &design.request.plant;
    value(&DesignJson {
        model: &plant.name,
        states: plant.states(),
        kind: design.request.kind.name(),
        poles: design.poles.iter().map(pole).collect(),
        gains: &design.gains,
        integral: design.integral.map(integral),
        discrete: design.discrete.as_ref().map(discrete),
        observability: ObservabilityJson { rank: design.rank, condition: design.condition },
        warnings: warnings(&design.warnings()),
    })
}

fn pole(z: &Complex<f64>) -> PoleJson {
    PoleJson { re: z.re, im: z.im }
}

fn integral(channel: Integral) -> IntegralJson {
    let Integral { row, gain, moment_per_integral, stable_below } = channel;
    IntegralJson { row, gain, moment_per_integral, stable_below }
}

fn discrete(d: &Discrete) -> DiscreteJson<'_> {
    let last_state = d.has_disturbance.then_some("moment_N_m");
    DiscreteJson { step_s: d.step_s, gains: &d.gains, phi: &d.phi, gamma: &d.gamma, last_state }
}

fn warnings(list: &[Warning]) -> Vec<String> {
    list.iter().map(warning).collect()
}

#[derive(Serialize, JsonSchema)]
struct SideBySideJson<'a> {
    model: &'a str,
    angle_rad: f64,
    disturbance_N_m: f64,
    harmonic: Option<HarmonicJson>,
    random: Option<RandomJson>,
    #[serde(rename = "static")]
    without_integral: RunJson<'a>,
    #[serde(rename = "astatic")]
    with_integral: RunJson<'a>,
}

#[derive(Serialize, JsonSchema)]
struct HarmonicJson {
    amplitude_N_m: f64,
    frequency_Hz: f64,
}

#[derive(Serialize, JsonSchema)]
struct RandomJson {
    sigma_N_m: f64,
    correlation_s: f64,
    seed: u64,
}

#[derive(Serialize, JsonSchema)]
struct RunJson<'a> {
    kind: &'static str,
    settled_s: Option<f64>,
    rate_settled_s: Option<f64>,
    greatest_angle_error_rad: f64,
    greatest_rate_error_rad_s: f64,
    at_end_s: Option<f64>,
    at_end: &'a [f64],
    rms_angle_error_rad: f64,
    rms_rate_error_rad_s: f64,
    /// For t → ∞ under the constant moment.
    #[serde(rename = "rest")]
    steady_errors: &'a [f64],
    moment_N_m: Option<f64>,
    closed_loop_at_end_rad: Option<f64>,
    #[serde(rename = "closed_loop_rest_rad")]
    closed_loop_steady_rad: Option<f64>,
    closed_loop_poles: Vec<PoleJson>,
    with_initial_error: TraceJson,
    moment_only: TraceJson,
}

#[derive(Serialize, JsonSchema)]
struct TraceJson {
    t_s: Vec<f64>,
    angle_error_rad: Vec<f64>,
    rate_error_rad_s: Vec<f64>,
    moment_N_m: Vec<f64>,
}

/// The answer of `stand observer simulate --json`: a static and an astatic observer side by side.
pub fn simulate_json(beside: &SideBySide<'_>) -> Value {
    let [one, other] = beside.designs;
    value(&SideBySideJson {
        model: &one.request.plant.name,
        angle_rad: beside.disturbed.angle_rad,
        disturbance_N_m: beside.disturbed.moment.constant_N_m,
        harmonic: beside
            .disturbed
            .moment
            .harmonic
            .map(|Harmonic { amplitude_N_m, frequency_Hz }| HarmonicJson { amplitude_N_m, frequency_Hz }),
        random: beside.disturbed.moment.random.map(|Random { sigma_N_m, correlation_s, seed }| RandomJson {
            sigma_N_m,
            correlation_s,
            seed,
        }),
        without_integral: run(one, beside.runs[0]),
        with_integral: run(other, beside.runs[1]),
    })
}

fn run<'a>(design: &Design, run: &'a Simulated) -> RunJson<'a> {
    RunJson {
        kind: design.request.kind.name(),
        settled_s: run.settled_s,
        rate_settled_s: run.rate_settled_s,
        greatest_angle_error_rad: run.largest[0],
        greatest_rate_error_rad_s: run.largest[1],
        at_end_s: run.both.t_s.last().copied(),
        at_end: &run.at_end,
        rms_angle_error_rad: run.rms_second_half[0],
        rms_rate_error_rad_s: run.rms_second_half[1],
        steady_errors: &run.steady,
        moment_N_m: run.both.moment_N_m.last().copied(),
        closed_loop_at_end_rad: run.closed.as_ref().and_then(|closed| closed.angle_rad.last().copied()),
        closed_loop_steady_rad: run.closed.as_ref().and_then(|closed| closed.steady_rad),
        closed_loop_poles: run.closed.iter().flat_map(|closed| closed.poles.iter().map(pole)).collect(),
        with_initial_error: trace(&run.both),
        moment_only: trace(&run.moment_only),
    }
}

fn trace(trace: &Trace) -> TraceJson {
    let every = trace.t_s.len().div_ceil(TRACE_ROWS).max(1);
    let error = |state: usize| trace.errors.iter().step_by(every).map(|e| e[state]).collect();
    TraceJson {
        t_s: trace.t_s.iter().copied().step_by(every).collect(),
        angle_error_rad: error(0),
        rate_error_rad_s: error(1),
        moment_N_m: trace.moment_N_m.iter().copied().step_by(every).collect(),
    }
}

#[derive(Serialize, JsonSchema)]
struct BodeAnswerJson<'a> {
    model: &'a str,
    fastest_mode_rad_s: f64,
    limits: LimitsJson,
    /// Rate of the object over its excitation: overload in g, or moment in N m, to rad/s.
    object: CurveJson,
    observers: Vec<BodeJson<'a>>,
}

#[derive(Serialize, JsonSchema)]
struct LimitsJson {
    #[serde(rename = "dB")]
    gain_dB: f64,
    #[serde(rename = "deg")]
    phase_deg: f64,
}

#[derive(Serialize, JsonSchema)]
struct BodeJson<'a> {
    omega_rad_s: f64,
    gains: &'a [f64],
    distorted_from_rad_s: Option<f64>,
    #[serde(rename = "distorted_from_the_start")]
    distorted_at_lowest_frequency: bool,
    noise_gain_1_s: f64,
    noise_at_rad_s: f64,
    at_vibration: Option<ResponseJson>,
    curve: CurveJson,
}

/// Response of the estimated rate over frequency, relative to the true rate.
#[derive(Serialize, JsonSchema)]
struct CurveJson {
    rad_s: Vec<f64>,
    #[serde(rename = "gain_dB")]
    gain_dB: Vec<f64>,
    phase_deg: Vec<f64>,
}

#[derive(Serialize, JsonSchema)]
struct ResponseJson {
    gain_dB: f64,
    phase_deg: f64,
}

/// The answer of `stand observer bode --json`: frequency responses of several observers.
pub fn bode_json(plant: &Plant, bodes: &[Bode], vibration_Hz: Option<f64>) -> Value {
    let response = |r: Complex<f64>| ResponseJson { gain_dB: 20.0 * r.norm().log10(), phase_deg: r.arg().to_degrees() };
    let observers = bodes.iter().map(|bode| BodeJson {
        omega_rad_s: bode.omega_rad_s,
        gains: &bode.gains,
        distorted_from_rad_s: bode.limit.rad_s,
        distorted_at_lowest_frequency: bode.limit.at_lowest_frequency,
        noise_gain_1_s: bode.noise.0,
        noise_at_rad_s: bode.noise.1,
        at_vibration: vibration_Hz.map(|f| response(bode.ratio(std::f64::consts::TAU * f))),
        curve: curve(|w| bode.ratio(w)),
    });
    value(&BodeAnswerJson {
        model: &plant.name,
        fastest_mode_rad_s: plant.fastest_rad_s(),
        limits: LimitsJson { gain_dB: MAX_GAIN_ERROR_DB, phase_deg: MAX_PHASE_ERROR_DEG },
        object: {
            let (_, numerator, denominator) = object_response(plant);
            curve(|w| {
                let s = Complex::new(0.0, w);
                evaluate(&numerator, s) / evaluate(&denominator, s)
            })
        },
        observers: observers.collect(),
    })
}

/// A curve on a logarithmic grid from 0.01 to 10⁴ rad/s, 50 points in a decade. The phase is unwrapped.
fn curve(of: impl Fn(f64) -> Complex<f64>) -> CurveJson {
    let rad_s: Vec<f64> =
        (0..=6 * CURVE_POINTS_PER_DECADE).map(|k| 10_f64.powf(-2.0 + k as f64 / CURVE_POINTS_PER_DECADE as f64)).collect();
    let values: Vec<Complex<f64>> = rad_s.iter().map(|w| of(*w)).collect();
    let mut last = 0.0;
    let phase = |value: &Complex<f64>| {
        let plain = value.arg().to_degrees();
        last = plain - 360.0 * ((plain - last) / 360.0).round();
        last
    };
    CurveJson {
        gain_dB: values.iter().map(|value| 20.0 * value.norm().log10()).collect(),
        phase_deg: values.iter().map(phase).collect(),
        rad_s,
    }
}

#[derive(Serialize, JsonSchema)]
struct VibrationJson {
    vibration_Hz: f64,
    periods: f64,
    alpha_rad: f64,
    estimated: CorrectionJson,
    response_corrected: CorrectionJson,
    exact: Option<CorrectionJson>,
    vibration_part_rad: Option<BudgetJson>,
    azimuth_rad: Option<BudgetJson>,
    precession_s: f64,
    warnings: Vec<String>,
}

#[derive(Serialize, JsonSchema)]
struct CorrectionJson {
    rate_rad: f64,
    with_inertia_rad: f64,
    corrected_rad: f64,
    /// Of the part by the exact rates; `null` if the log does not have them.
    removed_by_rate_percent: Option<f64>,
    removed_with_inertia_percent: Option<f64>,
}

#[derive(Serialize, JsonSchema)]
struct BudgetJson {
    #[serde(flatten)]
    estimate: EstimateJson,
    budget: Vec<BudgetLineJson>,
}

#[derive(Serialize, JsonSchema)]
struct BudgetLineJson {
    of: &'static str,
    u: f64,
}

/// The answer of `stand vibration compensate --json`: a corrected azimuth.
pub fn vibration_json(found: &Compensated, list: &[Warning]) -> Value {
    let exact = found.exact.map(|exact| exact.with_inertia_rad);
    let percent = |rad: f64| exact.map(|exact| 100.0 * rad / exact);
    let correction = |c: &Correction| CorrectionJson {
        rate_rad: c.rate_rad,
        with_inertia_rad: c.with_inertia_rad,
        corrected_rad: found.alpha_rad - c.with_inertia_rad,
        removed_by_rate_percent: percent(c.rate_rad),
        removed_with_inertia_percent: percent(c.with_inertia_rad),
    };
    let budget = |quantity: &VibrationQuantity| BudgetJson {
        estimate: EstimateJson::new(&quantity.estimate(), 1.0),
        budget: quantity
            .contributions
            .iter()
            .map(|line| BudgetLineJson { of: vibration_source(line.basis), u: line.contribution() })
            .collect(),
    };
    value(&VibrationJson {
        vibration_Hz: found.vibration_Hz,
        periods: found.periods,
        alpha_rad: found.alpha_rad,
        estimated: correction(&found.estimated),
        response_corrected: correction(&found.response_corrected),
        exact: found.exact.as_ref().map(correction),
        vibration_part_rad: found.part.as_ref().map(budget),
        azimuth_rad: found.corrected.as_ref().map(budget),
        precession_s: found.precession_s,
        warnings: warnings(list),
    })
}

/// Schemas of the answers.
pub(crate) fn schemas() -> Vec<(&'static str, Value)> {
    vec![
        ("observer design", schema_of::<DesignJson<'_>>()),
        ("observer simulate", schema_of::<SideBySideJson<'_>>()),
        ("observer bode", schema_of::<BodeAnswerJson<'_>>()),
        ("vibration compensate", schema_of::<VibrationJson>()),
    ]
}
