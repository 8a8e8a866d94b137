//! The names of the logs of each set. Seeds were fixed before the first run.

use std::fs;
use std::path::Path;

use drive_model::cards;

use crate::dirt::Dirt;
use crate::draw::{MODES, OUTSIDERS, PROFILES, mode_name};

/// A set of logs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Set {
    /// Every effect twice, 60 logs with nothing hidden, 30 with imperfections, 22 outsiders, 20 pairs, 10 triples, 10 from a model without
    /// effects, and the logs of another simulator.
    Daily,
    /// 600 logs with nothing hidden, 300 outsiders, 300 with imperfections, 120 pairs, 120 triples, every effect from a model without
    /// effects.
    Release,
}

/// The imperfections of the sets.
const IMPERFECTIONS: [Dirt; 6] = [Dirt::Jitter, Dirt::Outliers, Dirt::Coloured, Dirt::SlowInstant, Dirt::SlowMean, Dirt::Counts];

impl Set {
    /// All sets.
    pub const ALL: [Set; 2] = [Set::Daily, Set::Release];

    /// Name on the command line and of its files.
    pub fn name(self) -> &'static str {
        match self {
            Set::Daily => "daily",
            Set::Release => "release",
        }
    }

    /// The set of this name.
    pub fn by_name(name: &str) -> Option<Set> {
        Set::ALL.into_iter().find(|set| set.name() == name)
    }

    /// The names of its logs; those of another simulator where `data` has them.
    pub fn ids(self, data: Option<&Path>) -> Vec<String> {
        match self {
            Set::Daily => daily(data),
            Set::Release => release(),
        }
    }
}

fn daily(data: Option<&Path>) -> Vec<String> {
    let mut ids = Vec::new();
    for (k, card) in (0..).zip(cards()) {
        ids.extend([0, 1].map(|round| format!("own/{}/{}", card.id, experiment(2 * k + round, 20_001))));
    }
    ids.extend((0..60).map(|k| null(k, 21_001)));
    ids.extend((0..30).map(|k| format!("{}:{}", IMPERFECTIONS[k as usize % 6].name(), null(k, 22_001))));
    for (k, name) in (0..).zip(OUTSIDERS) {
        ids.extend([0, 1].map(|round| format!("outsiders/{name}/{}", experiment(2 * k + round, 23_001))));
    }
    ids.extend((0..20).map(|k| format!("several/2/{}", experiment(k, 24_001))));
    ids.extend((0..10).map(|k| format!("several/3/{}", experiment(k, 25_001))));
    ids.extend((0..10).map(|k| format!("empty:own/{}/{}", cards()[(4 * k + 1) as usize % cards().len()].id, experiment(k, 26_001))));
    ids.extend(data.map_or_else(Vec::new, foreign));
    ids
}

fn release() -> Vec<String> {
    let mut ids: Vec<String> = (0..600).map(|k| null(k, 31_001)).collect();
    for k in 0..300 {
        let kind = IMPERFECTIONS[k as usize % 6].name();
        ids.push(format!("{kind}:{}", null(k / 6, 32_001 + 1000 * (k % 6))));
    }
    ids.extend((0..300).map(|k| format!("outsiders/{}/{}", OUTSIDERS[k as usize % OUTSIDERS.len()], experiment(k, 38_001))));
    ids.extend((0..120).map(|k| format!("several/2/{}", experiment(k, 39_001))));
    ids.extend((0..120).map(|k| format!("several/3/{}", experiment(k, 40_001))));
    for (k, card) in (0..).zip(cards()) {
        ids.extend([0, 1].map(|round| format!("empty:own/{}/{}", card.id, experiment(2 * k + round, 41_001))));
    }
    ids.extend((0..100).map(|k| format!("empty:outsiders/{}/{}", OUTSIDERS[k as usize % OUTSIDERS.len()], experiment(k, 42_001))));
    ids
}

/// The folders of the cases of another simulator, sorted.
fn foreign(data: &Path) -> Vec<String> {
    let folders = fs::read_dir(data.join("cases")).into_iter().flatten().filter_map(Result::ok).filter(|entry| entry.path().is_dir());
    let mut ids: Vec<String> = folders.map(|entry| format!("foreign/{}", entry.file_name().to_string_lossy())).collect();
    ids.sort();
    ids
}

/// Experiments in rotation.
fn experiment(k: u64, first: u64) -> String {
    let mode = mode_name(MODES[(k / 3) as usize % 2]);
    format!("{mode}/{}/{}", PROFILES[k as usize % 3], first + k)
}

/// A third is closed-loop; one in nine has an additional effect that the user's model also has.
pub fn null(k: u64, first: u64) -> String {
    let mode = if k % 3 == 2 { "rate" } else { "voltage" };
    let group = if k % 9 >= 6 && k % 9 % 3 == (k / 9) % 3 { "known" } else { "nulls" };
    format!("{group}/{mode}/{}/{}", PROFILES[(k / 3) as usize % 3], first + k)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::draw::Drawn;

    #[test]
    fn every_name_is_that_of_one_log() {
        for set in Set::ALL {
            let ids = set.ids(None);
            assert_eq!(ids.iter().collect::<BTreeSet<_>>().len(), ids.len(), "{}", set.name());
            for id in &ids {
                let name = id.split_once(':').map_or(id.as_str(), |(_, name)| name);
                assert!(Drawn::by_name(name).is_some(), "{id}");
            }
        }
        assert_eq!((Set::Daily.ids(None).len(), Set::Release.ids(None).len()), (230, 1618));
    }
}
