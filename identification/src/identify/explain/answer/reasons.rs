//! Reasons and remarks of an explanation, as data; `report` words them.

use drive_model::Requirement;

use crate::identify::fit::held_out::Departure;
use crate::model::Channel;

/// Why an effect cannot be the explanation, whatever its gain.
#[derive(Debug, Clone, PartialEq)]
pub enum Refusal {
    /// A parameter is zero within its error, which makes the effect another one.
    ReducesTo {
        /// The parameter.
        parameter: String,
        /// The effect without it.
        effect: &'static str,
    },
    /// A number of periods per turn is whole within its error, which makes the effect another one.
    WholeOrder {
        /// The parameter.
        parameter: String,
        /// Its value.
        value: f64,
        /// The effect with a whole order.
        effect: &'static str,
    },
    /// An amplitude is at zero or would be negative.
    NegativeAmplitude {
        /// The parameter; `None` where the effect was only screened.
        parameter: Option<String>,
    },
    /// A parameter leaves its physical range.
    OutsideRange {
        /// The parameter.
        parameter: String,
        /// It belongs to the effect itself; otherwise to the model, whose parameter was within its range before.
        own: bool,
        /// Its value.
        value: f64,
        /// Its physical range.
        range: (f64, f64),
    },
    /// The whitened residuals are not smaller with it.
    NoGain,
    /// The error on the held-out rows grows.
    HeldOutErrorGrows {
        /// Gain on the held-out rows.
        gain: f64,
    },
    /// A small gain that the held-out rows do not confirm.
    NotConfirmed {
        /// Gain on the fitted rows.
        gain: f64,
        /// Gain on the held-out rows.
        heldout_gain: f64,
    },
    /// Only noise is left without it, and its gain is small.
    OnlyNoiseLeft {
        /// Gain on the fitted rows.
        gain: f64,
        /// Gain that would be needed.
        min_gain: f64,
    },
    /// A jump of the angle by less than a count of the encoder.
    LessThanACount {
        /// The parameter.
        parameter: String,
        /// The jump, rad.
        jump_rad: f64,
        /// A count, rad.
        count_rad: f64,
    },
    /// Its gain may come from the voltage within the rows, whose course the log leaves open.
    CourseOpen {
        /// Gain on the fitted rows.
        gain: f64,
        /// Part of it that remains beside the variance by the course.
        gain_beside_course: f64,
    },
    /// The error of a channel on the held-out rows grows.
    ChannelErrorGrows {
        /// The channel.
        channel: Channel,
        /// Ratio of its χ²/n with the effect to that without it.
        ratio: f64,
    },
    /// Much is left, and the effect removes hardly any of it.
    InsignificantPart {
        /// Smallest ratio of a channel's χ²/n with the effect to that without it.
        ratio: f64,
    },
    /// The fit of one log gets worse.
    LogGetsWorse {
        /// Number of the log, from 0.
        log: usize,
        /// Gain on this log.
        gain: f64,
    },
    /// The model's own parameters imitate it.
    NotIdentifiable {
        /// Fraction of its sensitivity that they cannot imitate.
        identifiable_fraction: f64,
    },
}

/// Why the logs, or the model, cannot show an effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NotVisible {
    /// A condition of its card is not met.
    Unmet(Requirement),
    /// The model lacks the effect on which it rests.
    RestsOn(&'static str),
    /// The winding temperature changes too little.
    TemperatureSpan {
        /// Its span, K.
        span_K: f64,
        /// Span that is needed, K.
        min_K: f64,
    },
    /// The logs cover too few turns.
    Turns {
        /// Turns of the logs.
        turns: f64,
        /// Turns that are needed.
        min: f64,
        /// The effect that fewer turns do not distinguish from it, where there is one.
        rival: Option<&'static str>,
    },
    /// An effect of the model includes it.
    IncludedIn(&'static str),
    /// An effect of the model takes its place.
    AlternativeTo(&'static str),
}

/// A remark for the user on the computation.
#[derive(Debug, Clone, PartialEq)]
pub enum Remark {
    /// The fit of the given model shifts a physical constant by a decade or more.
    ShiftedConstant(crate::log::plausible::ShiftedConstant),
    /// The parameters of the last model are those of largest likelihood of the prediction errors.
    ByPredictionErrors,
    /// Of a standard error of the last model, the larger part is by the voltage within the rows, for which a random walk is assumed.
    RestsOnCourse,
    /// A remark on the preparation of the log.
    Preparation(crate::recording::prepare::PreparationNote),
    /// These effects were added last and help too little far above the noise: they were removed.
    StandInsRemoved {
        /// Their names.
        effects: Vec<String>,
    },
    /// An effect is not needed any more beside later ones.
    NoLongerNeeded {
        /// Its name.
        effect: String,
        /// The later ones.
        beside: Vec<String>,
    },
    /// Parameters that the last model did not fit, although it leaves a structure: a wrong fixed value looks like one too.
    NotFree {
        /// Those that the model file fixes.
        fixed: Vec<String>,
        /// Those at the end of their range.
        at_bounds: Vec<String>,
    },
    /// A bridge that coasts in the off time of its PWM, which no note states, would fit better.
    MayCoast {
        /// Factor by which the rms of the residual falls, geometric mean over the compared values.
        decrease: f64,
    },
    /// An effect would not be added to the others at the end of the search.
    NotNeededAtEnd {
        /// Its name.
        effect: String,
        /// The others.
        beside: Vec<String>,
    },
    /// An effect is a small part of what was measured: an error of the model or of the readings that no catalogue has may look like it.
    SmallPart {
        /// Its name.
        effect: String,
        /// Rms that it explains over the standard deviation of the measured values, in the channel where that is largest.
        part: f64,
    },
    /// A rival fits better in the place of an effect, beside later ones.
    Exchanged {
        /// The effect.
        effect: String,
        /// Its rival.
        by: String,
        /// The later ones.
        beside: Vec<String>,
    },
    /// An effect has another name from here on: another of its kind was removed.
    Renamed {
        /// Old name.
        from: String,
        /// New name.
        to: String,
    },
    /// One unknown structure describes the logs better than these effects together.
    UnknownStructureBetter {
        /// The effects.
        effects: Vec<String>,
    },
    /// The residual of a channel is coloured noise: it depends on nothing that was put in.
    ColouredNoise {
        /// The channel.
        channel: Channel,
        /// Rms over the white noise.
        ratio: f64,
        /// Time over which it is correlated, s.
        correlation_s: f64,
    },
    /// What is left is no more than the input may have done between its samples.
    InputBetweenSamples {
        /// The column of the input.
        column: &'static str,
        /// Rms difference of two ways to fill the time between the samples, in the unit of the column.
        rms: f64,
    },
    /// What is left is no more than the rounding of the input's column makes.
    InputRounded {
        /// The column of the input.
        column: &'static str,
        /// Its step, in its unit.
        step: f64,
    },
    /// What is left is no more than the unknown age of a sensor's newest sample makes.
    SampleAge {
        /// The channel.
        channel: Channel,
        /// Its rms error by the age, in the unit of the channel.
        rms: f64,
        /// Interval of the samples, s.
        interval_s: f64,
    },
    /// Rows that are usually held out leave far more than the fitted ones: all rows are fitted.
    NothingHeldOut(Departure),
    /// The temperature of the winding has no scale in this log: its thermal resistance was assumed.
    TemperatureScale {
        /// The assumed thermal resistance, K/W.
        assumed_K_W: f64,
        /// Thermal resistance of a copper winding, K/W.
        copper_K_W: f64,
        /// Heat capacity of a copper winding, J/K.
        copper_J_K: f64,
    },
    /// These effects leave too much of the error to be its cause.
    TooMuchLeft {
        /// The effects.
        effects: Vec<String>,
        /// Fraction of the excess χ²/n that they leave.
        remainder: f64,
        /// It is left on the held-out rows.
        heldout: bool,
    },
}

/// The present stage of the computation.
#[derive(Debug, Clone, PartialEq)]
pub enum Progress {
    /// The given model is fitted.
    FittingGiven,
    /// All effects are tried.
    Trying {
        /// The effect that was added last.
        added: Option<String>,
    },
    /// The remainder is examined.
    ExaminingRemainder,
}
