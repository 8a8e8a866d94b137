//! Poles of the closed loop of element and regulator.
//!
//! Input: an element and a regulator M_K = −r₁ α̂ − r₂ α̂′ (or more states), with − M̂ if the moment is fed forward. Output: the poles. The
//! errors of the observer do not depend on the motion, so that the poles of the loop are those of A − B R and those of the observer, which
//! its design checks.

use nalgebra::{Complex, DMatrix};

use super::{Discrete, ObserverError, Plant};
use identification::statistics::Extremes;

/// Real part, relative to the fastest pole, below which a pole counts as undamped: rounding errors of the eigenvalues.
const MIN_RELATIVE_DAMPING: f64 = 1e-9;

/// A regulator M_K = −r₁ α̂ − r₂ α̂′, with − M̂ if the moment is fed forward.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Regulator {
    /// r₁, N m/rad.
    pub angle_N_m_rad: f64,
    /// r₂, N m s/rad.
    pub rate_N_m_s_rad: f64,
}

/// Poles of A − B R, slowest first, 1/s.
///
/// # Errors
/// A pole has a positive real part: the loop is unstable.
pub fn closed_loop_poles(plant: &Plant, regulator: Regulator) -> Result<Vec<Complex<f64>>, ObserverError> {
    let (a, b) = (plant.a(), plant.b());
    let n = a.len();
    let gains = [regulator.angle_N_m_rad, regulator.rate_N_m_s_rad];
    let matrix = DMatrix::from_fn(n, n, |i, j| a[i][j] - b[i] * gains.get(j).copied().unwrap_or(0.0));
    let mut poles: Vec<Complex<f64>> = matrix.complex_eigenvalues().iter().copied().collect();
    poles.sort_by(|a, b| b.re.total_cmp(&a.re).then(a.im.abs().total_cmp(&b.im.abs())));
    let fastest = poles.iter().map(|pole| pole.norm()).max_or_zero();
    match poles.first() {
        Some(pole) if pole.re.is_nan() || pole.re > MIN_RELATIVE_DAMPING * fastest => {
            Err(ObserverError::UnstableLoop { re: pole.re, im: pole.im.abs(), angle: gains[0], rate: gains[1] })
        }
        _ => Ok(poles),
    }
}

/// All poles are damped, so that the loop has a steady state.
pub fn has_steady_state(poles: &[Complex<f64>]) -> bool {
    let fastest = poles.iter().map(|pole| pole.norm()).max_or_zero();
    poles.iter().all(|pole| pole.re < -MIN_RELATIVE_DAMPING * fastest)
}

/// Largest magnitude of the poles of Φ − Γ R over the first `states` states of a discrete form; below 1 for a stable loop.
pub fn discrete_loop_radius(discrete: &Discrete, regulator: &[f64], states: usize) -> f64 {
    let matrix = DMatrix::from_fn(states, states, |i, j| discrete.phi[i][j] - discrete.gamma[i] * regulator.get(j).copied().unwrap_or(0.0));
    matrix.complex_eigenvalues().iter().map(|pole| pole.norm()).max_or_zero()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// docs/theory.md §1.5: −85.15567 ± 572.950j, −0.21709 ± 12.8428j, −0.15356 ± 0.154973j.
    #[test]
    fn poles_of_set_r_are_those_of_the_theory() {
        let plant = Plant::named("astatic-identifier-recovered").unwrap();
        let poles = closed_loop_poles(&plant, Regulator { angle_N_m_rad: 1e-2, rate_N_m_s_rad: 6.5e-2 }).unwrap();
        for (re, im) in [(-85.15567, 572.950), (-0.21709, 12.8428), (-0.15356, 0.154973)] {
            let near = |pole: &&Complex<f64>| (pole.re / re - 1.0).abs() < 1e-4 && (pole.im.abs() / im - 1.0).abs() < 1e-4;
            assert_eq!(poles.iter().filter(near).count(), 2, "{poles:?}");
        }
        assert!(has_steady_state(&poles));
    }

    #[test]
    fn a_regulator_of_the_wrong_sign_is_unstable_and_none_is_undamped() {
        let plant = Plant::named("astatic-identifier-recovered").unwrap();
        let unstable = closed_loop_poles(&plant, Regulator { angle_N_m_rad: 1e-2, rate_N_m_s_rad: -6.5e-2 });
        assert!(matches!(unstable, Err(ObserverError::UnstableLoop { re, .. }) if (re - 85.0).abs() < 1.0), "{unstable:?}");
        let poles = closed_loop_poles(&plant, Regulator { angle_N_m_rad: 0.0, rate_N_m_s_rad: 0.0 }).unwrap();
        assert!(!has_steady_state(&poles));
    }
}
