//! Results of the drift measurement for a terminal.

use super::display::{Display, OWN_DRIFT_NAMES};
use super::words::{QUIET, defect, warning};
use crate::uncertainty::{FOOTNOTE, estimate};
use crate::units::Units;
use crate::{plain, significant};
use stand_analysis::drift::measurement::{AzimuthLimit, SeparatedDrift};
use stand_analysis::drift::platform::PlatformResult;
use stand_analysis::drift::pulse_advice::PulseAdvice;
use stand_analysis::drift::{DEG_H, DriftResult, Measurement};

/// Names of the axes behind a quantity.
pub(super) fn axis_names(found: &SeparatedDrift) -> &'static [&'static str] {
    if found.own_rad_s.len() == 3 { &[" x", " y", " z"] } else { &[""] }
}

/// Own drift, apparent drift, azimuth and further results.
pub(super) fn drift_lines(found: &SeparatedDrift, display: &Display) -> Vec<String> {
    let axes = axis_names(found);
    let mut lines = Vec::new();
    for (axis, own) in axes.iter().zip(&found.own_rad_s) {
        lines.push(format!("own drift{axis} {}", estimate(own, &display.rate)));
    }
    for (axis, apparent) in axes.iter().zip(&found.apparent_rad_s) {
        lines.push(format!("apparent drift{axis} {}", estimate(apparent, &display.rate)));
    }
    match &found.azimuth_rad {
        Some(azimuth) => {
            let second = found.second_azimuth_rad();
            let second = second.map(|second| format!(", or {}: positions 0,90,180,270 decide", plain(second.to_degrees(), 5)));
            lines.push(format!("azimuth {}{}", estimate(azimuth, &display.angle), second.unwrap_or_default()));
        }
        None if found.azimuth_limit.is_some() => lines.extend(found.azimuth_limit.map(|limit| azimuth_limit(&limit))),
        None => lines.push("azimuth not determined: needs the latitude, and an apparent drift below the horizontal Earth rate".to_owned()),
    }
    for (axis, inequality) in axes.iter().zip(&found.inequality) {
        lines.push(format!("by two amplitudes, corrected: negative pulses{axis} stronger by {}", estimate(inequality, &display.percent)));
    }
    if let Some(fit) = &found.position_fit {
        for (found, axis) in fit.g_dependent.iter().zip(["sensitive", "output", "spin"]) {
            lines.extend(found.as_ref().map(|found| format!("drift by g along the {axis} axis {}", estimate(found, &display.per_g))));
        }
    }
    lines
}

/// An azimuth near the meridian.
fn azimuth_limit(limit: &AzimuthLimit) -> String {
    let within = significant(limit.within_rad.to_degrees(), 2);
    let size = if limit.near_rad == 0.0 { format!("|A| < {within}°") } else { format!("|A − 180°| < {within}°") };
    format!("azimuth {size} (95 %): the apparent drift exceeds the horizontal Earth rate by less than its uncertainty")
}

/// The cycles that are not used, with the reason.
pub(super) fn defect_lines(measurement: &Measurement) -> Vec<String> {
    let defective = measurement.cycles.iter().filter_map(|cycle| cycle.defect.as_ref().map(|found| (cycle, defect(found))));
    defective.map(|(cycle, defect)| format!("cycle {} at {} s is not used: {defect}", cycle.number, plain(cycle.start_s, 5))).collect()
}

/// The result of a measurement.
pub fn text(result: &DriftResult, units: Units) -> String {
    let display = Display::new(units);
    let m = &result.measurement;
    let valid = m.valid_cycles();
    let pulse_s = valid.first().map_or(0.0, |cycle| cycle.integral.pulse_s);
    let mut out = format!("{}: {} of {} cycles used, pulses of {} s\n", m.name, valid.len(), m.cycles.len(), plain(pulse_s, 5));
    for line in drift_lines(&result.corrected, &display) {
        out += &format!("  {line}\n");
    }
    for (axis, movement) in axis_names(&result.corrected).iter().zip(&result.corrected.movement) {
        if let Some(trend) = movement.trend {
            out += &format!("  trend of the drift{axis} {}\n", estimate(&trend, &display.ramp));
        }
    }
    if let Some(rate_rad_s) = result.reference_rad_s {
        out += &format!("  torquer rate by the unswitched sums {} °/s\n", significant(rate_rad_s.to_degrees(), 5));
    }
    if result.corrected.own_rad_s.iter().all(|own| own.uncertainty.is_none()) {
        out += "  no uncertainty: needs more cycles than own and apparent drift, lag, trend and unequal pulses together\n";
    }
    out += &format!("  {OWN_DRIFT_NAMES}\n  {FOOTNOTE}\n");
    out += "without corrections:\n";
    for line in drift_lines(&result.uncorrected, &display) {
        out += &format!("  {line}\n");
    }
    for line in defect_lines(m).into_iter().chain(result.warnings.iter().map(warning)) {
        out += &format!("{line}\n");
    }
    out
}

/// Advice on the pulse duration.
pub fn advice_text(log: &str, advice: &PulseAdvice) -> String {
    let mut out = String::new();
    let pulse_s = plain(advice.pulse_s, 5);
    if advice.period_s > 0.0 {
        let [error, wanted_error] = advice.line_error_rad_s.map(|rad_s| significant(rad_s / DEG_H, 3));
        out += &format!("{log}: pulses of {pulse_s} s, {} periods of {} s\n", advice.periods, plain(advice.period_s, 5));
        out += &format!("  greatest error of a cycle by all lines: {error} °/h; with the wanted duration {wanted_error} °/h\n");
    } else {
        out += &format!("{log}: no line exceeds the noise; pulses of {pulse_s} s are suitable\n");
    }
    out += &format!("  standard deviation of a cycle by noise: {} °/h\n", significant(advice.noise_rad_s / DEG_H, 3));
    for line in &advice.lines {
        out += &format!("  line at {} Hz, amplitude {}″\n", significant(line.frequency_Hz, 4), significant(line.amplitude_rad / DEG_H, 3));
    }
    out
}

/// Bias, scale and lag of a rate gyro on the platform.
pub fn platform_text(log: &str, result: &PlatformResult, units: Units) -> String {
    let display = Display::for_platform(units);
    let valid = result.cycles.iter().filter(|cycle| cycle.defect.is_none()).count();
    let mut out = format!("{log}: {valid} of {} cycles used, pulses of {} s\n", result.cycles.len(), plain(result.pulse_s, 4));
    let earth = if result.without_earth_rate {
        ", without the Earth rate"
    } else {
        ", with the Earth rate along the axis (--latitude subtracts it)"
    };
    out += &format!("  bias  {}{earth}\n", estimate(&result.bias_rad_s, &display.rate));
    out += &format!("  scale {}\n", estimate(&result.scale, &display.one));
    if let Some(lag) = &result.lag_s {
        out += &format!("  lag   {}\n", estimate(lag, &display.milliseconds));
    }
    if result.budgets.is_none() {
        out += "  no uncertainty: needs more cycles than bias, lag and trend together\n";
    }
    if result.is_quiet {
        out += &format!("  {QUIET}\n");
    }
    for cycle in result.cycles.iter().filter(|cycle| cycle.defect.is_some()) {
        let reason = cycle.defect.as_ref().map(defect).unwrap_or_default();
        out += &format!("  cycle at {} s is not used: {reason}\n", plain(cycle.start_s, 5));
    }
    out + &format!("  {FOOTNOTE}\n")
}
