//! Spelling suggestions: the known name nearest to an unknown one.

/// The known name with the least edit distance from `word`; `None` if no name is near enough.
pub fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<String> {
    let lower = word.to_lowercase();
    let distance = |name: &str| strsim::osa_distance(&lower, &name.to_lowercase());
    let best = known.into_iter().map(|name| (distance(name), name)).min_by_key(|(d, _)| *d)?;
    // Greatest distance: 0 for one letter, 1 for two or three, 2 for four to eight, from nine letters on a third of them.
    let letters = word.chars().count();
    let max_distance = (letters / 3).max(usize::from(letters > 1)).max(if letters > 3 { 2 } else { 0 });
    (best.0 <= max_distance).then(|| best.1.to_owned())
}
