//! Detection limits: the smallest effect that the logs would have shown beside a model that leaves only noise.
//!
//! An effect of amplitude a, added to the motion that was logged, is expected to gain (a/σ)² on the whitened residuals, where 1/σ² is the
//! information of the fitted rows about a that the model's own parameters and initial states cannot imitate. It is added if its gain
//! exceeds what the search asks for. The square root of the gain of one amplitude is a normal variable of mean a/σ and variance s², so that
//! a = σ (√gain + z s) exceeds it with the probability of z (power of a likelihood ratio test: Kay, Fundamentals of Statistical Signal
//! Processing II, 1998, chapter 6). For white noise s = 1. The autoregression that whitens the residual does not describe noise that is
//! slow beside its order: s² is the largest factor by which such noise exceeds white noise in a channel. An effect is only tried if the
//! score on the residuals themselves is significant ([`crate::identify::explain::candidates::screen`]): the limit is at least the amplitude
//! whose score is. Where the course of the voltage within the rows is open, the search judges the gain with that course as a second error
//! ([`crate::identify::explain::candidates::open_course`]): σ² is then larger by the ratio of the variance by noise and course to that by
//! the noise.

use std::borrow::Cow;

use drive_model::{HarmonicSource, ParameterKind};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rayon::prelude::*;

use crate::identify::explain::answer::{DetectionLimit, Verdict};
use crate::identify::explain::candidates::harmonics::periods::Periods;
use crate::identify::explain::candidates::harmonics::{HarmonicOrders, visible_orders};
use crate::identify::explain::candidates::score::batches;
use crate::identify::explain::candidates::screen::critical_gain;
use crate::identify::explain::candidates::trials::{self, Starts};
use crate::identify::explain::criteria::DetectionCriteria;
use crate::identify::explain::fitted::FittedModel;
use crate::identify::explain::fitted::likelihood::{View, Whitener};
use crate::identify::explain::fitted::trial::Trial;
use crate::identify::explain::verdict::outcome::Outcome;
use crate::identify::fit::simulate::run;
use crate::identify::fit::{build, differencing_rows};
use crate::identify::predict::{covariance_of, drawn_courses, with_course};
use crate::recording::PreparedLog;
use crate::recording::voltage::Known;
use crate::statistics::Extremes;

/// The limits after a search that found nothing; none where something is missing, or nothing was tested.
pub fn limits_after(outcome: &Outcome) -> Vec<DetectionLimit> {
    let search = &outcome.search;
    if outcome.verdict == Verdict::Adequate && search.tests > 0 { detection_limits(search.models.last(), search.tests) } else { Vec::new() }
}

/// The limits of the effects that are absent at zero, in the order of the catalogue. `tests` is the number of tests of the search. Effects
/// whose zero is singular (a shaft, a presliding stiffness) have no limit of this kind.
fn detection_limits(model: &FittedModel, tests: usize) -> Vec<DetectionLimit> {
    let criteria = &model.context.criteria.detection;
    let trials: Vec<Trial> = trials::list(model, &values_to_try(model, criteria)).0.into_iter().filter(has_one_amplitude).collect();
    let whitener = model.whitener();
    // Differenced readings have no slow noise.
    let direct = model.fit.channels.iter().enumerate().filter(|(k, _)| differencing_rows(&model.data, *k) == 0);
    let slow = direct.map(|(_, c)| c.slow_variance()).max_or_zero().max(1.0).sqrt();
    let effective_samples = model.whitened_sums(&whitener).effective_samples();
    let batches = batches(model, &trials);
    let groups = [false, true].into_iter().filter_map(|derived| trials.iter().find(|t| model.rate_from_encoder(t) == derived));
    let readings: Vec<Readings> = groups.map(|trial| Readings::of(model, trial)).collect();
    let found: Vec<(usize, f64)> = batches
        .par_iter()
        .flat_map_iter(|batch| {
            let of_batch = readings.iter().find(|r| r.data.rate_from_encoder == model.rate_from_encoder(&trials[batch[0]]));
            of_batch.map_or_else(Vec::new, |readings| standard_errors(model, &whitener, &trials, (batch, readings)))
        })
        .map(|(k, sigma)| {
            let free = trials[k].screened.iter().filter(|s| **s).count();
            let with_power = |gain: f64| gain.sqrt() + criteria.power_sigmas * slow;
            let added = sigma.whitened * with_power(min_gain(model, tests, free, effective_samples));
            let screened = sigma.plain * with_power(critical_gain(tests, 1, model.context.criteria.evidence.max_familywise_p));
            (k, added.max(screened))
        })
        .collect();
    let mut limits: Vec<DetectionLimit> = Vec::new();
    let mut ordered = found;
    ordered.sort_by_key(|(k, _)| *k);
    for (k, size) in ordered {
        let trial = &trials[k];
        let Some(parameter) = amplitude(trial) else { continue };
        let at = nonlinear(trial).map(|index| (index, trial.values[index]));
        match limits.iter_mut().find(|l| l.card.id == trial.card.id && l.parameter == parameter) {
            Some(known) if known.size >= size => {}
            Some(known) => (known.size, known.at) = (size, at),
            None => limits.push(DetectionLimit { card: trial.card, parameter, size, at }),
        }
    }
    // Above the largest value that a drive can have, nothing can be excluded.
    limits.retain(|l| l.size < l.card.parameters[l.parameter].range.1.min(LARGEST));
    limits
}

/// Gain that an effect with `free` parameters needs to be added to the model.
fn min_gain(model: &FittedModel, tests: usize, free: usize, effective_samples: f64) -> f64 {
    let evidence = &model.context.criteria.evidence;
    let by_bic = free as f64 * effective_samples.max(1.0).ln() + evidence.min_bic_difference;
    let by_chance = critical_gain(tests, free, evidence.max_familywise_p);
    by_bic.max(by_chance).max(model.min_gain())
}

/// One amplitude is screened, or the amplitude and the phase of a periodic effect, and the effect is absent at the trial's values.
fn has_one_amplitude(trial: &Trial) -> bool {
    let screened = trial.screened.iter().filter(|s| **s).count();
    trial.absent && screened == if trial.card.polar { 2 } else { 1 } && amplitude(trial).is_some()
}

/// Position of the amplitude that is screened.
fn amplitude(trial: &Trial) -> Option<usize> {
    let kinds = trial.card.parameters.iter().map(|p| p.kind).zip(&trial.screened);
    kinds.enumerate().find(|(_, (kind, screened))| **screened && *kind != ParameterKind::Phase).map(|(k, _)| k)
}

/// Position of the parameter at whose different values the effect is tried.
fn nonlinear(trial: &Trial) -> Option<usize> {
    let tried = |kind: ParameterKind| matches!(kind, ParameterKind::HarmonicOrder | ParameterKind::Periodicity | ParameterKind::EventTime);
    trial.card.parameters.iter().position(|p| tried(p.kind))
}

/// Orders, periods and times at which the limits are computed, spread over what the logs can show.
fn values_to_try(model: &FittedModel, criteria: &DetectionCriteria) -> Starts {
    let spread = |highest: u32| -> Vec<u32> {
        let mut list = Vec::new();
        let mut order = 1.0;
        while order <= f64::from(highest) {
            list.push(order as u32);
            order = (order * criteria.order_ratio).max(order + 1.0);
        }
        list
    };
    let highest = visible_orders(model);
    let orders = |source: HarmonicSource| highest.of(source).first().map_or_else(Vec::new, |n| spread((*n).min(criteria.max_order)));
    let mut torque = orders(HarmonicSource::Torque);
    torque.retain(|order| *order > 1); // A torque of order one is an unbalance.
    let per_turn: Vec<f64> = torque.iter().map(|order| f64::from(*order) + 0.5).collect();
    let orders = HarmonicOrders::new(
        torque,
        orders(HarmonicSource::MotorConstant),
        orders(HarmonicSource::Encoder),
        orders(HarmonicSource::Inertia),
    );
    let (from, to) = model.data.time_range_s();
    let harmonics = &model.context.criteria.harmonics;
    let lowest_Hz = harmonics.min_periods_in_log / (to - from).max(model.data.dt_s);
    let highest_Hz = harmonics.max_frequency_Hz.min(harmonics.max_frequency_per_row / model.data.dt_s);
    let mut frequencies_Hz = Vec::new();
    let mut frequency = lowest_Hz;
    while frequency < highest_Hz {
        frequencies_Hz.push(frequency);
        frequency *= criteria.frequency_ratio;
    }
    let jumps_s = criteria.jump_fractions.iter().map(|f| from + f * (to - from)).collect();
    Starts { orders, periods: Periods::new(per_turn, frequencies_Hz, 0), jumps_s }
}

/// What the logs can contain beside the model and the noise.
struct Readings<'m, 'l> {
    data: Cow<'m, PreparedLog<'l>>,
    /// Changes of the readings by other courses of the voltage within the rows, each by channel and row; none where the course is known.
    by_courses: Vec<Vec<Vec<f64>>>,
}

impl<'m, 'l> Readings<'m, 'l> {
    fn of(model: &'m FittedModel<'l>, trial: &Trial) -> Self {
        let data = model.data_for(trial);
        // The stand's own first moments of each row determine the course.
        let is_open = |open: &Cow<PreparedLog>| open.voltage_course.as_ref().is_some_and(|course| course.known == Known::Means);
        let open = with_course(model.context.log, &data).filter(is_open).map(Cow::into_owned);
        let Some((open, drawn)) = open.and_then(|open| drawn_courses(&open).map(|drawn| (open, drawn))) else {
            return Readings { data, by_courses: Vec::new() };
        };
        let expected = modelled(model, &open);
        let change = |drawn: &PreparedLog| -> Vec<Vec<f64>> {
            let differences = |(drawn, expected): (&Vec<f64>, &Vec<f64>)| drawn.iter().zip(expected).map(|(d, e)| d - e).collect();
            modelled(model, drawn).iter().zip(&expected).map(differences).collect()
        };
        let by_courses = drawn.par_iter().map(change).collect();
        Readings { data: Cow::Owned(open), by_courses }
    }
}

/// Values of the model by channel and row; NaN where there is none.
fn modelled(model: &FittedModel, data: &PreparedLog) -> Vec<Vec<f64>> {
    let parameters = &model.fit.parameters;
    let states = model.initial_states_for(&model.system, parameters, data);
    let rig = model.system.rig::<f64>(parameters, data.driven);
    let mut values = vec![vec![f64::NAN; data.len()]; data.channels.len()];
    for (segment, of_segment) in states.values.iter().enumerate() {
        run(&rig, data, segment, (&states.kinds, of_segment), 0, &mut |channel, row, value: &f64| {
            values[channel][row] = *value;
            true
        });
    }
    values
}

/// Standard errors of an amplitude, alone beside the model; of a periodic effect at its least favourable phase.
#[derive(Debug, Clone, Copy)]
struct Sigma {
    /// On the whitened residuals, with the open course of the voltage as a second error: decides whether the effect is added.
    whitened: f64,
    /// On the residuals themselves: decides whether the effect is tried.
    plain: f64,
}

/// Standard errors of each trial of a batch.
fn standard_errors(
    model: &FittedModel,
    whitener: &Whitener,
    trials: &[Trial],
    (batch, readings): (&[usize], &Readings),
) -> Vec<(usize, Sigma)> {
    let data = &readings.data;
    let (mut system, mut parameters) = (model.system.clone(), model.fit.parameters.clone());
    let own = model.free_parameters();
    let appended: Vec<_> = batch
        .iter()
        .map(|&k| build::append(&mut system, &mut parameters, trials[k].card, &trials[k].values, &trials[k].screened))
        .collect();
    let states = model.initial_states_for(&system, &parameters, data);
    let free = parameters.free();
    // The search screens, and judges the course, by the fit to the residuals themselves.
    let unfiltered = Whitener::plain(data.channels.len());
    let views = [View { whitener, changes: &[] }, View { whitener: &unfiltered, changes: &readings.by_courses }];
    let both = Whitener::information(&system, &parameters, &states, data, model.context.log_rows, &views);
    let of_view = |(all, gradients): (DMatrix<f64>, Vec<DVector<f64>>)| {
        let of_model: Vec<usize> = (0..own).chain(free.len()..all.nrows()).collect();
        Information::new(all, gradients, of_model)
    };
    let mut both = both.into_iter().map(of_view);
    let (Some(Some(whitened)), Some(Some(plain))) = (both.next(), both.next()) else { return Vec::new() };
    let min_identifiable = model.context.criteria.screening.min_identifiable_fraction;
    let sigma = |range: &std::ops::Range<usize>| -> Option<Sigma> {
        let lanes: Vec<usize> = (0..free.len()).filter(|&lane| range.contains(&free[lane])).collect();
        let of = |information: &Information| Some(information.covariance(&lanes, min_identifiable)?.symmetric_eigenvalues().max().sqrt());
        Some(Sigma { whitened: of(&whitened)? * plain.increase_by_changes(&lanes, min_identifiable)?, plain: of(&plain)? })
    };
    let is_finite = |sigma: &Sigma| sigma.whitened.is_finite() && sigma.plain.is_finite();
    batch.iter().zip(&appended).filter_map(|(&k, range)| Some((k, sigma(range).filter(is_finite)?))).collect()
}

/// Information of the rows about the unknowns, and the gradients by changes of the readings.
struct Information {
    all: DMatrix<f64>,
    gradients: Vec<DVector<f64>>,
    /// Unknowns of the model itself.
    of_model: Vec<usize>,
    /// Factor of their information.
    factor: Cholesky<f64, Dyn>,
}

impl Information {
    fn new(all: DMatrix<f64>, gradients: Vec<DVector<f64>>, of_model: Vec<usize>) -> Option<Self> {
        let mut block = all.select_rows(&of_model).select_columns(&of_model);
        for k in 0..of_model.len() {
            let d = block[(k, k)];
            block[(k, k)] = if d > 0.0 { d * (1.0 + RIDGE) } else { 1.0 };
        }
        Some(Information { factor: Cholesky::new(block)?, all, gradients, of_model })
    }

    /// Covariance of these unknowns, together beside the model; `None` where it imitates one of them but for a fraction `min_identifiable`
    /// of its sensitivity.
    fn covariance(&self, lanes: &[usize], min_identifiable: f64) -> Option<DMatrix<f64>> {
        let whole = self.all.select_rows(lanes).select_columns(lanes);
        let cross = self.all.select_rows(&self.of_model).select_columns(lanes);
        let left = &whole - cross.transpose() * self.factor.solve(&cross);
        let is_identifiable = |k: usize| left[(k, k)] > min_identifiable * whole[(k, k)];
        if (0..lanes.len()).all(is_identifiable) { left.try_inverse() } else { None }
    }

    /// Factor by which the changes, as a second error, increase the standard error of these unknowns, in the direction where they do so
    /// most.
    fn increase_by_changes(&self, lanes: &[usize], min_identifiable: f64) -> Option<f64> {
        if self.gradients.is_empty() {
            return Some(1.0);
        }
        let by_noise = self.covariance(lanes, min_identifiable)?;
        let cross = self.all.select_rows(&self.of_model).select_columns(lanes);
        let estimate = |gradient: &DVector<f64>| {
            let of_model = self.factor.solve(&gradient.select_rows(&self.of_model));
            &by_noise * (gradient.select_rows(lanes) - cross.transpose() * of_model)
        };
        let by_changes = covariance_of(&self.gradients.iter().map(estimate).collect::<Vec<_>>());
        let inverse = Cholesky::new(by_noise)?.l().try_inverse()?;
        let relative = &inverse * by_changes * inverse.transpose();
        Some((1.0 + relative.symmetric_eigenvalues().max()).sqrt())
    }
}

/// Amplitude that no drive has, in the SI unit of its parameter. A log that is never slow has an amplitude for the friction of slow motion
/// as well, of 1e100 N m.
const LARGEST: f64 = 1e9;

/// Relative increase of the diagonal of the information matrix, so that its factorisation exists.
const RIDGE: f64 = 1e-12;
