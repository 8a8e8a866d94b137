//! What is said of an effect: identifier, equation, parameters, account.

/// One effect of the catalogue, as data.
#[derive(Debug)]
pub struct Card {
    /// Name in models and answers, e.g. `torque-ripple`.
    pub id: &'static str,
    /// Name for a heading.
    pub title: &'static str,
    /// The equation in one line.
    pub equation: &'static str,
    /// Where it acts.
    pub domain: Domain,
    /// The coordinate over which a model that lacks it fails most.
    pub coordinate: Coordinate,
    /// Its parameters, in the order in which the law takes them.
    pub parameters: &'static [Parameter],
    /// The first parameter is an amplitude and the last its phase: a fit moves a·cos φ and a·sin φ instead.
    pub polar: bool,
    /// How its absence is tested.
    pub screen: Screen,
    /// Effects of the same family cannot be told apart by some logs; empty: none known beforehand.
    pub family: &'static str,
    /// The account in plain words.
    pub description: Description,
}

/// The account of an effect, for the person at the stand.
#[derive(Debug)]
pub struct Description {
    /// What it is.
    pub summary: &'static str,
    /// How it shows.
    pub signature: &'static str,
    /// Which experiment shows it best.
    pub experiment: &'static str,
    /// What else looks like it.
    pub similar: &'static str,
    /// Where to read on.
    pub reference: &'static str,
}

/// One parameter of an effect.
#[derive(Debug)]
pub struct Parameter {
    /// Name with its unit, as in the model file.
    pub name: &'static str,
    /// Unit for a person.
    pub unit: &'static str,
    /// What it is.
    pub description: &'static str,
    /// Physical range; a fit that leaves it is no explanation.
    pub range: (f64, f64),
    /// Start value of a fit, of the order of the default stand's.
    pub start: f64,
    /// How a fit may move it.
    pub kind: ParameterKind,
    /// Range from which `stand sim --hidden` draws its magnitude on the default stand (signed kinds get a random sign).
    pub simulated_range: (f64, f64),
}

/// How a parameter moves in a fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ParameterKind {
    /// A coefficient whose zero means "absent"; physically not negative.
    NonNegative,
    /// A coefficient of either sign.
    Signed,
    /// Never zero: moved by its logarithm.
    Positive,
    /// A share between 0 and 1: moved by its logit.
    Fraction,
    /// An angle in [0, 2π).
    Phase,
    /// A whole number, scanned, never fitted.
    HarmonicOrder,
    /// A moment of the record.
    EventTime,
}

/// Where an effect acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Domain {
    /// A torque on the rotor or a change of the mechanics.
    Torque,
    /// The bridge and the winding.
    Electrical,
    /// What a channel shows, with no torque behind it.
    Measurement,
}

impl Domain {
    /// Heading of the catalogue.
    pub fn title(self) -> &'static str {
        match self {
            Domain::Torque => "Drive: torque",
            Domain::Electrical => "Drive: electrical",
            Domain::Measurement => "Measurement",
        }
    }
}

/// A coordinate over which a residual is looked at (interfaces.md, `failures`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Coordinate {
    /// Angle within the turn.
    Theta,
    /// Rate.
    Omega,
    /// Current.
    Current,
    /// Winding temperature.
    Temperature,
    /// Time since the start.
    Time,
    /// Angular acceleration.
    Acceleration,
    /// What happened just before: reversals.
    History,
}

impl Coordinate {
    /// Name in the answers.
    pub fn name(self) -> &'static str {
        match self {
            Coordinate::Theta => "theta",
            Coordinate::Omega => "omega",
            Coordinate::Current => "current",
            Coordinate::Temperature => "temperature",
            Coordinate::Time => "time",
            Coordinate::Acceleration => "acceleration",
            Coordinate::History => "history",
        }
    }
}

/// How the absence of an effect is tested.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Screen {
    /// By its sensitivity at zero.
    AtZero,
    /// The same, over a scan of its discrete or nonlinear parameter.
    Scan,
    /// Zero is singular: by a few finite values.
    Probe,
}
