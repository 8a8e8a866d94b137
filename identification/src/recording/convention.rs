//! What is assumed of a recording where no note states it.
//!
//! A value may be taken at the time of its row or be the mean over the row; a rate may be the difference of an angle over the last row. Which
//! assumption fits is found in [`crate::identify::recording_conventions`].

use serde::{Deserialize, Serialize};

use super::PreparedLog;
use super::prepare::PreparationNote;
use super::voltage::{self, InputTiming, Known, VoltageCourse};
use crate::log::Log;
use crate::model::{Channel, Input};

/// A convention that differs from that of the project.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Convention {
    /// The input holds values at t.
    InputAtT,
    /// The input holds the values of the row before.
    InputOfRowBefore,
    /// The input holds means over the row, within which it moves.
    InputMoves,
    /// The current is its value at t.
    CurrentAtT,
    /// The rate is the mean over the last row, as differences of counts give it.
    RateOverLastRow,
}

impl Convention {
    /// All of them, in the order in which they are tried.
    pub const ALL: [Convention; 5] =
        [Convention::InputAtT, Convention::InputOfRowBefore, Convention::InputMoves, Convention::CurrentAtT, Convention::RateOverLastRow];
}

/// The values of the input, where neither a note nor its course within the rows states when it had them.
fn input_of_unknown_timing<'l>(log: &'l Log, data: &PreparedLog) -> Option<&'l [f64]> {
    let column = data.driven.column();
    let course_is_known = data.voltage_course.as_ref().is_some_and(|course| course.known != Known::Values);
    if course_is_known || data.driven == Input::Motion || log.notes().states_timing(column) { None } else { log.column(column) }
}

/// The data by a convention that no note contradicts, and the note on it; `None` where it does not apply.
pub fn apply<'a>(convention: Convention, log: &'a Log, data: &PreparedLog<'a>) -> Option<(PreparedLog<'a>, PreparationNote)> {
    let mut data = data.clone();
    let note = assumed(convention, log, &mut data)?;
    Some((data, note))
}

/// Changes the data by a convention; `None` where it does not apply.
fn assumed(convention: Convention, log: &Log, data: &mut PreparedLog) -> Option<PreparationNote> {
    match convention {
        Convention::InputAtT => {
            let is_open = data.input_timing == InputTiming::OverRow && !log.notes().voltage_is_held();
            let values = input_of_unknown_timing(log, data).filter(|_| is_open)?;
            data.input_timing = InputTiming::AtT;
            data.input = voltage::input(values, data.input_timing, &data.segments).into_owned().into();
            data.voltage_course = VoltageCourse::expected(log, values, data.driven, Known::Values, &data.segments);
            Some(PreparationNote::AssumedAtT { column: data.driven.column() })
        }
        Convention::InputOfRowBefore => {
            let values = input_of_unknown_timing(log, data).filter(|_| data.input_timing != InputTiming::OverRowBefore)?;
            data.input_timing = InputTiming::OverRowBefore;
            data.input = voltage::input(values, data.input_timing, &data.segments).into_owned().into();
            data.voltage_course = None;
            Some(PreparationNote::AssumedOfRowBefore { column: data.driven.column() })
        }
        Convention::InputMoves => {
            let is_known = data.input_timing == InputTiming::AtT || data.voltage_course.is_some() || log.notes().voltage_is_held();
            if is_known || data.driven != Input::Voltage {
                return None;
            }
            data.voltage_course = VoltageCourse::expected(log, &data.input, data.driven, Known::Means, &data.segments);
            Some(PreparationNote::AssumedToMove { column: data.driven.column() })
        }
        Convention::CurrentAtT => {
            let column = Channel::Current.column();
            let channel = data.channels.iter_mut().find(|c| c.channel == Channel::Current && !c.instant)?;
            if log.notes().has_provenance(column) {
                return None;
            }
            channel.instant = true;
            Some(PreparationNote::AssumedAtT { column })
        }
        Convention::RateOverLastRow => {
            let column = Channel::Rate.column();
            let dt_s = data.dt_s;
            let channel =
                data.channels.iter_mut().find(|c| c.channel == Channel::Rate && c.mean_before_s.is_none() && c.filter_hz.is_none())?;
            if log.notes().has_provenance(column) {
                return None;
            }
            channel.mean_before_s = Some(dt_s);
            Some(PreparationNote::AssumedOverLastRow { column, interval_s: dt_s })
        }
    }
}
