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

/// Relative damping from which on a response has no peak: 1/√2.
const MAX_DAMPING_RATIO: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Frequencies at which the shafts of a model resonate, Hz: from, to. Their width is that of half the power, 2 ζ f.
pub fn shaft_resonances_Hz(model: &Model) -> Vec<(f64, f64)> {
    let shafts = model.effects().iter().filter(|used| used.card.elastic == Some(Elastic::Shaft));
    let resonance = |parameters: &[usize]| {
        let [.., stiffness, damping, share] = parameters else { return None };
        let value = |k: &usize| model.parameters()[*k].value;
        let reduced = model.base(BaseParameter::Inertia)? * value(share) * (1.0 - value(share));
        let frequency_Hz = (value(stiffness) / reduced).sqrt() / std::f64::consts::TAU;
        let half_width_Hz = value(damping) / reduced / (2.0 * std::f64::consts::TAU);
        (half_width_Hz < MAX_DAMPING_RATIO * frequency_Hz).then_some((frequency_Hz - half_width_Hz, frequency_Hz + half_width_Hz))
    };
    shafts.filter_map(|used| resonance(&used.parameters)).collect()
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A reduced inertia of 2.5e-4 · 0.3 · 0.7 kg m² on 0.634 N m/rad swings at 17.5 Hz, with the relative damping d/(2 √(k J)) of 2.1 %.
    #[test]
    fn resonance_is_that_of_the_reduced_inertia() {
        let text = "[drive]\ninput = \"u_V\"\neffects = [\"compliance\"]\n[parameters]\ninertia_kg_m2 = 2.5e-4\nmotor_constant_N_m_A = 2.34e-2\n\
                    resistance_ohm = 2.32\nshaft_N_m_rad = 0.634\nshaft_N_m_s_rad = 2.435e-4\nmotor_inertia_share = 0.3\n";
        let [(from_Hz, to_Hz)] = shaft_resonances_Hz(&Model::parse(text, "shaft.toml").expect("a model"))[..] else {
            panic!("one resonance")
        };
        assert!((0.5 * (from_Hz + to_Hz) - 17.49).abs() < 0.01, "{from_Hz} {to_Hz}");
        assert!(((to_Hz - from_Hz) / (2.0 * 0.0211 * 17.49) - 1.0).abs() < 0.01, "{from_Hz} {to_Hz}");
        let damped = text.replace("2.435e-4", "9e-3");
        assert!(shaft_resonances_Hz(&Model::parse(&damped, "shaft.toml").expect("a model")).is_empty(), "a damping of 78 %");
    }
}
