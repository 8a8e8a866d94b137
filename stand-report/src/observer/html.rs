//! Observer results as HTML pages with plots.

use super::words::{excitation, moment, pole_list, warning};
use super::{bode_text, simulate_text, vibration_text};
use crate::digits;
use crate::html::{Cell, Class, Markup, Page, Table};
use crate::plot::envelope::{envelope, extent};
use crate::plot::svg::Drawing;
use crate::plot::{Axis, Plot, with_margin};
use identification::statistics::Extremes;
use stand_analysis::observer::bode::{evaluate, object_response};
use stand_analysis::observer::vibration::{Compensated, Correction, Measured, Period};
use stand_analysis::observer::{Bode, ClosedTrace, Design, Plant, SideBySide, Trace, Warning};

const WIDTH: f64 = 980.0;
/// Classes of the lines, in order.
const CLASSES: [&str; 3] = ["measured", "modelled", "residual"];

/// A design.
pub fn design_html(design: &Design) -> String {
    let request = &design.request;
    let mut page = Page::new(&format!("Observer of {}", request.plant.name));
    page.paragraph(
        Class::Lead,
        format!(
            "A {} observer. The angle makes {} of {} states observable (condition number {}).",
            request.kind.name(),
            design.rank,
            design.gains.len(),
            digits(design.condition)
        ),
    );
    for found in design.warnings() {
        page.paragraph(Class::Warning, warning(&found));
    }
    page.text(format!("Poles, 1/s: {}.", pole_list(&design.poles)));
    let scientific = |x: Option<&f64>| Cell::number(x.map_or(String::new(), |x| crate::significant(*x, 9)));
    let heads = ["state", "gain", "K, discrete", "Γ"];
    let mut table = Table::new(heads.into_iter().take(if design.discrete.is_some() { 4 } else { 2 }));
    for (k, state) in request.plant.states().iter().copied().chain(design.integral.map(|_| "moment_N_m")).enumerate() {
        let mut cells = vec![Cell::code(state), scientific(design.gains.get(k))];
        if let Some(discrete) = &design.discrete {
            cells.extend([scientific(discrete.gains.get(k)), scientific(discrete.gamma.get(k))]);
        }
        table.row(cells);
    }
    page.table(table);
    if let Some(channel) = design.integral {
        let below = channel.stable_below.map_or(String::new(), |most| format!("; stable below {}", digits(most)));
        let gain = digits(channel.gain);
        page.text(format!(
            "Integral channel: row {}, gain {gain}{below}. Estimated moment: {} N m per rad s of integrated angle error.",
            channel.row,
            digits(channel.moment_per_integral)
        ));
    }
    page.finish()
}

/// A static and an astatic observer side by side.
pub fn simulate_html(beside: &SideBySide<'_>) -> String {
    let [one, other] = beside.designs;
    let [a, b] = beside.runs;
    let mut page = Page::new(&format!("Observers of {}, side by side", one.request.plant.name));
    let offset = |x: f64| if x.abs() < 1e-18 { "none".to_owned() } else { format!("{} rad", digits(x)) };
    let (kinds, of) = ([one.request.kind.name(), other.request.kind.name()], moment(&beside.disturbed.moment));
    page.paragraph(
        Class::Lead,
        if beside.disturbed.moment.is_constant() {
            format!(
                "A constant {of} leaves a steady (t → ∞) angle error in the {} observer of {}, in the {} observer of {}.",
                kinds[0],
                offset(a.steady[0]),
                kinds[1],
                offset(b.steady[0])
            )
        } else {
            format!(
                "The {of} leaves an rms angle error in the {} observer of {}, in the {} observer of {}.",
                kinds[0],
                offset(a.rms_second_half[0]),
                kinds[1],
                offset(b.rms_second_half[0])
            )
        },
    );
    page.preformatted(&simulate_text(beside));
    let names = [one.request.kind.name(), other.request.kind.name()];
    let caption = || Markup::swatch(CLASSES[0], names[0]).then(" ").then(Markup::swatch(CLASSES[1], names[1]));
    let pairs = [
        ("angle error, with an initial error", "rad", [column(&a.both, 0), column(&b.both, 0)]),
        ("rate error, with an initial error", "rad/s", [column(&a.both, 1), column(&b.both, 1)]),
        ("angle error, moment only", "rad", [column(&a.moment_only, 0), column(&b.moment_only, 0)]),
        ("rate error, moment only", "rad/s", [column(&a.moment_only, 1), column(&b.moment_only, 1)]),
    ];
    for (name, unit, lines) in pairs {
        page.figure(&over_time(&lines, name, unit), caption());
    }
    let applied = b.moment_only.t_s.iter().copied().zip(b.moment_only.applied_N_m.iter().copied()).collect();
    page.figure(
        &over_time(&[applied, moments(&b.moment_only)], "moment", "N m"),
        Markup::swatch(CLASSES[0], "applied").then(" ").then(Markup::swatch(CLASSES[1], "estimated")),
    );
    if let (Some(x), Some(y)) = (&a.closed, &b.closed) {
        let line = |closed: &ClosedTrace| closed.t_s.iter().copied().zip(closed.angle_rad.iter().copied()).collect::<Vec<_>>();
        page.figure(
            &over_time(&[line(x), line(y)], "angle in the closed loop", "rad"),
            caption().then(format!(". The {} observer feeds its estimated moment forward.", names[1])),
        );
    }
    page.finish()
}

fn column(trace: &Trace, k: usize) -> Vec<(f64, f64)> {
    trace.t_s.iter().copied().zip(trace.errors.iter().map(|e| e[k])).collect()
}

fn moments(trace: &Trace) -> Vec<(f64, f64)> {
    trace.t_s.iter().copied().zip(trace.moment_N_m.iter().copied()).collect()
}

fn over_time(lines: &[Vec<(f64, f64)>], name: &str, unit: &str) -> Drawing {
    let end = lines.iter().filter_map(|line| line.last()).map(|p| p.0).max_or_zero();
    let pieces: Vec<_> = lines.iter().map(|line| envelope(line.iter().copied(), (0.0, end), 1500, f64::INFINITY)).collect();
    let range = extent(pieces.iter()).unwrap_or((0.0, 1.0));
    let range = (range.0.min(0.0), range.1.max(0.0));
    let mut plot = Plot::new(Axis::new((0.0, end), 10, "time", "s"), Axis::new(with_margin(range), 5, name, unit), WIDTH, 260.0);
    plot.level(0.0, "zero");
    for (line, class) in pieces.iter().zip(CLASSES) {
        plot.lines(line, class);
    }
    plot.finish()
}

/// An azimuth under vibration, corrected.
pub fn vibration_html(name: &str, measured: &Measured<'_>, found: &Compensated, warnings: &[Warning]) -> String {
    let arcsec = |rad: f64| rad.to_degrees() * 3600.0;
    let mut page = Page::new(&format!("Azimuth of {name} under vibration"));
    let left = |c: &Correction| digits(arcsec(found.alpha_rad - c.with_inertia_rad));
    let exact = found.exact.as_ref().map_or(String::new(), |exact| format!(", by the exact rates {}″", left(exact)));
    let expanded = found.corrected.as_ref().and_then(|quantity| quantity.estimate().expanded());
    let expanded = expanded.map_or(String::new(), |expanded| format!(" ± {} (U)", digits(arcsec(expanded))));
    page.paragraph(
        Class::Lead,
        format!(
            "The mean azimuth over {} periods of {} Hz is {}″; without the part by vibration, by the estimated rates, {}{expanded}″{exact}.",
            found.periods,
            digits(found.vibration_Hz),
            digits(arcsec(found.alpha_rad)),
            left(&found.response_corrected)
        ),
    );
    for found in warnings {
        page.paragraph(Class::Warning, warning(found));
    }
    page.preformatted(&vibration_text(found, &[]));
    let over = |of: &dyn Fn(&Period) -> Option<f64>| -> Vec<(f64, f64)> {
        found.by_period.iter().filter_map(|period| of(period).map(|rad| (period.t_s, arcsec(rad)))).collect()
    };
    let means = [over(&|p| Some(p.alpha_rad)), over(&|p| Some(p.estimated_rad)), over(&|p| p.exact_rad)];
    let names = ["uncorrected", "corrected by the estimated rates", "corrected by the exact rates"];
    let shown = if found.exact.is_some() { 3 } else { 2 };
    let caption = Markup::joined(CLASSES.iter().zip(names).take(shown).map(|(class, name)| Markup::swatch(class, name)), " ");
    page.figure(&over_time(&means[..shown], "azimuth, mean of a period", "″"), caption.then("."));
    let rows = measured.alpha_rad.iter().enumerate().map(|(k, alpha)| (k as f64 * measured.step_s, arcsec(*alpha))).collect();
    page.figure(&over_time(&[rows], "azimuth", "″"), Markup::swatch(CLASSES[0], "azimuth").then(" of all rows."));
    page.finish()
}

/// Frequency responses of the object and of its observers.
pub fn bode_html(plant: &Plant, bodes: &[Bode], vibration_Hz: Option<f64>) -> String {
    let mut page = Page::new(&format!("Observers of {} over frequency", plant.name));
    page.preformatted(&bode_text(plant, bodes, vibration_Hz));
    let (from, to) = (-2.0_f64, 4.0_f64);
    let grid: Vec<f64> = (0..1500).map(|k| 10f64.powf(from + (to - from) * k as f64 / 1499.0)).collect();
    let (input, numerator, denominator) = object_response(plant);
    let s = |w: f64| nalgebra::Complex::new(0.0, w);
    let object = |w: f64| evaluate(&numerator, s(w)) / evaluate(&denominator, s(w));
    let dB = |x: f64| 20.0 * x.max(1e-12).log10();
    let mut curves: Vec<(String, Vec<(f64, f64)>)> =
        vec![("rate of the object".to_owned(), grid.iter().map(|w| (w.log10(), dB(object(*w).norm()))).collect())];
    for bode in bodes.iter().take(CLASSES.len() - 1) {
        let name = format!("estimated with poles at {} 1/s", digits(bode.omega_rad_s));
        curves.push((name, grid.iter().map(|w| (w.log10(), dB((object(*w) * bode.ratio(*w)).norm()))).collect()));
    }
    page.figure(&over_frequency(&curves, (from, to), "gain", "dB"), captions(&curves, &format!("From {} to rad/s.", excitation(input))));
    for bode in bodes {
        let gain: Vec<(f64, f64)> = grid.iter().map(|w| (w.log10(), dB(bode.ratio(*w).norm()))).collect();
        let phase: Vec<(f64, f64)> = grid.iter().map(|w| (w.log10(), bode.ratio(*w).arg().to_degrees())).collect();
        let caption = match bode.limit.rad_s {
            Some(w) => format!("Poles at {} 1/s: distorted above {} rad/s.", digits(bode.omega_rad_s), digits(w)),
            None => format!("Poles at {} 1/s: not distorted.", digits(bode.omega_rad_s)),
        };
        for (line, unit, name) in [(gain, "dB", "estimated rate / true rate"), (phase, "°", "phase of the estimated rate")] {
            let one = [(name.to_owned(), line)];
            page.figure(&banded(&one, (from, to), name, unit, bode.limit.rad_s), &caption);
        }
    }
    page.finish()
}

fn captions(curves: &[(String, Vec<(f64, f64)>)], remark: &str) -> Markup {
    Markup::joined(curves.iter().zip(CLASSES).map(|((name, _), class)| Markup::swatch(class, name)), " ").then(". ").then(remark)
}

fn over_frequency(curves: &[(String, Vec<(f64, f64)>)], range: (f64, f64), name: &str, unit: &str) -> Drawing {
    banded(curves, range, name, unit, None)
}

/// Splits a curve where its phase wraps.
fn unwrapped(line: &[(f64, f64)]) -> Vec<Vec<(f64, f64)>> {
    let mut pieces: Vec<Vec<(f64, f64)>> = vec![Vec::new()];
    for point in line {
        let jumps = pieces.last().and_then(|piece| piece.last()).is_some_and(|last: &(f64, f64)| (point.1 - last.1).abs() > 180.0);
        if jumps {
            pieces.push(Vec::new());
        }
        if let Some(piece) = pieces.last_mut() {
            piece.push(*point);
        }
    }
    pieces
}

/// Curves over the logarithm of frequency; the range above `limit` (rad/s) is shaded.
fn banded(curves: &[(String, Vec<(f64, f64)>)], range: (f64, f64), name: &str, unit: &str, limit: Option<f64>) -> Drawing {
    let pieces: Vec<_> = curves.iter().map(|(_, line)| unwrapped(line)).collect();
    let extent = extent(pieces.iter()).unwrap_or((0.0, 1.0));
    let x = Axis::decades(range, "frequency, rad/s");
    let mut plot = Plot::new(x, Axis::new(with_margin(extent), 5, name, unit), WIDTH, 260.0);
    if let Some(limit) = limit {
        plot.shade(limit.log10(), range.1, "held");
    }
    plot.level(0.0, "zero");
    for (line, class) in pieces.iter().zip(CLASSES) {
        plot.lines(line, class);
    }
    plot.finish()
}
