//! The fitted parameters that the other methods use.

use identification::identify::fit::FitResult;

/// Fitted parameters that the other methods use, each with its standard uncertainty.
pub(super) struct Drive {
    /// J, kg m².
    pub inertia_kg_m2: (f64, f64),
    /// K, N m/A.
    pub motor_constant_N_m_A: (f64, f64),
    /// b, N m s/rad.
    pub viscous_N_m_s: (f64, f64),
}

impl Drive {
    pub(super) fn of(result: &FitResult, misfit: f64) -> Option<Self> {
        // An incomplete model underestimates its uncertainties at least by the misfit.
        let widened = |(value, sigma): (f64, f64)| (value, sigma * misfit.max(1.0));
        Some(Self {
            inertia_kg_m2: widened(get(result, "inertia_kg_m2")?),
            motor_constant_N_m_A: widened(get(result, "motor_constant_N_m_A")?),
            viscous_N_m_s: widened(get(result, "viscous_N_m_s").unwrap_or((0.0, 0.0))),
        })
    }
}

/// A fitted parameter with its standard uncertainty; `None` if it is not determined.
pub(super) fn get(result: &FitResult, name: &str) -> Option<(f64, f64)> {
    let k = result.parameters.list.iter().position(|p| p.name == name)?;
    Some((result.parameters.list[k].value, *result.sigmas.get(k)?)).filter(|(_, sigma)| sigma.is_finite())
}
