//! Bandwidth, damping and delay by lock-in against the encoder: sines, or a chirp in pieces.
//!
//! A nonlinear device has another slope at each mean rate and amplitude, and the platform has others at each frequency. The output is
//! therefore linearised by the static characteristic first, so that the responses differ by the dynamics alone. The linearisation holds
//! within the full scale of the characteristic: a step whose rates go beyond it is left out with a remark.

use super::characteristic::Characteristic;
use super::influences::{clock, misalignment, misalignment_factor};
use super::{GyroSettings, dut_output};
use crate::calibrate::chirp::along_chirp;
use crate::calibrate::lock_in::{Response, lock_in};
use crate::calibrate::response::{Structure, Transfer, transfer};
use crate::calibrate::{AbsenceReason, Basis, Curve, CurveKind, Findings, FrequencyPoint, Meaning, Remark, Step};
use crate::calibrate::{Contribution, Quantity};
use identification::log::Log;
use identification::statistics::Extremes;
use identification::statistics::uncertainty::{COVERAGE_PROBABILITY, coverage_factor};

/// Step of the time stamp of the device under test, s (ISM330DHCX: DS13012, 25 µs). The board's time is compared with a time stamp that is
/// rounded down; where the chip's oscillator advances by whole steps between such comparisons, the samples of a whole measurement are late
/// by the same part of a step. Along a chirp this is a delay.
const TIME_STAMP_STEP_S: f64 = 25e-6;

/// Coherence below which a response is left out.
const MIN_COHERENCE: f64 = 0.02;

fn note(log: &Log, key: &str) -> Option<f64> {
    log.notes().number(key)
}

/// Rate beyond which a step leaves the full scale of the characteristic, over full scale.
const FULL_SCALE_TOLERANCE: f64 = 1.02;
/// Rows over which the greatest rate of a step is a mean.
const RATE_ROWS: usize = 10;

/// Greatest rate of the platform in these rows, rad/s.
fn greatest_rate(t_s: &[f64], theta: &[f64]) -> f64 {
    let rates = (RATE_ROWS..t_s.len()).map(|k| (theta[k] - theta[k - RATE_ROWS]) / (t_s[k] - t_s[k - RATE_ROWS]));
    rates.max_abs()
}

/// Responses of the linearised output in all steps with a sine or a chirp, by frequency, and remarks on the steps that are left out.
fn responses(steps: &[&Step], found: &Characteristic, settings: &GyroSettings) -> (Vec<Response>, Vec<Remark>) {
    let (mut responses, mut remarks) = (Vec::new(), Vec::new());
    for step in steps {
        let log = &step.log;
        let profile = log.note("profile");
        let (Some(output), Some(theta)) = (dut_output(log, settings), log.column("theta_rad")) else { continue };
        if !matches!(profile, Some("sine" | "chirp")) {
            continue;
        }
        // The age is that of the device under test; the rate sensor of the stand is read at the row.
        let age = log.column("sensor_age_s").filter(|_| settings.column != "omega_rad_s");
        let from = log.t_s().partition_point(|t| *t < log.t_s()[0] + settings.settle_s);
        let t_s = &log.t_s()[from..];
        let greatest_rad_s = greatest_rate(t_s, &theta[from..]);
        if greatest_rad_s > FULL_SCALE_TOLERANCE * found.full_scale_rad_s {
            let full_scale_rad_s = found.full_scale_rad_s;
            remarks.push(Remark::BeyondFullScale { step: step.name.clone(), greatest_rad_s, full_scale_rad_s });
            continue;
        }
        let linear: Vec<f64> = output.iter().map(|y| found.rate_of(*y)).collect();
        if profile == Some("chirp") {
            responses.extend(along_chirp(log, theta, &linear, age));
        } else if let Some(frequency_Hz) = note(log, "profile_frequency_Hz") {
            let response = lock_in(t_s, &theta[from..], &linear[from..], age.map(|a| &a[from..]), frequency_Hz);
            let timing_s = age.map_or(0.0, |_| TIME_STAMP_STEP_S / 12_f64.sqrt());
            responses.extend(response.map(|r| Response { timing_s, ..r }));
        }
    }
    responses.retain(|r| r.coherence > MIN_COHERENCE);
    responses.sort_by(|a, b| a.frequency_Hz.total_cmp(&b.frequency_Hz));
    (responses, remarks)
}

/// Adds bandwidth, delay, damping and dynamic scale.
pub(super) fn add(steps: &[&Step], characteristic: &Characteristic, settings: &GyroSettings, findings: &mut Findings) {
    let (found, remarks) = responses(steps, characteristic, settings);
    findings.remarks.extend(remarks);
    let assumed = &settings.assumptions;
    let known_filter = |s: &&Step| note(&s.log, "sensor_filter_Hz").filter(|_| settings.column != "omega_rad_s");
    let filter_Hz = steps.iter().find_map(known_filter);
    let Some(h) = transfer(&found, filter_Hz) else {
        return findings.add_absent("bandwidth_Hz", AbsenceReason::NeedsSinesOrChirp);
    };
    let scatter = |u: f64| Contribution::type_a("noise", u, h.dof, Basis::Responses { count: found.len(), ratio: h.ratio });
    let highest_Hz = found.last().map_or(0.0, |r| r.frequency_Hz);
    match (h.bandwidth_Hz(), filter_Hz) {
        // A known low-pass is an assumption, not a measurement.
        (Some(_), Some(filter_Hz)) if h.structure() == Structure::DelayOnly => {
            findings.add_absent("bandwidth_Hz", AbsenceReason::OnlyKnownFilter { highest_Hz, filter_Hz });
        }
        (Some((value, u)), _) => {
            let q = Quantity::new("bandwidth_Hz", "Hz", value, vec![scatter(u), clock(assumed, value)]);
            let extrapolated_beyond_Hz = (value > highest_Hz).then_some(highest_Hz);
            findings.quantities.push(q.meaning(Meaning::Bandwidth { structure: h.structure(), extrapolated_beyond_Hz }));
        }
        (None, _) => findings.add_absent("bandwidth_Hz", AbsenceReason::NoFallBy3dB { highest_Hz }),
    }
    let (delay, u) = h.delay_s();
    let mut contributions = vec![scatter(u)];
    if filter_Hz.is_some() {
        contributions.push(Contribution::rectangular("time stamp", TIME_STAMP_STEP_S, "s", 1.0, Basis::TimeStampStep));
    }
    findings.quantities.push(Quantity::new("delay_s", "s", delay, contributions).meaning(Meaning::Delay { known_filter_Hz: filter_Hz }));
    if let Some((zeta, u)) = h.damping() {
        findings
            .quantities
            .push(Quantity::new("damping", "1", zeta, vec![scatter(u)]).meaning(Meaning::Damping { known_filter_Hz: filter_Hz }));
    }
    let Some(lowest) = found.first() else { return };
    findings.quantities.push(dynamic_scale(&h, lowest, characteristic, &scatter, settings));
    findings.frequency_response = found.iter().map(|r| frequency_point(r, &h, characteristic)).collect();
    findings.curves.extend(curves(&found, &h));
}

/// Slope towards frequency zero at the mean rate and amplitude of the lowest frequency.
fn dynamic_scale(
    h: &Transfer,
    lowest: &Response,
    characteristic: &Characteristic,
    scatter: &impl Fn(f64) -> Contribution,
    settings: &GyroSettings,
) -> Quantity {
    let assumed = &settings.assumptions;
    let (mean_rad_s, amplitude_rad_s) = (lowest.mean_rad_s, lowest.rate_rad_s);
    let (slope, gradient) = characteristic.slope_at(mean_rad_s, amplitude_rad_s);
    let (ratio, u) = h.scale();
    let factor = misalignment_factor(assumed);
    let value = slope * ratio * factor;
    let (_, of_slope) = characteristic.combination(&gradient);
    let mut contributions = vec![scatter(u * (slope * factor).abs())];
    contributions.extend(of_slope.into_iter().map(|c| Contribution { source: format!("static {}", c.source), ..c.scaled(ratio * factor) }));
    contributions.extend([clock(assumed, value), misalignment(assumed, -value)]);
    Quantity::new("scale_dynamic", "1", value, contributions).meaning(Meaning::DynamicScale { mean_rad_s, amplitude_rad_s })
}

/// Gain and phase at one frequency with their expanded uncertainties (ISO 16063-15). The gain is that of the output over the rate at the
/// mean rate and amplitude of the step.
fn frequency_point(r: &Response, h: &Transfer, characteristic: &Characteristic) -> FrequencyPoint {
    let (slope, _) = characteristic.slope_at(r.mean_rad_s, r.rate_rad_s);
    let [u, u_across] = [r.sigma, r.sigma_across()].map(|u| u * h.ratio.max(1.0));
    let k = coverage_factor(h.dof, COVERAGE_PROBABILITY);
    FrequencyPoint {
        frequency_Hz: r.frequency_Hz,
        mean_rad_s: r.mean_rad_s,
        amplitude_rad_s: r.rate_rad_s,
        gain: r.gain() * slope,
        gain_U: k * u * slope.abs(),
        phase_deg: r.phase_rad().to_degrees(),
        phase_U_deg: (k * u_across / r.gain()).to_degrees(),
    }
}

fn curves(found: &[Response], h: &Transfer) -> [Curve; 3] {
    let (low, high) = (found.first().map_or(1.0, |r| r.frequency_Hz), found.last().map_or(1.0, |r| r.frequency_Hz));
    let grid: Vec<f64> = (0..=100).map(|k| low * (high / low).powf(f64::from(k) / 100.0)).collect();
    [
        Curve::new(
            CurveKind::Gain,
            found.iter().map(|r| (r.frequency_Hz, r.gain())).collect(),
            grid.iter().map(|f| (*f, h.at(*f).norm())).collect(),
        ),
        Curve::new(
            CurveKind::Phase,
            found.iter().map(|r| (r.frequency_Hz, r.phase_rad().to_degrees())).collect(),
            grid.iter().map(|f| (*f, h.at(*f).arg().to_degrees())).collect(),
        ),
        Curve::new(CurveKind::Coherence, found.iter().map(|r| (r.frequency_Hz, r.coherence)).collect(), Vec::new()),
    ]
}
