//! Words for notes on the preparation of a log and for remarks on an evaluation.

use super::{column, listed, numbers, unit};
use identification::identify::evaluation::EvaluationRemark;
use identification::identify::fit::held_out::Departure;
use identification::identify::repetition::Repetition;
use identification::log::Axis;
use identification::log::plausible::ShiftedConstant;
use identification::model::Channel;
use identification::recording::prepare::PreparationNote;

/// A preparation note as a sentence.
pub fn note(axis: Axis, note: &PreparationNote) -> String {
    match note {
        PreparationNote::Limited { channel, rows, of } => format!(
            "{} of {} rows of {} are at the end of the sensor’s range and are not compared: they do not say how large the quantity is",
            numbers::grouped(*rows),
            numbers::grouped(*of),
            column(axis, *channel)
        ),
        PreparationNote::Outliers { channel, rows, of } => format!(
            "Heavy-tailed noise: {rows} of {} readings of {} differ from all their neighbours by more than {} standard deviations; they are not compared.",
            super::numbers::grouped(*of),
            super::column(axis, *channel),
            identification::identify::fit::outliers::MIN_SIGMAS
        ),
        PreparationNote::AssumedAtT { column } => format!(
            "The log does not state how {0} was made. Values at the time of the row fit better than means over the row and are assumed; the note “{0}: at t” or “{0}: mean over the row” states it.",
            axis.column(column)
        ),
        PreparationNote::AssumedOfRowBefore { column } => format!(
            "The log does not state when {0} had its values. Each fits better as the value over the row before its own, as of a program that logs its last output with the next readings, and this is assumed; the note “{0}: over the row before t” or “{0}: mean over the row” states it. Without the note another command may assume another convention, which shifts a delay by a row.",
            axis.column(column)
        ),
        PreparationNote::AssumedToMove { column } => format!(
            "{0}: means over the row of a voltage that moves within it fit better than one that is constant within each row, and are assumed; its course is the smoothest with these means. A log with more rows per second shows the course itself.",
            axis.column(column)
        ),
        PreparationNote::AssumedOverLastRow { column, interval_s } => format!(
            "The log does not state how {0} was made. Means over the last row fit better than values at the time of the row and are assumed, as of a rate from differences of an angle; the note “{0}: encoder, mean over {1} ms before t” states it. Without the note another command may assume another convention, which shifts a delay by half a row.",
            axis.column(column),
            numbers::plain(interval_s * 1e3, 4)
        ),
        PreparationNote::MotionNotResolved { rows, of } => format!(
            "The sensor is not compared in {} of {} rows, where the angle does not resolve the rate: at the ends, and where the acceleration jumps within 20 ms.",
            super::numbers::grouped(*rows),
            super::numbers::grouped(*of)
        ),
        PreparationNote::Segments { segments, short: (short, rows) } => {
            let left_out = match short {
                0 => String::new(),
                1 => format!(" One more segment of {rows} rows is too short to determine its initial state and counts in no score."),
                _ => format!(
                    " {short} more segments, {rows} rows together, are too short to determine their initial states and count in no score."
                ),
            };
            let are = if *segments == 1 { "One segment is compared".to_owned() } else { format!("{segments} segments are compared") };
            format!("The time has gaps: {are}, each with an initial state of its own.{left_out}")
        }
        PreparationNote::NotVisibleAtTerminals { effect } => {
            format!("u_V was measured at the motor terminals, behind the bridge: {effect} is not visible in this log.")
        }
    }
}

/// A question about a constant that a fit shifts by a decade or more, as sentences.
pub fn constant(axis: Axis, shifted: &ShiftedConstant) -> String {
    format!(
        "By a fit {}. A physical constant is known better than to a factor of ten: check the units of the log's columns and the start value.",
        super::defects::shifted_constant(axis, shifted)
    )
}

/// A standard error is mostly by the voltage within the rows.
pub const RESTS_ON_COURSE: &str = "The log leaves open what the input does within its rows, and a ± is mostly from that: a random walk is assumed, or, for values at t, that each may be held for up to a row. Where the voltage jumps, as by play or a soft shaft under a speed loop, a ± may be too small, by a factor of up to 2.5 in simulations. A log in voltage mode, or with more rows per second, determines these parameters better.";

/// The parameters are those of the prediction errors.
pub const BY_PREDICTION_ERRORS: &str = "The parameters are from prediction errors: the input may be from a control loop, where the noise of the angle returns in it and biases a free run (the note “mode: voltage” states that there is none).";

/// Held-out rows that depart, as a sentence.
pub fn departs(axis: Axis, departure: &Departure) -> String {
    format!(
        "From {} s on {} departs by {} × the noise, in rows that were held out, while the fitted rows leave only noise: what acts there acts nowhere else in this log.",
        numbers::significant(departure.from_s, 3),
        column(axis, departure.channel),
        numbers::significant(departure.ratio, 3)
    )
}

/// A remark on an evaluation as a sentence.
pub fn remark(axis: Axis, remark: &EvaluationRemark) -> String {
    match remark {
        EvaluationRemark::Preparation(n) => note(axis, n),
        EvaluationRemark::AssumedRateSource { from_encoder } => {
            let source = if *from_encoder { "derived from the encoder" } else { "from a separate sensor" };
            format!(
                "The log does not state the source of {}. The fit is better for a rate {source}, which is assumed.",
                axis.column("omega_rad_s")
            )
        }
        EvaluationRemark::MoreThanNoise { ratio } => format!(
            "The model leaves {} × the noise in its worst channel. The ± are those of noise of that size; what the model lacks may have shifted the parameters by more.",
            numbers::significant(*ratio, 3)
        ),
        EvaluationRemark::HeldOutDeparts(departure) => departs(axis, departure),
        EvaluationRemark::ByPredictionErrors => BY_PREDICTION_ERRORS.to_owned(),
        EvaluationRemark::RestsOnCourse => RESTS_ON_COURSE.to_owned(),
        EvaluationRemark::ShiftedConstant(shifted) => constant(axis, shifted),
        EvaluationRemark::Repetition(repeated) => repetition(axis, repeated),
    }
}

/// What does not repeat with the input.
fn repetition(axis: Axis, repeated: &Repetition) -> String {
    let part = |(channel, sigma): &(Channel, f64)| {
        format!("{} {} {}", column(axis, *channel), numbers::significant(*sigma, 2), unit(axis, *channel))
    };
    let parts: Vec<String> = repeated.not_repeatable.iter().map(part).collect();
    format!(
        "The input repeats itself every {} s, {} times. What does not repeat with it: {} (standard deviation). A residual above this returns with the input, so the model lacks something; a residual near it is noise, or depends on something that does not repeat, such as the angle.",
        numbers::plain(repeated.period_s, 4),
        repeated.periods,
        listed(&parts)
    )
}
