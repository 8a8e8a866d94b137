//! Spelling suggestions: the known name nearest to an unknown one.

/// The known name nearest to `word` by edit distance; `None` if none is near.
pub fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<String> {
    let lower = word.to_lowercase();
    let distance = |name: &str| strsim::osa_distance(&lower, &name.to_lowercase());
    let best = known.into_iter().map(|name| (distance(name), name)).min_by_key(|(d, _)| *d)?;
    // At most a third of the letters may differ, two in names of four letters or more, none in a single letter.
    let letters = word.chars().count();
    let most = (letters / 3).max(usize::from(letters > 1)).max(if letters > 3 { 2 } else { 0 });
    (best.0 <= most).then(|| best.1.to_owned())
}
