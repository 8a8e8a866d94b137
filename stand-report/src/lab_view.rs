//! A laboratory work for the page of the panel: the instructions as HTML (texts of the program; on a real stand, with names out of
//! `work.toml`), questions, quantities and classes, as JSON.
//!
//! Texts are in the language of the work. The HTML has no markup of the text itself: what CommonMark calls raw HTML is escaped.

use pulldown_cmark::{Event, HeadingLevel, Options, Parser, Tag, TagEnd, html::push_html};
use serde_json::{Value, json};

use stand_lab::answers::classes;
use stand_lab::course::Lab;
use stand_lab::work::Work;

/// CommonMark with tables as HTML, without links and pictures. Headings are one level lower, because the page has the first.
fn html_of(text: &str) -> String {
    let lower = |level| match level {
        HeadingLevel::H1 => HeadingLevel::H2,
        _ => HeadingLevel::H3,
    };
    let leads_away =
        |event: &Event| matches!(event, Event::Start(Tag::Link { .. } | Tag::Image { .. }) | Event::End(TagEnd::Link | TagEnd::Image));
    let events = Parser::new_ext(text, Options::ENABLE_TABLES).filter(|event| !leads_away(event)).map(|event| match event {
        Event::Start(Tag::Heading { level, id, classes, attrs }) => Event::Start(Tag::Heading { level: lower(level), id, classes, attrs }),
        Event::End(TagEnd::Heading(level)) => Event::End(TagEnd::Heading(lower(level))),
        Event::Html(text) | Event::InlineHtml(text) => Event::Text(text),
        other => other,
    });
    let mut html = String::new();
    push_html(&mut html, events);
    html
}

/// A work without its answers.
pub fn work_json(work: &Work, lab: &Lab) -> Value {
    let language = work.language;
    let questions: Vec<Value> =
        lab.questions.iter().map(|q| json!({"id": q.id, "when": q.when, "text": q.text.in_language(language)})).collect();
    let quantities: Vec<Value> =
        lab.quantities().iter().map(|q| json!({"name": q.name, "unit": q.unit, "text": q.text.in_language(language)})).collect();
    let hunt = lab.hunt().map(|task| {
        let classes = classes(&lab.effects_in_model()).into_iter().map(|(class, effects)| json!({"class": class, "effects": effects}));
        json!({"logs": task.logs, "classes": classes.collect::<Vec<_>>()})
    });
    json!({
        "lab": work.lab, "student": work.student, "attempt": work.attempt, "sealed": work.sealed, "language": language,
        "instructions": html_of(&work.instructions(lab)), "questions": questions, "quantities": quantities, "hunt": hunt,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use stand_lab::course::{Language, works};

    #[test]
    fn markup_in_a_text_is_escaped() {
        let html = html_of("# A <b>\n\n<script>alert(1)</script>\n\nx <img src=x onerror=y> `<i>` [l](javascript:y) ![p](http://z)\n");
        assert!(!html.contains("href") && !html.contains("src=\"") && html.contains("l p"), "{html}");
        assert!(!html.contains("<script") && !html.contains("<img") && !html.contains("<b>") && !html.contains("<i>"), "{html}");
        assert!(html.contains("<h2>") && html.contains("&lt;script&gt;") && html.contains("<code>&lt;i&gt;</code>"), "{html}");
    }

    /// The page's policy refuses `style` attributes, which aligned columns would have.
    #[test]
    fn instructions_have_no_attributes_that_the_policy_of_the_page_refuses() {
        for lab in works().expect("works") {
            for language in [Language::En, Language::Uk] {
                let html = html_of(lab.instructions(language));
                assert!(html.contains("<h2>") && html.contains("<h3>") && html.contains("<pre><code>"), "{}", lab.id);
                assert!(!html.contains(" style=") && !html.contains(" href=") && !html.contains(" src="), "{}", lab.id);
            }
        }
    }
}
