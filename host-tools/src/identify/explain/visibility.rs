//! Which effects the columns of the logs and the model cannot show.

use drive_model::{Card, Elastic, Requirement as Condition};

use super::fitted_model::FittedModel;
use super::reasons::{NotVisible, Requirement};
use super::trial::turns;
use crate::log::Voltage;
use crate::model::{Channel, Input};
use crate::statistics::Extremes;

/// Why the logs or the model cannot show the effect: the first condition of its card that is not met; `None` where all are met.
pub fn not_visible(card: &Card, base: &FittedModel) -> Option<NotVisible> {
    let has = |id: &&str| base.model.effects().iter().any(|e| e.card.id == *id);
    let basis = card.rests_on.first().filter(|_| !card.rests_on.iter().any(|id| has(&id)));
    let lacks_basis = basis.map(|id| NotVisible::Needs(Requirement::Effect(id)));
    lacks_basis.or_else(|| card.requires.iter().find_map(|condition| unmet(*condition, card, base)))
}

/// The reason why a condition is not met; `None` where it is met.
fn unmet(condition: Condition, card: &Card, base: &FittedModel) -> Option<NotVisible> {
    let (model, data) = (&base.model, &base.data);
    let compared = |channel: Channel| data.channels.iter().any(|c| c.channel == channel);
    let needs = |is_met: bool, what: Requirement| (!is_met).then_some(NotVisible::Needs(what));
    let input = model.input();
    match condition {
        Condition::CommandedVoltage => (base.context.log.voltage() == Voltage::Terminal).then_some(NotVisible::TerminalVoltage),
        Condition::Voltage => needs(input == Input::Voltage || compared(Channel::Voltage), Requirement::Voltage),
        Condition::MotorConstant => needs(model.index("motor_constant_N_m_A").is_some(), Requirement::VoltageOrCurrentInput),
        Condition::Angle => needs(data.theta.is_some() || input == Input::Motion, Requirement::Angle),
        Condition::ComparedAngle => needs(compared(Channel::Angle), Requirement::ComparedAngle),
        Condition::ComparedRate => needs(compared(Channel::Rate), Requirement::Rate),
        Condition::ComparedCurrent => needs(compared(Channel::Current) && input != Input::Current, Requirement::Current),
        Condition::MeasuredTemperature => needs(data.temp_C.is_some(), Requirement::WindingTemperature),
        Condition::TemperatureChange => {
            let (low, high) = data.temp_C.as_ref()?.iter().copied().min_max();
            let (span_K, min_K) = (high - low, base.context.criteria.trials.min_temperature_span_K);
            (span_K < min_K).then_some(NotVisible::TemperatureSpan { span_K, min_K })
        }
        Condition::Turns { min, rival } => {
            let turns = turns(data);
            (turns < min).then_some(NotVisible::Turns { turns, min, rival })
        }
        Condition::SimulatedCurrent => (input == Input::Motion).then_some(NotVisible::DependsOnComparedCurrent),
        Condition::SimulatedMotion => (input == Input::Motion).then_some(NotVisible::PrescribedMotion),
        Condition::NoOtherShaft => {
            let mut others = model.effects().iter().map(|e| e.card).filter(|c| c.elastic == Some(Elastic::Shaft) && c.id != card.id);
            others.next().map(|other| {
                if other.reduces_to == Some(card.id) { NotVisible::IncludedIn(other.id) } else { NotVisible::AlternativeTo(other.id) }
            })
        }
    }
}
