//! Observer results as JSON.

use nalgebra::Complex;
use serde_json::{Value, json};

use super::words::warning;
use crate::observer::bode::{MAX_GAIN_ERROR_DB, MAX_PHASE_ERROR_DEG};
use crate::observer::vibration::{Compensated, Correction};
use crate::observer::{Bode, Design, Plant, SideBySide, Simulated, Trace, Warning};

/// A number, or `null`.
fn number(x: f64) -> Value {
    if x.is_finite() { json!(x) } else { Value::Null }
}

fn numbers(list: &[f64]) -> Value {
    list.iter().map(|x| number(*x)).collect()
}

fn poles(list: &[Complex<f64>]) -> Value {
    list.iter().map(|z| json!({ "re": number(z.re), "im": number(z.im) })).collect()
}

/// A design.
pub fn design_json(design: &Design) -> Value {
    let request = &design.request;
    let integral = design.integral.map(|channel| {
        json!({
            "row": channel.row,
            "gain": number(channel.gain),
            "moment_per_integral": number(channel.moment_per_integral),
            "stable_below": channel.stable_below.map_or(Value::Null, number),
        })
    });
    let discrete = design.discrete.as_ref().map(|d| {
        json!({
            "step_s": d.step_s,
            "gains": numbers(&d.gains),
            "phi": d.phi.iter().map(|row| numbers(row)).collect::<Value>(),
            "gamma": numbers(&d.gamma),
            "last_state": if d.has_disturbance { json!("moment_N_m") } else { Value::Null },
        })
    });
    json!({
        "model": request.plant.name,
        "states": request.plant.states(),
        "kind": request.kind.name(),
        "poles": poles(&design.poles),
        "gains": numbers(&design.gains),
        "integral": integral,
        "discrete": discrete,
        "observability": { "rank": design.rank, "condition": number(design.condition) },
        "warnings": design.warnings().iter().map(warning).collect::<Vec<_>>(),
    })
}

/// A static and an astatic observer side by side.
pub fn simulate_json(beside: &SideBySide<'_>) -> Value {
    let of = |design: &Design, run: &Simulated| {
        let rows = |trace: &Trace| {
            // About a hundred rows; the plot of the page has all.
            let every = trace.t_s.len().div_ceil(100).max(1);
            json!({
                "t_s": numbers(&trace.t_s.iter().copied().step_by(every).collect::<Vec<_>>()),
                "angle_error_rad": numbers(&trace.errors.iter().step_by(every).map(|e| e[0]).collect::<Vec<_>>()),
                "rate_error_rad_s": numbers(&trace.errors.iter().step_by(every).map(|e| e[1]).collect::<Vec<_>>()),
                "moment_N_m": numbers(&trace.moment_N_m.iter().copied().step_by(every).collect::<Vec<_>>()),
            })
        };
        json!({
            "kind": design.request.kind.name(),
            "settled_s": run.settled_s,
            "rate_settled_s": run.rate_settled_s,
            "greatest_angle_error_rad": number(run.largest[0]),
            "greatest_rate_error_rad_s": number(run.largest[1]),
            "rest": numbers(&run.steady),
            "moment_N_m": run.both.moment_N_m.last().map_or(Value::Null, |m| number(*m)),
            "closed_loop_rest_rad": run.closed_loop_steady_rad.map_or(Value::Null, number),
            "with_initial_error": rows(&run.both),
            "moment_only": rows(&run.moment_only),
        })
    };
    let [one, other] = beside.designs;
    json!({
        "model": one.request.plant.name,
        "angle_rad": beside.disturbed.angle_rad,
        "disturbance_N_m": beside.disturbed.moment_N_m,
        "static": of(one, beside.runs[0]),
        "astatic": of(other, beside.runs[1]),
    })
}

/// Frequency responses of several observers.
pub fn bode_json(plant: &Plant, bodes: &[Bode], vibration_Hz: Option<f64>) -> Value {
    let one = |bode: &Bode| {
        let at = vibration_Hz.map(|f| bode.ratio(std::f64::consts::TAU * f));
        json!({
            "omega_rad_s": bode.omega_rad_s,
            "gains": numbers(&bode.gains),
            "distorted_from_rad_s": bode.limit.rad_s,
            "distorted_from_the_start": bode.limit.at_lowest_frequency,
            "noise_gain_1_s": number(bode.noise.0),
            "noise_at_rad_s": number(bode.noise.1),
            "at_vibration": at.map(|r| json!({ "gain_dB": number(20.0 * r.norm().log10()), "phase_deg": number(r.arg().to_degrees()) })),
        })
    };
    json!({
        "model": plant.name,
        "fastest_mode_rad_s": number(plant.fastest_rad_s()),
        "limits": { "dB": MAX_GAIN_ERROR_DB, "deg": MAX_PHASE_ERROR_DEG },
        "observers": bodes.iter().map(one).collect::<Vec<_>>(),
    })
}

/// A corrected azimuth.
pub fn vibration_json(found: &Compensated, warnings: &[Warning]) -> Value {
    let correction = |c: &Correction| {
        let share = |rad: f64| number(100.0 * rad / found.alpha_rad);
        json!({
            "rate_rad": number(c.rate_rad),
            "with_inertia_rad": number(c.with_inertia_rad),
            "corrected_rad": number(found.alpha_rad - c.with_inertia_rad),
            "removed_by_rate_percent": share(c.rate_rad),
            "removed_with_inertia_percent": share(c.with_inertia_rad),
        })
    };
    json!({
        "vibration_Hz": number(found.vibration_Hz),
        "periods": found.periods,
        "alpha_rad": number(found.alpha_rad),
        "estimated": correction(&found.estimated),
        "exact": found.exact.as_ref().map(correction),
        "warnings": warnings.iter().map(warning).collect::<Vec<_>>(),
    })
}
