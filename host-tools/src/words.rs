//! Help with words: the nearest known name to one that is not.

/// The known name that `word` most likely meant; `None` where none is near.
pub fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<String> {
    let lower = word.to_lowercase();
    let distance = |name: &str| strsim::osa_distance(&lower, &name.to_lowercase());
    let best = known.into_iter().map(|name| (distance(name), name)).min_by_key(|(d, _)| *d)?;
    // A third of the letters may be wrong, two in short names; a single letter resembles everything.
    let letters = word.chars().count();
    let most = (letters / 3).max(usize::from(letters > 1)).max(if letters > 3 { 2 } else { 0 });
    (best.0 <= most).then(|| best.1.to_owned())
}
