//! Answers of `stand drift … --json`.

use super::display::Display;
use super::words::{NoteKind, QUIET, platform_source, warning_kind};
use super::{defect, source, warning};
use crate::json::schema_of;
use crate::json::value;
use crate::uncertainty::{EstimateJson, QuantityJson};
use crate::units::Units;
use identification::statistics::uncertainty::{Estimate, Quantity};
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;
use stand_analysis::drift::error_budget::{AxisBudget, DriftQuantity, ErrorSource};
use stand_analysis::drift::evaluation::sources;
use stand_analysis::drift::measurement::{AzimuthLimit, SeparatedDrift};
use stand_analysis::drift::platform::{PlatformCycle, PlatformResult, PlatformSource};
use stand_analysis::drift::pulse_advice::PulseAdvice;
use stand_analysis::drift::{Cycle, DEG_H, DriftResult};

const AXES: [&str; 3] = ["x", "y", "z"];

#[derive(Serialize, JsonSchema)]
#[serde(untagged)]
enum AxesEntry {
    One(EstimateJson),
    Three { x: EstimateJson, y: EstimateJson, z: EstimateJson },
}

impl AxesEntry {
    fn new(estimates: &[Estimate]) -> Option<Self> {
        let entry = |estimate| EstimateJson::new(estimate, 1.0 / DEG_H);
        match estimates {
            [one] => Some(Self::One(entry(one))),
            [x, y, z] => Some(Self::Three { x: entry(x), y: entry(y), z: entry(z) }),
            _ => None,
        }
    }
}

#[derive(Serialize, JsonSchema)]
struct AzimuthEntry {
    #[serde(flatten)]
    estimate: EstimateJson,
    or: Option<f64>,
}

impl AzimuthEntry {
    fn new(found: &SeparatedDrift) -> Option<Self> {
        let azimuth = found.azimuth_rad?;
        let second = found.second_azimuth_rad();
        Some(Self { estimate: EstimateJson::new(&azimuth, 1_f64.to_degrees()), or: second.map(f64::to_degrees) })
    }
}

/// An azimuth near the meridian: |A − near_deg| < within_deg (95 %).
#[derive(Serialize, JsonSchema)]
struct AzimuthLimitEntry {
    near_deg: f64,
    within_deg: f64,
}

impl From<AzimuthLimit> for AzimuthLimitEntry {
    fn from(limit: AzimuthLimit) -> Self {
        Self { near_deg: limit.near_rad.to_degrees(), within_deg: limit.within_rad.to_degrees() }
    }
}

#[derive(Serialize, JsonSchema)]
struct CycleEntry {
    number: u32,
    axis: Option<&'static str>,
    turned_deg: f64,
    raised_deg: f64,
    rolled_deg: f64,
    sequence: &'static str,
    start_s: f64,
    pulse_s: f64,
    amplitude_deg_s: f64,
    drift_deg_h: f64,
    raw_deg_h: f64,
    residual_deg_h: Option<f64>,
    slope_deg_h: f64,
    bad: Option<String>,
}

impl CycleEntry {
    fn new(c: &Cycle, axis: Option<&'static str>) -> Self {
        Self {
            number: c.number,
            axis,
            turned_deg: c.position.turned_rad.to_degrees(),
            raised_deg: c.position.raised_rad.to_degrees(),
            rolled_deg: c.position.rolled_rad.to_degrees(),
            sequence: if c.sign < 0 { "-+" } else { "+-" },
            start_s: c.start_s,
            pulse_s: c.integral.pulse_s,
            amplitude_deg_s: c.amplitude_rad_s.to_degrees(),
            drift_deg_h: c.rate_rad_s() / DEG_H,
            raw_deg_h: c.integral.drift_rad_s() / DEG_H,
            residual_deg_h: c.residual_rad_s.map(|rad_s| rad_s / DEG_H),
            slope_deg_h: c.integral.slope_rad_s / DEG_H,
            bad: c.defect.as_ref().map(defect),
        }
    }
}

#[derive(Serialize, JsonSchema)]
struct AxisEntry {
    axis: Option<&'static str>,
    #[serde(flatten)]
    estimate: EstimateJson,
}

#[derive(Serialize, JsonSchema)]
struct MovementEntry {
    axis: Option<&'static str>,
    trend_deg_h_h: Option<EstimateJson>,
    trend_significant: bool,
    random_walk_deg_h_sqrt_h: Option<f64>,
    visit_contrasts: usize,
    visits_log10_p: Option<f64>,
    visits_sigma_deg_h: Option<f64>,
}

#[derive(Serialize, JsonSchema)]
struct ContributionEntry {
    of: &'static str,
    axis: Option<&'static str>,
    own_deg_h: Option<f64>,
    apparent_deg_h: Option<f64>,
    azimuth_arcmin: Option<f64>,
}

#[derive(Serialize, JsonSchema)]
struct UncorrectedEntry {
    own_drift_deg_h: Option<AxesEntry>,
    apparent_drift_deg_h: Option<AxesEntry>,
    azimuth_deg: Option<AzimuthEntry>,
}

#[derive(Serialize, JsonSchema)]
struct DriftEntry<'a> {
    name: &'a str,
    cycles: Vec<CycleEntry>,
    good: usize,
    bad: usize,
    own_drift_deg_h: Option<AxesEntry>,
    apparent_drift_deg_h: Option<AxesEntry>,
    azimuth_deg: Option<AzimuthEntry>,
    #[serde(skip_serializing_if = "Option::is_none")]
    azimuth_limit: Option<AzimuthLimitEntry>,
    g_drift_deg_h_g: Vec<AxisEntry>,
    latitude_deg: Option<f64>,
    inequality: Vec<AxisEntry>,
    reference_deg_s: Option<f64>,
    movement: Vec<MovementEntry>,
    uncertainty: Vec<ContributionEntry>,
    quantities: Vec<QuantityJson>,
    uncorrected: UncorrectedEntry,
    warnings: Vec<String>,
    /// The same warnings: kind and numbers.
    notes: Vec<NoteKind>,
}

/// The answer of `stand drift run --json` and `stand drift compute --json`.
pub fn json(result: &DriftResult, units: Units) -> Value {
    let m = &result.measurement;
    let axis = |k: usize| m.has_three_axes.then(|| AXES[k]);
    let good = m.valid_cycles().len();
    let (corrected, uncorrected) = (&result.corrected, &result.uncorrected);
    let g_dependent = corrected.position_fit.iter().flat_map(|fit| fit.g_dependent.iter().zip(["input", "output", "spin"]));
    let g_dependent = g_dependent
        .filter_map(|(estimate, axis)| Some(AxisEntry { axis: Some(axis), estimate: EstimateJson::new(estimate.as_ref()?, 1.0 / DEG_H) }));
    let inequality = corrected.inequality.iter().enumerate();
    let inequality = inequality.map(|(k, found)| AxisEntry { axis: axis(k), estimate: EstimateJson::new(found, 1.0) });
    let contribution = |k: usize, budget: &AxisBudget, of: ErrorSource| ContributionEntry {
        of: source(of),
        axis: axis(k),
        own_deg_h: part(budget.own.as_ref(), of).map(|u| u / DEG_H),
        apparent_deg_h: part(budget.apparent.as_ref(), of).map(|u| u / DEG_H),
        azimuth_arcmin: part(budget.azimuth.as_ref(), of).map(|u| u.to_degrees() * 60.0),
    };
    let budgets = result.budgets.iter().enumerate();
    let uncertainty = budgets.flat_map(|(k, budget)| sources(budget).into_iter().map(move |of| (k, budget, of)));
    let movement = corrected.movement.iter().enumerate().map(|(k, found)| MovementEntry {
        axis: axis(k),
        trend_deg_h_h: found.trend.map(|trend| EstimateJson::new(&trend, 3600.0 / DEG_H)),
        trend_significant: found.has_trend,
        visit_contrasts: found.free_visits,
        random_walk_deg_h_sqrt_h: found.walk_rad_s_sqrt_s.map(|walk| walk * 60.0 / DEG_H),
        visits_log10_p: found.log10_p_visits,
        visits_sigma_deg_h: found.visit_sigma_rad_s.map(|sigma| sigma / DEG_H),
    });
    value(&DriftEntry {
        name: &m.name,
        cycles: m.cycles.iter().map(|c| CycleEntry::new(c, axis(c.axis))).collect(),
        good,
        bad: m.cycles.len() - good,
        own_drift_deg_h: AxesEntry::new(&corrected.own_rad_s),
        apparent_drift_deg_h: AxesEntry::new(&corrected.apparent_rad_s),
        azimuth_deg: AzimuthEntry::new(corrected),
        azimuth_limit: corrected.azimuth_limit.map(AzimuthLimitEntry::from),
        g_drift_deg_h_g: g_dependent.collect(),
        latitude_deg: m.latitude_deg,
        inequality: inequality.collect(),
        reference_deg_s: result.reference_rad_s.map(f64::to_degrees),
        movement: movement.collect(),
        uncertainty: uncertainty.map(|(k, budget, of)| contribution(k, budget, of)).collect(),
        quantities: quantities(corrected, &Display::new(units)),
        uncorrected: UncorrectedEntry {
            own_drift_deg_h: AxesEntry::new(&uncorrected.own_rad_s),
            apparent_drift_deg_h: AxesEntry::new(&uncorrected.apparent_rad_s),
            azimuth_deg: AzimuthEntry::new(uncorrected),
        },
        warnings: result.warnings.iter().map(warning).collect(),
        notes: result.warnings.iter().map(warning_kind).collect(),
    })
}

/// Standard uncertainty by one source.
fn part(quantity: Option<&DriftQuantity>, of: ErrorSource) -> Option<f64> {
    let lines: Vec<f64> = quantity?.contributions.iter().filter(|line| line.basis == of).map(|line| line.contribution()).collect();
    (!lines.is_empty()).then(|| lines.iter().map(|u| u * u).sum::<f64>().sqrt())
}

/// The results by the names of the standards, in the units of the user.
fn quantities(found: &SeparatedDrift, display: &Display) -> Vec<QuantityJson> {
    let suffix = |k: usize| if found.own_rad_s.len() == 3 { format!(" {}", AXES[k]) } else { String::new() };
    let mut all = Vec::new();
    for (k, own) in found.own_rad_s.iter().enumerate() {
        all.push(QuantityJson::new(format!("systematic drift rate{}", suffix(k)), "IEEE 528, drift rate", own, &display.rate));
    }
    for (k, movement) in found.movement.iter().enumerate() {
        let trend =
            movement.trend.map(|trend| QuantityJson::new(format!("rate ramp{}", suffix(k)), "IEEE 952, annex C", &trend, &display.ramp));
        all.extend(trend);
        let walk = movement.walk_rad_s_sqrt_s.map(|value| Estimate { value, uncertainty: None });
        all.extend(walk.map(|walk| QuantityJson::new(format!("rate random walk{}", suffix(k)), "IEEE 952, annex C", &walk, &display.walk)));
    }
    let g_dependent = found.position_fit.iter().flat_map(|fit| fit.g_dependent.iter().zip(["input", "output", "spin"]));
    for (estimate, axis) in g_dependent {
        let name = format!("acceleration-sensitive drift rate, {axis} axis");
        all.extend(
            estimate
                .as_ref()
                .map(|estimate| QuantityJson::new(name, "IEEE 528, acceleration-sensitive drift rate", estimate, &display.per_g)),
        );
    }
    all
}

#[derive(Serialize, JsonSchema)]
struct LineEntry {
    frequency_Hz: f64,
    amplitude_arcsec: f64,
}

#[derive(Serialize, JsonSchema)]
struct AdviceEntry<'a> {
    log: &'a str,
    pulse_s: f64,
    period_s: Option<f64>,
    periods: u32,
    leaves_deg_h: f64,
    wanted_leaves_deg_h: f64,
    noise_deg_h: f64,
    lines: Vec<LineEntry>,
}

/// The answer of `stand drift advise --json`.
pub fn advice_json(log: &str, advice: &PulseAdvice) -> Value {
    let [leaves_deg_h, wanted_leaves_deg_h] = advice.line_error_rad_s.map(|rad_s| rad_s / DEG_H);
    let lines = advice.lines.iter();
    value(&AdviceEntry {
        log,
        pulse_s: advice.pulse_s,
        period_s: (advice.period_s > 0.0).then_some(advice.period_s),
        periods: advice.periods,
        leaves_deg_h,
        wanted_leaves_deg_h,
        noise_deg_h: advice.noise_rad_s / DEG_H,
        lines: lines.map(|l| LineEntry { frequency_Hz: l.frequency_Hz, amplitude_arcsec: l.amplitude_rad / DEG_H }).collect(),
    })
}

#[derive(Serialize, JsonSchema)]
struct UnitEntry {
    #[serde(flatten)]
    estimate: EstimateJson,
    unit: &'static str,
    budget: Vec<PlatformLineEntry>,
}

#[derive(Serialize, JsonSchema)]
struct PlatformLineEntry {
    of: &'static str,
    u: f64,
}

#[derive(Serialize, JsonSchema)]
struct BiasAndScaleEntry {
    bias_rad_s: f64,
    scale: f64,
}

#[derive(Serialize, JsonSchema)]
struct PlatformCycleEntry {
    start_s: f64,
    bias_rad_s: f64,
    scale: f64,
    sequence: &'static str,
    rate_rad_s: f64,
    bad: Option<String>,
    uncorrected: BiasAndScaleEntry,
}

#[derive(Serialize, JsonSchema)]
struct PlatformEntry<'a> {
    log: &'a str,
    pulse_s: f64,
    bias_rad_s: UnitEntry,
    scale: UnitEntry,
    lag_s: Option<UnitEntry>,
    without_earth_rate: bool,
    quantities: Vec<QuantityJson>,
    cycles: Vec<PlatformCycleEntry>,
    warnings: Vec<&'static str>,
}

/// The answer of `stand drift platform --json`.
pub fn platform_json(log: &str, result: &PlatformResult, units: Units) -> Value {
    let display = Display::for_platform(units);
    let line = |quantity: &Quantity<PlatformSource, ()>| {
        quantity.contributions.iter().map(|line| PlatformLineEntry { of: platform_source(line.basis), u: line.contribution() }).collect()
    };
    let budgets = result.budgets.as_ref();
    let with_unit = |estimate: &Estimate, unit, budget: Option<&Quantity<PlatformSource, ()>>| UnitEntry {
        estimate: EstimateJson::new(estimate, 1.0),
        unit,
        budget: budget.map(line).unwrap_or_default(),
    };
    let cycle = |c: &PlatformCycle| PlatformCycleEntry {
        start_s: c.start_s,
        bias_rad_s: c.bias_rad_s,
        scale: c.scale,
        sequence: if c.sign < 0 { "-+" } else { "+-" },
        rate_rad_s: c.rate_rad_s,
        bad: c.defect.as_ref().map(defect),
        uncorrected: BiasAndScaleEntry { bias_rad_s: c.uncorrected[0], scale: c.uncorrected[1] },
    };
    value(&PlatformEntry {
        log,
        pulse_s: result.pulse_s,
        bias_rad_s: with_unit(&result.bias_rad_s, "rad/s", budgets.map(|[bias, _]| bias)),
        scale: with_unit(&result.scale, "1", budgets.map(|[_, scale]| scale)),
        lag_s: result.lag_s.as_ref().map(|lag| with_unit(lag, "s", None)),
        without_earth_rate: result.without_earth_rate,
        quantities: vec![
            QuantityJson::new("bias", "IEEE 528, bias", &result.bias_rad_s, &display.rate),
            QuantityJson::new("scale factor", "IEEE 528, scale factor", &result.scale, &display.one),
        ],
        cycles: result.cycles.iter().map(cycle).collect(),
        warnings: result.is_quiet.then_some(QUIET).into_iter().collect(),
    })
}

/// Schemas of the answers.
pub(crate) fn schemas() -> Vec<(&'static str, Value)> {
    vec![
        ("drift run, drift compute", schema_of::<DriftEntry<'_>>()),
        ("drift advise", schema_of::<AdviceEntry<'_>>()),
        ("drift platform", schema_of::<PlatformEntry<'_>>()),
    ]
}
