//! Sentences for the typed reasons, remarks and proposals of an explanation.

use drive_model::{Card, Coordinate, Requirement, StandRun};
use hal_sim::plant::Stand;
use schemars::JsonSchema;
use serde::Serialize;

use super::names::{card, first_lower};
use crate::coordinates::AxisLabel;
use crate::{column, listed, numbers, unit};
use identification::identify::explain::{
    Explanation, NotVisible, Progress, Purpose, Refusal, Remark, Repeated, Separation, Shape, ShapeForm,
};
use identification::log::Axis;
use identification::model::{Channel, SummingPoint};

/// Why an effect was refused.
pub fn refusal(axis: Axis, reason: &Refusal) -> String {
    match reason {
        Refusal::ReducesTo { parameter, effect } => format!("{parameter} is zero within its error, which reduces the effect to {effect}"),
        Refusal::WholeOrder { parameter, value, effect } => {
            format!("{parameter} = {} is whole within its error, which makes the effect {effect}", numbers::significant(*value, 5))
        }
        Refusal::NegativeAmplitude { parameter: Some(parameter) } => format!("{parameter} would have to be negative"),
        Refusal::NegativeAmplitude { parameter: None } => "the best amplitude would be negative, which is unphysical".to_owned(),
        Refusal::OutsideRange { parameter, own, value, .. } => {
            let owner = if *own { "" } else { "with it the model's " };
            format!("{owner}{parameter} would be {value:.3e}, outside its physical range")
        }
        Refusal::NoGain => "the residuals are not smaller with it".to_owned(),
        Refusal::HeldOutErrorGrows { .. } => "the error on the held-out rows grows".to_owned(),
        Refusal::NotConfirmed { .. } => "its small gain is not confirmed by the held-out rows".to_owned(),
        Refusal::OnlyNoiseLeft { .. } => "only noise is left without it, and its gain is too small to be significant".to_owned(),
        Refusal::LessThanACount { parameter, jump_rad, count_rad } => {
            format!("{parameter} would be {jump_rad:.3e}, less than a count of the encoder ({count_rad:.3e} rad)")
        }
        Refusal::CourseOpen { .. } => "its gain may come from the voltage within the rows, whose course the log leaves open".to_owned(),
        Refusal::ChannelErrorGrows { channel, .. } => format!("the error of {} on the held-out rows grows", column(axis, *channel)),
        Refusal::InsignificantPart { .. } => "much is left, and it removes hardly any of it".to_owned(),
        Refusal::LogGetsWorse { log, .. } => format!("it improves the fit of the logs together and worsens that of log {}", log + 1),
        Refusal::NotIdentifiable { .. } => "not distinguishable from the model's own parameters in this log".to_owned(),
    }
}

/// Why an effect was refused, for programs.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum RefusalKind {
    /// A parameter is zero, which makes the effect another one.
    ReducesTo {
        /// The parameter.
        parameter: String,
        /// The effect.
        effect: String,
    },
    /// A number of periods is whole, which makes the effect another one.
    WholeOrder {
        /// The parameter.
        parameter: String,
        /// Its value.
        value: f64,
        /// The effect.
        effect: String,
    },
    /// A parameter would be negative.
    NegativeParameter {
        /// The parameter.
        parameter: String,
    },
    /// The amplitude would be negative.
    NegativeAmplitude,
    /// A parameter leaves its range.
    OutsideRange {
        /// The parameter.
        parameter: String,
        /// Its value.
        value: f64,
    },
    /// A parameter of the model leaves its range.
    ModelOutsideRange {
        /// The parameter.
        parameter: String,
        /// Its value.
        value: f64,
    },
    /// The residuals are not smaller.
    NoGain,
    /// The error on the held-out rows grows.
    HeldOutErrorGrows,
    /// The held-out rows do not confirm the gain.
    NotConfirmed,
    /// Only noise is left without it.
    OnlyNoiseLeft,
    /// A jump by less than a count.
    LessThanACount {
        /// The parameter.
        parameter: String,
        /// Its value.
        value: f64,
        /// A count of the encoder, rad.
        count_rad: f64,
    },
    /// The course of the voltage within the rows may be the cause.
    CourseOpen,
    /// The error of a channel grows.
    ChannelErrorGrows {
        /// The channel.
        channel: &'static str,
    },
    /// It removes hardly anything.
    InsignificantPart,
    /// One log gets worse.
    LogGetsWorse {
        /// Number of the log, from 1.
        log: usize,
    },
    /// The model's own parameters imitate it.
    NotIdentifiable,
}

/// Why an effect was refused, for programs.
pub fn refusal_kind(axis: Axis, reason: &Refusal) -> RefusalKind {
    match reason {
        Refusal::ReducesTo { parameter, effect } => RefusalKind::ReducesTo { parameter: parameter.clone(), effect: (*effect).to_owned() },
        Refusal::WholeOrder { parameter, value, effect } => {
            RefusalKind::WholeOrder { parameter: parameter.clone(), value: *value, effect: (*effect).to_owned() }
        }
        Refusal::NegativeAmplitude { parameter: Some(parameter) } => RefusalKind::NegativeParameter { parameter: parameter.clone() },
        Refusal::NegativeAmplitude { parameter: None } => RefusalKind::NegativeAmplitude,
        Refusal::OutsideRange { parameter, own: true, value, .. } => {
            RefusalKind::OutsideRange { parameter: parameter.clone(), value: *value }
        }
        Refusal::OutsideRange { parameter, value, .. } => RefusalKind::ModelOutsideRange { parameter: parameter.clone(), value: *value },
        Refusal::NoGain => RefusalKind::NoGain,
        Refusal::HeldOutErrorGrows { .. } => RefusalKind::HeldOutErrorGrows,
        Refusal::NotConfirmed { .. } => RefusalKind::NotConfirmed,
        Refusal::OnlyNoiseLeft { .. } => RefusalKind::OnlyNoiseLeft,
        Refusal::LessThanACount { parameter, jump_rad, count_rad } => {
            RefusalKind::LessThanACount { parameter: parameter.clone(), value: *jump_rad, count_rad: *count_rad }
        }
        Refusal::CourseOpen { .. } => RefusalKind::CourseOpen,
        Refusal::ChannelErrorGrows { channel, .. } => RefusalKind::ChannelErrorGrows { channel: column(axis, *channel) },
        Refusal::InsignificantPart { .. } => RefusalKind::InsignificantPart,
        Refusal::LogGetsWorse { log, .. } => RefusalKind::LogGetsWorse { log: log + 1 },
        Refusal::NotIdentifiable { .. } => RefusalKind::NotIdentifiable,
    }
}

/// Why the log, or the model, cannot show an effect, for programs.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum NotVisibleKind {
    /// The model lacks the effect on which it rests.
    RestsOn {
        /// The effect.
        effect: String,
    },
    /// The temperature changes too little.
    TemperatureSpan {
        /// Span of the log, K.
        span_K: f64,
        /// Span that is needed, K.
        min_K: f64,
    },
    /// Too few turns.
    Turns {
        /// Turns of the log.
        turns: f64,
        /// Turns that are needed.
        min: f64,
    },
    /// Too few turns to distinguish it from a rival.
    TurnsForRival {
        /// Turns of the log.
        turns: f64,
        /// Turns that are needed.
        min: f64,
        /// The rival.
        rival: String,
    },
    /// An effect of the model includes it.
    IncludedIn {
        /// The effect.
        effect: String,
    },
    /// An effect of the model takes its place.
    AlternativeTo {
        /// The effect.
        effect: String,
    },
    /// The voltage is not a command.
    CommandedVoltage,
    /// Needs voltage.
    NeedsVoltage,
    /// Needs motor constant.
    NeedsMotorConstant,
    /// Needs angle.
    NeedsAngle,
    /// Needs angle reading.
    NeedsAngleReading,
    /// Needs compared angle.
    NeedsComparedAngle,
    /// Needs rate.
    NeedsRate,
    /// Needs rate or sensor angle.
    NeedsRateOrSensorAngle,
    /// Needs current.
    NeedsCurrent,
    /// Needs temperature.
    NeedsTemperature,
    /// Needs temperature change.
    NeedsTemperatureChange,
    /// Needs turns.
    NeedsTurns,
    /// Needs simulated current.
    NeedsSimulatedCurrent,
    /// Needs simulated motion.
    NeedsSimulatedMotion,
    /// Needs no other shaft.
    NeedsNoOtherShaft,
}

/// Why the log, or the model, cannot show an effect, for programs.
pub fn not_visible_kind(reason: &NotVisible) -> NotVisibleKind {
    match reason {
        NotVisible::Unmet(requirement) => unmet_kind(*requirement),
        NotVisible::RestsOn(effect) => NotVisibleKind::RestsOn { effect: (*effect).to_owned() },
        NotVisible::TemperatureSpan { span_K, min_K } => NotVisibleKind::TemperatureSpan { span_K: *span_K, min_K: *min_K },
        NotVisible::Turns { turns, min, rival: None } => NotVisibleKind::Turns { turns: *turns, min: *min },
        NotVisible::Turns { turns, min, rival: Some(rival) } => {
            NotVisibleKind::TurnsForRival { turns: *turns, min: *min, rival: (*rival).to_owned() }
        }
        NotVisible::IncludedIn(effect) => NotVisibleKind::IncludedIn { effect: (*effect).to_owned() },
        NotVisible::AlternativeTo(effect) => NotVisibleKind::AlternativeTo { effect: (*effect).to_owned() },
    }
}

/// A condition that is not met, for programs.
fn unmet_kind(requirement: Requirement) -> NotVisibleKind {
    match requirement {
        Requirement::CommandedVoltage => NotVisibleKind::CommandedVoltage,
        Requirement::Voltage => NotVisibleKind::NeedsVoltage,
        Requirement::MotorConstant => NotVisibleKind::NeedsMotorConstant,
        Requirement::Angle => NotVisibleKind::NeedsAngle,
        Requirement::AngleReading => NotVisibleKind::NeedsAngleReading,
        Requirement::ComparedAngle => NotVisibleKind::NeedsComparedAngle,
        Requirement::ComparedRate => NotVisibleKind::NeedsRate,
        Requirement::RateOrSensorAngle => NotVisibleKind::NeedsRateOrSensorAngle,
        Requirement::ComparedCurrent => NotVisibleKind::NeedsCurrent,
        Requirement::MeasuredTemperature => NotVisibleKind::NeedsTemperature,
        Requirement::TemperatureChange => NotVisibleKind::NeedsTemperatureChange,
        Requirement::Turns { .. } => NotVisibleKind::NeedsTurns,
        Requirement::SimulatedCurrent => NotVisibleKind::NeedsSimulatedCurrent,
        Requirement::SimulatedMotion => NotVisibleKind::NeedsSimulatedMotion,
        Requirement::NoOtherShaft => NotVisibleKind::NeedsNoOtherShaft,
    }
}

/// Why the log, or the model, cannot show an effect.
pub fn not_visible(reason: &NotVisible) -> String {
    match reason {
        NotVisible::Unmet(requirement) => unmet(*requirement).to_owned(),
        NotVisible::RestsOn(effect) => format!("needs {effect} in the model"),
        NotVisible::TemperatureSpan { span_K, min_K } => {
            format!("the temperature changes by {} K only, less than {} K", numbers::significant(*span_K, 2), numbers::plain(*min_K, 2))
        }
        NotVisible::Turns { turns, min, rival } => {
            let rival = rival.map_or(String::new(), |rival| format!(" to be distinguishable from {rival}"));
            format!("needs {} turns or more{rival}; the log covers {}", numbers::plain(*min, 2), numbers::significant(*turns, 2))
        }
        NotVisible::IncludedIn(effect) => format!("{effect} in the model includes it"),
        NotVisible::AlternativeTo(effect) => format!("an alternative to {effect} in the model: exchange the two to try it"),
    }
}

/// A condition that is not met.
fn unmet(requirement: Requirement) -> &'static str {
    match requirement {
        Requirement::CommandedVoltage => "u_V was measured at the motor's terminals, after the bridge",
        Requirement::Voltage => "needs the voltage as the model's input (u_V)",
        Requirement::MotorConstant => "needs the voltage or the current as the model's input",
        Requirement::Angle => "needs the angle of the platform (theta_rad)",
        Requirement::AngleReading => "needs the angle among the model's outputs, or a rate that is compared with it",
        Requirement::ComparedAngle => "needs the angle among the model's outputs",
        Requirement::ComparedRate => "needs a measured rate (omega_rad_s)",
        Requirement::RateOrSensorAngle => {
            "needs a measured rate (omega_rad_s), or an angle sensor beside a known motion (theta_sensor_rad)"
        }
        Requirement::ComparedCurrent => "needs a measured current besides the voltage (i_A)",
        Requirement::MeasuredTemperature => "needs the winding temperature (temp_C)",
        Requirement::TemperatureChange => "needs a change of the winding temperature",
        Requirement::Turns { .. } => "needs more turns",
        Requirement::SimulatedCurrent => "the motion is prescribed and the current is compared: the current would explain itself",
        Requirement::SimulatedMotion => "the motion is prescribed, so that it changes nothing that is simulated",
        Requirement::NoOtherShaft => "another effect of the model has a shaft already",
    }
}

/// A remark.
pub fn remark(axis: Axis, remark: &Remark) -> String {
    match remark {
        Remark::Preparation(note) => crate::preparation::note(axis, note),
        Remark::ByPredictionErrors => crate::preparation::BY_PREDICTION_ERRORS.to_owned(),
        Remark::RestsOnCourse => crate::preparation::RESTS_ON_COURSE.to_owned(),
        Remark::ShiftedConstant(shifted) => crate::preparation::constant(axis, shifted),
        Remark::StandInsRemoved { effects } => {
            format!("Removed again: {}. The residual stays far above the noise, and their improvement is too small.", listed(effects))
        }
        Remark::NoLongerNeeded { effect, beside } => format!("{effect} was added first and is no longer needed beside {}.", listed(beside)),
        Remark::NotFree { fixed, at_bounds } => {
            let part = |names: &[String], why: &str| {
                let names: Vec<String> = names.iter().map(|name| axis.parameter(name)).collect();
                (!names.is_empty()).then(|| format!("{} ({why})", listed(&names)))
            };
            let parts: Vec<String> =
                [part(fixed, "fixed in the model"), part(at_bounds, "at the end of the range")].into_iter().flatten().collect();
            format!(
                "Not free: {}. A wrong fixed value, or a value that the range keeps away, looks like a missing structure too.",
                parts.join("; ")
            )
        }
        Remark::MayCoast { decrease } => format!(
            "With a bridge that coasts in the off time of its PWM the given model would fit better: the residual falls by a factor of {} (rms, mean over the channels). If the bridge does so, state it: --note u_V=coasting.",
            numbers::significant(*decrease, 2)
        ),
        Remark::NotNeededAtEnd { effect, beside } => {
            format!("{effect} was added, but is not significant beside {}; it was removed.", listed(beside))
        }
        Remark::SmallPart { effect, part } => format!(
            "{effect} is small: {} % of the measured motion in the channel that shows it most (rms). It is significant, but an error of the readings or of the model that is not in the catalogue may look the same at this size. Repeat the log with another excitation before you rely on the name.",
            numbers::significant(100.0 * part, 1)
        ),
        Remark::Exchanged { effect, by, beside } => {
            format!("{effect} was added first; beside {} {by} fits better in its place.", listed(beside))
        }
        Remark::Renamed { from, to } => format!("From here on {from} is named {to}."),
        Remark::UnknownStructureBetter { effects } => {
            format!("One unknown structure fits the log better than {} together; none of them is named as the cause.", listed(effects))
        }
        Remark::ColouredNoise { channel, ratio, correlation_s } => format!(
            "The residual of {} is coloured noise: {} × its white noise, correlated over {} ms, and independent of the input, the motion and the other channels.",
            channel.column(),
            numbers::significant(*ratio, 3),
            numbers::significant(1e3 * correlation_s, 2)
        ),
        Remark::InputBetweenSamples { column, rms } => format!(
            "{column} is known at the times of the rows only; what it did between them is uncertain by {} (rms), and the residual is no larger than that explains. Smaller effects are not visible in this log: record means over the row, or a higher row rate.",
            numbers::significant(*rms, 2)
        ),
        Remark::InputRounded { column, step } => format!(
            "{column} is rounded to steps of {}; the drive saw other values, and the residual is no larger than that explains. Smaller effects are not visible in this log: record the input with a finer resolution.",
            numbers::significant(*step, 2)
        ),
        Remark::SampleAge { channel, rms, interval_s } => format!(
            "A reading of {} is the newest of samples every {} ms, of unknown age; while the rate changes this is an error of {} {} (rms), and the residual is no larger. Smaller effects are not visible in this log: hold constant rates, or change the rate more slowly.",
            column(axis, *channel),
            numbers::significant(1e3 * interval_s, 2),
            numbers::significant(*rms, 2),
            unit(axis, *channel)
        ),
        Remark::NothingHeldOut(departure) => {
            format!("{} All rows are fitted, and none is left for validation.", crate::preparation::departs(axis, departure))
        }
        Remark::TemperatureScale { assumed_K_W, copper_K_W, copper_J_K } => format!(
            "No temperature is measured, so that this log determines resistance_per_K / thermal_J_K and thermal_J_K × thermal_K_W alone: resistance_per_K and thermal_J_K, and their ±, hold for thermal_K_W = {} only. For a copper winding, resistance_per_K = 0.0039, they are thermal_K_W = {} and thermal_J_K = {}.",
            numbers::significant(*assumed_K_W, 3),
            numbers::significant(*copper_K_W, 3),
            numbers::significant(*copper_J_K, 3)
        ),
        Remark::TooMuchLeft { effects, remainder, heldout } => format!(
            "{} of the error remains with {}{}; none of them is named as the cause.",
            percent(*remainder),
            listed(effects),
            if *heldout { ", on held-out rows" } else { "" }
        ),
    }
}

fn percent(fraction: f64) -> String {
    format!("{:.0} %", 100.0 * fraction)
}

/// All remarks.
pub fn remarks(e: &Explanation) -> Vec<String> {
    e.remarks.iter().map(|r| remark(e.model.axis(), r)).collect()
}

/// The present stage of the computation.
pub fn progress(progress: &Progress) -> String {
    match progress {
        Progress::FittingGiven => "fitting the given model".to_owned(),
        Progress::Trying { added: None } => "trying every effect of the catalogue".to_owned(),
        Progress::Trying { added: Some(effect) } => format!("{effect} added; trying further effects"),
        Progress::ExaminingRemainder => "examining the residual".to_owned(),
    }
}

/// The form of a shape in one sentence.
pub fn shape(axis: Axis, shape: &Shape) -> String {
    match shape.form {
        ShapeForm::PiecewiseLinear { largest } => {
            let what = match shape.acts_on {
                SummingPoint::Voltage => "a voltage",
                SummingPoint::Dry => "a Coulomb friction",
                SummingPoint::Rate => "an error of the rate reading",
                SummingPoint::Angle => "an error of the angle reading",
                _ => "a torque",
            };
            let (_, unit) = acts_on(axis, shape.acts_on);
            format!(
                "The residual looks like {what} that depends on the {}: up to {largest:.2e} {unit} from its median.",
                over(shape.coordinate)
            )
        }
        ShapeForm::Oscillation { frequency_Hz, amplitude } => {
            let what = if shape.acts_on == SummingPoint::Voltage { "a part of the commanded voltage" } else { "a torque" };
            let (_, unit) = acts_on(axis, shape.acts_on);
            format!("The residual looks like {what} that oscillates at {frequency_Hz:.3} Hz with the amplitude {amplitude:.2e} {unit}.")
        }
    }
}

/// Form of a structure that no effect of the catalogue has, for programs.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum ShapeKind {
    /// A voltage, piecewise linear.
    Voltage {
        /// Largest magnitude.
        largest: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// A friction, piecewise linear.
    Friction {
        /// Largest magnitude.
        largest: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// An error of a reading, piecewise linear.
    Reading {
        /// The channel.
        channel: &'static str,
        /// Largest magnitude.
        largest: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// A torque, piecewise linear.
    Torque {
        /// Largest magnitude.
        largest: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// A voltage at one frequency.
    VoltageOscillation {
        /// Hz.
        frequency_Hz: f64,
        /// Amplitude.
        amplitude: f64,
    },
    /// A torque at one frequency.
    Oscillation {
        /// Hz.
        frequency_Hz: f64,
        /// Amplitude.
        amplitude: f64,
        /// Its unit.
        unit: &'static str,
    },
}

/// The form of a shape, for programs.
pub fn shape_kind(axis: Axis, shape: &Shape) -> ShapeKind {
    let unit = acts_on(axis, shape.acts_on).1;
    let is_voltage = shape.acts_on == SummingPoint::Voltage;
    match shape.form {
        ShapeForm::PiecewiseLinear { largest } if is_voltage => ShapeKind::Voltage { largest, unit },
        ShapeForm::PiecewiseLinear { largest } if shape.acts_on == SummingPoint::Dry => ShapeKind::Friction { largest, unit },
        ShapeForm::PiecewiseLinear { largest } if matches!(shape.acts_on, SummingPoint::Rate | SummingPoint::Angle) => {
            ShapeKind::Reading { channel: shape.acts_on.key(), largest, unit }
        }
        ShapeForm::PiecewiseLinear { largest } => ShapeKind::Torque { largest, unit },
        ShapeForm::Oscillation { frequency_Hz, amplitude } if is_voltage => ShapeKind::VoltageOscillation { frequency_Hz, amplitude },
        ShapeForm::Oscillation { frequency_Hz, amplitude } => ShapeKind::Oscillation { frequency_Hz, amplitude, unit },
    }
}

fn over(coordinate: Coordinate) -> &'static str {
    match coordinate {
        Coordinate::Theta => "angle",
        Coordinate::Omega => "rate",
        Coordinate::Current => "current",
        Coordinate::Temperature => "temperature",
        _ => "time",
    }
}

/// Label of the axis over which a shape is drawn.
pub fn along(axis: Axis, shape: &Shape) -> AxisLabel {
    let (name, unit) = match (shape.form, shape.coordinate) {
        (ShapeForm::Oscillation { .. }, _) => ("time within a period", "s"),
        (_, Coordinate::Theta) => ("angle within the turn", "rad"),
        (_, Coordinate::Omega) => ("rate", "rad/s"),
        (_, Coordinate::Current) => ("current", "A"),
        (_, Coordinate::Temperature) => ("winding temperature", "°C"),
        _ => ("time", "s"),
    };
    AxisLabel { name: axis.quantity(name), unit: axis.unit(unit) }
}

/// Name and unit of what a shape acts on.
pub fn acts_on(axis: Axis, point: SummingPoint) -> (&'static str, &'static str) {
    match point {
        SummingPoint::Torque => ("residual torque", "N m"),
        SummingPoint::Dry => ("residual Coulomb torque", "N m"),
        SummingPoint::Voltage => ("residual voltage", "V"),
        SummingPoint::Rate => ("residual of the rate", unit(axis, Channel::Rate)),
        SummingPoint::Angle => ("residual of the angle", unit(axis, Channel::Angle)),
        SummingPoint::Current => ("residual of the current", unit(axis, Channel::Current)),
    }
}

/// The command of a session.
pub fn command(run: &StandRun) -> String {
    let StandRun { mode, profile, amplitude, duration_s } = run;
    format!("stand sim --out next.parquet --mode {mode} --profile {profile} --amplitude {amplitude} --seconds {duration_s}")
}

/// What the next experiment is for, and where it runs; `None` where none is proposed.
pub fn next_experiment(e: &Explanation) -> Option<String> {
    let next = e.next.as_ref()?;
    let simulated = e.log.note("stand").is_some_and(|s| s == Stand::default().name);
    let place = if simulated {
        "If the log was simulated with --hidden or --stand, add the same option to the command."
    } else {
        "The command runs on the simulated stand. On your stand, record this profile with a suitable amplitude."
    };
    Some(format!("{}. {}{place}", purpose(&next.purpose).trim_end_matches('.'), expectation(e, &next.expected)))
}

/// What the runs of the stand are expected to bring, with a space at the end; empty where nothing was computed.
fn expectation(e: &Explanation, expected: &[Separation]) -> String {
    let Some((best, others)) = expected.split_first() else { return String::new() };
    let delta_bic = |s: &Separation| numbers::significant(s.expected_delta_bic, 2);
    let name = |run: &StandRun| format!("{} of {} {}", run.profile, run.amplitude, if run.mode == "rate" { "rad/s" } else { "V" });
    if best.expected_delta_bic < e.criteria.evidence.min_bic_difference {
        return format!(
            "With what this log shows of them, no run of the stand separates them: the best, {}, is expected to bring ΔBIC = {}. Parts that the log does not show may differ. ",
            name(&best.run),
            delta_bic(best)
        );
    }
    let next = others.first().map_or(String::new(), |s| format!("; next best: {}, {}", name(&s.run), delta_bic(s)));
    format!("Expected from {}: ΔBIC = {}{next}, computed with the fitted model. ", name(&best.run), delta_bic(best))
}

fn purpose(purpose: &Purpose) -> String {
    let experiment = |card: Option<&Card>| card.map_or(String::new(), |c| first_lower(c.description.experiment));
    match purpose {
        Purpose::Distinguish { effect, rival, repeated: Some(Repeated::ChangeOfStand(change)), .. } => {
            format!("{effect} is not distinguishable from {rival} in this log, which is already the run that separates them best. {change}")
        }
        Purpose::Distinguish { effect, rival, difference, repeated: Some(Repeated::OtherRun) } => format!(
            "{effect} is not distinguishable from {rival} in this log, which is already the run that separates them best.{} Record a run with another excitation, and give both logs to `stand explain`",
            difference.map_or(String::new(), |difference| format!(" {difference}."))
        ),
        Purpose::Distinguish { effect, rival, difference: Some(difference), repeated: None } => {
            format!("{effect} is not distinguishable from {rival} in this log. {difference}")
        }
        Purpose::Distinguish { effect, rival, difference: None, repeated: None } => format!(
            "{effect} is not distinguishable from {rival} in this log. The best experiment for {effect}: {} The best experiment for {rival}: {}",
            experiment(card(effect)),
            experiment(card(rival))
        ),
        Purpose::BothDirections => {
            "The log has one direction of rotation only: Coulomb friction, a load and direction-dependent friction are not distinguishable. Pass through zero in both directions"
                .to_owned()
        }
        Purpose::Determine { effect } => {
            format!("To see {effect} better, and to estimate its parameters more precisely: {}", experiment(drive_model::card(effect)))
        }
        Purpose::Repeat => {
            "Repeat the measurement with other rates. An effect of the stand repeats over the same angle, rate or current; a single event does not"
                .to_owned()
        }
        Purpose::SlowTurns => {
            "The log has few slow whole turns, in which effects that depend on the angle are most visible. Rotate slowly to be sure".to_owned()
        }
    }
}

/// What the next experiment is for, for programs.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum PurposeKind {
    /// A change of the stand separates two effects.
    ChangeOfStand {
        /// The effect.
        effect: String,
        /// The rival.
        rival: String,
        /// Sentences of the catalogue.
        catalogue: Vec<&'static str>,
    },
    /// Another run separates two effects.
    OtherRun {
        /// The effect.
        effect: String,
        /// The rival.
        rival: String,
        /// Sentences of the catalogue.
        catalogue: Vec<&'static str>,
    },
    /// Two effects are to be distinguished.
    Distinguish {
        /// The effect.
        effect: String,
        /// The rival.
        rival: String,
        /// Sentences of the catalogue.
        catalogue: Vec<&'static str>,
    },
    /// Both directions of motion.
    BothDirections,
    /// An effect is to be determined.
    Determine {
        /// The effect.
        effect: String,
        /// Sentences of the catalogue.
        catalogue: Vec<&'static str>,
    },
    /// The same again.
    Repeat,
    /// Slow turns.
    SlowTurns,
}

/// What the next experiment is for, for programs. `difference`, `change` and `experiment` are sentences of the catalogue.
pub fn purpose_kind(purpose: &Purpose) -> PurposeKind {
    let experiment = |name: &str| card(name).map_or("", |c| c.description.experiment);
    match purpose {
        Purpose::Distinguish { effect, rival, repeated: Some(Repeated::ChangeOfStand(change)), .. } => {
            PurposeKind::ChangeOfStand { effect: effect.clone(), rival: rival.clone(), catalogue: vec![change] }
        }
        Purpose::Distinguish { effect, rival, difference, repeated: Some(Repeated::OtherRun) } => {
            PurposeKind::OtherRun { effect: effect.clone(), rival: rival.clone(), catalogue: difference.iter().copied().collect() }
        }
        Purpose::Distinguish { effect, rival, difference: Some(difference), repeated: None } => {
            PurposeKind::Distinguish { effect: effect.clone(), rival: rival.clone(), catalogue: vec![difference] }
        }
        Purpose::Distinguish { effect, rival, difference: None, repeated: None } => PurposeKind::Distinguish {
            effect: effect.clone(),
            rival: rival.clone(),
            catalogue: vec![experiment(effect), experiment(rival)],
        },
        Purpose::BothDirections => PurposeKind::BothDirections,
        Purpose::Determine { effect } => PurposeKind::Determine { effect: (*effect).to_owned(), catalogue: vec![experiment(effect)] },
        Purpose::Repeat => PurposeKind::Repeat,
        Purpose::SlowTurns => PurposeKind::SlowTurns,
    }
}
