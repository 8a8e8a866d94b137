//! Rate stability as an HTML page with a plot for each width.

use super::text;
use super::words::{scales, width};
use crate::html::Page;
use crate::plot::envelope::envelope;
use crate::plot::{Axis, Plot, WIDTH, with_margin};
use crate::units::Units;
use identification::statistics::Extremes;
use stand_analysis::stability::PlateauStability;

/// Points of a curve across the page.
const PLOT_POINTS: usize = 1500;

/// The page.
pub fn html(log: &str, plateaus: &[PlateauStability], units: Units) -> String {
    let (rate, ratio) = scales(units);
    let mut page = Page::new(&format!("Rate stability of {log}"));
    page.preformatted(&text(log, plateaus, units));
    for plateau in plateaus {
        let mean = crate::significant(plateau.mean_rad_s.value * rate.factor, 5);
        page.section(format!("Plateau at {mean} {}", rate.unit), |page| {
            for found in &plateau.widths {
                let line: Vec<(f64, f64)> = found.deviations.iter().map(|(t, d)| (*t, d * ratio.factor)).collect();
                let (from, to) = line.iter().map(|(t, _)| *t).min_max();
                let range = line.iter().map(|(_, d)| *d).min_max();
                let mut plot = Plot::new(
                    Axis::new((from, to), 10, "time", "s"),
                    Axis::new(with_margin(range), 6, "deviation from the mean rate", &ratio.unit),
                    WIDTH,
                    220.0,
                );
                plot.level(0.0, "zero");
                for sign in [1.0, -1.0] {
                    plot.level(sign * found.sigma.value * ratio.factor, "zero");
                }
                plot.lines(&envelope(line.iter().copied(), (from, to), PLOT_POINTS, f64::INFINITY), "measured");
                page.figure(&plot.finish(), format!("Mean rates over {}; lines: ± one standard deviation", width(found.width)));
            }
        });
    }
    page.finish()
}
