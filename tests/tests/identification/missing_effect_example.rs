//! The program of examples/missing-effect prints what its page shows.
#![allow(clippy::unwrap_used)]

#[path = "../../../examples/missing-effect/main.rs"]
mod example;

#[test]
fn example_finds_the_effect_and_prints_what_its_page_shows() {
    let mut printed = Vec::new();
    example::session(&mut printed).unwrap();
    let page = include_str!("../../../examples/missing-effect/README.md");
    let shown = page.split("```\n").find(|block| block.starts_with("without the effect")).expect("the page shows the output");
    assert_eq!(String::from_utf8(printed).unwrap(), shown);
}
