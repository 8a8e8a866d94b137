//! The catalogue as Markdown: docs/effects.md.

use drive_model::Card;

use super::{DOMAINS, family, of_domain, range, unit};
use crate::digits;

/// Text above the catalogue.
const INTRODUCTION: &str = "\
# Physical effects

This page is generated from the cards in `drive-model/src/effects/` (`STAND_DOCS=write cargo test -p stand-tests --test project docs_are_true` writes it; the
test fails if the page and the cards differ). `stand effects ID` prints one effect, `stand effects ID --html FILE` plots it.

The model without effects is a rigid rotor J ω' = K i with a quasi-static armature i = (u − K ω)/R. Positive torque, voltage and current turn towards
positive θ; torques act on the rotor. T is the winding temperature, T0 = 25 °C. Amplitudes are ≥ 0, phases lie in [0, 2π), harmonic orders are whole
numbers, unless the card says otherwise; t is the time of the log (t_s), or the time since its first row where the card says so. A fit that ends outside a parameter's range is refused as an explanation. An effect may be given by the user as an expression instead
([logs-and-models.md](logs-and-models.md#effects-of-your-own)).

*Requires* names effects of which the model must contain one before `explain` tries the effect. *Family* names effects that some logs cannot
distinguish from this one.
";

/// The catalogue as a Markdown page.
pub fn catalogue_markdown() -> String {
    let mut page = INTRODUCTION.to_owned();
    for domain in DOMAINS {
        page += &format!("\n## {}\n", domain.title());
        for card in of_domain(domain) {
            page += &section(card);
        }
    }
    page
}

fn section(card: &Card) -> String {
    let mut text = format!("\n### {}: `{}`\n\n{}\n\n    {}\n\n", card.title, card.id, card.description.summary, card.equation);
    text += "| parameter | unit | meaning | range | start |\n|---|---|---|---|---|\n";
    for p in card.parameters {
        text += &format!(
            "| `{}` | {} | {} | {} | {} |\n",
            p.name,
            unit(p.unit),
            p.description.replace('|', "\\|"),
            range(p.range),
            digits(p.start)
        );
    }
    text += &format!("\n- Signature: {}\n", card.description.signature);
    text += &format!("- Coordinate: {}\n", card.coordinate.name());
    text += &format!("- Experiment: {}\n", card.description.experiment);
    text += &format!("- Similar: {}\n", card.description.similar);
    let mut separations: Vec<(&str, Vec<&str>)> = Vec::new();
    for rival in card.rivals {
        match separations.iter_mut().find(|(separation, _)| *separation == rival.separation) {
            Some((_, effects)) => effects.push(rival.effect),
            None => separations.push((rival.separation, vec![rival.effect])),
        }
    }
    for (separation, effects) in separations {
        text += &format!("- Separation from `{}`: {separation}.\n", effects.join("`, `"));
    }
    for (term, ids) in [("Requires", card.rests_on.to_vec()), ("Family", family(card))] {
        if !ids.is_empty() {
            text += &format!("- {term}: `{}`\n", ids.join("`, `"));
        }
    }
    if card.repeatable {
        text += "- A model may contain this effect several times.\n";
    }
    text += &format!("- Reference: {}\n", card.description.reference);
    text
}
