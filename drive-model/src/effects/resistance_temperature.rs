//! Temperature-dependent winding resistance: R (1 + α (T − T0)), T0 = 25 °C; T is measured, or a thermal state heated by R i².

use crate::{Abscissa, Card, Contributions, Coordinate, Demonstration, Description, Domain, Law, Motion, Parameter, ParameterKind, Point, Requirement, Rival, Scalar, Screening, Output, StandRun, Structure, T0_C, Thermal};

/// Separates a temperature from the current that causes it.
const TEMPERATURE_OR_CURRENT: &str = "Warm the winding with large currents and record its temperature and the supply voltage: a temperature effect remains when the current falls";

/// The card of `resistance-temperature`.
pub const CARD: Card = Card {
    id: "resistance-temperature",
    title: "Temperature-dependent winding resistance",
    equation: "R (1 + α (T − T0)), T0 = 25 °C; T is measured, or a thermal state heated by R i²",
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
            description: "heat capacity of the winding, if its temperature is not measured",
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
    requires: &[Requirement::Voltage, Requirement::TemperatureChange],
    screening: Screening::HeatCapacities(&[0.1, 1.0, 10.0]),
    rivals: &[
        Rival { effect: "viscous-temperature", separation: TEMPERATURE_OR_CURRENT, run: StandRun::WARM_UP, change_of_stand: None },
        Rival { effect: "supply-droop", separation: TEMPERATURE_OR_CURRENT, run: StandRun::WARM_UP, change_of_stand: None },
    ],
    next_run: StandRun::WARM_UP,
    demonstration: Some(Demonstration {
        motion: Motion::Constant(20.0),
        duration_s: 60.0,
        output: Output::Voltage,
        abscissa: Abscissa::Coordinate(Coordinate::Temperature),
        added: &[Demonstration::WEIGHT],
    }),
    unused_with_temperature: &[1, 2],
    law: &ResistanceTemperature,
    description: Description {
        summary: "The resistance of copper rises by 0.39 % per kelvin.",
        signature: "Under load the current falls slowly at constant voltage.",
        experiment: "Run long at high current and record the winding temperature.",
        similar: "A falling supply voltage; a viscosity that falls with temperature has the opposite sign.",
        reference: "IEC 60034-1; copper: 0.00393/K at 20 °C",
    },
    ..Card::DEFAULT
};

/// The law of `resistance-temperature`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct ResistanceTemperature;

impl<S: Scalar> Law<S> for ResistanceTemperature {
    fn configure(&self, p: &[S], structure: &mut Structure<S>) {
        structure.thermal = Some(Thermal { J_K: p[1], K_W: p[2] });
    }
    fn contribute(&self, p: &[S], x: &Point<S>, out: &mut Contributions<S>) {
        out.resistance_factor *= p[0] * (x.temp_C - T0_C) + 1.0;
    }
}
