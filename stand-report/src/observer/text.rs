//! Observer results as text for a terminal.

use super::words::{moment, pole_list, vibration_source, warning};
use crate::uncertainty::{FOOTNOTE, estimate};
use crate::units::Scale;
use crate::{digits, plain, significant};
use stand_analysis::observer::bode::{MAX_GAIN_ERROR_DB, MAX_PHASE_ERROR_DEG};
use stand_analysis::observer::vibration::Compensated;
use stand_analysis::observer::{Bode, ClosedTrace, Design, Plant, SideBySide, Simulated, Warning};

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
        "{}: initial angle error {} rad, {} from t = 0\n\n{:38}{:>16}{:>16}\n",
        one.request.plant.name,
        digits(beside.disturbed.angle_rad),
        moment(&beside.disturbed.moment),
        "",
        one.request.kind.name(),
        other.request.kind.name()
    );
    let time = |t: Option<f64>| t.map_or("not reached".to_owned(), |t| plain(t, 4));
    for (name, x, y) in [
        ("angle error below 1 % after, s", a.settled_s, b.settled_s),
        ("rate error below 1 % of peak, s", a.rate_settled_s, b.rate_settled_s),
    ] {
        text += &format!("{name:38}{:>16}{:>16}\n", time(x), time(y));
    }
    let mut row = |name: &str, x: f64, y: f64| text += &format!("{name:38}{:>16}{:>16}\n", cell(x), cell(y));
    row("largest angle error, rad", a.largest[0], b.largest[0]);
    row("largest rate error, rad/s", a.largest[1], b.largest[1]);
    let end_s = plain(a.both.t_s.last().copied().unwrap_or(0.0), 4);
    row(&format!("angle error at the end, {end_s} s, rad"), a.at_end[0], b.at_end[0]);
    row(&format!("rate error at the end, {end_s} s, rad/s"), a.at_end[1], b.at_end[1]);
    let last = |run: &Simulated| run.both.moment_N_m.last().copied().unwrap_or(f64::NAN);
    row("estimated moment at the end, N m", last(a), last(b));
    if beside.disturbed.moment.is_constant() {
        row("steady (t → ∞) angle error, rad", a.steady[0], b.steady[0]);
        row("steady (t → ∞) rate error, rad/s", a.steady[1], b.steady[1]);
        row("steady (t → ∞) tilt-rate error, rad/s", a.steady[3], b.steady[3]);
    } else {
        row("rms angle error, second half, rad", a.rms_second_half[0], b.rms_second_half[0]);
        row("rms rate error, second half, rad/s", a.rms_second_half[1], b.rms_second_half[1]);
    }
    if let (Some(x), Some(y)) = (&a.closed, &b.closed) {
        let end = |closed: &ClosedTrace| closed.angle_rad.last().copied().unwrap_or(f64::NAN);
        let end_s = plain(x.t_s.last().copied().unwrap_or(0.0), 4);
        row(&format!("closed loop: angle at the end, {end_s} s, rad"), end(x), end(y));
        if beside.disturbed.moment.is_constant() {
            row("closed loop: steady (t → ∞) angle, rad", x.steady_rad.unwrap_or(f64::NAN), y.steady_rad.unwrap_or(f64::NAN));
        }
        text += &format!("poles of the closed loop, 1/s: {}\n", pole_list(&x.poles));
    }
    text
}

fn cell(x: f64) -> String {
    // Below this size only rounding remains.
    if x.abs() < 1e-18 {
        "0".to_owned()
    } else if x.is_finite() {
        format!("{x:.4e}")
    } else {
        "none: not damped".to_owned()
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
    let exact = compensated.exact.map(|exact| exact.with_inertia_rad);
    let mut text = format!(
        "Vibration of {:.4} Hz, {} whole periods: mean azimuth {:.6e} rad ({:.2}″)\n\n{:42}{:>14}{}\n",
        compensated.vibration_Hz,
        compensated.periods,
        compensated.alpha_rad,
        compensated.alpha_rad.to_degrees() * 3600.0,
        "part by vibration",
        "rad",
        if exact.is_some() { "   of the exact part, %" } else { "" }
    );
    let mut row = |name: &str, rad: f64| {
        let share = exact.map_or(String::new(), |exact| format!("{:>23.2}", 100.0 * rad / exact));
        text += &format!("{name:42}{rad:>14.5e}{share}\n");
    };
    row("estimated α′", compensated.estimated.rate_rad);
    row("estimated, with (Jx − Jz)", compensated.estimated.with_inertia_rad);
    row("estimated, with response and (Jx − Jz)", compensated.response_corrected.with_inertia_rad);
    if let Some(exact) = &compensated.exact {
        row("exact α′", exact.rate_rad);
        row("exact, with (Jx − Jz)", exact.with_inertia_rad);
    }
    if let (Some(part), Some(corrected)) = (&compensated.part, &compensated.corrected) {
        let arcseconds = Scale { factor: ARCSECONDS, unit: "″".to_owned() };
        text += &format!("\npart by vibration  {}\n", estimate(&part.estimate(), &arcseconds));
        text += &format!("corrected azimuth  {}\n{FOOTNOTE}\n", estimate(&corrected.estimate(), &arcseconds));
        text += &format!("\n{:52}{:>12}{:>22}\n", "source", "part, u, ″", "azimuth, u, ″");
        for (of_part, of_azimuth) in part.contributions.iter().zip(&corrected.contributions) {
            text += &format!(
                "{:52}{:>12}{:>22}\n",
                vibration_source(of_part.basis),
                significant(of_part.contribution() * ARCSECONDS, 2),
                significant(of_azimuth.contribution() * ARCSECONDS, 2)
            );
        }
    } else {
        text += "\nno uncertainty: too few periods\n";
    }
    for found in warnings {
        text += &format!("\nWarning: {}\n", warning(found));
    }
    text
}

/// Arcseconds per radian.
const ARCSECONDS: f64 = 180.0 * 3600.0 / std::f64::consts::PI;

/// An observer written into the stand behind `port`; `phase`: phase of the stand's observer afterwards.
pub fn transfer_text(port: &str, phase: &str, saved: bool) -> String {
    let flash = if saved { " and saved in the stand's flash" } else { "; SETTings:SAVE saves it" };
    format!("\n{port}: the observer is on ({phase}){flash}\n")
}
