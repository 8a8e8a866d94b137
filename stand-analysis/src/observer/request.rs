//! The request for an observer: element, poles, kind.

use super::exact::{Matrix, exact};
use super::{Plant, Poles};

/// Kind of observer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// No integral channel: a constant disturbance leaves an offset (docs/theory.md §1.4).
    Static,
    /// The static gains and an integral of the error that acts on one row (docs/theory.md §1.5). Without a given gain, the magnitude of
    /// that row's own gain is used.
    Integral {
        /// Row of the channel, 1 … n.
        row: usize,
        /// Gain κ.
        gain: Option<f64>,
    },
    /// The disturbance is an additional state and all poles are placed (docs/theory.md §1.5, P7).
    Augmented,
}

/// Row of the observer that the integral channel feeds by default.
pub const DEFAULT_INTEGRAL_ROW: usize = 2;

impl Kind {
    /// The kind of this name.
    pub fn named(name: &str) -> Option<Kind> {
        [Kind::Static, Kind::Integral { row: DEFAULT_INTEGRAL_ROW, gain: None }, Kind::Augmented]
            .into_iter()
            .find(|kind| kind.name() == name)
    }

    /// The usual kind for an element: integral for six states, static for four.
    pub fn usual(plant: &Plant) -> Kind {
        if plant.states().len() == 6 { Kind::Integral { row: DEFAULT_INTEGRAL_ROW, gain: None } } else { Kind::Static }
    }

    /// The kind with these values of the integral channel, where they are given; `None` for a kind without this channel.
    pub fn with_integral(self, row: Option<usize>, gain: Option<f64>) -> Option<Kind> {
        match self {
            Kind::Integral { row: usual, gain: own } => Some(Kind::Integral { row: row.unwrap_or(usual), gain: gain.or(own) }),
            other => (row.is_none() && gain.is_none()).then_some(other),
        }
    }

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Static => "static",
            Self::Integral { .. } => "integral",
            Self::Augmented => "augmented",
        }
    }
}

/// A design request.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// The element.
    pub plant: Plant,
    /// Requested poles.
    pub poles: Poles,
    /// Kind of observer.
    pub kind: Kind,
    /// Step of the discrete form, s.
    pub step_s: Option<f64>,
    /// Highest vibration frequency, Hz, for the warnings.
    pub vibration_Hz: Option<f64>,
}

/// The integral channel: x̂′ = … + e_row κ z, z′ = y − x̂₁.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Integral {
    /// Row on which it acts, from 1.
    pub row: usize,
    /// Gain κ.
    pub gain: f64,
    /// Estimated moment per integral, N m/(rad s): M̂ = this · z.
    pub moment_per_integral: f64,
    /// Upper end of the stable range of the gain; `None` for an augmented observer.
    pub stable_below: Option<f64>,
}

/// The plant with a constant moment as one state more.
pub(super) fn augmented(plant: &Plant) -> Matrix {
    let (a, b) = (plant.a(), plant.b());
    let n = a.len();
    Matrix::new(n + 1, n + 1, |i, j| {
        exact(if i == n {
            0.0
        } else if j == n {
            b[i]
        } else {
            a[i][j]
        })
    })
}
