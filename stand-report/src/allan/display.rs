//! Units in which an Allan analysis is displayed.

use crate::units::{AccelerationUnit, Dimension, RateUnit, Scale, Units};
use stand_analysis::allan::answer::{Answer, FLICKER};
use stand_analysis::allan::units::{ColumnKind, PROCESSES};

/// Dimensions of Q, N, B, K, R of a rate, and of an acceleration.
const OF_RATE: [Dimension; 5] =
    [Dimension::Angle, Dimension::AngleRandomWalk, Dimension::Rate, Dimension::RateRandomWalk, Dimension::RateRamp];
const OF_ACCELERATION: [Dimension; 5] = [
    Dimension::Velocity,
    Dimension::VelocityRandomWalk,
    Dimension::Acceleration,
    Dimension::AccelerationRandomWalk,
    Dimension::AccelerationRamp,
];

/// Units without a choice of the user: those of data sheets for rates, SI for accelerations.
pub const DEFAULTS: Units = Units {
    rate: Some(RateUnit::DegH),
    random_walk: None,
    density: None,
    acceleration: Some(AccelerationUnit::MetreS2),
    acceleration_density: None,
    ratio: None,
};

/// Factor and unit of each coefficient and of the one-sided densities, from the unit of the column.
#[derive(Debug, Clone, PartialEq)]
pub struct Display {
    coefficients: [Scale; 5],
    densities: Vec<Scale>,
}

impl Display {
    /// For this answer, with units that are completed by [`DEFAULTS`].
    pub fn new(answer: &Answer, units: Units) -> Self {
        let chosen = units.or(DEFAULTS);
        let si = |dimensions: [Dimension; 5], size: f64| {
            dimensions.map(|dimension| {
                let Scale { factor, unit } = chosen.scale(dimension);
                Scale { factor: factor * size, unit }
            })
        };
        let density = |units: Units, dimension: Dimension, size: f64| {
            let Scale { factor, unit } = units.scale(dimension);
            Scale { factor: factor * size, unit }
        };
        match answer.unit.kind {
            ColumnKind::Rate { rad } => {
                // Without a choice in both units of data sheets.
                let densities = if units.rate.or(units.density).is_some() {
                    vec![density(chosen, Dimension::RateDensity, rad)]
                } else {
                    [RateUnit::DegH, RateUnit::DegS]
                        .map(|rate| density(Units { rate: Some(rate), ..Units::default() }, Dimension::RateDensity, rad))
                        .to_vec()
                };
                Self { coefficients: si(OF_RATE, rad), densities }
            }
            ColumnKind::Acceleration => {
                Self { coefficients: si(OF_ACCELERATION, 1.0), densities: vec![density(chosen, Dimension::AccelerationDensity, 1.0)] }
            }
            ColumnKind::Other => Self {
                coefficients: PROCESSES.map(|process| Scale { factor: 1.0, unit: answer.unit.times(process.unit) }),
                densities: vec![Scale { factor: 1.0, unit: answer.unit.times("/√Hz") }],
            },
        }
    }

    /// Of coefficient `p`, an index of [`PROCESSES`].
    pub fn coefficient(&self, p: usize) -> &Scale {
        &self.coefficients[p]
    }

    /// Of the deviation.
    pub fn deviation(&self) -> &Scale {
        &self.coefficients[FLICKER]
    }

    /// Of the one-sided density √2 N.
    pub fn densities(&self) -> &[Scale] {
        &self.densities
    }
}
