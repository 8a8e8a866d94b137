//! Pages for a browser.

use drive_model::Card;

use super::picture::drawings;
use super::{ROOMS, beside, family, of_room, range, unit};
use crate::report::digits;
use crate::report::page::{Page, escaped, with_code};

/// The catalogue, room by room.
pub fn list_html() -> String {
    let mut page = Page::new("The physical effects");
    page.push(&format!(
        "<p>{}</p>",
        with_code("What a model of the stand may hold or lack. `stand effects ID --html FILE` draws one; `stand model add MODEL ID` adds it to a model.")
    ));
    for room in ROOMS {
        page.push(&format!("<section><h2>{}</h2><table><tbody>", escaped(room.title())));
        for card in of_room(room) {
            page.push(&format!(
                "<tr><td class=\"number\"><code>{}</code></td><td>{}<br/><span class=\"equation\">{}</span></td><td class=\"mark\">over {}</td></tr>",
                card.id,
                escaped(card.description.summary),
                escaped(card.equation),
                card.coordinate.name()
            ));
        }
        page.push("</tbody></table></section>");
    }
    page.finish()
}

/// The account of one effect, with its picture.
pub fn effect_html(card: &'static Card) -> String {
    let mut page = Page::new(card.title);
    page.push(&format!("<p class=\"faint\"><code>{}</code> · {}</p>", card.id, escaped(card.domain.title())));
    page.push(&format!("<p class=\"equation\">{}</p>", escaped(card.equation)));
    page.paragraph("lead", card.description.summary);
    match beside(card) {
        Ok(beside) => {
            for (drawing, caption) in drawings(card, &beside) {
                page.figure(&drawing, &caption);
            }
        }
        Err(error) => page.paragraph("warn", &format!("No picture: {error}")),
    }
    page.push("<section><h2>Account</h2><dl>");
    let others = family(card);
    let others =
        if others.is_empty() { String::new() } else { format!("{}: some logs cannot tell these from {}.", others.join(", "), card.id) };
    let a = &card.description;
    let entries = [
        ("How it shows", a.signature),
        ("Best seen by", a.experiment),
        ("What looks like it", a.similar),
        ("Family", others.as_str()),
        ("Read on", a.reference),
    ];
    for (term, says) in entries.into_iter().filter(|(_, says)| !says.is_empty()) {
        page.push(&format!("<dt>{term}</dt><dd>{}</dd>", escaped(says)));
    }
    page.push("</dl></section><section><h2>Parameters</h2><div class=\"scroll\"><table><thead><tr><th>name</th><th>what</th><th>unit</th><th>physical range</th><th>start of a fit</th></tr></thead><tbody>");
    for p in card.parameters {
        page.push(&format!(
            "<tr><td><code>{}</code></td><td>{}</td><td>{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td></tr>",
            p.name,
            escaped(p.description),
            escaped(unit(p.unit)),
            range(p.range),
            digits(p.start)
        ));
    }
    page.push("</tbody></table></div></section>");
    page.push(&format!("<p>{}</p>", with_code(&format!("`stand model add MODEL {}` adds it to a model.", card.id))));
    page.finish()
}
