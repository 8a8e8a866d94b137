//! Sentences about an Allan analysis.

use schemars::JsonSchema;
use serde::Serialize;

use super::Display;
use crate::uncertainty::estimate;
use crate::{grouped, log_warning, plain, significant, with_sigma};
use stand_analysis::allan::FLOOR;
use stand_analysis::allan::answer::{Answer, FLICKER, Interpretation, NotShown, Note, WHITE};
use stand_analysis::allan::time_stamps::TimingNote;
use stand_analysis::allan::units::{PROCESSES, Process, Unit};

/// Rows that a fit of coefficients needs.
const ROWS_FOR_COEFFICIENTS: usize = 80;

/// What the intervals depend on.
pub(super) const CONDITIONS: &str = "The intervals are conditional on the noise model: stationary noise of these five processes; they contain that the processes can replace each other.";

/// Standard and clause of a coefficient.
pub(super) fn standard(p: usize) -> &'static str {
    [
        "IEEE 952, annex C: quantization noise",
        "IEEE 952, annex C: angle random walk",
        "IEEE 952, annex C: bias instability",
        "IEEE 952, annex C: rate random walk",
        "IEEE 952, annex C: rate ramp",
    ][p]
}

/// The reason why coefficient `p` has no value; `None` if it has one.
pub(super) fn not_shown(answer: &Answer, display: &Display, p: usize) -> Option<String> {
    let coefficient = &answer.coefficients[p];
    Some(match coefficient.not_shown? {
        NotShown::NotSignificant { has_minimum } => {
            let scale = display.coefficient(p);
            let limit = match coefficient.below {
                Some(below) => {
                    format!("not significant in this record: below {} {} (95 %)", significant(below * scale.factor, 2), scale.unit)
                }
                None => "not distinguishable from the other processes in this record".to_owned(),
            };
            let minimum = match has_minimum {
                Some(true) => "; the other processes explain the minimum of the curve",
                Some(false) => "; the curve has no minimum up to T/10, a longer record may show one",
                None => "",
            };
            limit + minimum
        }
        general => no_coefficients(general),
    })
}

fn no_coefficients(reason: NotShown) -> String {
    match reason {
        NotShown::TooFewRows { rows } => {
            format!("{rows} rows are too few to separate the processes: at least {ROWS_FOR_COEFFICIENTS} rows are needed")
        }
        NotShown::ZeroVariance => "the curve reaches zero and cannot be fitted".to_owned(),
        NotShown::NotSignificant { .. } => "not significant in this record".to_owned(),
        NotShown::Transient => "not given: the record begins with a transient, which imitates slow noise".to_owned(),
        NotShown::SlowMotion => "not given: a slow motion of the level imitates slow noise".to_owned(),
        NotShown::LongTimesOmitted => "not given: long averages do not follow the five processes".to_owned(),
        NotShown::CoarseResolution => {
            "not given: the least significant bit of the column is larger than 1.5 standard deviations of the noise, so that the rows do not show it".to_owned()
        }
        NotShown::ManySteps => "not given: the level steps too often".to_owned(),
    }
}

/// A remark about the record or the fit.
pub(super) fn note(note: &Note, display: &Display) -> String {
    match note {
        Note::Log(warning) => log_warning(warning),
        Note::Timing(TimingNote::Scatter { relative }) => {
            format!(
                "time stamps scatter by {} % of the interval; the samples are treated as evenly spaced",
                significant(100.0 * relative, 2)
            )
        }
        Note::Timing(TimingNote::Bursts { rows, interval_s }) => format!(
            "time stamps come in bursts of {} rows on average; the samples are treated as evenly spaced by {} s, the time per row",
            significant(*rows, 3),
            significant(*interval_s, 6)
        ),
        Note::Timing(TimingNote::Gaps { count, missing }) => format!(
            "{count} {}, about {} samples missing: no difference crosses a gap, the terms of all segments are pooled",
            if *count == 1 { "gap" } else { "gaps" },
            missing.round().max(1.0)
        ),
        Note::Timing(TimingNote::LostRows { count, elapsed }) => format!(
            "about {} single rows are lost: averaging times count the rows that are there; the elapsed time is {} times as long, which K and R consider",
            count.round(),
            significant(*elapsed, 4)
        ),
        Note::Timing(TimingNote::RateChange { interval_s, used_s: [from_s, to_s] }) => format!(
            "the sampling interval changes: only the longest stretch of one interval is analysed, {} s to {} s at {} s; --from and --to choose another one",
            plain(*from_s, 6),
            plain(*to_s, 6),
            plain(*interval_s, 6)
        ),
        Note::Steps(steps) => {
            let scale = display.deviation();
            let shown: Vec<String> = steps
                .iter()
                .map(|step| format!("{} {} at {} s", significant(step.size * scale.factor, 3), scale.unit, plain(step.t_s, 6)))
                .collect();
            format!(
                "the level steps, which no noise of these processes does (probability below 1e-4): {}; the record is divided there, and no difference crosses a step",
                shown.join(", ")
            )
        }
        Note::WildRows { count, largest, oadev: [with, without] } => {
            let scale = display.deviation();
            let size = |size: f64| significant(size * scale.factor, 4);
            format!(
                "{count} wild {}, up to {} {} beside the level of {} neighbours, which no noise does (probability below 1e-4): replaced by this level; the deviation of single rows is {} {} with {} and {} {} without",
                if *count == 1 { "row" } else { "rows" },
                significant(largest * scale.factor, 3),
                scale.unit,
                if *count == 1 { "its" } else { "their" },
                size(*with),
                scale.unit,
                if *count == 1 { "it" } else { "them" },
                size(*without),
                scale.unit
            )
        }
        Note::Periodic { period_s, amplitude } => {
            let scale = display.deviation();
            format!(
                "a periodic signal, which is no noise, such as a vibration or the temperature of a room: amplitude {} {}, period {} s ({} Hz); it is subtracted",
                significant(amplitude * scale.factor, 2),
                scale.unit,
                significant(*period_s, 3),
                significant(1.0 / period_s, 3)
            )
        }
        Note::SlowMotion { amplitude, period_s } => {
            let scale = display.deviation();
            format!(
                "a slow motion of the level, which is no noise, such as by the temperature; the record is too short to show its course: a sinusoid of {} {} with a period of {} s is subtracted, and B, K and R are not given",
                significant(amplitude * scale.factor, 2),
                scale.unit,
                significant(*period_s, 2)
            )
        }
        Note::Resolution { part } => format!(
            "the rounding of the column is {} % of the variance of a row; it is subtracted from N²",
            significant(100.0 * part, 2)
        ),
        Note::Transient { time_constant_s, size, from_s } => {
            let scale = display.deviation();
            format!(
                "a transient at the beginning, such as a warm-up: about {} {} with a time constant of {} s; it is subtracted, but what is left of it would be taken for slow noise, so B, K and R are not given; `--from {}` leaves it out",
                significant(size * scale.factor, 2),
                scale.unit,
                significant(*time_constant_s, 2),
                plain(from_s.ceil(), 6)
            )
        }
        Note::SlowNoiseTogether => {
            "slow noise is significant, but this record does not tell flicker noise, random walk and ramp apart: only their limits are given".to_owned()
        }
        Note::NoCoefficients(reason) => no_coefficients(*reason),
        Note::Unexplained { misfit } => format!(
            "the five processes do not explain this curve: χ² is {} per degree of freedom, and the intervals are widened by its square root. Possible causes: vibration, a periodic signal or steps in the record",
            significant(*misfit, 3)
        ),
        Note::LongTimesOmitted { above_s } => format!(
            "averages above {} s do not follow the five processes (a slow motion that is no noise) and are not used in the fit",
            significant(*above_s, 3)
        ),
        Note::ShortTimesOmitted { below_s } => format!(
            "averages below {} s do not follow the five processes (a filter in the sensor, the step of its converter) and are not used in the fit",
            significant(*below_s, 3)
        ),
    }
}

/// A remark on the analysis, for programs.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum NoteKind {
    /// A remark on the log.
    Log {
        /// The sentence of the program.
        says: String,
    },
    /// The interval of the rows scatters.
    Scatter {
        /// %.
        percent: f64,
    },
    /// Rows arrive in bursts.
    Bursts {
        /// Rows.
        rows: f64,
        /// Interval, s.
        interval_s: f64,
    },
    /// Gaps.
    Gaps {
        /// Number.
        count: usize,
        /// Missing rows.
        missing: f64,
    },
    /// Rows were lost.
    LostRows {
        /// Number.
        count: f64,
        /// Rows that elapsed.
        elapsed: f64,
    },
    /// The interval of the rows changes; one stretch is used.
    RateChange {
        /// Begin, s.
        from_s: f64,
        /// End, s.
        to_s: f64,
        /// Interval, s.
        interval_s: f64,
    },
    /// There are no coefficients.
    NoCoefficients,
    /// The level steps.
    Steps {
        /// Times, s.
        times_s: Vec<f64>,
    },
    /// Wild rows, which were replaced by the level beside them.
    WildRows {
        /// Number.
        count: usize,
        /// The largest deviation from the level.
        largest: f64,
        /// Allan deviation of single rows with them.
        oadev_with: f64,
        /// Allan deviation of single rows without them.
        oadev_without: f64,
        /// Unit of the three.
        unit: String,
    },
    /// A periodic signal, which was subtracted.
    Periodic {
        /// Amplitude.
        amplitude: f64,
        /// Its unit.
        unit: String,
        /// Period, s.
        period_s: f64,
    },
    /// A slow motion of the level, which was subtracted as a sinusoid.
    SlowMotion {
        /// Amplitude.
        amplitude: f64,
        /// Its unit.
        unit: String,
        /// Period, s.
        period_s: f64,
    },
    /// The rounding of the column was subtracted from the white noise.
    Resolution {
        /// Its part of the variance of a row, %.
        percent: f64,
    },
    /// A transient at the begin, which was subtracted.
    Transient {
        /// Size.
        size: f64,
        /// Its unit.
        unit: String,
        /// Time constant, s.
        time_constant_s: f64,
        /// Begin, s.
        from_s: f64,
    },
    /// Slow noise of several kinds, not separable.
    SlowNoiseTogether,
    /// The model does not explain the curve.
    Unexplained {
        /// Ratio.
        misfit: f64,
    },
    /// Long times are omitted.
    LongTimesOmitted {
        /// s.
        above_s: f64,
    },
    /// Short times are omitted.
    ShortTimesOmitted {
        /// s.
        below_s: f64,
    },
}

/// A remark about the record or the fit, for programs.
pub(super) fn note_kind(note: &Note, display: &Display) -> NoteKind {
    let (factor, unit) = (display.deviation().factor, &display.deviation().unit);
    match note {
        Note::Log(warning) => NoteKind::Log { says: log_warning(warning) },
        Note::Timing(TimingNote::Scatter { relative }) => NoteKind::Scatter { percent: 100.0 * relative },
        Note::Timing(TimingNote::Bursts { rows, interval_s }) => NoteKind::Bursts { rows: *rows, interval_s: *interval_s },
        Note::Timing(TimingNote::Gaps { count, missing }) => NoteKind::Gaps { count: *count, missing: missing.round().max(1.0) },
        Note::Timing(TimingNote::LostRows { count, elapsed }) => NoteKind::LostRows { count: count.round(), elapsed: *elapsed },
        Note::Timing(TimingNote::RateChange { interval_s, used_s: [from_s, to_s] }) => {
            NoteKind::RateChange { from_s: *from_s, to_s: *to_s, interval_s: *interval_s }
        }
        Note::NoCoefficients(_) => NoteKind::NoCoefficients,
        Note::Steps(steps) => NoteKind::Steps { times_s: steps.iter().map(|step| step.t_s).collect() },
        Note::WildRows { count, largest, oadev: [with, without] } => NoteKind::WildRows {
            count: *count,
            largest: largest * factor,
            oadev_with: with * factor,
            oadev_without: without * factor,
            unit: unit.to_string(),
        },
        Note::Periodic { period_s, amplitude } => {
            NoteKind::Periodic { amplitude: amplitude * factor, unit: unit.to_string(), period_s: *period_s }
        }
        Note::SlowMotion { amplitude, period_s } => {
            NoteKind::SlowMotion { amplitude: amplitude * factor, unit: unit.to_string(), period_s: *period_s }
        }
        Note::Resolution { part } => NoteKind::Resolution { percent: 100.0 * part },
        Note::Transient { time_constant_s, size, from_s } => {
            NoteKind::Transient { size: size * factor, unit: unit.to_string(), time_constant_s: *time_constant_s, from_s: from_s.ceil() }
        }
        Note::SlowNoiseTogether => NoteKind::SlowNoiseTogether,
        Note::Unexplained { misfit } => NoteKind::Unexplained { misfit: *misfit },
        Note::LongTimesOmitted { above_s } => NoteKind::LongTimesOmitted { above_s: *above_s },
        Note::ShortTimesOmitted { below_s } => NoteKind::ShortTimesOmitted { below_s: *below_s },
    }
}

/// What was analysed.
pub(super) fn title(answer: &Answer) -> String {
    let taken = if answer.interpretation == Interpretation::Integral { ", interpreted as an integral" } else { "" };
    format!(
        "{}: {}{taken}, {} rows, {} s at {} s",
        answer.log,
        answer.column,
        grouped(answer.rows),
        plain(answer.duration_s(), 6),
        plain(answer.interval_s, 6)
    )
}

/// Name of a process for this column.
pub(super) fn name(answer: &Answer, process: &Process) -> &'static str {
    if answer.unit.rad().is_some() { process.name } else { process.plain_name }
}

/// The value of coefficient `p` with its standard uncertainty, or the reason why it has none.
pub(super) fn value(answer: &Answer, display: &Display, p: usize) -> String {
    let (coefficient, process) = (&answer.coefficients[p], &PROCESSES[p]);
    let (scale, unit) = (display.coefficient(p).factor, &display.coefficient(p).unit);
    let Some(found) = &coefficient.estimate else { return not_shown(answer, display, p).unwrap_or_default() };
    let floor = if process.letter == "B" {
        format!("; floor of the curve 0.664 B = {} {unit}", significant(FLOOR * found.value * scale, 3))
    } else {
        String::new()
    };
    let range = coefficient.within_95.map_or(String::new(), |[low, high]| {
        format!(", 95 % between {} and {} {unit}", significant(low * scale, 3), significant(high * scale, 3))
    });
    format!("{}{range}{floor}", estimate(found, display.coefficient(p)))
}

/// One-sided noise density √2 N in the units of data sheets.
pub(super) fn density(answer: &Answer, display: &Display) -> Option<String> {
    let shown = std::f64::consts::SQRT_2 * answer.coefficients[WHITE].estimate?.value;
    let each: Vec<String> =
        display.densities().iter().map(|scale| format!("{} {}", significant(shown * scale.factor, 4), scale.unit)).collect();
    Some(format!("one-sided density √2 N = {}", each.join(" = ")))
}

fn lowest(answer: &Answer, display: &Display) -> Option<String> {
    let found = answer.lowest.as_ref()?;
    let (scale, unit) = (display.deviation().factor, &display.deviation().unit);
    let low = format!("lowest point {} {unit} at {} s", significant(found.oadev * scale, 3), significant(found.tau_s, 3));
    Some(if found.inside {
        format!(
            "{low}, over 0.664: {} {unit} (bias instability as defined in data sheets{})",
            with_sigma(found.over_floor * scale, found.uncertainty.expanded() * scale),
            if answer.coefficients[FLICKER].estimate.is_some() { ", includes the other processes" } else { "" }
        )
    } else {
        let floor = if answer.coefficients[FLICKER].estimate.is_some() {
            "the curve still decreases towards 0.664 B"
        } else {
            "no floor is visible"
        };
        format!("{low}, at the end of the range used: {floor}")
    })
}

fn read(answer: &Answer) -> Option<String> {
    let [from, to] = answer.read_s?;
    Some(format!(
        "coefficients from τ = {} s to T/10 = {} s; χ² per degree of freedom {}",
        significant(from, 3),
        significant(to, 3),
        significant(answer.misfit?, 2)
    ))
}

fn quantum(answer: &Answer) -> Option<String> {
    let unit = Unit::of(&answer.column).name;
    answer.quantum.map(|quantum| format!("least significant bit of the column: {} {unit}", significant(quantum, 3)))
}

/// Lowest point, range of the fit and resolution.
pub(super) fn facts(answer: &Answer, display: &Display) -> Vec<String> {
    [lowest(answer, display), read(answer), quantum(answer)].into_iter().flatten().collect()
}
