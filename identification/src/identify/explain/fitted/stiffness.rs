//! Ranges of stiffness that the sampling resolves.

use drive_model::Elastic;

use crate::identify::explain::criteria::TrialCriteria;
use crate::identify::fit::Parameters;
use crate::model::{BaseParameter, Model};

/// Smallest and largest share of the inertia at the motor, of a fitted shaft.
const SHARE_RANGE: (f64, f64) = (0.03, 0.97);

/// Ranges of stiffness, damping and share of a fitted shaft. A resonance that the sampling does not resolve is a rigid shaft.
pub fn shaft_ranges(model: &Model, dt_s: f64, criteria: &TrialCriteria) -> [(f64, f64); 3] {
    let inertia = model.base(BaseParameter::Inertia).unwrap_or(1.0);
    let w = std::f64::consts::TAU * criteria.min_shaft_resonance_Hz;
    let stiff = std::f64::consts::TAU * criteria.max_shaft_resonance_per_row / dt_s;
    // J_red lies between 0.05 J (a share of 0.05) and 0.25 J (a share of one half).
    [(0.05 * inertia * w * w, 0.25 * inertia * stiff * stiff), (0.0, 0.5 * inertia * stiff), SHARE_RANGE]
}

/// Largest stiffness of a bristle, by the resonance of the rotor on it.
pub fn max_bristle_stiffness(model: &Model, dt_s: f64, criteria: &TrialCriteria) -> f64 {
    let inertia = model.base(BaseParameter::Inertia).unwrap_or(1.0);
    let stiff = std::f64::consts::TAU * criteria.max_bristle_resonance_per_row / dt_s;
    inertia * stiff * stiff
}

/// Limits shafts and bristles of a model to what the sampling resolves, where they begin within that range.
pub fn limit_stiffness(model: &Model, dt_s: f64, criteria: &TrialCriteria, parameters: &mut Parameters) {
    for used in model.effects() {
        let ranges = match used.card.elastic {
            Some(Elastic::Bristle) => vec![(0.0, max_bristle_stiffness(model, dt_s, criteria))],
            Some(Elastic::Shaft) => shaft_ranges(model, dt_s, criteria).to_vec(),
            None => continue,
        };
        // The three parameters of a shaft stand last.
        let first = used.parameters.len().saturating_sub(ranges.len());
        for (&k, range) in used.parameters[first..].iter().zip(ranges) {
            let p = &mut parameters.list[k];
            let both = (p.range.0.max(range.0), p.range.1.min(range.1));
            if (both.0..=both.1).contains(&p.value) {
                p.range = both;
            }
        }
    }
}
