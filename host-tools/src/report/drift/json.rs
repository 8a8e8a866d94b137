//! Answers of `stand drift … --json`.

use super::{defect, source, warning};
use crate::drift::error_budget::ErrorContribution;
use crate::drift::estimate::Estimate;
use crate::drift::measurement::SeparatedDrift;
use crate::drift::platform::{PlatformCycle, PlatformResult};
use crate::drift::pulse_advice::PulseAdvice;
use crate::drift::{Cycle, DEG_H, DriftResult};
use crate::report::json::value;
use serde::Serialize;
use serde_json::Value;

const AXES: [&str; 3] = ["x", "y", "z"];

#[derive(Serialize)]
struct EstimateEntry {
    value: f64,
    sigma: Option<f64>,
}

impl EstimateEntry {
    /// The estimate divided by `unit`.
    fn new(estimate: &Estimate, unit: f64) -> Self {
        Self { value: estimate.value / unit, sigma: estimate.sigma.map(|sigma| sigma / unit) }
    }
}

#[derive(Serialize)]
#[serde(untagged)]
enum AxesEntry {
    One(EstimateEntry),
    Three { x: EstimateEntry, y: EstimateEntry, z: EstimateEntry },
}

impl AxesEntry {
    fn new(estimates: &[Estimate]) -> Option<Self> {
        let entry = |estimate| EstimateEntry::new(estimate, DEG_H);
        match estimates {
            [one] => Some(Self::One(entry(one))),
            [x, y, z] => Some(Self::Three { x: entry(x), y: entry(y), z: entry(z) }),
            _ => None,
        }
    }
}

#[derive(Serialize)]
struct AzimuthEntry {
    value: f64,
    sigma: Option<f64>,
    or: Option<f64>,
}

impl AzimuthEntry {
    fn new(found: &SeparatedDrift) -> Option<Self> {
        let azimuth = found.azimuth_rad?;
        let second = found.second_azimuth_rad();
        Some(Self { value: azimuth.value.to_degrees(), sigma: azimuth.sigma.map(f64::to_degrees), or: second.map(f64::to_degrees) })
    }
}

#[derive(Serialize)]
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
            bad: c.defect.as_ref().map(|found| defect(found).to_owned()),
        }
    }
}

#[derive(Serialize)]
struct AxisEntry {
    axis: Option<&'static str>,
    value: f64,
    sigma: Option<f64>,
}

#[derive(Serialize)]
struct ContributionEntry {
    of: &'static str,
    axis: Option<&'static str>,
    own_deg_h: Option<f64>,
    apparent_deg_h: Option<f64>,
    azimuth_arcmin: Option<f64>,
}

#[derive(Serialize)]
struct UncorrectedEntry {
    own_drift_deg_h: Option<AxesEntry>,
    apparent_drift_deg_h: Option<AxesEntry>,
    azimuth_deg: Option<AzimuthEntry>,
}

#[derive(Serialize)]
struct DriftEntry<'a> {
    name: &'a str,
    cycles: Vec<CycleEntry>,
    good: usize,
    bad: usize,
    own_drift_deg_h: Option<AxesEntry>,
    apparent_drift_deg_h: Option<AxesEntry>,
    azimuth_deg: Option<AzimuthEntry>,
    g_drift_deg_h_g: Vec<AxisEntry>,
    latitude_deg: Option<f64>,
    inequality: Vec<AxisEntry>,
    reference_deg_s: Option<f64>,
    uncertainty: Vec<ContributionEntry>,
    uncorrected: UncorrectedEntry,
    warnings: Vec<String>,
}

/// The answer of `stand drift run --json` and `stand drift compute --json`.
pub fn json(result: &DriftResult) -> Value {
    let m = &result.measurement;
    let axis = |k: usize| m.has_three_axes.then(|| AXES[k]);
    let good = m.valid_cycles().len();
    let (corrected, uncorrected) = (&result.corrected, &result.uncorrected);
    let g_dependent = corrected.position_fit.iter().flat_map(|fit| fit.g_dependent.iter().zip(["input", "output", "spin"]));
    let g_dependent = g_dependent.filter_map(|(estimate, axis)| {
        let EstimateEntry { value, sigma } = EstimateEntry::new(estimate.as_ref()?, DEG_H);
        Some(AxisEntry { axis: Some(axis), value, sigma })
    });
    let inequality = corrected.inequality.iter().enumerate();
    let inequality = inequality.map(|(k, found)| AxisEntry { axis: axis(k), value: found.excess.value, sigma: found.excess.sigma });
    let contribution = |k: usize, c: &ErrorContribution| ContributionEntry {
        of: source(c.source),
        axis: axis(k),
        own_deg_h: c.own_rad_s.map(|s| s / DEG_H),
        apparent_deg_h: c.apparent_rad_s.map(|s| s / DEG_H),
        azimuth_arcmin: c.azimuth_rad.map(|s| s.to_degrees() * 60.0),
    };
    let uncertainty = result.budgets.iter().enumerate().flat_map(|(k, budget)| budget.iter().map(move |c| (k, c)));
    value(&DriftEntry {
        name: &m.name,
        cycles: m.cycles.iter().map(|c| CycleEntry::new(c, axis(c.axis))).collect(),
        good,
        bad: m.cycles.len() - good,
        own_drift_deg_h: AxesEntry::new(&corrected.own_rad_s),
        apparent_drift_deg_h: AxesEntry::new(&corrected.apparent_rad_s),
        azimuth_deg: AzimuthEntry::new(corrected),
        g_drift_deg_h_g: g_dependent.collect(),
        latitude_deg: m.latitude_deg,
        inequality: inequality.collect(),
        reference_deg_s: result.reference_rad_s.map(f64::to_degrees),
        uncertainty: uncertainty.map(|(k, c)| contribution(k, c)).collect(),
        uncorrected: UncorrectedEntry {
            own_drift_deg_h: AxesEntry::new(&uncorrected.own_rad_s),
            apparent_drift_deg_h: AxesEntry::new(&uncorrected.apparent_rad_s),
            azimuth_deg: AzimuthEntry::new(uncorrected),
        },
        warnings: m.warnings.iter().map(warning).collect(),
    })
}

#[derive(Serialize)]
struct LineEntry {
    frequency_Hz: f64,
    amplitude_arcsec: f64,
}

#[derive(Serialize)]
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

#[derive(Serialize)]
struct UnitEntry {
    value: f64,
    sigma: Option<f64>,
    unit: &'static str,
}

#[derive(Serialize)]
struct BiasAndScaleEntry {
    bias_rad_s: f64,
    scale: f64,
}

#[derive(Serialize)]
struct PlatformCycleEntry {
    start_s: f64,
    bias_rad_s: f64,
    scale: f64,
    uncorrected: BiasAndScaleEntry,
}

#[derive(Serialize)]
struct PlatformEntry<'a> {
    log: &'a str,
    bias_rad_s: UnitEntry,
    scale: UnitEntry,
    cycles: Vec<PlatformCycleEntry>,
}

/// The answer of `stand drift platform --json`.
pub fn platform_json(log: &str, result: &PlatformResult) -> Value {
    let with_unit = |estimate: Estimate, unit| UnitEntry { value: estimate.value, sigma: estimate.sigma, unit };
    let cycle = |c: &PlatformCycle| PlatformCycleEntry {
        start_s: c.start_s,
        bias_rad_s: c.bias_rad_s,
        scale: c.scale,
        uncorrected: BiasAndScaleEntry { bias_rad_s: c.uncorrected[0], scale: c.uncorrected[1] },
    };
    value(&PlatformEntry {
        log,
        bias_rad_s: with_unit(result.bias_rad_s, "rad/s"),
        scale: with_unit(result.scale, "1"),
        cycles: result.cycles.iter().map(cycle).collect(),
    })
}
