//! Text, HTML and JSON of all results.
//!
//! In: the data that the analyses return. Out: text; nothing is printed or written here. One file or folder for each topic. Shared:
//! [`numbers`] (digits, uncertainties, p-values), [`terminal`] (line width, emphasis), [`html`] (HTML) and [`plot`] (SVG).

pub mod allan;
pub mod bad_log;
pub mod calibration;
pub mod certificate;
pub mod comparison;
pub mod compensation;
pub mod conversion;
pub mod coordinates;
mod defects;
pub mod demonstration;
pub mod drift;
pub mod effects;
pub mod equation_error;
mod escape;
pub mod explanation;
pub mod fleet;
pub mod html;
pub mod inspection;
pub mod json;
pub mod kinds;
pub mod lab;
pub mod lab_view;
mod lab_words;
mod log_warning;
pub mod misfits;
pub mod model;
pub mod numbers;
pub mod observer;
pub mod plot;
pub mod plot_files;
pub mod preparation;
pub mod recording;
pub mod residual_plots;
pub mod schema;
pub mod settings;
pub mod simulation;
pub mod stability;
pub mod terminal;
pub mod uncertainty;
pub mod units;

pub use bad_log::{bad_log_html, bad_log_json, bad_log_text};
pub use comparison::{Comparison, compare_json, fit_json, html as comparison_html, profiles_json, text as comparison_text};
pub use defects::defect;
pub use explanation::{explain_bad_log_json, explain_html, explain_json, explain_text};
pub use log_warning::log_warning;
pub use numbers::{grouped, p_statement, p_value, plain, significant, with_sigma};
pub use terminal::{Style, sparkline};

use identification::identify::fit::ChannelFit;
use identification::log::{Axis, Log};
use identification::model::Channel;

/// File, length and origin of a log, as terms with their values.
fn log_entries(log: &Log) -> Vec<(&'static str, String)> {
    let size = format!(
        "{}: {} rows, {} s at {} ms",
        log.path().display(),
        numbers::grouped(log.len()),
        numbers::plain(log.duration_s(), 4),
        numbers::plain(log.median_dt_s() * 1e3, 3)
    );
    let mut entries = vec![("Log", size)];
    for (key, term) in [("date", "Recorded"), ("stand", "Stand"), ("profile", "Profile")] {
        if let Some(note) = log.note(key) {
            entries.push((term, note.to_owned()));
        }
    }
    entries
}

/// Warnings of the log's reader.
fn log_warnings(log: &Log) -> Vec<String> {
    let mut lines: Vec<String> = log.warnings().iter().map(log_warning).collect();
    if !log.ignored().is_empty() {
        lines.push(format!("Columns of unknown name are ignored: {}.", log.ignored().join(", ")));
    }
    lines
}

/// `a`, `a and b`, `a, b and c`.
pub fn listed(items: &[String]) -> String {
    match items {
        [] => String::new(),
        [one] => one.clone(),
        [before @ .., last] => format!("{} and {last}", before.join(", ")),
    }
}

/// A number with at most six significant digits, without trailing zeros.
pub fn digits(x: f64) -> String {
    plain(x, 6)
}

/// Column of a channel, as the files of this axis name it.
pub fn column(axis: Axis, channel: Channel) -> &'static str {
    axis.column(channel.column())
}

/// Unit of a channel.
pub fn unit(axis: Axis, channel: Channel) -> &'static str {
    axis.unit(match channel {
        Channel::Rate => "rad/s",
        Channel::Angle => "rad",
        Channel::Current => "A",
        Channel::Voltage => "V",
        Channel::Torque => "N m",
    })
}

/// Quantity of a fitted channel: the angle itself, where it was compared and not its increments.
pub fn fitted_quantity(axis: Axis, f: &ChannelFit) -> &'static str {
    if f.channel == Channel::Angle && !f.is_increment { axis.quantity("angle") } else { quantity(axis, f.channel) }
}

/// Quantity of a channel, for headings and axes.
pub fn quantity(axis: Axis, channel: Channel) -> &'static str {
    axis.quantity(match channel {
        Channel::Rate => "rate",
        Channel::Angle => "angle increment over 20 ms",
        Channel::Current => "current",
        Channel::Voltage => "voltage",
        Channel::Torque => "torque",
    })
}
