//! The verdict: the given model is adequate, effects were missing, the structure of the error is unknown, or the time did not suffice.

use super::unknown_structure;
use crate::identify::explain::answer::OpenPart;
use crate::identify::explain::answer::reasons::Remark;
use crate::identify::explain::answer::{Shape, Verdict};
use crate::identify::explain::criteria::MisfitClass;
use crate::identify::explain::fitted::adequacy::{Adequacy, adequacy, input_between_samples, rounded_input, sample_age};
use crate::identify::explain::search::path::{Search, bic_difference};

/// The verdict, and the shape of what no effect explains. A budget that ends the search or the search for unknown structures leaves no
/// verdict: what was cut short may have missed something. Then the part that is open.
pub fn verdict(search: &mut Search) -> Result<(Verdict, Vec<Shape>), OpenPart> {
    let budget = search.models.given().data.budget.clone();
    if search.termination.is_by_budget() {
        return Err(OpenPart::AddingStep { number: search.added.len() + 1 });
    }
    if budget.checkpoint() {
        return Err(OpenPart::Conventions);
    }
    let found = finished_verdict(search);
    if budget.checkpoint() { Err(OpenPart::Remainder) } else { Ok(found) }
}

/// The verdict of a complete search. `effect-found` needs an adequate final model: only noise is left, of whatever colour. Where one
/// unknown structure fits better than all added effects together, or where these leave too much, the added effects are removed from the
/// search.
fn finished_verdict(search: &mut Search) -> (Verdict, Vec<Shape>) {
    let (first, last) = (search.models.given(), search.models.last());
    let criteria = first.context.criteria;
    let chi2_per_n = last.chi2_per_n();
    let invisible = last.misfit() <= MisfitClass::Invisible;
    let found = !search.added.is_empty();
    let many = search.added.len() >= criteria.verdict.suspicious_effects;
    let adequate = if found { Verdict::EffectFound } else { Verdict::Adequate };
    if invisible && !many {
        return (adequate, Vec::new());
    }
    if found
        && let Some(unknown) = unknown_structure::best(first)
        && unknown.shape.delta_bic < bic_difference(first, last) - criteria.evidence.min_bic_difference
        && criteria.replaces(unknown.chi2_per_n, chi2_per_n)
    {
        search.remarks.push(Remark::UnknownStructureBetter { effects: search.names(0) });
        search.truncate(0);
        return (Verdict::UnknownStructure, vec![unknown.shape]);
    }
    if invisible {
        return (adequate, Vec::new());
    }
    if let Some(remark) = input_between_samples(last).or_else(|| rounded_input(last)).or_else(|| sample_age(last)) {
        search.remarks.push(remark);
        return (adequate, Vec::new());
    }
    let shapes: Vec<Shape> = unknown_structure::best(last).map(|u| u.shape).into_iter().collect();
    if shapes.is_empty() {
        if !found && last.misfit() <= MisfitClass::NoiseUncertainty {
            return (Verdict::Adequate, shapes);
        }
        // Several effects beside coloured noise may be parts of one that no catalogue has: that the rest depends on nothing is weak
        // evidence then.
        if !(found && many)
            && let Adequacy::ColouredNoise(remarks) = adequacy(last)
        {
            search.remarks.extend(remarks);
            return (adequate, shapes);
        }
    }
    let ((given, given_heldout), (_, left_heldout)) = (first.chi2_per_n_by_noise_of(last), last.chi2_per_n_by_noise_of(last));
    let heldout_remainder = criteria.remainder(given_heldout, left_heldout);
    let remainder = criteria.remainder(given, chi2_per_n).max(heldout_remainder);
    // Many effects that leave much may stand in for one that no catalogue has.
    let doubtful = many && last.misfit() > criteria.verdict.max_misfit_of_many;
    if found && !doubtful && criteria.may_be_the_cause(remainder, chi2_per_n) {
        return (Verdict::PartlyExplained, shapes);
    }
    if found && (many || remainder >= criteria.verdict.max_remainder) {
        let heldout = heldout_remainder >= criteria.verdict.max_remainder;
        search.remarks.push(Remark::TooMuchLeft { effects: search.names(0), remainder, heldout });
        search.truncate(0);
    }
    (Verdict::UnknownStructure, shapes)
}
