//! Plot of the Allan deviation over averaging time, both logarithmic, with confidence interval and fitted processes.

use super::Display;
use crate::plot::svg::Drawing;
use crate::plot::{Axis, Plot};
use identification::statistics::Extremes;
use stand_analysis::allan::MAX_RELATIVE_TAU;
use stand_analysis::allan::answer::{Answer, Point};
use stand_analysis::allan::units::PROCESSES;

/// Variance of one process at τ for a coefficient of 1 (in seconds).
fn part(process: usize, tau_s: f64) -> f64 {
    stand_analysis::allan::confidence::parts(1)[process] * [tau_s.powi(-2), 1.0 / tau_s, 1.0, tau_s, tau_s * tau_s][process]
}

/// The plot.
pub fn curve(answer: &Answer, display: &Display) -> Drawing {
    let (scale, unit) = (display.deviation().factor, &display.deviation().unit);
    let log = |x: f64| (x * scale).max(f64::MIN_POSITIVE).log10();
    let points: Vec<&Point> = answer.points.iter().filter(|p| p.oadev > 0.0).collect();
    let tau = |p: &Point| p.tau_s.log10();
    let (from, to) = (points.first().map_or(0.0, |p| tau(p)), points.last().map_or(1.0, |p| tau(p)));
    let middle = points.iter().map(|p| log(p.oadev)).min_max();
    // The confidence interval of the last points is clipped to 0.7 decades beyond the curve.
    let low = points.iter().map(|p| log(p.within_95[0])).fold(middle.0, f64::min).max(middle.0 - 0.7);
    let high = points.iter().map(|p| log(p.within_95[1])).fold(middle.1, f64::max).min(middle.1 + 0.7);
    let mut plot = Plot::new(
        Axis::decades((from - 0.1, to + 0.1), "averaging time τ, s"),
        Axis::decades((low.floor(), high.ceil().max(low.floor() + 1.0)), &format!("Allan deviation, {unit}")),
        980.0,
        520.0,
    );
    plot.shade((MAX_RELATIVE_TAU * answer.duration_s()).log10(), to + 0.1, "held");
    let below = points.iter().rev().map(|p| (tau(p), log(p.within_95[0])));
    plot.lines(&[points.iter().map(|p| (tau(p), log(p.within_95[1]))).chain(below).collect()], "band");
    let reach = |x: f64| (x, 10_f64.powf(x));
    for (p, process) in PROCESSES.iter().enumerate() {
        let Some(value) = answer.coefficients[p].estimate.map(|estimate| estimate.value) else { continue };
        let y = |tau_s: f64| log(value * part(p, tau_s).sqrt());
        // Points outside the frame are omitted; clipped lines would run along the frame.
        let inside = |y: f64| y >= low.floor() && y <= high.ceil().max(low.floor() + 1.0);
        let line: Vec<(f64, f64)> = (0..=200)
            .map(|k| reach(from + (to - from) * f64::from(k) / 200.0))
            .map(|(x, t)| (x, y(t)))
            .filter(|(_, y)| inside(*y))
            .collect();
        let end = if matches!(p, 0 | 1) { line.first() } else { line.last() };
        if let Some(&(x, y)) = end {
            plot.label((x, y), process.letter);
        }
        plot.lines(&[line], "process");
    }
    plot.lines(&[points.iter().map(|p| (tau(p), log(p.fitted))).collect()], "residual");
    plot.lines(&[points.iter().map(|p| (tau(p), log(p.oadev))).collect()], "modelled");
    points.iter().for_each(|p| plot.dot((tau(p), log(p.oadev)), 2.6, "mean-after"));
    plot.finish()
}
