//! The given model, fitted to the logs: where an explanation begins.

use super::FittedModel;
use crate::budget::Budget;
use crate::identify::constants;
use crate::identify::explain::context::Context;
use crate::identify::fit::FitError;
use crate::identify::recording_conventions::Recording;
use crate::log::plausible::{Defect, ShiftedConstant};
use crate::model::Model;
use crate::recording::Convention;
use crate::recording::PreparedLog;
use crate::recording::prepare::{self, PreparationNote, PrepareError};

/// The given model, fitted.
pub struct Given<'a> {
    /// The model as it was given.
    pub model: &'a Model,
    /// The model, fitted by the conventions of [`Given::recording`].
    pub base: FittedModel<'a>,
    /// How the logs were recorded.
    pub recording: Recording,
    /// The logs, with no convention of recording assumed.
    pub data: PreparedLog<'a>,
    /// What the preparation of the logs noted.
    pub notes: Vec<PreparationNote>,
}

/// Why the given model could not be fitted.
#[derive(Debug, thiserror::Error)]
pub enum GivenError {
    /// A log lacks what the model needs.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// The model cannot be simulated along the logs.
    #[error(transparent)]
    Fit(#[from] FitError),
}

impl<'a> Given<'a> {
    /// Prepares the logs and fits `model`. `hold_out`: blocks of rows are held out. `conventions` of recording: those to assume; `None`:
    /// the ones that fit best.
    ///
    /// # Errors
    /// [`GivenError`].
    pub fn fit(
        context: Context<'a>,
        model: &'a Model,
        budget: &Budget,
        hold_out: bool,
        conventions: Option<&[Convention]>,
    ) -> Result<Self, GivenError> {
        let (data, notes) = prepare::prepare(context.log, model, hold_out)?;
        let data = data.spending(budget.clone()).comparing_increments();
        let (base, recording) = FittedModel::fit(context, model, data.clone(), conventions)?;
        Ok(Given { model, base, recording, data, notes })
    }

    /// Columns that seem to be in thousandths of their unit. Values on the way to the minimum prove nothing about units.
    pub fn wrong_unit(&self) -> Option<Defect> {
        let is_cut_short = self.base.data.budget.checkpoint();
        (!is_cut_short).then(|| constants::columns_in_thousandths_by_fit(self.model, &self.base.data, &self.base.fit)).flatten()
    }

    /// Physical constants that the fit shifts by a decade or more.
    pub fn shifted_constants(&self) -> Vec<ShiftedConstant> {
        constants::shifted(self.model, &self.base.fit)
    }
}
