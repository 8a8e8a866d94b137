//! A fit's system and parameters from a model.

use std::ops::Range;
use std::sync::Arc;

use drive_model::{Card, Law};

use super::parameters::{Dual, Parameter, Parameters};
use super::simulate::{Effect, LawSource, System};
use crate::model::Model;

/// The law of an effect of the catalogue.
struct CatalogueLaw(&'static str);

/// The same law in every scalar of [`LawSource`].
macro_rules! in_every_scalar {
    ($source:ident => $law:expr) => {
        in_every_scalar!(@ $source => $law, plain f64, dual8 Dual<8>, dual12 Dual<12>, dual16 Dual<16>, dual32 Dual<32>);
    };
    (@ $source:ident => $law:expr, $($make:ident $scalar:ty),*) => {$(
        fn $make(&self) -> Box<dyn Law<$scalar>> {
            let $source = self;
            $law
        }
    )*};
}

impl LawSource for CatalogueLaw {
    in_every_scalar!(source => {
        #[expect(clippy::expect_used, reason = "the identifier comes from the catalogue itself")]
        drive_model::law(source.0).expect("an effect of the catalogue")
    });
}

/// The system of a model, and its parameters in the model's order.
///
/// Where the winding temperature is measured, the constants of its heating have no part in the model and are held.
pub fn system(model: &Model, temperature_is_measured: bool) -> (System, Parameters) {
    let mut list: Vec<Parameter> = model
        .parameters()
        .iter()
        .map(|p| Parameter {
            name: p.name.clone(),
            value: p.value,
            fixed: p.fixed || (temperature_is_measured && p.name.starts_with("thermal_")),
            kind: p.kind(),
            range: p.range(),
            polar: None,
        })
        .collect();
    let mut effects = Vec::new();
    for used in model.effects() {
        if let (true, Some(&first), Some(&last)) = (used.card.polar, used.parameters.first(), used.parameters.last()) {
            list[first].polar = Some(last);
            list[last].polar = Some(first);
        }
        effects.push(Effect { name: used.name(), source: Arc::new(CatalogueLaw(used.card.id)), parameters: used.parameters.clone() });
    }
    for own in model.user_effects() {
        effects.push(Effect { name: own.name.clone(), source: Arc::new(GenericLaw(own.clone())), parameters: own.parameters.clone() });
    }
    let system = System {
        inertia: model.index("inertia_kg_m2"),
        motor_constant: model.index("motor_constant_N_m_A"),
        resistance: model.index("resistance_ohm"),
        effects,
    };
    (system, Parameters { list })
}

/// Adds an effect of the catalogue to a system, with `values` for its parameters, of which the `free` ones may move; gives where they
/// stand in the list. The parameters go by their names in the card, whatever else has them.
pub fn append(system: &mut System, parameters: &mut Parameters, card: &'static Card, values: &[f64], free: &[bool]) -> Range<usize> {
    let first = parameters.list.len();
    for ((info, &value), &free) in card.parameters.iter().zip(values).zip(free) {
        parameters.list.push(Parameter {
            name: info.name.to_owned(),
            value,
            fixed: !free,
            kind: info.kind,
            range: info.range,
            polar: None,
        });
    }
    let range = first..parameters.list.len();
    if card.polar && !range.is_empty() {
        parameters.list[first].polar = Some(range.end - 1);
        parameters.list[range.end - 1].polar = Some(first);
    }
    system.effects.push(Effect { name: card.id.to_owned(), source: Arc::new(CatalogueLaw(card.id)), parameters: range.clone().collect() });
    range
}

/// Adds a law that is no effect of the catalogue, linear in `count` free coefficients that begin at zero; gives where they stand.
pub fn append_linear(system: &mut System, parameters: &mut Parameters, name: &str, law: Arc<dyn LawSource>, count: usize) -> Range<usize> {
    let first = parameters.list.len();
    for k in 0..count {
        parameters.list.push(Parameter {
            name: format!("{name}.{k}"),
            value: 0.0,
            fixed: false,
            kind: drive_model::ParameterKind::Signed,
            range: (f64::NEG_INFINITY, f64::INFINITY),
            polar: None,
        });
    }
    let range = first..parameters.list.len();
    system.effects.push(Effect { name: name.to_owned(), source: law, parameters: range.clone().collect() });
    range
}

/// A source of one law in every scalar of [`LawSource`], for a type that is [`Law`] in all of them.
pub struct GenericLaw<T>(pub T);

impl<T> LawSource for GenericLaw<T>
where
    T: Clone + Law<f64> + Law<Dual<8>> + Law<Dual<12>> + Law<Dual<16>> + Law<Dual<32>> + 'static,
{
    in_every_scalar!(source => Box::new(source.0.clone()));
}
