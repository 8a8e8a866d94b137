//! A plot: axes with round ticks, and the shapes between them.
//!
//! In: values in their own units. Out: SVG. Values outside an axis are drawn at its edge.

pub mod envelope;
pub mod svg;

use super::numbers;
use svg::{Anchor, Drawing, Svg};

/// One axis: range, ticks with their labels, axis label.
#[derive(Debug, Clone)]
pub struct Axis {
    from: f64,
    to: f64,
    ticks: Vec<(f64, String)>,
    label: String,
}

/// Powers of ten of the largest value for which tick labels are plain numbers; else a power of ten goes to the axis label.
const PLAIN_POWERS: std::ops::RangeInclusive<i32> = -2..=4;

impl Axis {
    /// An axis over `range` with about `count` ticks at round numbers. `name` and `unit` make the axis label, with a power of ten where the
    /// values are very large or small.
    pub fn new(range: (f64, f64), count: usize, name: &str, unit: &str) -> Self {
        let (from, to) = not_empty(range);
        let step = round_step((to - from) / count.max(1) as f64);
        let size = from.abs().max(to.abs()).log10().floor() as i32;
        let power = if PLAIN_POWERS.contains(&size) { 0 } else { size.div_euclid(3) * 3 };
        let scale = 10f64.powi(power);
        let decimals = (-(step / scale).log10().floor()).clamp(0.0, 9.0) as usize;
        let first = (from / step - 1e-9).ceil() as i64;
        let ticks = (0..)
            .map(|k| (first + k) as f64 * step)
            .take_while(|v| *v <= to + 1e-9 * step)
            .take(64)
            .map(|v| {
                let shown = format!("{:.decimals$}", v / scale);
                let zero = shown.trim_start_matches('-').chars().all(|c| c == '0' || c == '.');
                (v, if zero { "0".to_owned() } else { shown.replace('-', "−") })
            })
            .collect();
        let label = match (unit.is_empty() || unit == "1", power) {
            (true, 0) => name.to_owned(),
            (true, _) => format!("{name}, 10{}", numbers::superscript(power)),
            (false, 0) => format!("{name}, {unit}"),
            (false, _) => format!("{name}, 10{} {unit}", numbers::superscript(power)),
        };
        Axis { from, to, ticks, label }
    }

    /// The angle within one turn, with ticks at its quarters.
    pub fn turn(label: &str) -> Self {
        use std::f64::consts::{FRAC_PI_2, TAU};
        let words = ["0", "π/2", "π", "3π/2", "2π"];
        let ticks = words.iter().enumerate().map(|(k, w)| (k as f64 * FRAC_PI_2, (*w).to_owned())).collect();
        Axis { from: 0.0, to: TAU, ticks, label: label.to_owned() }
    }

    /// A logarithmic axis with a tick at each power of ten; `range` and all values are decimal logarithms.
    pub fn decades(range: (f64, f64), label: &str) -> Self {
        let ticks =
            (range.0.ceil() as i32..=range.1.floor() as i32).map(|k| (f64::from(k), format!("10{}", numbers::superscript(k)))).collect();
        Axis { from: range.0, to: range.1, ticks, label: label.to_owned() }
    }

    /// A logarithmic axis of up to three decades with ticks at 1, 2 and 5 times the powers of ten; `range` and all values are decimal
    /// logarithms.
    pub fn log(range: (f64, f64), label: &str) -> Self {
        let decades = range.0.floor() as i32..=range.1.ceil() as i32;
        let at = decades.flat_map(|k| [1.0, 2.0, 5.0].map(|m: f64| f64::from(k) + m.log10()));
        let ticks = at.filter(|v| (range.0..=range.1).contains(v)).map(|v| (v, numbers::plain(10_f64.powf(v), 2))).collect();
        Axis { from: range.0, to: range.1, ticks, label: label.to_owned() }
    }

    fn fraction(&self, v: f64) -> f64 {
        ((v - self.from) / (self.to - self.from)).clamp(-0.002, 1.002)
    }
}

/// The range, widened where it is empty; [0, 1] where it is not finite.
fn not_empty((from, to): (f64, f64)) -> (f64, f64) {
    if !(from.is_finite() && to.is_finite()) {
        return (0.0, 1.0);
    }
    let least = 1e-9 * from.abs().max(to.abs()).max(1e-12);
    if to - from > least {
        (from, to)
    } else {
        let half = 0.5 * from.abs().max(1e-3);
        (from - half, to + half)
    }
}

/// The range with a margin of 6 % on both sides.
pub fn with_margin((low, high): (f64, f64)) -> (f64, f64) {
    let (low, high) = not_empty((low, high));
    let margin = 0.06 * (high - low);
    (low - margin, high + margin)
}

/// 1, 2 or 5 times a power of ten, close to `wanted` and preferably below it.
fn round_step(wanted: f64) -> f64 {
    let power = 10f64.powf(wanted.log10().floor());
    [5.0, 2.0].into_iter().map(|m| m * power).find(|s| *s <= wanted * 1.2).unwrap_or(power)
}

/// Width of a plot across the page, px.
pub const WIDTH: f64 = 980.0;
/// Width of one of two plots side by side, px.
pub const HALF_WIDTH: f64 = 480.0;
/// Margins for tick labels and axis labels, px.
const LEFT: f64 = 62.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 24.0;
const BOTTOM: f64 = 40.0;

/// A plot under construction. Shapes drawn later cover earlier ones.
pub struct Plot {
    x: Axis,
    y: Axis,
    width: f64,
    height: f64,
    svg: Svg,
}

impl Plot {
    /// An empty frame of `width` by `height` px; the label of the vertical axis is above the frame.
    pub fn new(x: Axis, y: Axis, width: f64, height: f64) -> Self {
        let description = format!("{} over {}", y.label, x.label);
        Plot { svg: Svg::new(width, height, &description), x, y, width, height }
    }

    fn at(&self, (x, y): (f64, f64)) -> (f64, f64) {
        let (inner_width, inner_height) = (self.width - LEFT - RIGHT, self.height - TOP - BOTTOM);
        (LEFT + self.x.fraction(x) * inner_width, TOP + (1.0 - self.y.fraction(y)) * inner_height)
    }

    fn box_of(&mut self, (x0, x1): (f64, f64), (y0, y1): (f64, f64), class: &str) {
        let (left, top) = self.at((x0, y1));
        let (right, bottom) = self.at((x1, y0));
        if right > left && bottom > top {
            self.svg.rect(left, top, right - left, bottom - top, class);
        }
    }

    /// Shades an interval of the horizontal axis.
    pub fn shade(&mut self, from: f64, to: f64, class: &str) {
        let all = (self.y.from, self.y.to);
        self.box_of((from.max(self.x.from), to.min(self.x.to)), all, class);
    }

    /// Shades an interval of the vertical axis.
    pub fn band(&mut self, from: f64, to: f64, class: &str) {
        let all = (self.x.from, self.x.to);
        self.box_of(all, (from.max(self.y.from), to.min(self.y.to)), class);
    }

    /// A horizontal line; nothing where `y` is outside the axis.
    pub fn level(&mut self, y: f64, class: &str) {
        if y >= self.y.from && y <= self.y.to {
            let (from, to) = (self.at((self.x.from, y)), self.at((self.x.to, y)));
            self.svg.line(from, to, class);
        }
    }

    /// A vertical bar from zero to `y`.
    pub fn bar(&mut self, x: (f64, f64), y: f64, class: &str) {
        self.box_of(x, (y.min(0.0), y.max(0.0)), class);
    }

    /// A line with gaps: its pieces.
    pub fn lines(&mut self, pieces: &[Vec<(f64, f64)>], class: &str) {
        let placed: Vec<Vec<(f64, f64)>> = pieces.iter().map(|p| p.iter().map(|v| self.at(*v)).collect()).collect();
        self.svg.path(placed.iter().map(Vec::as_slice), class);
    }

    /// A filled circle.
    pub fn dot(&mut self, at: (f64, f64), radius: f64, class: &str) {
        let at = self.at(at);
        self.svg.dot(at, radius, class);
    }

    /// A label beside a point.
    pub fn label(&mut self, at: (f64, f64), text: &str) {
        let (x, y) = self.at(at);
        let (at, anchor) = if x > self.width / 2.0 { ((x - 5.0, y - 5.0), Anchor::End) } else { ((x + 5.0, y - 5.0), Anchor::Start) };
        self.svg.text(at, anchor, "label", text);
    }

    /// A mean with its confidence interval ± `half`.
    pub fn whisker(&mut self, x: f64, y: f64, half: f64) {
        let (from, to, at) = (self.at((x, y - half)), self.at((x, y + half)), self.at((x, y)));
        self.svg.line(from, to, "whisker");
        self.svg.dot(at, 2.2, "mean");
    }

    /// Indices of the ticks of the horizontal axis that get a label, so that labels do not overlap: every one, every second, …, including
    /// zero.
    fn labelled(&self, ticks: &[(f64, String)]) -> Vec<usize> {
        const LETTER: f64 = 7.0;
        const BETWEEN: f64 = 8.0;
        let widest = ticks.iter().map(|(_, label)| label.chars().count()).max().unwrap_or(0) as f64 * LETTER + BETWEEN;
        let apart = match ticks {
            [(first, _), (second, _), ..] => self.at((*second, self.y.from)).0 - self.at((*first, self.y.from)).0,
            _ => f64::INFINITY,
        };
        let every = (widest / apart.max(1.0)).ceil().max(1.0) as usize;
        let zero = ticks.iter().position(|(_, label)| label == "0").unwrap_or(0);
        (0..ticks.len()).filter(|k| k % every == zero % every).collect()
    }

    /// Adds frame, ticks and labels, and returns the drawing.
    pub fn finish(mut self) -> Drawing {
        let (left, right, top, bottom) = (LEFT, self.width - RIGHT, TOP, self.height - BOTTOM);
        let (x_ticks, y_ticks) = (std::mem::take(&mut self.x.ticks), std::mem::take(&mut self.y.ticks));
        let labelled = self.labelled(&x_ticks);
        for (k, (v, label)) in x_ticks.iter().enumerate() {
            let (x, _) = self.at((*v, self.y.from));
            self.svg.line((x, top), (x, bottom), "grid");
            if labelled.contains(&k) {
                self.svg.text((x, bottom + 15.0), Anchor::Middle, "tick", label);
            }
        }
        for (v, label) in &y_ticks {
            let (_, y) = self.at((self.x.from, *v));
            self.svg.line((left, y), (right, y), "grid");
            self.svg.text((left - 6.0, y + 4.0), Anchor::End, "tick", label);
        }
        self.svg.rect(left, top, right - left, bottom - top, "frame");
        self.svg.text(((left + right) / 2.0, self.height - 6.0), Anchor::Middle, "label", &self.x.label);
        self.svg.text((4.0, 14.0), Anchor::Start, "label", &self.y.label);
        self.svg.finish()
    }
}
