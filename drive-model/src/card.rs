//! The card of an effect: all that a program needs to know of the effect, as data.

use crate::coordinate::Coordinate;
use crate::experiment::{Demonstration, StandRun};
use crate::law::{Law, LawSource};
use crate::scalar::Scalar;
use crate::screening::{Elastic, Requirement, Screening};

/// One effect of the catalogue, as data.
///
/// A card is written as a struct literal that ends in `..Card::DEFAULT`.
#[derive(Debug)]
pub struct Card {
    /// Name in models and answers, e.g. `torque-ripple`.
    pub id: &'static str,
    /// Name for a heading.
    pub title: &'static str,
    /// The equation in one line.
    pub equation: &'static str,
    /// Where the effect acts.
    pub domain: Domain,
    /// The coordinate over which a model without the effect has the largest residual.
    pub coordinate: Coordinate,
    /// Parameters, in the order in which the law takes them.
    pub parameters: &'static [Parameter],
    /// The first parameter is an amplitude and the last its phase: a fit moves a·cos φ and a·sin φ instead.
    pub polar: bool,
    /// A model may contain the effect several times, each time at another harmonic order.
    pub repeatable: bool,
    /// Effects of which the model must contain at least one before this effect is tried; the usual one first. Empty: no condition.
    pub rests_on: &'static [&'static str],
    /// Without an effect of `rests_on` the law changes nothing.
    pub inert_alone: bool,
    /// Conditions on log and model, checked in this order.
    pub requires: &'static [Requirement],
    /// Elastic element that the effect adds to the drive.
    pub elastic: Option<Elastic>,
    /// The effect that remains, with the other parameters, where the first parameter is zero, or where a number of periods per turn is
    /// whole.
    pub reduces_to: Option<&'static str>,
    /// The law depends on the measured supply voltage.
    pub uses_supply: bool,
    /// The law changes the rate channel only where the rate is derived from the encoder.
    pub uses_rate_source: bool,
    /// Indices of the parameters whose equation has no meaning below zero: a fit stops there.
    pub limited_at_zero: &'static [usize],
    /// Index of a parameter that is a level of dry friction. χ² has steps over it, where the rotor begins to stick.
    pub dry_friction: Option<usize>,
    /// Index of a parameter that is a clearance. χ² has several minima over it.
    pub clearance: Option<usize>,
    /// Indices of the parameters without influence where the winding temperature is measured.
    pub unused_with_temperature: &'static [usize],
    /// How its absence is tested.
    pub screening: Screening,
    /// Effects of one family are indistinguishable in some logs; empty: no family.
    pub family: &'static str,
    /// How to separate the effect from others. A pair of effects is listed on one of the two cards; see [`Rival::between`].
    pub rivals: &'static [Rival],
    /// The run of the stand that determines the effect best.
    pub next_run: StandRun,
    /// The simulated experiment that shows the effect; `None`: the usual one of its domain and coordinate.
    pub demonstration: Option<Demonstration>,
    /// How the firmware compensates the effect; `None`: it cannot.
    pub compensation: Option<Compensation>,
    /// The physics.
    pub law: &'static dyn LawSource,
    /// The description for the user.
    pub description: Description,
}

impl Card {
    /// Values for the fields that most cards leave unchanged. Identifier, texts and parameters are empty.
    pub const DEFAULT: Card = Card {
        id: "",
        title: "",
        equation: "",
        domain: Domain::Torque,
        coordinate: Coordinate::Omega,
        parameters: &[],
        polar: false,
        repeatable: false,
        rests_on: &[],
        inert_alone: false,
        requires: &[],
        elastic: None,
        reduces_to: None,
        uses_supply: false,
        uses_rate_source: false,
        limited_at_zero: &[],
        dry_friction: None,
        clearance: None,
        unused_with_temperature: &[],
        screening: Screening::AtZero,
        family: "",
        rivals: &[],
        next_run: StandRun::STEPS,
        demonstration: None,
        compensation: None,
        law: &NoLaw,
        description: Description { summary: "", signature: "", experiment: "", similar: "", reference: "" },
    };

    /// Index of the harmonic order among the parameters, if the effect has one.
    pub fn harmonic_order_index(&self) -> Option<usize> {
        self.parameters.iter().position(|p| p.kind == ParameterKind::HarmonicOrder)
    }

    /// Index of a number of periods that need not be whole, if the effect has one.
    pub fn periodicity_index(&self) -> Option<usize> {
        self.parameters.iter().position(|p| p.kind == ParameterKind::Periodicity)
    }
}

/// The law of a card that does not state its own: no effect at all.
#[derive(Debug, Clone, Copy)]
struct NoLaw;

impl<S: Scalar> Law<S> for NoLaw {}

/// Description of an effect for the user.
#[derive(Debug)]
pub struct Description {
    /// The physical cause.
    pub summary: &'static str,
    /// How the effect appears in a log.
    pub signature: &'static str,
    /// The experiment that shows it best.
    pub experiment: &'static str,
    /// Effects and errors with a similar signature.
    pub similar: &'static str,
    /// Literature.
    pub reference: &'static str,
}

/// One parameter of an effect.
#[derive(Debug)]
pub struct Parameter {
    /// Name with its unit, as in the model file.
    pub name: &'static str,
    /// Unit for the user.
    pub unit: &'static str,
    /// Meaning.
    pub description: &'static str,
    /// Physical range; a fit that ends outside is refused as an explanation.
    pub range: (f64, f64),
    /// Start value of a fit, typical of the default stand.
    pub start: f64,
    /// How a fit moves it.
    pub kind: ParameterKind,
    /// Range from which `stand sim --hidden` draws its magnitude on the default stand; signed parameters get a random sign.
    pub simulated_range: (f64, f64),
}

impl Parameter {
    /// The amplitude a of a torque over the angle or the time, N m.
    pub(crate) const fn torque_amplitude(name: &'static str, simulated_range: (f64, f64)) -> Self {
        Self {
            name,
            unit: "N m",
            description: "amplitude a",
            range: (0.0, f64::INFINITY),
            start: 0.0005,
            kind: ParameterKind::NonNegative,
            simulated_range,
        }
    }

    /// The harmonic order n of a ripple of the motor. Commutator segments, poles and teeth of a micromotor make 5 to 14 periods per turn.
    pub(crate) const fn harmonic_order(name: &'static str) -> Self {
        Self {
            name,
            unit: "1/turn",
            description: "harmonic order n: periods per turn",
            range: (1.0, 400.0),
            start: 7.0,
            kind: ParameterKind::HarmonicOrder,
            simulated_range: (5.0, 14.0),
        }
    }

    /// The phase φ of a harmonic, rad.
    pub(crate) const fn phase(name: &'static str) -> Self {
        let turn = (0.0, core::f64::consts::TAU);
        Self { name, unit: "rad", description: "phase φ", range: turn, start: 0.0, kind: ParameterKind::Phase, simulated_range: turn }
    }
}

/// How a fit moves a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ParameterKind {
    /// A coefficient whose zero means "absent"; physically not negative.
    NonNegative,
    /// A coefficient of either sign.
    Signed,
    /// Never zero: moved by its logarithm.
    Positive,
    /// A fraction between 0 and 1: moved by its logit.
    Fraction,
    /// An angle in [0, 2π).
    Phase,
    /// A whole number of periods per turn: scanned, never fitted.
    HarmonicOrder,
    /// A number of periods per turn or per second that need not be whole: scanned, then fitted near the scanned value.
    Periodicity,
    /// A time of the record.
    EventTime,
}

/// Where an effect acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Domain {
    /// A torque on the rotor or a change of the mechanics.
    Torque,
    /// The bridge and the winding.
    Electrical,
    /// The reading of a channel; no torque causes it.
    Measurement,
}

impl Domain {
    /// Heading in the catalogue.
    pub fn title(self) -> &'static str {
        match self {
            Domain::Torque => "Drive: torque",
            Domain::Electrical => "Drive: electrical",
            Domain::Measurement => "Measurement",
        }
    }
}

/// How the firmware compensates an effect; the arguments are the effect's parameters in the order of the card.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Compensation {
    /// Coulomb torque.
    CoulombTorque,
    /// Viscous coefficient.
    ViscousCoefficient,
    /// A torque of amplitude, harmonic order and phase.
    Harmonic,
    /// A torque of amplitude and phase at harmonic order 1.
    FirstHarmonic,
    /// Inductance, as the time constant of the winding.
    WindingTimeConstant,
}

/// Another effect with a similar signature, and how to separate the two.
#[derive(Debug, Clone, Copy)]
pub struct Rival {
    /// The other effect.
    pub effect: &'static str,
    /// How to separate the two, as a sentence without its full stop.
    pub separation: &'static str,
    /// The run of the stand that separates them.
    pub run: StandRun,
    /// A change of the stand that separates them where no run does, because their equations coincide; a sentence without its full stop.
    pub change_of_stand: Option<&'static str>,
}

impl Rival {
    /// Two parts of the friction that depend on the rate in different ways.
    pub const fn by_rate_dependence(effect: &'static str) -> Rival {
        Rival {
            effect,
            separation: "The parts of the friction differ in their dependence on the rate and its sign: pass through zero slowly, several times, in both directions",
            run: StandRun::LOW_RATES,
            change_of_stand: None,
        }
    }

    /// How to separate two effects, listed on either card; `None`: neither card lists the other.
    pub fn between(one: &Card, other: &Card) -> Option<&'static Rival> {
        let listed = |card: &Card, id: &str| card.rivals.iter().find(|r| r.effect == id);
        listed(one, other.id).or_else(|| listed(other, one.id))
    }
}
