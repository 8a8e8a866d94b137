//! Which effects the columns of the logs and the model cannot show.

use drive_model::{Card, Domain, Elastic, Requirement};

use crate::identify::explain::answer::reasons::NotVisible;
use crate::identify::explain::fitted::FittedModel;
use crate::identify::explain::fitted::motion::turns;
use crate::log::VoltageSource;
use crate::model::{BaseParameter, Channel, Input};
use crate::statistics::Extremes;

/// Why the logs or the model cannot show the effect: the first condition of its card that is not met; `None` where all are met.
pub fn not_visible(card: &Card, base: &FittedModel) -> Option<NotVisible> {
    let has = |id: &str| base.model.effects().iter().any(|e| e.card.id == id);
    let lacking = card.rests_on.first().filter(|_| !card.rests_on.iter().any(|id| has(id)));
    let rests_on = lacking.map(|id| NotVisible::RestsOn(id));
    rests_on.or_else(|| card.requires.iter().find_map(|requirement| unmet(*requirement, card, base)))
}

/// Why a condition is not met; `None` where it is met.
fn unmet(requirement: Requirement, card: &Card, base: &FittedModel) -> Option<NotVisible> {
    let (model, data) = (&base.model, &base.data);
    let compared = |channel: Channel| data.channels.iter().any(|c| c.channel == channel);
    let input = model.input();
    let met = match requirement {
        Requirement::CommandedVoltage => input != Input::Setpoint && base.context.log.voltage() != VoltageSource::Terminals,
        Requirement::Voltage => input.is_voltage() || compared(Channel::Voltage),
        Requirement::MotorConstant => model.base_index(BaseParameter::MotorConstant).is_some(),
        Requirement::Angle => data.theta.is_some() || input == Input::Motion,
        Requirement::ComparedAngle => compared(Channel::Angle),
        Requirement::AngleReading => compared(Channel::Angle) || (input == Input::Motion && compared(Channel::Rate)),
        Requirement::ComparedRate => compared(Channel::Rate),
        Requirement::RateOrSensorAngle => compared(Channel::Rate) || (input == Input::Motion && compared(Channel::Angle)),
        Requirement::ComparedCurrent => compared(Channel::Current) && input != Input::Current,
        Requirement::MeasuredTemperature => data.temp_C.is_some(),
        // A sensor against a known motion.
        Requirement::SimulatedMotion if input == Input::Motion => card.domain == Domain::Measurement && data.known_motion.is_some(),
        Requirement::SimulatedCurrent | Requirement::SimulatedMotion => input != Input::Motion,
        Requirement::TemperatureChange => {
            let (low, high) = data.temp_C.as_ref()?.iter().copied().min_max();
            let (span_K, min_K) = (high - low, base.context.criteria.trials.min_temperature_span_K);
            return (span_K < min_K).then_some(NotVisible::TemperatureSpan { span_K, min_K });
        }
        Requirement::Turns { min, rival } => {
            let turns = turns(data);
            return (turns < min).then_some(NotVisible::Turns { turns, min, rival });
        }
        Requirement::NoOtherShaft => {
            let mut cards = model.effects().iter().map(|e| e.card);
            let other = cards.find(|c| c.elastic == Some(Elastic::Shaft) && c.id != card.id)?;
            let includes = other.reduces_to == Some(card.id);
            return Some(if includes { NotVisible::IncludedIn(other.id) } else { NotVisible::AlternativeTo(other.id) });
        }
    };
    (!met).then_some(NotVisible::Unmet(requirement))
}
