//! System and parameters of a fit, from a model.

use std::ops::Range;
use std::sync::Arc;

use drive_model::{Card, LawSource};

use super::parameters::{Parameter, Parameters};
use super::system::{Effect, System};
use crate::model::{BaseParameter, Model};

/// The system of a model, and its parameters in the order of the model.
///
/// Parameters without influence under a measured winding temperature are fixed if `temperature_is_measured`.
pub fn system(model: &Model, temperature_is_measured: bool) -> (System, Parameters) {
    let mut list: Vec<Parameter> = model
        .parameters()
        .iter()
        .map(|p| Parameter { fixed: p.fixed, kind: p.kind(), range: p.range(), ..Parameter::plain(p.name.clone(), p.value) })
        .collect();
    let mut effects = Vec::new();
    for used in model.effects() {
        for (index, &k) in used.parameters.iter().enumerate() {
            list[k].set_properties(used.card, index);
            list[k].fixed |= temperature_is_measured && used.card.unused_with_temperature.contains(&index);
        }
        if let (true, Some(&first), Some(&last)) = (used.card.polar, used.parameters.first(), used.parameters.last()) {
            list[first].polar = Some(last);
            list[last].polar = Some(first);
        }
        effects.push(Effect { name: used.name(), source: Arc::new(used.card.law), parameters: used.parameters.clone() });
    }
    for own in model.user_effects() {
        effects.push(Effect {
            name: own.name.clone(),
            source: Arc::new(own.clone()),
            parameters: own.parameters.iter().copied().chain(own.shared.iter().map(|(_, k)| *k)).collect(),
        });
    }
    let servo = [BaseParameter::ServoGain, BaseParameter::ServoDamping, BaseParameter::ServoLimit].map(|p| model.base_index(p));
    let system = System {
        inertia: model.base_index(BaseParameter::Inertia),
        motor_constant: model.base_index(BaseParameter::MotorConstant),
        resistance: model.base_index(BaseParameter::Resistance),
        servo: if let [Some(gain), Some(damping), Some(limit)] = servo { Some([gain, damping, limit]) } else { None },
        effects,
    };
    (system, Parameters { list })
}

/// Adds an effect of the catalogue, with `values` for its parameters, of which the `free` ones are fitted. Returns their indices in the
/// list. The parameters have the names of the card, also where these are not unique.
pub fn append(system: &mut System, parameters: &mut Parameters, card: &'static Card, values: &[f64], free: &[bool]) -> Range<usize> {
    let first = parameters.list.len();
    for (index, ((info, &value), &free)) in card.parameters.iter().zip(values).zip(free).enumerate() {
        let plain = Parameter::plain(info.name.to_owned(), value);
        let mut parameter = Parameter { fixed: !free, kind: info.kind, range: info.range, ..plain };
        parameter.set_properties(card, index);
        parameters.list.push(parameter);
    }
    let range = first..parameters.list.len();
    if card.polar && !range.is_empty() {
        parameters.list[first].polar = Some(range.end - 1);
        parameters.list[range.end - 1].polar = Some(first);
    }
    system.effects.push(Effect { name: card.id.to_owned(), source: Arc::new(card.law), parameters: range.clone().collect() });
    range
}

/// Adds a law that is linear in `count` free coefficients, which start at zero. Returns their indices in the list.
pub fn append_linear(system: &mut System, parameters: &mut Parameters, name: &str, law: Arc<dyn LawSource>, count: usize) -> Range<usize> {
    let first = parameters.list.len();
    parameters.list.extend((0..count).map(|k| Parameter::plain(format!("{name}.{k}"), 0.0)));
    let range = first..parameters.list.len();
    system.effects.push(Effect { name: name.to_owned(), source: law, parameters: range.clone().collect() });
    range
}
