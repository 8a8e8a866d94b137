//! Plots of one channel: measured and modelled, the residual, its distribution and autocorrelation, and its dependence on coordinates.

use crate::coordinates::CoordinateAxis;
use crate::html::{Class, Markup, Page};
use crate::plot::{Axis, HALF_WIDTH, Plot, with_margin};
use crate::residual_plots::{self, PlotLine};
use crate::unit;
use identification::identify::fit::ChannelFit;
use identification::recording::PreparedLog;
use identification::recording::prepared_log::ComparedChannel;
use identification::statistics::Extremes;
use identification::statistics::series::{autocorrelation, histogram};

/// Lags of the autocorrelation, rows.
const LAGS: usize = 100;
/// Rows below which distribution and autocorrelation are not drawn.
const MIN_ROWS: usize = 50;

/// Measured, modelled and residual over the whole log.
pub(super) fn whole_log(data: &PreparedLog, compared: &ComparedChannel, f: &ChannelFit, page: &mut Page) {
    if let Some(range) = residual_plots::whole_log(data) {
        traces(data, compared, f, range, page);
    }
}

/// The same over the 2 s in which the residual is largest; nothing where the log is not much longer.
pub(super) fn close_up(data: &PreparedLog, compared: &ComparedChannel, f: &ChannelFit, page: &mut Page) {
    if let Some(range) = residual_plots::worst_interval(data, f) {
        page.heading("Close-up of the largest residual");
        traces(data, compared, f, range, page);
    }
}

fn traces(data: &PreparedLog, compared: &ComparedChannel, f: &ChannelFit, range: (f64, f64), page: &mut Page) {
    if let Some(plot) = residual_plots::traces(data, compared, &[PlotLine { fit: f, class: "modelled" }], range, true) {
        page.figure(&plot, Markup::swatch("measured", "measured").then(" ").then(Markup::swatch("modelled", "modelled")));
    }
    if let Some(plot) = residual_plots::residuals(data, &[PlotLine { fit: f, class: "residual" }], range, true) {
        let band = Markup::swatch("band", "± 2 × noise: 95 % of the rows of a complete model");
        let caption = Markup::swatch("residual", "residual").then(" ").then(band);
        let caption = if data.held_out.is_some() { caption.then(" ").then(Markup::swatch("held", "held out of the fit")) } else { caption };
        page.figure(&plot, caption);
    }
}

/// Histogram and autocorrelation of the residual.
pub(super) fn distribution(data: &PreparedLog, f: &ChannelFit, page: &mut Page) {
    let finite: Vec<f64> = f.residual.iter().copied().filter(|r| r.is_finite()).collect();
    if finite.len() < MIN_ROWS {
        return;
    }
    page.heading("Distribution and autocorrelation of the residual");
    page.side_by_side(|page| {
        density(&finite, data, f, page);
        correlogram(data, f, page);
    });
}

fn density(residual: &[f64], data: &PreparedLog, f: &ChannelFit, page: &mut Page) {
    let unit = unit(data.axis, f.channel);
    let rms = (residual.iter().map(|r| r * r).sum::<f64>() / residual.len() as f64).sqrt();
    let reach = 4.0 * rms.max(f.noise);
    let h = histogram(residual, reach, 60);
    let normal = |x: f64| (-0.5 * (x / f.noise).powi(2)).exp() / (f.noise * std::f64::consts::TAU.sqrt());
    let highest_bar = h.density.iter().copied().max_or_zero();
    let highest = highest_bar.max(normal(0.0).min(6.0 * highest_bar));
    let mut plot = Plot::new(
        Axis::new((-reach, reach), 6, "measured − modelled", unit),
        Axis::new((0.0, 1.06 * highest), 4, "density", &format!("1/({unit})")),
        HALF_WIDTH,
        250.0,
    );
    for (k, density) in h.density.iter().enumerate() {
        let left = h.from + k as f64 * h.width;
        plot.bar((left, left + h.width), *density, "bar");
    }
    let curve: Vec<(f64, f64)> = (0..=240).map(|k| -reach + 2.0 * reach * f64::from(k) / 240.0).map(|x| (x, normal(x))).collect();
    plot.lines(&[curve], "normal");
    page.figure(
        &plot.finish(),
        Markup::from("Histogram of the residual. ").then(Markup::swatch("modelled", "normal distribution of the noise")),
    );
}

fn correlogram(data: &PreparedLog, f: &ChannelFit, page: &mut Page) {
    let a = autocorrelation(&f.residual, LAGS);
    let ms = data.dt_s * 1e3;
    let (low, high) = a.correlation.iter().fold((-2.0 * a.band, 2.0 * a.band), |(l, h), c| (l.min(*c), h.max(*c)));
    let mut plot = Plot::new(
        Axis::new((0.0, (a.correlation.len() + 1) as f64 * ms), 6, "lag", "ms"),
        Axis::new(with_margin((low, high)), 5, "autocorrelation", ""),
        HALF_WIDTH,
        250.0,
    );
    plot.level(0.0, "zero");
    for (k, c) in a.correlation.iter().enumerate() {
        let lag = (k + 1) as f64 * ms;
        plot.bar((lag - 0.35 * ms, lag + 0.35 * ms), *c, "bar");
    }
    plot.band(-a.band, a.band, "band");
    let caption = Markup::from("Autocorrelation of the residual. ").then(Markup::swatch("band", "95 % interval of white noise"));
    let angle = ". Angle increments that share a reading have a correlation of −½ at a lag of 20 ms.";
    page.figure(&plot.finish(), if f.is_increment { caption.then(angle) } else { caption });
}

/// Mean residual over each coordinate.
pub(super) fn over_coordinates(f: &ChannelFit, along: &[CoordinateAxis], page: &mut Page) {
    page.heading("Residual over coordinates");
    page.paragraph(
        Class::Faint,
        "Mean residual in each bin, with its 95 % interval. For a complete model 19 of 20 intervals contain zero.",
    );
    page.side_by_side(|page| {
        for a in along {
            if let Some(plot) = residual_plots::over_coordinate(&[PlotLine { fit: f, class: "residual" }], a) {
                page.figure(&plot, "");
            }
        }
    });
}
