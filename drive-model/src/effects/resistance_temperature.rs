//! Winding resistance and temperature: R (1 + α (T − T0)); T measured, or a thermal state heated by R i².

use crate::{Description, Contributions, Structure, Card, Coordinate, ParameterKind, Law, Parameter, Point, Domain, Scalar, Screen, T0_C, Thermal};

/// The card of `resistance-temperature`.
pub const CARD: Card = Card {
    id: "resistance-temperature",
    title: "Winding resistance and temperature",
    equation: "R (1 + α (T − T0)); T measured, or a thermal state heated by R i²",
    domain: Domain::Electrical,
    coordinate: Coordinate::Temperature,
    parameters: &[
        Parameter {
            name: "resistance_per_K",
            unit: "1/K",
            description: "temperature coefficient α (copper: 0.0039)",
            range: (0.0, 0.02),
            start: 0.0039,
            kind: ParameterKind::NonNegative,
            simulated_range: (0.0039, 0.0039),
        },
        Parameter {
            name: "thermal_J_K",
            unit: "J/K",
            description: "heat capacity of the winding, where no temperature is measured",
            range: (0.1, 100000.0),
            start: 15.0,
            kind: ParameterKind::Positive,
            simulated_range: (12.0, 18.0),
        },
        Parameter {
            name: "thermal_K_W",
            unit: "K/W",
            description: "thermal resistance to the surroundings",
            range: (0.1, 1000.0),
            start: 12.0,
            kind: ParameterKind::Positive,
            simulated_range: (10.0, 15.0),
        },
    ],
    polar: false,
    screen: Screen::AtZero,
    family: "",
    description: Description {
        summary: "Copper resists more as it warms: four tenths of a percent per kelvin.",
        signature: "Under load the current slowly falls at the same voltage.",
        experiment: "A long run at high current, with the winding temperature logged.",
        similar: "Falling supply voltage; a viscosity that falls with temperature acts the other way.",
        reference: "IEC 60034-1; copper: 0.00393/K at 20 °C",
    },
};

/// The law of `resistance-temperature`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct ResistanceTemperature;

impl<S: Scalar> Law<S> for ResistanceTemperature {
    fn configure(&self, p: &[S], structure: &mut Structure<S>) {
        structure.thermal = Some(Thermal { J_K: p[1], K_W: p[2] });
    }
    fn contribute(&self, p: &[S], x: &Point<S>, a: &mut Contributions<S>) {
        a.resistance_factor *= p[0] * (x.temp_C - T0_C) + 1.0;
    }
}
