//! What was designed, simulated or found, in words for a terminal and as JSON (interfaces.md, "Answers").

use nalgebra::Complex;
use serde_json::{Value, json};

use super::bode::{MOST_DB, MOST_DEG};
use super::vibration::Compensated;
use super::{Bode, Design, Disturbed, Plant, Simulated};
use crate::report::{digits, plain};

/// A number, or `null`.
pub(super) fn number(x: f64) -> Value {
    if x.is_finite() { json!(x) } else { Value::Null }
}

fn numbers(list: &[f64]) -> Value {
    list.iter().map(|x| number(*x)).collect()
}

fn poles(list: &[Complex<f64>]) -> Value {
    list.iter().map(|z| json!({ "re": number(z.re), "im": number(z.im) })).collect()
}

/// The design as JSON.
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
        "warnings": design.warnings(),
    })
}

/// The design in words.
pub fn design_text(design: &Design) -> String {
    let request = &design.request;
    let mut text = format!("{}: {} observer of {} states\n", request.plant.name, request.kind.name(), design.gains.len());
    text += &format!("observability: rank {} of {}, condition {}\n", design.rank, design.gains.len(), digits(design.condition));
    text += &format!("poles, 1/s: {}\n\n", pole_words(&design.poles));
    text += "      gain             of\n";
    for (k, (gain, state)) in design.gains.iter().zip(request.plant.states()).enumerate() {
        text += &format!("  k{}  {gain:>16.9e}  {state}\n", k + 1);
    }
    if let Some(channel) = design.integral {
        text += &format!("\nintegral channel: row {}, gain {:.9e}", channel.row, channel.gain);
        if let Some(most) = channel.stable_below {
            text += &format!(" (stable: 0 < gain < {most:.4e})");
        }
        text += &format!("\n  estimated moment = {:.9e} N m × integral of the angle's error, rad s\n", channel.moment_per_integral);
    }
    if let Some(d) = &design.discrete {
        text += &format!("\nexact discrete form at {} s: x̂[n+1] = Φ x̂[n] + Γ M[n] + K (y[n] − x̂₁[n])\n", d.step_s);
        for (k, (gain, gamma)) in d.gains.iter().zip(&d.gamma).enumerate() {
            text += &format!("  K{} {gain:>16.9e}   Γ{} {gamma:>16.9e}\n", k + 1, k + 1);
        }
        if d.has_disturbance {
            text += "  the last state is the estimated moment, N m\n";
        }
    }
    for warning in design.warnings() {
        text += &format!("\nbeware: {warning}\n");
    }
    text
}

/// Poles, equal ones once.
pub(crate) fn pole_words(poles: &[Complex<f64>]) -> String {
    let mut words: Vec<String> = Vec::new();
    let mut k = 0;
    while let Some(pole) = poles.get(k) {
        let count = poles[k..].iter().take_while(|z| *z == pole).count();
        let one = if pole.im.abs() < 1e-9 * pole.norm() {
            digits(pole.re)
        } else {
            format!("{} {} {}i", digits(pole.re), if pole.im < 0.0 { "−" } else { "+" }, digits(pole.im.abs()))
        };
        words.push(if count > 1 { format!("{one} ({count} times)") } else { one });
        k += count;
    }
    words.join(", ")
}

/// A static observer beside an astatic one.
pub struct Beside<'a> {
    /// The two designs.
    pub designs: [&'a Design; 2],
    /// What they did.
    pub runs: [&'a Simulated; 2],
    /// What was done to them.
    pub disturbed: Disturbed,
}

/// The two as JSON.
pub fn simulate_json(beside: &Beside<'_>) -> Value {
    let of = |design: &Design, run: &Simulated| {
        let rows = |trace: &super::Trace| {
            // A hundred rows are enough for a reader; the plot has all.
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
            "greatest_angle_error_rad": number(run.greatest[0]),
            "greatest_rate_error_rad_s": number(run.greatest[1]),
            "rest": numbers(&run.rest),
            "moment_N_m": run.both.moment_N_m.last().map_or(Value::Null, |m| number(*m)),
            "closed_loop_rest_rad": run.closed_rest_rad.map_or(Value::Null, number),
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

/// The two in words.
pub fn simulate_text(beside: &Beside<'_>) -> String {
    let [one, other] = beside.designs;
    let [a, b] = beside.runs;
    let mut text = format!(
        "{}: first error {} rad, moment {} N m from t = 0\n\n{:34}{:>16}{:>16}\n",
        one.request.plant.name,
        digits(beside.disturbed.angle_rad),
        digits(beside.disturbed.moment_N_m),
        "",
        one.request.kind.name(),
        other.request.kind.name()
    );
    let time = |t: Option<f64>| t.map_or("not yet".to_owned(), |t| plain(t, 4));
    for (name, x, y) in
        [("angle within 1 % after, s", a.settled_s, b.settled_s), ("rate within 1 % of its peak, s", a.rate_settled_s, b.rate_settled_s)]
    {
        text += &format!("{name:34}{:>16}{:>16}\n", time(x), time(y));
    }
    let mut row = |name: &str, x: f64, y: f64| text += &format!("{name:34}{:>16}{:>16}\n", cell(x), cell(y));
    row("greatest error of angle, rad", a.greatest[0], b.greatest[0]);
    row("greatest error of rate, rad/s", a.greatest[1], b.greatest[1]);
    row("offset of angle at the end, rad", a.rest[0], b.rest[0]);
    row("offset of rate at the end, rad/s", a.rest[1], b.rest[1]);
    row("offset of tilt rate, rad/s", a.rest[3], b.rest[3]);
    let last = |run: &Simulated| run.both.moment_N_m.last().copied().unwrap_or(f64::NAN);
    row("estimated moment at the end, N m", last(a), last(b));
    let rest = |run: &Simulated| run.closed_rest_rad.unwrap_or(f64::NAN);
    row("closed loop: angle at the end, rad", rest(a), rest(b));
    text
}

fn cell(x: f64) -> String {
    // What is left of nothing is rounding.
    if x.abs() < 1e-18 {
        "0".to_owned()
    } else if x.is_finite() {
        format!("{x:.4e}")
    } else {
        "not yet".to_owned()
    }
}

/// Several observers over frequency, as JSON.
pub fn bode_json(plant: &Plant, bodes: &[Bode], vibration_Hz: Option<f64>) -> Value {
    let one = |bode: &Bode| {
        let at = vibration_Hz.map(|f| bode.ratio(std::f64::consts::TAU * f));
        json!({
            "omega_rad_s": bode.omega_rad_s,
            "gains": numbers(&bode.gains),
            "distorted_from_rad_s": bode.limit.rad_s,
            "distorted_from_the_start": bode.limit.from_the_start,
            "noise_gain_1_s": number(bode.noise.0),
            "noise_at_rad_s": number(bode.noise.1),
            "at_vibration": at.map(|r| json!({ "gain_dB": number(20.0 * r.norm().log10()), "phase_deg": number(r.arg().to_degrees()) })),
        })
    };
    json!({
        "model": plant.name,
        "fastest_mode_rad_s": number(plant.fastest_rad_s()),
        "limits": { "dB": MOST_DB, "deg": MOST_DEG },
        "observers": bodes.iter().map(one).collect::<Vec<_>>(),
    })
}

/// The same in words.
pub fn bode_text(plant: &Plant, bodes: &[Bode], vibration_Hz: Option<f64>) -> String {
    let mut text = format!(
        "{}: fastest mode {} rad/s; distorted: beyond ± {MOST_DB} dB or ± {MOST_DEG}°\n\n   poles, 1/s   distorted from, rad/s   noise gain, 1/s   at, rad/s\n",
        plant.name,
        digits(plant.fastest_rad_s())
    );
    for bode in bodes {
        let from = match (bode.limit.rad_s, bode.limit.from_the_start) {
            (None, _) => "nowhere".to_owned(),
            (Some(_), true) => "the start".to_owned(),
            (Some(w), false) => format!("{w:.4}"),
        };
        text += &format!("  {:>11}   {from:>21}   {:>15.5e}   {:>9.4}\n", digits(bode.omega_rad_s), bode.noise.0, bode.noise.1);
    }
    if let Some(f) = vibration_Hz {
        text += &format!("\nat the vibration of {} Hz:\n", digits(f));
        for bode in bodes {
            let r = bode.ratio(std::f64::consts::TAU * f);
            text += &format!("  {:>11}   {:+.3} dB, {:+.2}°\n", digits(bode.omega_rad_s), 20.0 * r.norm().log10(), r.arg().to_degrees());
        }
    }
    text
}

/// A corrected azimuth as JSON.
pub fn vibration_json(found: &Compensated, warnings: &[String]) -> Value {
    let correction = |c: &super::vibration::Correction| {
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
        "warnings": warnings,
    })
}

/// The same in words.
pub fn vibration_text(found: &Compensated, warnings: &[String]) -> String {
    let mut text = format!(
        "vibration of {:.4} Hz, {} whole periods: mean azimuth {:.6e} rad ({:.2}″)\n\n{:28}{:>14}{:>14}{:>16}\n",
        found.vibration_Hz,
        found.periods,
        found.alpha_rad,
        found.alpha_rad.to_degrees() * 3600.0,
        "correction",
        "rad",
        "takes off, %",
        "leaves, ″"
    );
    let mut row = |name: &str, rad: f64| {
        let left = (found.alpha_rad - rad).to_degrees() * 3600.0;
        text += &format!("{name:28}{rad:>14.5e}{:>14.2}{left:>16.3}\n", 100.0 * rad / found.alpha_rad);
    };
    row("estimated α′", found.estimated.rate_rad);
    row("estimated, with (Jx − Jz)", found.estimated.with_inertia_rad);
    if let Some(exact) = &found.exact {
        row("exact α′", exact.rate_rad);
        row("exact, with (Jx − Jz)", exact.with_inertia_rad);
    }
    for warning in warnings {
        text += &format!("\nbeware: {warning}\n");
    }
    text
}
