//! The search in prediction-error form as the parts of an explanation: stages, candidates, verdict.
//!
//! The stages are fitted again as free runs (output error), from the parameters of their prediction-error form: the reader sees how far the simulated
//! drive is from the measured one.

use super::candidate::{Candidate, Extension};
use super::free_form;
use super::free_run::{Stage, free_run};
use super::model::PredictedModel;
use super::recorded::without_outliers;
use super::search::{Found, MIN_BIC_IMPROVEMENT, Node, search};
use super::starts::search_frequencies;
use crate::identify::explain::Context;
use crate::identify::explain::adequacy::{self, Adequacy, adequacy};
use crate::identify::explain::answer::{self, Estimate, Shape, ShapeForm, Verdict};
use crate::identify::explain::candidate::channel_errors;
use crate::identify::explain::criteria::MisfitClass;
use crate::identify::explain::fitted_model::FittedModel;
use crate::identify::explain::reasons::{Progress, Refusal, Remark};
use crate::identify::explain::search_path::{Added, Search};
use crate::identify::explain::symbolic::{self, Proposal};
use crate::identify::explain::unknown_structure;
use crate::identify::fit::prepare::PreparationNote;
use crate::identify::fit::{self, FitError, Iterate, PreparedLog, build};
use crate::identify::predict::fit::Prediction;
use crate::model::{Model, SummingPoint};
use crate::statistics::Extremes;
use crate::statistics::distributions::ln_chi_squared_tail;

/// Free forms that are fitted.
const FITTED_FORMS: usize = 2;

/// The given model in both forms.
pub struct Given<'a> {
    /// In prediction-error form.
    pub predicted: PredictedModel<'a>,
    /// As a free run.
    pub free_run: FittedModel<'a>,
    /// How the log was recorded.
    pub notes: Vec<PreparationNote>,
}

/// Fits the given model; `None` where the log or the model has no prediction-error form (a known motion, a rotor without inertia).
///
/// # Errors
/// The model cannot be simulated along the logs.
pub fn given<'a>(context: Context<'a>, model: &Model, data: &PreparedLog<'a>) -> Result<Option<Given<'a>>, FitError> {
    let Some((predicted, notes)) = without_outliers(context, model, data, None) else { return Ok(None) };
    let free_run = free_run(context, &Stage { model: model.clone(), prediction: predicted.prediction.clone() }, &predicted.fitted.data)?;
    Ok(Some(Given { predicted, free_run, notes }))
}

/// Searches from the given model.
///
/// # Errors
/// A model with an added effect cannot be simulated.
pub fn explain<'a>(
    context: Context<'a>,
    given: Given<'a>,
    progress: &(dyn Fn(&Progress) + Sync),
) -> Result<(Search<'a>, Verdict, Vec<Shape>), FitError> {
    let Given { predicted, free_run: mut base, .. } = given;
    let deadline = base.data.deadline;
    let stage = Stage { model: base.model.clone(), prediction: predicted.prediction.clone() };
    let found = search(predicted, progress);
    if !found.best.notes.is_empty() {
        base = free_run(context, &stage, &found.best.model.fitted.data)?;
    }
    let mut models = vec![base];
    let later = found.best.before.iter().skip(1).cloned().chain((!found.best.added.is_empty()).then(|| found.best.stage()));
    for stage in later {
        models.push(free_run(context, &stage, &found.best.model.fitted.data)?);
    }
    let added = found.best.added.iter().map(|a| Added { name: a.name.clone(), rivals: Vec::new() }).collect();
    let candidates = candidates(&models[0], &found);
    let mut search = Search { models, added, candidates, remarks: found.remarks.clone(), tests: 0, doubt: None };
    search.remarks.extend(found.best.notes.iter().cloned().map(Remark::Preparation));
    if deadline.has_passed() {
        return Ok((search, Verdict::NotFinished, Vec::new()));
    }
    progress(&Progress::ExaminingRemainder);
    let (verdict, shapes) = verdict(&mut search, &found.best);
    Ok((search, if deadline.has_passed() { Verdict::NotFinished } else { verdict }, shapes))
}

/// The candidates of the first step for the answer: those that were fitted, those that were only screened, and those that the logs cannot show.
fn candidates(base: &FittedModel, found: &Found) -> Vec<answer::Candidate> {
    let name = |id: &str| base.model.next_name(id);
    let tests = found.screening.trials.len().max(1) as f64;
    let is_good = |c: &&Candidate| c.refused.is_none() && c.delta_bic < -MIN_BIC_IMPROVEMENT;
    let best = found.first.iter().find(is_good).map(|c| c.delta_bic);
    let as_good = |c: &Candidate| is_good(&c) && best.is_some_and(|best| c.delta_bic < best + MIN_BIC_IMPROVEMENT);
    let mut list: Vec<answer::Candidate> = Vec::new();
    for c in &found.first {
        let Extension::Effect(trial) = &c.extension else { continue };
        let effect = name(trial.card.id);
        if list.iter().any(|l| l.effect == effect) {
            continue;
        }
        let others = found.first.iter().filter(|o| as_good(c) && as_good(o)).filter_map(|o| match &o.extension {
            Extension::Effect(other) if other.card.id != trial.card.id => Some(name(other.card.id)),
            _ => None,
        });
        let mut ambiguous_with: Vec<String> = others.collect();
        ambiguous_with.dedup();
        let free = trial.fitted.iter().filter(|f| **f).count().max(1);
        let ln_p = (ln_chi_squared_tail(c.gain.max(0.0), free as f64) + tests.ln()).min(0.0);
        let sigma = |k: usize| c.sigmas.get(k).copied().unwrap_or(0.0);
        let parameters = trial.card.parameters.iter().zip(c.own.clone()).map(|(info, k)| {
            let p = &c.parameters().list[k];
            Estimate { name: p.name.clone(), unit: info.unit, value: p.value, sigma: sigma(k) }
        });
        list.push(answer::Candidate {
            parameters: parameters.collect(),
            refitted: true,
            outputs: if c.sigmas.is_empty() { Vec::new() } else { free_run_errors(base, c) },
            delta_bic: Some(c.delta_bic),
            p_value: ln_p.exp(),
            log10_p: ln_p / std::f64::consts::LN_10,
            ambiguous_with,
            refused: c.refused.clone(),
            not_visible: None,
            effect,
        });
    }
    if let Some(first) = found.best.added.first()
        && let Some(k) = list.iter().position(|c| c.effect == first.name)
    {
        let chosen = list.remove(k);
        list.insert(0, chosen);
    }
    for s in &found.screening.trials {
        let effect = name(s.trial.card.id);
        if list.iter().any(|l| l.effect == effect) {
            continue;
        }
        let ln_p = (ln_chi_squared_tail(s.score.chi2_decrease, s.score.free.max(1) as f64) + tests.ln()).min(0.0);
        let negative = s.score.negative.then_some(Refusal::NegativeAmplitude { parameter: None });
        list.push(answer::Candidate::screened(effect, s.trial.card, &s.score.values, ln_p, negative));
    }
    list.extend(found.screening.invisible.iter().map(|i| answer::Candidate::invisible(name(i.card.id), i.reason)));
    list
}

/// Errors of the channels in the free run of a candidate, after a few steps from its parameters.
fn free_run_errors(base: &FittedModel, candidate: &Candidate) -> Vec<answer::ChannelError> {
    let Extension::Effect(trial) = &candidate.extension else { return Vec::new() };
    let data = base.data_for(trial);
    let parameters = candidate.parameters();
    let states = base.initial_states_for(&candidate.system, parameters, &data);
    let begin = Iterate::new(&candidate.system, parameters, &data, &states);
    let problem = fit::Problem { system: &candidate.system, data: &data, weights: &base.weights };
    let end = fit::solve::minimize_within(problem, begin, FREE_RUN_STEPS, |chi2| MIN_CHI2_PART * chi2);
    channel_errors(base, &end.linearization.residuals)
}

/// Steps of a candidate's free run.
const FREE_RUN_STEPS: usize = 3;
/// Predicted decrease, part of χ², below which they end.
const MIN_CHI2_PART: f64 = 0.01;

/// The verdict, and the shape of what no effect explains.
///
/// `effect-found` and `adequate` need a final model that leaves noise: its free run leaves no more than the noise, or what is left is coloured noise of a
/// sensor, because no torque that acts on the drive makes the log more likely.
fn verdict(search: &mut Search, best: &Node) -> (Verdict, Vec<Shape>) {
    let (Some(first), Some(last)) = (search.models.first(), search.models.last()) else { return (Verdict::Adequate, Vec::new()) };
    let criteria = first.context.criteria;
    let found = !search.added.is_empty();
    let many = search.added.len() >= criteria.verdict.suspicious_effects;
    let adequate = if found { Verdict::EffectFound } else { Verdict::Adequate };
    let invisible = last.misfit() <= MisfitClass::Invisible;
    // Several effects, or an effect beside noise that is not white, may stand in for one structure.
    if (many || (found && !invisible))
        && let Some(given) = best.given()
        && let Some(shape) = best_shape(&given)
        && shape.delta_bic < best.delta_bic - MIN_BIC_IMPROVEMENT
    {
        search.remarks.push(Remark::UnknownStructureBetter { effects: search.names(0) });
        search.truncate(0);
        return (Verdict::UnknownStructure, vec![shape]);
    }
    if invisible {
        return (adequate, Vec::new());
    }
    if let Some(remark) = adequacy::input_between_samples(last) {
        search.remarks.push(remark);
        return (adequate, Vec::new());
    }
    let shape = best_shape(&best.model);
    if shape.is_none()
        && !best.model.has_random_torque()
        && let Adequacy::WhiteNoise | Adequacy::ColouredNoise(_) = adequacy(last)
    {
        search.remarks.extend(adequacy::coloured_noise(last));
        // Beside noise far above the white one, an effect may be one half of a cause and the noise the other.
        let certain = !found || last.misfit() <= MisfitClass::Small;
        return (if certain { adequate } else { Verdict::PartlyExplained }, Vec::new());
    }
    let chi2_per_n = last.chi2_per_n();
    let ((given, given_heldout), (_, left_heldout)) = (first.chi2_per_n_by_noise_of(last), last.chi2_per_n_by_noise_of(last));
    let heldout_remainder = criteria.remainder(given_heldout, left_heldout);
    let remainder = criteria.remainder(given, chi2_per_n).max(heldout_remainder);
    let shapes: Vec<Shape> = shape.into_iter().collect();
    // Many effects that leave much may stand in for one that no catalogue has.
    let doubtful = many && last.misfit() > criteria.verdict.max_misfit_of_many;
    if found && !doubtful && criteria.may_be_the_cause(remainder, chi2_per_n) {
        return (Verdict::PartlyExplained, shapes);
    }
    if found {
        let heldout = heldout_remainder >= criteria.verdict.max_remainder;
        search.remarks.push(Remark::TooMuchLeft { effects: search.names(0), remainder, heldout });
        search.truncate(0);
    }
    (Verdict::UnknownStructure, shapes)
}

/// The most likely free form or oscillation beside the final model, where it is clearly more likely than the model.
fn best_shape(base: &PredictedModel) -> Option<Shape> {
    let n = base.samples();
    let forms = free_form::score_all(base);
    let penalty = |knots: usize, tried: usize| knots as f64 * n.ln() + 2.0 * (tried.max(1) as f64).ln();
    let chi2 = base.fitted.fit.chi2;
    let promising = forms.iter().filter(|form| {
        let part = (form.chi2_decrease / chi2).clamp(0.0, 1.0 - 1e-9);
        n * (-part).ln_1p() + penalty(form.heights.len(), forms.len()) < -MIN_BIC_IMPROVEMENT
    });
    let fitted: Vec<Candidate> = promising
        .take(FITTED_FORMS)
        .filter_map(|form| Candidate::free_form(base, form, penalty(form.heights.len(), forms.len())))
        .map(|candidate| candidate.with_own_noise(base))
        .collect();
    let mut shapes: Vec<Shape> = fitted.iter().filter(|c| c.delta_bic < -MIN_BIC_IMPROVEMENT).filter_map(|c| drawn(base, c)).collect();
    shapes.extend(oscillations(base));
    shapes.into_iter().min_by(|a, b| a.delta_bic.total_cmp(&b.delta_bic))
}

/// A fitted free form as a shape, with an expression where one describes it; `None` where no knot differs from zero.
fn drawn(base: &PredictedModel, candidate: &Candidate) -> Option<Shape> {
    let Extension::FreeForm(law) = &candidate.extension else { return None };
    let criteria = base.fitted.context.criteria;
    let heights: Vec<f64> = candidate.own_parameters().iter().map(|p| p.value).collect();
    let confidence: Vec<f64> =
        candidate.sigmas.get(candidate.own.clone())?.iter().map(|s| unknown_structure::CONFIDENCE_SIGMAS * s).collect();
    let bins = unknown_structure::bins(criteria, law, &heights, &confidence);
    if !bins.iter().any(|b| b.mean.abs() > b.confidence) {
        return None;
    }
    let proposals = symbolic::proposals(&criteria.unknown, law, &heights, &confidence, criteria.unknown.max_expressions);
    let expressions = proposals.iter().filter_map(|proposal| with_expression(base, proposal));
    let expression = expressions.min_by(|a, b| a.delta_bic.total_cmp(&b.delta_bic));
    let delta_bic = expression.as_ref().map_or(candidate.delta_bic, |e| e.delta_bic.min(candidate.delta_bic));
    Some(Shape {
        acts_on: law.acts_on,
        coordinate: law.coordinate,
        form: ShapeForm::PiecewiseLinear { largest: bins.iter().map(|b| b.mean).max_abs() },
        bins,
        expression: expression.filter(|e| e.delta_bic < -MIN_BIC_IMPROVEMENT).map(|e| e.toml),
        delta_bic,
    })
}

/// A torque and a voltage that oscillate in time, each at its best frequency.
fn oscillations(base: &PredictedModel) -> Vec<Shape> {
    let frequencies = search_frequencies(base);
    // One frequency may be that of a torque or of a voltage.
    let tried = [
        (frequencies.torque_Hz, SummingPoint::Torque, ""),
        (frequencies.voltage_Hz, SummingPoint::Voltage, "u * "),
        (frequencies.torque_Hz.filter(|_| frequencies.voltage_Hz.is_some()), SummingPoint::Voltage, "u * "),
    ];
    let oscillation = |(hz, acts_on, factor): (Option<f64>, SummingPoint, &str)| {
        let text = format!("{factor}(a * sin(2 * pi * f * t) + b * cos(2 * pi * f * t))");
        let found = with_expression(base, &Proposal { acts_on, text, starts: vec![("a", 0.0), ("b", 0.0), ("f", hz?)] })?;
        let [a, b, f] = found.values[..] else { return None };
        let is_likely = found.delta_bic < -MIN_BIC_IMPROVEMENT;
        is_likely.then(|| unknown_structure::oscillation(acts_on, (a, b, f), found.toml, found.delta_bic))
    };
    tried.into_iter().filter_map(oscillation).collect()
}

/// A fitted expression.
struct Expression {
    toml: String,
    values: Vec<f64>,
    delta_bic: f64,
}

/// A model with an expression in it, fitted in prediction-error form.
fn with_expression(base: &PredictedModel, proposal: &Proposal) -> Option<Expression> {
    let fitted = &base.fitted;
    let Proposal { acts_on, text, starts } = proposal;
    let mut model = fitted.model.clone();
    model.add_user_effect(unknown_structure::NAME, *acts_on, text, starts).ok()?;
    let (system, mut parameters) = build::system(&model, fitted.data.temp_C.is_some());
    for p in &mut parameters.list {
        if let Some(known) = fitted.fit.parameters.list.iter().find(|q| q.name == p.name) {
            p.value = known.value;
        }
    }
    let prediction = Prediction::new(&system, &fitted.data);
    let states = fitted.initial_states_for(&system, &parameters, &fitted.data);
    let begin = prediction.at(&parameters, Some(states), base.prediction.noise.clone())?;
    let end = prediction.fit(prediction.descend(begin, EXPRESSION_STEPS)?)?;
    let mut values = Vec::new();
    for (name, _) in starts {
        values.push(end.parameters.list.iter().find(|p| p.name == format!("{}.{name}", unknown_structure::NAME))?.value);
    }
    let n = base.samples();
    let free = starts.len() as f64;
    let delta_bic = end.minus_2_ln_likelihood - base.prediction.minus_2_ln_likelihood + free * n.ln() + 2.0 * n.ln();
    let named: Vec<(&str, f64)> = starts.iter().zip(&values).map(|((name, _), v)| (*name, *v)).collect();
    let toml = unknown_structure::expression_table(*acts_on, text, &named);
    Some(Expression { toml, values, delta_bic })
}

/// Steps of an expression at the random torque of the model.
const EXPRESSION_STEPS: usize = 12;
