//! Results of the drift measurement as HTML pages.

use super::display::{Display, OWN_DRIFT_NAMES};
use super::text::{advice_text, defect_lines, drift_lines, platform_text};
use super::words::platform_source;
use super::{defect, source, warning};
use crate::html::{Cell, Class, Markup, Page, Table};
use crate::plot::svg::Drawing;
use crate::plot::{Axis, Plot, with_margin};
use crate::uncertainty::{FOOTNOTE, coverage};
use crate::units::{Scale, Units};
use crate::{plain, significant};
use identification::statistics::Extremes;
use stand_analysis::drift::error_budget::{AxisBudget, DriftQuantity};
use stand_analysis::drift::evaluation::sources;
use stand_analysis::drift::platform::{PlatformCycle, PlatformResult};
use stand_analysis::drift::pulse_advice::PulseAdvice;
use stand_analysis::drift::{Cycle, DEG_H, DriftResult};

/// Width of a plot, px.
const PLOT_WIDTH: f64 = 980.0;

/// The page of a measurement.
pub fn html(result: &DriftResult, units: Units) -> String {
    let display = Display::new(units);
    let m = &result.measurement;
    let mut page = Page::new(&format!("drift {}", m.name));
    page.paragraph(Class::Lead, drift_lines(&result.corrected, &display).join("; "));
    page.text(OWN_DRIFT_NAMES);
    page.text(FOOTNOTE);
    for line in defect_lines(m).into_iter().chain(result.warnings.iter().map(warning)) {
        page.paragraph(Class::Warning, line);
    }
    page.section("Cycles", |page| {
        let caption = Markup::from("Drift rate of each cycle over the time of the session: ")
            .then(Markup::swatch("residual", "corrected by the current, "));
        page.figure(&cycles_plot(result, &display.rate), caption.then(Markup::swatch("measured", "uncorrected")));
        page.table(cycles_table(&m.cycles, &display.rate));
    });
    for (axis, budget) in result.budgets.iter().enumerate() {
        let about = if m.has_three_axes { [" about x", " about y", " about z"][axis] } else { "" };
        page.section(format!("Uncertainty{about}"), |page| page.table(budget_table(budget, &display)));
    }
    page.section("Without corrections", |page| {
        for line in drift_lines(&result.uncorrected, &display) {
            page.text(line);
        }
    });
    page.finish()
}

fn cycles_table(cycles: &[Cycle], scale: &Scale) -> Table {
    let [drift, uncorrected, slope] = ["drift", "uncorrected", "by slope"].map(|name| format!("{name}, {}", scale.unit));
    let mut table = Table::new(["cycle", "begin, s", "turned", "sequence", "pulses, °/s", &drift, &uncorrected, &slope, ""]);
    for c in cycles {
        let rate = |rad_s: f64| Cell::number(significant(rad_s * scale.factor, 5));
        table.row([
            Cell::text(c.number.to_string()),
            Cell::number(plain(c.start_s, 5)),
            Cell::number(format!("{}°", plain(c.position.turned_rad.to_degrees(), 5))),
            Cell::text(if c.sign < 0 { "− +" } else { "+ −" }),
            Cell::number(significant(c.amplitude_rad_s.to_degrees(), 3)),
            rate(c.rate_rad_s()),
            rate(c.integral.drift_rad_s()),
            rate(c.integral.slope_rad_s),
            Cell::text(c.defect.as_ref().map_or(String::new(), defect)).class(Class::Warning),
        ]);
    }
    table
}

fn budget_table(budget: &AxisBudget, display: &Display) -> Table {
    let arcminutes = Scale { factor: 60.0 * 1_f64.to_degrees(), unit: "′".to_owned() };
    let columns = [
        (&budget.own, "own drift", &display.rate),
        (&budget.apparent, "apparent drift", &display.rate),
        (&budget.azimuth, "azimuth", &arcminutes),
    ];
    let heads = columns.map(|(_, name, scale)| format!("{name}, {}", scale.unit));
    let mut table = Table::new(["source, u".to_owned()].into_iter().chain(heads));
    type Of<'a> = &'a dyn Fn(&DriftQuantity, &Scale) -> String;
    let mut row = |name: &str, of: Of<'_>| {
        let cell = |(quantity, _, scale): (&Option<DriftQuantity>, &str, &Scale)| {
            Cell::number(quantity.as_ref().map_or("–".to_owned(), |quantity| of(quantity, scale)))
        };
        table.row([Cell::text(name)].into_iter().chain(columns.map(cell)));
    };
    for listed in sources(budget) {
        row(source(listed), &|quantity, scale| {
            let lines: Vec<f64> =
                quantity.contributions.iter().filter(|line| line.basis == listed).map(|line| line.contribution()).collect();
            if lines.is_empty() { "–".to_owned() } else { significant(lines.iter().map(|u| u * u).sum::<f64>().sqrt() * scale.factor, 2) }
        });
    }
    row("combined u", &|quantity, scale| significant(quantity.combined_u() * scale.factor, 2));
    row("U", &|quantity, scale| {
        let uncertainty = quantity.estimate().uncertainty;
        uncertainty.map_or(String::new(), |u| format!("{} {}", significant(u.expanded() * scale.factor, 2), coverage(&u)))
    });
    table
}

fn cycles_plot(result: &DriftResult, scale: &Scale) -> Drawing {
    let cycles = &result.measurement.cycles;
    let valid = result.measurement.valid_cycles();
    let range = valid.iter().flat_map(|c| [c.rate_rad_s(), c.integral.drift_rad_s()].map(|rate| rate * scale.factor)).min_max();
    let (begin_s, end_s) = cycles.iter().flat_map(|c| [c.start_s, c.start_s + 2.0 * c.integral.pulse_s]).min_max();
    let mut plot = Plot::new(
        Axis::new((begin_s, end_s), 10, "time", "s"),
        Axis::new(with_margin(range), 6, "drift rate, own + apparent", &scale.unit),
        PLOT_WIDTH,
        280.0,
    );
    for c in cycles {
        let (from, to) = (c.start_s, c.start_s + 2.0 * c.integral.pulse_s);
        if c.defect.is_some() {
            plot.shade(from, to, "held");
            continue;
        }
        let raw = c.integral.drift_rad_s() * scale.factor;
        plot.lines(&[vec![(from, raw), (to, raw)]], "measured");
        plot.dot((0.5 * (from + to), c.rate_rad_s() * scale.factor), 3.0, "mean");
    }
    plot.finish()
}

/// The page of the platform method.
pub fn platform_html(log: &str, result: &PlatformResult, units: Units) -> String {
    let display = Display::for_platform(units);
    let mut page = Page::new(&format!("drift platform {log}"));
    page.preformatted(&platform_text(log, result, units));
    let valid: Vec<&PlatformCycle> = result.cycles.iter().filter(|cycle| cycle.defect.is_none()).collect();
    let mut plots = |name: &str, scale: &Scale, of: &dyn Fn(&PlatformCycle) -> f64| {
        let values = valid.iter().map(|cycle| of(cycle) * scale.factor).min_max();
        let times = valid.iter().map(|cycle| cycle.start_s).min_max();
        let x = Axis::new(with_margin(times), 10, "time", "s");
        let mut plot = Plot::new(x, Axis::new(with_margin(values), 6, name, &scale.unit), PLOT_WIDTH, 240.0);
        for cycle in &valid {
            plot.dot((cycle.start_s, of(cycle) * scale.factor), 3.0, if cycle.sign < 0 { "mean" } else { "mean-after" });
        }
        page.figure(&plot.finish(), format!("{name} of each cycle; its two colours are the signs of the first rotation"));
    };
    plots("bias with lag", &display.rate, &|cycle| cycle.bias_rad_s);
    plots("scale", &display.one, &|cycle| cycle.scale);
    if let Some([bias, scale]) = &result.budgets {
        page.section("Uncertainty", |page| {
            let mut table = Table::new(["quantity", "source", "u", ""]);
            for (quantity, unit) in [(bias, &display.rate), (scale, &display.one)] {
                for line in &quantity.contributions {
                    let u = significant(line.contribution() * unit.factor, 2);
                    table.row([
                        Cell::code(&quantity.name),
                        Cell::text(platform_source(line.basis)),
                        Cell::number(u),
                        Cell::text(unit.unit.as_str()),
                    ]);
                }
            }
            page.table(table);
        });
    }
    page.finish()
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
