//! A fit's system from names: base, effects of the catalogue, effects of the user's own.

use hal_sim::effects::{self, Kind, Law};
use hal_sim::rig::Input;

use super::parameters::{Dual, Parameter, Parameters};
use super::record::Driven;
use super::simulate::{Effect, Source, System};

/// The law of an effect of the catalogue.
struct Catalogued(&'static str);

macro_rules! from_catalogue {
    ($($make:ident -> $scalar:ty),*) => {$(
        #[expect(clippy::expect_used, reason = "the identifier comes from the catalogue itself")]
        fn $make(&self) -> Box<dyn Law<$scalar>> {
            effects::law(self.0).expect("an effect of the catalogue")
        }
    )*};
}

impl Source for Catalogued {
    from_catalogue!(plain -> f64, dual8 -> Dual<8>, dual16 -> Dual<16>, dual32 -> Dual<32>);
}

/// The base parameters: name, unit, what it is, start value on the default stand, range.
pub const BASE: [(&str, &str, &str, f64); 3] = [
    ("inertia_kg_m2", "kg m²", "inertia of all that turns", 2.5e-4),
    ("motor_constant_N_m_A", "N m/A", "motor constant, of torque and of back-EMF", 2.34e-2),
    ("resistance_ohm", "Ω", "resistance of the winding", 2.32),
];

/// The base parameters that a model of this input has.
pub fn base_of(driven: Driven, outputs_voltage: bool) -> &'static [(&'static str, &'static str, &'static str, f64)] {
    match driven {
        Driven::By(Input::Voltage) => &BASE,
        Driven::By(Input::Current) => &BASE[..2],
        Driven::By(Input::Torque) => &BASE[..1],
        Driven::Motion if outputs_voltage => &BASE,
        Driven::Motion => &BASE[..2],
    }
}

/// Name of a parameter in the instance `suffix` of an effect: `cogging_N_m#2`.
pub fn instance_name(stem: &str, instance: u32) -> String {
    if instance <= 1 { stem.to_owned() } else { format!("{stem}#{instance}") }
}

/// Builds a system part by part.
pub struct Builder {
    system: System,
    parameters: Parameters,
}

impl Builder {
    /// The bare drive; `value` gives (value, fixed) of a parameter by name.
    pub fn new(driven: Driven, outputs_voltage: bool, value: &impl Fn(&str, f64) -> (f64, bool)) -> Self {
        let base = base_of(driven, outputs_voltage);
        let mut parameters = Parameters::default();
        for (name, _, _, start) in base {
            let (value, fixed) = value(name, *start);
            parameters.list.push(Parameter {
                name: (*name).to_owned(),
                value,
                fixed,
                kind: Kind::Positive,
                range: (0.0, f64::INFINITY),
                polar: None,
            });
        }
        let system = System {
            inertia: 0,
            motor_constant: (base.len() > 1).then_some(1),
            resistance: (base.len() > 2).then_some(2),
            effects: Vec::new(),
        };
        Builder { system, parameters }
    }

    /// Adds an effect of the catalogue; `false` where there is none of that name.
    ///
    /// Effects may share a parameter of the same name (the shaft of `compliance` and `backlash`).
    pub fn catalogued(&mut self, id: &str, instance: u32, value: &impl Fn(&str, f64) -> (f64, bool)) -> bool {
        let Some(card) = effects::card(id) else { return false };
        let first = self.parameters.list.len();
        let mut indices = Vec::new();
        for p in card.parameters {
            let name = instance_name(p.name, instance);
            if let Some(k) = self.parameters.list.iter().position(|q| q.name == name) {
                indices.push(k);
                continue;
            }
            let (value, fixed) = value(&name, p.start);
            indices.push(self.parameters.list.len());
            self.parameters.list.push(Parameter { name, value, fixed, kind: p.kind, range: p.range, polar: None });
        }
        if card.polar && self.parameters.list.len() > first {
            let last = self.parameters.list.len() - 1;
            self.parameters.list[first].polar = Some(last);
            self.parameters.list[last].polar = Some(first);
        }
        self.system.effects.push(Effect { name: instance_name(id, instance), source: Box::new(Catalogued(card.id)), parameters: indices });
        true
    }

    /// Adds an effect of the user's own with its parameters (name, value, fixed), all moved linearly.
    pub fn own(&mut self, name: &str, source: Box<dyn Source>, parameters: &[(String, f64, bool)]) {
        let first = self.parameters.list.len();
        for (name, value, fixed) in parameters {
            self.parameters.list.push(Parameter {
                name: name.clone(),
                value: *value,
                fixed: *fixed,
                kind: Kind::Signed,
                range: (f64::NEG_INFINITY, f64::INFINITY),
                polar: None,
            });
        }
        let indices = (first..self.parameters.list.len()).collect();
        self.system.effects.push(Effect { name: name.to_owned(), source, parameters: indices });
    }

    /// The system and its parameters.
    pub fn done(self) -> (System, Parameters) {
        (self.system, self.parameters)
    }
}
