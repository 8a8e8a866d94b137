//! The search from the given model, with its verdict.

use super::judgement::verdict;
use crate::identify::explain::answer::reasons::{Progress, Remark};
use crate::identify::explain::answer::{Shape, Unfinished, Verdict};
use crate::identify::explain::fitted::given::Given;
use crate::identify::explain::search::path::Search;
use crate::identify::explain::search::recorded::search_as_recorded;
use crate::identify::explain::search::unfinished::SearchState;
use crate::identify::fit::FitError;
use crate::identify::fit::held_out::{Departure, departure};
use crate::identify::predict::refined;
use crate::recording::prepare::PreparationNote;

/// What a search found.
pub struct Outcome<'a> {
    /// The models from the given one to the last.
    pub search: Search<'a>,
    /// The verdict.
    pub verdict: Verdict,
    /// The shape of what no effect explains.
    pub unexplained: Vec<Shape>,
    /// What the budget left open.
    pub unfinished: Option<Unfinished>,
    /// How the log was recorded, as far as its notes do not state it.
    pub recorded: Vec<PreparationNote>,
}

impl<'a> Outcome<'a> {
    /// Searches from the given model, and from the stages of a `state` where there is one.
    ///
    /// # Errors
    /// A model with an added effect cannot be simulated.
    pub fn of(given: Given<'a>, state: Option<&SearchState>, progress: &(dyn Fn(&Progress) + Sync)) -> Result<Self, FitError> {
        let Given { model, base, recording, data, .. } = given;
        let hold_out = data.held_out.is_some();
        let (mut search, recording) = search_as_recorded(model, base, recording, data, state, progress)?;
        progress(&Progress::ExaminingRemainder);
        let (verdict, unexplained, unfinished) = match verdict(&mut search) {
            Ok((verdict, unexplained)) => (verdict, unexplained, None),
            Err(open) => {
                let state = search.state(model, &recording.conventions, hold_out).to_toml();
                (Verdict::NotFinished, Vec::new(), Some(Unfinished { open, state }))
            }
        };
        Ok(Outcome { search, verdict, unexplained, unfinished, recorded: recording.notes })
    }

    /// Nothing more than noise is left.
    fn leaves_noise(&self) -> bool {
        matches!(self.verdict, Verdict::Adequate | Verdict::EffectFound)
    }

    /// Something is left that no effect explains.
    pub fn leaves_more(&self) -> bool {
        matches!(self.verdict, Verdict::PartlyExplained | Verdict::UnknownStructure)
    }

    /// Held-out rows that the final model does not describe, although nothing is said to be missing.
    pub fn departure(&self) -> Option<Departure> {
        let last = self.search.models.last();
        self.leaves_noise().then(|| departure(&last.data, &last.fit.channels)).flatten()
    }

    /// Gives the last model the parameters of largest likelihood of the prediction errors, where nothing is left, and remarks on what it
    /// rests on.
    pub fn conclude(&mut self) {
        let mut remarks = Vec::new();
        // Between the minima of the free runs, before the last one is replaced.
        if self.verdict == Verdict::EffectFound {
            remarks.extend(self.search.small_parts());
        }
        if self.leaves_noise() {
            let last = self.search.models.last_mut();
            let (found, by_prediction_errors) = refined(&last.system, last.context.log, &last.data, last.fit.clone());
            last.replace_fit(found);
            remarks.extend(by_prediction_errors.then_some(Remark::ByPredictionErrors));
            remarks.extend(last.fit.rests_on_course.then_some(Remark::RestsOnCourse));
        }
        let (given, last) = (self.search.models.given(), self.search.models.last());
        if self.verdict != Verdict::UnknownStructure {
            remarks.extend(last.temperature_scale());
        }
        if self.leaves_more() {
            remarks.extend(given.may_coast(last));
        }
        if self.verdict == Verdict::UnknownStructure {
            remarks.extend(last.not_free());
        }
        self.search.remarks.append(&mut remarks);
    }
}
