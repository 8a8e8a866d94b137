//! Results of the drift measurement as HTML pages.

use super::text::{advice_text, defect_lines, drift_lines};
use super::{defect, source, warning};
use crate::drift::error_budget::{ErrorContribution, combined};
use crate::drift::pulse_advice::PulseAdvice;
use crate::drift::{Cycle, DEG_H, DriftResult};
use crate::report::html::{Cell, Class, Markup, Page, Table};
use crate::report::plot::svg::Drawing;
use crate::report::plot::{Axis, Plot, with_margin};
use crate::report::{plain, significant};
use crate::statistics::Extremes;

/// Width of a plot, px.
const PLOT_WIDTH: f64 = 980.0;

/// The page of a measurement.
pub fn html(result: &DriftResult) -> String {
    let m = &result.measurement;
    let mut page = Page::new(&format!("drift {}", m.name));
    page.paragraph(Class::Lead, drift_lines(&result.corrected).join("; "));
    for line in defect_lines(m).into_iter().chain(m.warnings.iter().map(warning)) {
        page.paragraph(Class::Warning, line);
    }
    page.section("Cycles", |page| {
        let caption = Markup::from("Drift rate of each cycle: ").then(Markup::swatch("residual", "corrected by the current, "));
        page.figure(&cycles_plot(result), caption.then(Markup::swatch("measured", "uncorrected")));
        page.table(cycles_table(&m.cycles));
    });
    for (axis, budget) in result.budgets.iter().enumerate() {
        let about = if m.has_three_axes { [" about x", " about y", " about z"][axis] } else { "" };
        page.section(format!("Uncertainty{about}"), |page| page.table(budget_table(budget)));
    }
    page.section("Without corrections", |page| {
        for line in drift_lines(&result.uncorrected) {
            page.text(line);
        }
    });
    page.finish()
}

fn cycles_table(cycles: &[Cycle]) -> Table {
    let heads = ["cycle", "turned", "sequence", "pulses, °/s", "drift, °/h", "uncorrected, °/h", "by slope, °/h", ""];
    let mut table = Table::new(heads);
    for c in cycles {
        let rate = |rad_s: f64| Cell::number(significant(rad_s / DEG_H, 5));
        table.row([
            Cell::text(c.number.to_string()),
            Cell::number(format!("{}°", plain(c.position.turned_rad.to_degrees(), 5))),
            Cell::text(if c.sign < 0 { "− +" } else { "+ −" }),
            Cell::number(significant(c.amplitude_rad_s.to_degrees(), 3)),
            rate(c.rate_rad_s()),
            rate(c.integral.drift_rad_s()),
            rate(c.integral.slope_rad_s),
            Cell::text(c.defect.as_ref().map_or(String::new(), |found| defect(found).to_owned())).class(Class::Warning),
        ]);
    }
    table
}

fn budget_table(budget: &[ErrorContribution]) -> Table {
    let mut table = Table::new(["source (1σ)", "own drift, °/h", "apparent drift, °/h", "azimuth, ′"]);
    let cell = |x: Option<f64>, unit: f64| Cell::number(x.map_or("–".to_owned(), |x| significant(x / unit, 2)));
    let mut row = |name: &str, [own, apparent, azimuth]: [Option<f64>; 3]| {
        table.row([Cell::text(name), cell(own, DEG_H), cell(apparent, DEG_H), cell(azimuth, 60.0 * DEG_H)]);
    };
    for c in budget {
        row(source(c.source), [c.own_rad_s, c.apparent_rad_s, c.azimuth_rad]);
    }
    let total = [combined(budget, |c| c.own_rad_s), combined(budget, |c| c.apparent_rad_s), combined(budget, |c| c.azimuth_rad)];
    row("combined", total);
    table
}

fn cycles_plot(result: &DriftResult) -> Drawing {
    let cycles = &result.measurement.cycles;
    let valid = result.measurement.valid_cycles();
    let range = valid.iter().flat_map(|c| [c.rate_rad_s() / DEG_H, c.integral.drift_rad_s() / DEG_H]).min_max();
    let mut plot = Plot::new(
        Axis::new((0.0, cycles.len() as f64 + 1.0), 10, "cycle", ""),
        Axis::new(with_margin(range), 6, "drift rate, own + apparent", "°/h"),
        PLOT_WIDTH,
        280.0,
    );
    for (k, c) in cycles.iter().enumerate() {
        let x = k as f64 + 1.0;
        if c.defect.is_some() {
            plot.shade(x - 0.4, x + 0.4, "held");
            continue;
        }
        plot.lines(&[vec![(x, c.integral.drift_rad_s() / DEG_H)]], "measured");
        plot.dot((x, c.rate_rad_s() / DEG_H), 3.0, "mean");
    }
    plot.finish()
}

/// The page of an advice on the pulse duration.
pub fn advice_html(log: &str, advice: &PulseAdvice) -> String {
    let mut page = Page::new(&format!("drift advise {log}"));
    for (k, line) in advice_text(log, advice).lines().enumerate() {
        if k == 0 { page.paragraph(Class::Lead, line) } else { page.text(line) }
    }
    let shown: Vec<(f64, f64)> = advice.spectrum.iter().map(|(f, a)| (f.log10(), (a / DEG_H).max(1e-9).log10())).collect();
    let (low, high) = shown.iter().map(|(_, y)| *y).min_max();
    let frequencies = shown.iter().map(|(x, _)| *x).min_max();
    let mut plot = Plot::new(
        Axis::new(frequencies, 8, "log₁₀ of the frequency in Hz", ""),
        Axis::new(with_margin((low.max(high - 8.0), high)), 6, "log₁₀ of the amplitude in ″", ""),
        PLOT_WIDTH,
        300.0,
    );
    plot.lines(&[shown], "modelled");
    for line in &advice.lines {
        plot.dot((line.frequency_Hz.log10(), (line.amplitude_rad / DEG_H).log10()), 3.5, "mean");
    }
    page.figure(&plot.finish(), "Spectrum of the angle sensor; dots: lines considered in the advice");
    page.finish()
}
