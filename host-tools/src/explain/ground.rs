//! A model fitted to a record, as the place from which the next effect is looked for.

use super::trial::Trial;
use crate::fit::normal::Starts;
use crate::fit::parameters::Parameters;
use crate::fit::simulate::{Initial, System, initials};
use crate::fit::solve::{self, Place};
use crate::fit::{self, Held, Record, build, first_starts};
use crate::model::Model;

/// A fitted model and its record.
pub struct Ground<'a> {
    /// The model, with the fitted values.
    pub model: Model,
    /// The log as the model sees it.
    pub record: Record<'a>,
    /// The model as a system.
    pub system: System,
    /// The fit.
    pub held: Held,
    /// 1/noise² of each channel.
    pub weights: Vec<f64>,
}

/// Fall of χ² that a fit of a candidate leaves undone: far below what any decision asks for.
const ENOUGH: f64 = 0.05;

impl<'a> Ground<'a> {
    /// Fits `model` to the record.
    ///
    /// # Errors
    /// Where the model cannot be simulated along this log.
    pub fn fit(model: &Model, record: Record<'a>) -> Result<Self, fit::FitError> {
        let (system, parameters) = build::system(model, record.temp_C.is_some());
        let held = fit::fit(&system, &parameters, &record)?;
        let mut model = model.clone();
        // A fit may leave a physical range that the file's reader guards; then the file keeps its own value and the answer says so.
        for p in &held.parameters.list {
            let _ = model.set(&p.name, p.value);
        }
        let noise: Vec<f64> = held.channels.iter().map(|c| c.noise).collect();
        Ok(Ground { model, record, system, weights: fit::weights(&noise), held })
    }

    /// Residuals by channel.
    pub fn residuals(&self) -> Vec<&[f64]> {
        self.held.channels.iter().map(|c| c.residual.as_slice()).collect()
    }

    /// The record as `trial` needs it.
    pub fn record_for(&self, trial: &Trial) -> Record<'a> {
        let mut record = self.record.clone();
        if let Some(derived) = trial.rate_from_encoder {
            record.rate_from_encoder = derived;
        }
        record
    }

    /// Initial states for a system that may have more of them than this one.
    pub fn starts_for(&self, system: &System, parameters: &Parameters, record: &Record) -> Starts {
        let kinds: Vec<Initial> = initials(&system.rig::<f64>(parameters, record.driven), record);
        let mut starts = first_starts(&kinds, record, parameters, system);
        for (values, own) in starts.values.iter_mut().zip(&self.held.starts.values) {
            for (value, kind) in values.iter_mut().zip(&kinds) {
                if let Some(k) = self.held.starts.kinds.iter().position(|own| own == kind) {
                    *value = own[k];
                }
            }
        }
        starts
    }

    /// The system with `trial` in it, and where the trial's parameters stand.
    pub fn with(&self, trial: &Trial, free: &[bool]) -> (System, Parameters, std::ops::Range<usize>) {
        let mut system = self.system.clone();
        let mut parameters = self.held.parameters.clone();
        let own = build::append(&mut system, &mut parameters, trial.card, &trial.values, free);
        (system, parameters, own)
    }

    /// Descends from the given parameters, with this ground's weights.
    pub fn descend(&self, system: &System, parameters: &Parameters, record: &Record, starts: &Starts) -> Place {
        let place = Place::begin(system, parameters, record, starts);
        solve::descend(system, record, place, &self.weights, |_| ENOUGH)
    }
}
