//! Observer results as text for a terminal.

use super::words::{pole_list, warning};
use crate::observer::bode::{MAX_GAIN_ERROR_DB, MAX_PHASE_ERROR_DEG};
use crate::observer::vibration::Compensated;
use crate::observer::{Bode, Design, Plant, SideBySide, Simulated, Warning};
use crate::report::{digits, plain};

/// A design.
pub fn design_text(design: &Design) -> String {
    let request = &design.request;
    let mut text = format!("{}: {} observer of {} states\n", request.plant.name, request.kind.name(), design.gains.len());
    text += &format!("observability: rank {} of {}, condition {}\n", design.rank, design.gains.len(), digits(design.condition));
    text += &format!("poles, 1/s: {}\n\n", pole_list(&design.poles));
    text += "      gain             state\n";
    for (k, (gain, state)) in design.gains.iter().zip(request.plant.states()).enumerate() {
        text += &format!("  k{}  {gain:>16.9e}  {state}\n", k + 1);
    }
    if let Some(channel) = design.integral {
        text += &format!("\nintegral channel: row {}, gain {:.9e}", channel.row, channel.gain);
        if let Some(most) = channel.stable_below {
            text += &format!(" (stable: 0 < gain < {most:.4e})");
        }
        text += &format!("\n  estimated moment = {:.9e} N m × integral of the angle error, rad s\n", channel.moment_per_integral);
    }
    if let Some(d) = &design.discrete {
        text += &format!("\nexact discrete form at {} s: x̂[n+1] = Φ x̂[n] + Γ M[n] + K (y[n] − x̂₁[n])\n", d.step_s);
        for (k, (gain, gamma)) in d.gains.iter().zip(&d.gamma).enumerate() {
            text += &format!("  K{} {gain:>16.9e}   Γ{} {gamma:>16.9e}\n", k + 1, k + 1);
        }
        if d.has_disturbance {
            text += "  The last state is the estimated moment, N m.\n";
        }
    }
    for found in design.warnings() {
        text += &format!("\nWarning: {}\n", warning(&found));
    }
    text
}

/// A static and an astatic observer side by side.
pub fn simulate_text(beside: &SideBySide<'_>) -> String {
    let [one, other] = beside.designs;
    let [a, b] = beside.runs;
    let mut text = format!(
        "{}: initial angle error {} rad, moment {} N m from t = 0\n\n{:34}{:>16}{:>16}\n",
        one.request.plant.name,
        digits(beside.disturbed.angle_rad),
        digits(beside.disturbed.moment_N_m),
        "",
        one.request.kind.name(),
        other.request.kind.name()
    );
    let time = |t: Option<f64>| t.map_or("not reached".to_owned(), |t| plain(t, 4));
    for (name, x, y) in [
        ("angle error below 1 % after, s", a.settled_s, b.settled_s),
        ("rate error below 1 % of peak, s", a.rate_settled_s, b.rate_settled_s),
    ] {
        text += &format!("{name:34}{:>16}{:>16}\n", time(x), time(y));
    }
    let mut row = |name: &str, x: f64, y: f64| text += &format!("{name:34}{:>16}{:>16}\n", cell(x), cell(y));
    row("largest angle error, rad", a.largest[0], b.largest[0]);
    row("largest rate error, rad/s", a.largest[1], b.largest[1]);
    row("steady angle error, rad", a.steady[0], b.steady[0]);
    row("steady rate error, rad/s", a.steady[1], b.steady[1]);
    row("steady tilt-rate error, rad/s", a.steady[3], b.steady[3]);
    let last = |run: &Simulated| run.both.moment_N_m.last().copied().unwrap_or(f64::NAN);
    row("estimated moment at the end, N m", last(a), last(b));
    let closed = |run: &Simulated| run.closed_loop_steady_rad.unwrap_or(f64::NAN);
    row("closed loop: steady angle, rad", closed(a), closed(b));
    text
}

fn cell(x: f64) -> String {
    // Below this size only rounding remains.
    if x.abs() < 1e-18 {
        "0".to_owned()
    } else if x.is_finite() {
        format!("{x:.4e}")
    } else {
        "not reached".to_owned()
    }
}

/// Frequency responses of several observers.
pub fn bode_text(plant: &Plant, bodes: &[Bode], vibration_Hz: Option<f64>) -> String {
    let mut text = format!(
        "{}: fastest mode {} rad/s; distorted means a rate error beyond ± {MAX_GAIN_ERROR_DB} dB or ± {MAX_PHASE_ERROR_DEG}°\n\n   poles, 1/s   distorted from, rad/s   noise gain, 1/s   at, rad/s\n",
        plant.name,
        digits(plant.fastest_rad_s())
    );
    for bode in bodes {
        let from = match (bode.limit.rad_s, bode.limit.at_lowest_frequency) {
            (None, _) => "nowhere".to_owned(),
            (Some(_), true) => "lowest frequency".to_owned(),
            (Some(w), false) => format!("{w:.4}"),
        };
        text += &format!("  {:>11}   {from:>21}   {:>15.5e}   {:>9.4}\n", digits(bode.omega_rad_s), bode.noise.0, bode.noise.1);
    }
    if let Some(f) = vibration_Hz {
        text += &format!("\nAt the vibration frequency of {} Hz:\n", digits(f));
        for bode in bodes {
            let r = bode.ratio(std::f64::consts::TAU * f);
            text += &format!("  {:>11}   {:+.3} dB, {:+.2}°\n", digits(bode.omega_rad_s), 20.0 * r.norm().log10(), r.arg().to_degrees());
        }
    }
    text
}

/// A corrected azimuth.
pub fn vibration_text(compensated: &Compensated, warnings: &[Warning]) -> String {
    let mut text = format!(
        "Vibration of {:.4} Hz, {} whole periods: mean azimuth {:.6e} rad ({:.2}″)\n\n{:28}{:>14}{:>14}{:>16}\n",
        compensated.vibration_Hz,
        compensated.periods,
        compensated.alpha_rad,
        compensated.alpha_rad.to_degrees() * 3600.0,
        "correction",
        "rad",
        "removed, %",
        "remaining, ″"
    );
    let mut row = |name: &str, rad: f64| {
        let left = (compensated.alpha_rad - rad).to_degrees() * 3600.0;
        text += &format!("{name:28}{rad:>14.5e}{:>14.2}{left:>16.3}\n", 100.0 * rad / compensated.alpha_rad);
    };
    row("estimated α′", compensated.estimated.rate_rad);
    row("estimated, with (Jx − Jz)", compensated.estimated.with_inertia_rad);
    if let Some(exact) = &compensated.exact {
        row("exact α′", exact.rate_rad);
        row("exact, with (Jx − Jz)", exact.with_inertia_rad);
    }
    for found in warnings {
        text += &format!("\nWarning: {}\n", warning(found));
    }
    text
}

/// An observer written into the stand behind `port`; `phase`: phase of the stand's observer afterwards.
pub fn transfer_text(port: &str, phase: &str, saved: bool) -> String {
    let flash = if saved { " and saved in the stand's flash" } else { "; SETTings:SAVE saves it" };
    format!("\n{port}: the observer is on ({phase}){flash}\n")
}
