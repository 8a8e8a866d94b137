//! Fit by equation error, with the output-error fit of the same model for comparison.

use super::fit::equation_error::{self, EquationErrorFit, InverseModelError, Settings};
use super::fit::{self, FitError, FitResult};
use crate::identify::defects::defects;
use crate::log::Log;
use crate::log::plausible::Defect;
use crate::model::{Input, Model};
use crate::recording::PreparedLog;
use crate::recording::prepare::PrepareError;

/// Estimates that differ by more than this many standard uncertainties of their difference are marked.
const MAX_DIFFERENCE_SIGMA: f64 = 3.0;

/// Result of [`fit`].
pub enum EquationErrorResult {
    /// The log is not a plausible record of a drive; nothing was computed.
    ImplausibleLog(Vec<Defect>),
    /// Both fits.
    Fitted(Box<EquationErrorComparison>),
}

/// The fit by equation error and the output-error fit.
pub struct EquationErrorComparison {
    /// Fit by equation error.
    pub equation: EquationErrorFit,
    /// Output-error fit (free run); `None` for a prescribed motion, which has no free run.
    pub free_run: Option<Result<FitResult, FitError>>,
}

/// Why there is no fit.
#[derive(Debug, thiserror::Error)]
pub enum EquationErrorFailure {
    /// The fit by equation error failed.
    #[error(transparent)]
    InverseModel(#[from] InverseModelError),
    /// The log lacks what the model needs.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
}

/// Fits `model` to `log` by equation error and by output error. `cutoff_hz`: cutoff of the differentiating filter, default by the row
/// rate; `all_rows`: the output-error fit holds out no rows.
///
/// # Errors
/// The cutoff is out of range; the log lacks a column; the model is not linear in a parameter.
pub fn fit(log: &Log, model: &Model, cutoff_hz: Option<f64>, all_rows: bool) -> Result<EquationErrorResult, EquationErrorFailure> {
    let settings = cutoff_hz.map_or_else(|| Ok(Settings::usual(log)), |hz| Settings::with_cutoff(log, hz))?;
    let findings = defects(log, model);
    if !findings.is_empty() {
        return Ok(EquationErrorResult::ImplausibleLog(findings));
    }
    equation_error::angle(log)?;
    let (data, _) = crate::recording::prepare(log, model, !all_rows)?;
    let equation = equation_error::fit_prepared(log, &data, model, settings)?;
    let free_run = (model.input() != Input::Motion).then(|| free_run(&data, model));
    Ok(EquationErrorResult::Fitted(Box::new(EquationErrorComparison { equation, free_run })))
}

fn free_run(data: &PreparedLog, model: &Model) -> Result<FitResult, FitError> {
    let (system, parameters) = fit::build::system(model, data.temp_C.is_some());
    fit::fit(&system, &parameters.within_physical_ranges(), data)
}

impl EquationErrorComparison {
    /// Value and standard uncertainty of parameter `k` by output error; `None` without a successful output-error fit.
    pub fn by_free_run(&self, k: usize) -> Option<(f64, f64)> {
        let result = self.free_run.as_ref()?.as_ref().ok()?;
        Some((result.parameters.list.get(k)?.value, *result.sigmas.get(k)?))
    }

    /// The two estimates of parameter `k` differ significantly.
    pub fn differs(&self, k: usize) -> bool {
        let (value, sigma) = (self.equation.parameters.list[k].value, self.equation.sigmas[k]);
        self.by_free_run(k).is_some_and(|(free, free_sigma)| (value - free).abs() > MAX_DIFFERENCE_SIGMA * sigma.hypot(free_sigma))
    }
}
