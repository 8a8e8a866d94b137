//! Which effects the columns of the logs and the model cannot show.

use drive_model::Card;

use super::fitted_model::FittedModel;
use super::reasons::{NotVisible, Requirement};
use super::trial::turns;
use crate::log::Voltage;
use crate::model::{Channel, Input};
use crate::statistics::Extremes;

/// Why the logs or the model cannot show the effect; `None` where they can.
pub fn not_visible(card: &Card, base: &FittedModel) -> Option<NotVisible> {
    let (model, data, criteria) = (&base.model, &base.data, &base.context.criteria.trials);
    let compared = |channel: Channel| data.channels.iter().any(|c| c.channel == channel);
    let has = |id: &str| model.effects().iter().any(|e| e.card.id == id);
    let needs = |what: Requirement| Some(NotVisible::Needs(what));
    let input = model.input();
    let too_even = |temperature: &[f64]| {
        let (low, high) = temperature.iter().copied().min_max();
        let (span_K, min_K) = (high - low, criteria.min_temperature_span_K);
        (span_K < min_K).then_some(NotVisible::TemperatureSpan { span_K, min_K })
    };
    let too_few_turns = |min: f64, rival: Option<&'static str>| {
        let turns = turns(data);
        (turns < min).then_some(NotVisible::Turns { turns, min, rival })
    };
    match card.id {
        "dead-time" | "supply-droop" if base.context.log.voltage() == Voltage::Terminal => Some(NotVisible::TerminalVoltage),
        "inductance" | "brush-drop" | "dead-time" | "resistance-temperature" | "supply-droop"
            if input != Input::Voltage && !compared(Channel::Voltage) =>
        {
            needs(Requirement::Voltage)
        }
        "torque-ripple" | "magnetic-saturation" if model.index("motor_constant_N_m_A").is_none() => {
            needs(Requirement::VoltageOrCurrentInput)
        }
        "cogging" | "unbalance" | "torque-ripple" | "cable-spring" | "encoder-eccentricity" | "rate-g-sensitivity"
            if data.theta.is_none() && input != Input::Motion =>
        {
            needs(Requirement::Angle)
        }
        "encoder-eccentricity" if !compared(Channel::Angle) => needs(Requirement::ComparedAngle),
        "sensor-lag" | "rate-scale" | "rate-scale-nonlinearity" | "rate-bias" | "rate-bias-temperature" | "rate-g-sensitivity"
            if !compared(Channel::Rate) =>
        {
            needs(Requirement::Rate)
        }
        "current-offset" | "current-scale" if !compared(Channel::Current) || input == Input::Current => needs(Requirement::Current),
        "viscous-temperature" if !has("viscous") => needs(Requirement::Effect("viscous")),
        "viscous-temperature" | "rate-bias-temperature" => match &data.temp_C {
            None => needs(Requirement::WindingTemperature),
            Some(t) => too_even(t),
        },
        "resistance-temperature" => data.temp_C.as_ref().and_then(|t| too_even(t)),
        "presliding" | "stribeck" if !has("coulomb") && !has("stribeck") => needs(Requirement::Effect("coulomb")),
        "asymmetric-friction" if !has("coulomb") => needs(Requirement::Effect("coulomb")),
        "unbalance" if too_few_turns(criteria.min_unbalance_turns, None).is_some() => {
            too_few_turns(criteria.min_unbalance_turns, Some("cable-spring"))
        }
        "encoder-eccentricity" | "rate-g-sensitivity" if too_few_turns(criteria.min_periods, None).is_some() => {
            too_few_turns(criteria.min_periods, None)
        }
        "magnetic-saturation" if input == Input::Motion => Some(NotVisible::DependsOnComparedCurrent),
        "presliding" | "compliance" | "backlash" | "inductance" | "load-step" | "sensor-lag" | "time-skew" if input == Input::Motion => {
            (card.id != "load-step").then_some(NotVisible::PrescribedMotion)
        }
        "compliance" if has("backlash") => Some(NotVisible::IncludedIn("backlash")),
        "backlash" if has("compliance") => Some(NotVisible::AlternativeTo("compliance")),
        _ => None,
    }
}
