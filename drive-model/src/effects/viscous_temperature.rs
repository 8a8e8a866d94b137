//! Temperature-dependent viscosity: viscous coefficient b exp(−κ (T − T0)), T0 = 25 °C.

use crate::{Abscissa, Card, Contributions, Coordinate, Demonstration, Description, Domain, Law, Motion, Parameter, ParameterKind, Point, Requirement, Scalar, Output, StandRun, T0_C};

/// The card of `viscous-temperature`.
pub const CARD: Card = Card {
    id: "viscous-temperature",
    title: "Temperature-dependent viscosity",
    equation: "viscous coefficient b exp(−κ (T − T0)), T0 = 25 °C",
    domain: Domain::Torque,
    coordinate: Coordinate::Temperature,
    parameters: &[
        Parameter {
            name: "viscous_temperature_per_K",
            unit: "1/K",
            description: "relative decrease κ per kelvin",
            range: (0.0, 0.2),
            start: 0.01,
            kind: ParameterKind::NonNegative,
            simulated_range: (0.01, 0.03),
        },
    ],
    rests_on: &["viscous"],
    inert_alone: true,
    requires: &[Requirement::MeasuredTemperature, Requirement::TemperatureChange],
    next_run: StandRun::WARM_UP,
    demonstration: Some(Demonstration {
        motion: Motion::Constant(60.0),
        duration_s: 60.0,
        output: Output::Current,
        abscissa: Abscissa::Coordinate(Coordinate::Temperature),
        added: &[Demonstration::WEIGHT, ("viscous", "viscous_N_m_s", 2e-4)],
    }),
    law: &ViscousTemperature,
    description: Description {
        summary: "The viscosity of grease falls with temperature, and so does the viscous friction.",
        signature: "The same voltage gives a slowly rising rate while the stand warms up.",
        experiment: "Run the same rates cold and after half an hour of operation.",
        similar: "A winding resistance that rises with temperature has the opposite sign and appears in the current.",
        reference: "Vogel (1921); SKF rolling bearings catalogue, friction",
    },
    ..Card::DEFAULT
};

/// The law of `viscous-temperature`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct ViscousTemperature;

impl<S: Scalar> Law<S> for ViscousTemperature {
    fn contribute(&self, p: &[S], x: &Point<S>, out: &mut Contributions<S>) {
        out.viscous_factor *= (-(p[0] * (x.temp_C - T0_C))).portable_exp();
    }
}
