//! A model fitted to a record, as the place from which the next effect is looked for.

use std::ops::Range;

use super::evidence::{Squares, Whitener};
use super::trial::{Trial, keep_in_reach};
use crate::identify::fit::normal_equations::InitialStates;
use crate::identify::fit::parameters::Parameters;
use crate::identify::fit::simulate::{InitialStateKind, System, initial_state_kinds};
use crate::identify::fit::solve::{self, Iterate};
use crate::identify::fit::starting_point::{WINDOW_S, fit_windows, windows};
use crate::identify::fit::{self, ChannelFit, FitError, FitResult, PreparedLog, build, starting_states};
use crate::model::{Input, Model};
use crate::statistics::Extremes;

/// A fitted model and its record.
pub struct Ground<'a> {
    /// The model, with the fitted values.
    pub model: Model,
    /// The log as the model sees it.
    pub record: PreparedLog<'a>,
    /// The model as a system.
    pub system: System,
    /// Where its fit began.
    begun: Parameters,
    /// The fit.
    pub held: FitResult,
    /// 1/noise² of each channel.
    pub weights: Vec<f64>,
}

/// Fall of χ² that a fit of a candidate leaves undone: far below what any decision asks for.
const ENOUGH: f64 = 0.05;
/// The same for one that will be fitted again if it is among the best: a part of what it leaves to explain.
const ROUGHLY: f64 = 1e-3;
/// A step that promises less than this part of the way to the best rival will not reach it.
const LOST: f64 = 0.02;
/// Steps after which a descent is judged by how fast it falls, and a fall in them that is no more than a trifle.
const TREND_STEPS: usize = 4;
const TRIFLE: f64 = 0.5;
/// Most steps of one candidate's fit.
const MOST_STEPS: usize = 20;
const MOST_ON_EXCERPT: usize = 30;
/// Length of an excerpt.
const EXCERPT_S: f64 = 3.0;
const EXCERPT_ROWS: usize = 500;

/// Windows after the short ones.
const LONGER_S: [f64; 2] = [1.0, 4.0];

/// How far a descent goes.
#[derive(Debug, Clone, Copy)]
pub enum Goal {
    /// To the end.
    End,
    /// Until it is clear where it ends, or that it cannot reach a rival of this χ² (infinite: none is known).
    Race(f64),
}

fn rows(record: &PreparedLog) -> usize {
    record.segments.iter().map(Range::len).sum()
}

/// χ² that a record's noise leaves, at most: held-out rows count here.
fn noise_chi2(record: &PreparedLog) -> f64 {
    (rows(record) * record.channels.len()) as f64
}

/// Who is this near to the best is fitted to the end: as a part of what the best leaves to explain, or of the noise.
const NEAR: f64 = 0.1;

/// In its last steps a descent that passed these χ² won less than any decision asks for: where what sticks comes loose the cost has steps, and
/// what the linear model promises there is not kept.
fn falls_by_trifles(passed: &[f64]) -> bool {
    passed.len().checked_sub(TREND_STEPS + 1).is_some_and(|before| passed[before] - passed[passed.len() - 1] < TRIFLE)
}

/// A descent that passed these χ² would, falling on as in its last steps, not have reached a rival of the χ² `rival` after `most` steps.
fn falls_too_slowly(passed: &[f64], rival: f64, most: usize) -> bool {
    let Some(before) = passed.len().checked_sub(TREND_STEPS + 1) else { return false };
    let now = passed[passed.len() - 1];
    let per_step = (passed[before] - now) / TREND_STEPS as f64;
    now - per_step * most.saturating_sub(passed.len() - 1) as f64 > rival
}

/// χ² below which a fit is near to one of the χ² `best`.
pub fn near(best: f64, record: &PreparedLog) -> f64 {
    within(NEAR, best, record)
}

/// χ² that leaves this part more to explain than the χ² `best`, or this part of the noise where that leaves less.
pub fn within(part: f64, best: f64, record: &PreparedLog) -> f64 {
    let noise = noise_chi2(record);
    best + part * (best - noise).max(noise)
}

impl<'a> Ground<'a> {
    /// Fits `model` to the record.
    ///
    /// # Errors
    /// Where the model cannot be simulated along this log.
    pub fn fit(model: &Model, record: PreparedLog<'a>) -> Result<Self, FitError> {
        let (system, parameters) = build::system(model, record.temp_C.is_some());
        let held = fit::fit(&system, &parameters, &record)?;
        Ok(Ground::of(model, system, parameters, held, record))
    }

    /// Fits a model that is a small change of this ground's, from the values that it has.
    ///
    /// # Errors
    /// Where the model cannot be simulated along this log.
    pub fn refit(&self, model: &Model, record: PreparedLog<'a>) -> Result<Self, FitError> {
        let (system, parameters, starts) = self.changed(model, &record);
        let held = fit::refit(&system, &parameters, &record, &starts, &self.noise())?;
        Ok(Ground::of(model, system, parameters, held, record))
    }

    /// The same for a model of which is asked whether it comes near a rival of the χ² `rival`: where it does not, it is not followed to its end.
    ///
    /// # Errors
    /// Where the model cannot be simulated along this log.
    pub fn refit_beside(&self, model: &Model, record: PreparedLog<'a>, rival: f64) -> Result<Self, FitError> {
        let (system, parameters, starts) = self.changed(model, &record);
        let place = self.minimize(&system, &parameters, &record, &starts, Goal::Race(rival));
        let cost = place.normal_equations(&self.weights).cost;
        let held = if cost.is_finite() && cost >= near(rival, &record) {
            fit::evaluate(&system, &record, place, &self.noise())
        } else {
            fit::refit(&system, &place.parameters, &record, &place.starts, &self.noise())?
        };
        Ok(Ground::of(model, system, parameters, held, record))
    }

    /// System, parameters and initial states of a model that is a small change of this ground's.
    fn changed(&self, model: &Model, record: &PreparedLog) -> (System, Parameters, InitialStates) {
        let (system, mut parameters) = build::system(model, record.temp_C.is_some());
        keep_in_reach(model, record.dt_s, &mut parameters);
        let starts = self.starts_for(&system, &parameters, record);
        (system, parameters, starts)
    }

    /// The model fitted to short windows from where its fit began. What is missing cannot carry it far in them, where along the whole log the
    /// parameters may have run away with it; `None` where there are too few windows.
    pub fn fit_windows(&self) -> Option<Self> {
        let record = if self.record.driven == Input::Motion { None } else { windows(&self.record, WINDOW_S) }?;
        let place = fit_windows(&self.system, &self.begun, &record, &self.held.starts.kinds, &self.weights);
        self.held_at(place, record)
    }

    /// The model as its fit began, held against this ground's rows.
    pub fn as_begun(&self) -> Option<Self> {
        let starts = starting_states(&self.held.starts.kinds, &self.record, &self.begun, &self.system);
        self.held_at(Iterate::new(&self.system, &self.begun, &self.record, &starts), self.record.clone())
    }

    /// The model at a place of this record; `None` where it does not stay finite there.
    fn held_at(&self, place: Iterate, record: PreparedLog<'a>) -> Option<Self> {
        let held = fit::evaluate(&self.system, &record, place, &self.noise());
        held.chi2.is_finite().then(|| Ground::of(&self.model, self.system.clone(), self.begun.clone(), held, record))
    }

    /// Parameters that were found in short windows, fitted to longer and longer ones: what swings over runs away along a whole log from
    /// parameters that are a little off.
    pub fn lengthened(&self, system: &System, parameters: &Parameters, record: &PreparedLog) -> Parameters {
        let mut parameters = parameters.clone();
        let kinds = initial_state_kinds(&system.rig::<f64>(&parameters, record.driven), record);
        for window_s in LONGER_S {
            let Some(record) = windows(record, window_s) else { continue };
            let place = fit_windows(system, &parameters, &record, &kinds, &self.weights);
            if place.normal_equations(&self.weights).cost.is_finite() {
                parameters = place.parameters;
            }
        }
        parameters
    }

    fn of(model: &Model, system: System, begun: Parameters, held: FitResult, record: PreparedLog<'a>) -> Self {
        let mut model = model.clone();
        // A fit may leave a physical range that the file's reader guards; then the file keeps its own value and the answer says so.
        for p in &held.parameters.list {
            let _ = model.set(&p.name, p.value);
        }
        let noise: Vec<f64> = held.channels.iter().map(|c| c.noise).collect();
        Ground { model, record, system, begun, weights: fit::weights(&noise), held }
    }

    fn noise(&self) -> Vec<f64> {
        self.held.channels.iter().map(|c| c.noise).collect()
    }

    /// The largest χ²/n of the channels: 1 where nothing but noise is left.
    pub fn misfit(&self) -> f64 {
        misfit(self.held.channels.iter().map(|c| c.chi2_per_n()))
    }

    /// The same of its rms over the noise that `other` found: the fine structure of a wrong model's residual says less of the noise. With it
    /// that of the rows that the fit never saw.
    pub fn misfits_beside(&self, other: &Ground) -> (f64, f64) {
        let squares = |rms: fn(&ChannelFit) -> f64| {
            let noise = other.held.channels.iter().map(|c| c.noise);
            misfit(self.held.channels.iter().zip(noise).map(|(c, noise)| (rms(c) / noise).powi(2)))
        };
        (squares(|c| c.rms), squares(|c| c.heldout_rms.unwrap_or(c.rms)))
    }

    /// χ²/n of each channel on rows that the fit never saw.
    pub fn heldout(&self) -> Vec<f64> {
        self.held.channels.iter().map(|c| (c.heldout_rms.unwrap_or(c.rms) / c.noise).powi(2)).collect()
    }

    /// Residuals by channel.
    pub fn residuals(&self) -> Vec<&[f64]> {
        self.held.channels.iter().map(|c| c.residual.as_slice()).collect()
    }

    /// Its whitened sums of squares on each log.
    pub fn squares(&self, whitener: &Whitener, logs: &[Range<usize>]) -> Squares {
        whitener.squares(&self.system, &self.held.parameters, &self.held.starts, &self.record, logs)
    }

    /// The record as `trial` needs it.
    pub fn record_for(&self, trial: &Trial) -> PreparedLog<'a> {
        let mut record = self.record.clone();
        if let Some(derived) = trial.rate_from_encoder {
            record.rate_from_encoder = derived;
        }
        record
    }

    /// Initial states for a system that may have more of them than this one: this ground's where the record begins as its own does,
    /// else what the first rows show.
    pub fn starts_for(&self, system: &System, parameters: &Parameters, record: &PreparedLog) -> InitialStates {
        let kinds: Vec<InitialStateKind> = initial_state_kinds(&system.rig::<f64>(parameters, record.driven), record);
        let mut starts = starting_states(&kinds, record, parameters, system);
        for (values, rows) in starts.values.iter_mut().zip(&record.segments) {
            let same = self.record.segments.iter().position(|own| own.start == rows.start);
            let Some(own) = same.map(|k| &self.held.starts.values[k]) else { continue };
            for (value, kind) in values.iter_mut().zip(&kinds) {
                if let Some(k) = self.held.starts.kinds.iter().position(|own| own == kind) {
                    *value = own[k];
                }
            }
        }
        starts
    }

    /// The system with `trial` in it, and where the trial's parameters stand.
    pub fn with(&self, trial: &Trial, free: &[bool]) -> (System, Parameters, Range<usize>) {
        let mut system = self.system.clone();
        let mut parameters = self.held.parameters.clone();
        let own = build::append(&mut system, &mut parameters, trial.card, &trial.values, free);
        for (k, range) in own.clone().zip(&trial.ranges) {
            parameters.list[k].range = *range;
        }
        (system, parameters, own)
    }

    /// Descends from the given parameters, with this ground's weights.
    pub fn minimize(&self, system: &System, parameters: &Parameters, record: &PreparedLog, starts: &InitialStates, goal: Goal) -> Iterate {
        self.descend_from(system, record, Iterate::new(system, parameters, record, starts), goal)
    }

    /// The same from a place.
    pub fn descend_from(&self, system: &System, record: &PreparedLog, place: Iterate, goal: Goal) -> Iterate {
        let most = if rows(record) < self.record.len() { MOST_ON_EXCERPT } else { MOST_STEPS };
        let noise = noise_chi2(record);
        let mut passed: Vec<f64> = Vec::new();
        solve::minimize_within(system, record, place, &self.weights, most, |cost| {
            // A step that was refused says nothing of how fast it falls.
            if passed.last() != Some(&cost) {
                passed.push(cost);
            }
            match goal {
                Goal::End if falls_by_trifles(&passed) => f64::INFINITY,
                Goal::End => ENOUGH,
                Goal::Race(rival) if rival.is_finite() && falls_too_slowly(&passed, rival, most) => f64::INFINITY,
                Goal::Race(rival) => ENOUGH.max(ROUGHLY * (cost - noise)).max(if rival.is_finite() { LOST * (cost - rival) } else { 0.0 }),
            }
        })
    }

    /// A few seconds of the record where the model fails most: enough to judge what rings or plays, at a small part of the cost.
    pub fn excerpt(&self) -> PreparedLog<'a> {
        let record = &self.record;
        let rows = ((EXCERPT_S / record.dt_s) as usize).max(EXCERPT_ROWS);
        let mut best: Option<(f64, Range<usize>)> = None;
        for segment in &record.segments {
            let mut from = segment.start;
            while from < segment.end {
                let part = from..(from + rows).min(segment.end);
                let squares = |r: &Vec<f64>| r[part.clone()].iter().filter(|r| r.is_finite()).map(|r| r * r).sum::<f64>();
                let fails: f64 = self.held.channels.iter().zip(&self.weights).map(|(c, w)| w * squares(&c.residual)).sum();
                let long = part.len() * 2 > rows || best.is_none();
                if long && best.as_ref().is_none_or(|(most, _)| fails > *most) {
                    best = Some((fails, part));
                }
                from += rows;
            }
        }
        let part = best.map_or(0..record.len(), |(_, part)| part);
        PreparedLog { segments: vec![part], hold_out: false, ..record.clone() }
    }
}

/// χ²/n beyond 1 below which nothing is left to compare.
const AS_NOISE: f64 = 0.1;

/// A model with the first channels' χ²/n leaves less than half of what one with the second leaves to explain, in the worst channel.
pub fn leaves_far_less(one: &[f64], other: &[f64]) -> bool {
    let left = |of: &[f64]| (misfit(of.iter().copied()) - 1.0).max(AS_NOISE);
    left(one) < 0.5 * left(other)
}

/// The largest of the channels' χ²/n.
pub fn misfit(chi2_per_n: impl Iterator<Item = f64>) -> f64 {
    chi2_per_n.max_or_zero()
}
