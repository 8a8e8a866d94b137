//! Coverage of the uncertainties that `fit`, `calibrate`, `drift` and `allan` report: simulated measurements with known truth, 95 %
//! intervals against it.
//!
//! A condition is one way of measuring (`fit` of clean logs in voltage mode, `calibrate` of gyroscopes …); its measurements differ by their
//! seeds, which were fixed before the first run. A measurement is named `ANALYSIS/CONDITION/SEED`.
//!
//! * [`fit`], [`calibrate`], [`drift`], [`allan`]: the measurements of each analysis;
//! * [`rows`]: counts of each quantity under each condition, and what chance allows;
//! * [`changes`]: two runs.

pub mod allan;
pub mod calibrate;
pub mod changes;
pub mod drift;
pub mod fit;
pub mod rows;

use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::record::List;
use super::run::Identified;

/// An analysis whose uncertainties are tested.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Analysis {
    /// `stand fit`.
    Fit,
    /// `stand calibrate`.
    Calibrate,
    /// `stand drift`.
    Drift,
    /// `stand allan`.
    Allan,
}

impl Analysis {
    /// All analyses.
    pub const ALL: [Analysis; 4] = [Analysis::Fit, Analysis::Calibrate, Analysis::Drift, Analysis::Allan];

    /// The command's name.
    pub fn name(self) -> &'static str {
        match self {
            Analysis::Fit => "fit",
            Analysis::Calibrate => "calibrate",
            Analysis::Drift => "drift",
            Analysis::Allan => "allan",
        }
    }

    /// Names of its conditions, with the first seed and the number of measurements of the baseline.
    fn conditions(self) -> Vec<(String, u64, u64)> {
        match self {
            Analysis::Fit => fit::conditions(),
            Analysis::Calibrate => calibrate::conditions(),
            Analysis::Drift => drift::conditions(),
            Analysis::Allan => allan::conditions(),
        }
    }

    fn measured(self, condition: &str, seed: u64) -> Result<Measured, String> {
        match self {
            Analysis::Fit => fit::measured(condition, seed),
            Analysis::Calibrate => calibrate::measured(condition, seed),
            Analysis::Drift => drift::measured(condition, seed),
            Analysis::Allan => allan::measured(condition, seed),
        }
    }
}

/// Names of the measurements: `cases` of each condition, or as many as the baseline has.
pub fn ids(cases: Option<u64>) -> Vec<String> {
    let mut ids = Vec::new();
    for analysis in Analysis::ALL {
        for (condition, first, count) in analysis.conditions() {
            ids.extend((first..first + cases.unwrap_or(count)).map(|seed| format!("{}/{condition}/{seed}", analysis.name())));
        }
    }
    ids
}

/// A measurement's input and results.
pub struct Measured {
    /// Hash of what the analysis is given.
    pub inputs: String,
    /// The reported intervals, or why the analysis refuses the measurement.
    pub intervals: Result<Vec<Interval>, String>,
}

/// A reported 95 % interval, or upper 95 % limit, and the truth.
#[derive(Debug, Clone, PartialEq)]
pub struct Interval {
    /// Name of the quantity, without blanks.
    pub quantity: String,
    /// Error in standard uncertainties; `None` for an upper limit.
    pub error_sigma: Option<f64>,
    /// The interval contains the truth.
    pub covers: bool,
}

impl Interval {
    fn to_entry(&self) -> String {
        let error = self.error_sigma.map_or(String::new(), |error| format!("{error:.4}"));
        format!("{}={error};{}", self.quantity, if self.covers { "covers" } else { "misses" })
    }

    fn of_entry(entry: &str) -> Option<Self> {
        let (quantity, rest) = entry.split_once('=')?;
        let (error, covers) = rest.split_once(';')?;
        let error_sigma = if error.is_empty() { None } else { Some(error.parse().ok()?) };
        Some(Self { quantity: quantity.to_owned(), error_sigma, covers: covers == "covers" })
    }
}

/// One measurement in the file of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CaseRecord {
    /// Name of the measurement.
    pub id: String,
    /// Hash of what the analysis is given.
    pub inputs: String,
    /// Why the analysis refuses it; empty otherwise.
    pub refused: String,
    /// `QUANTITY=ERROR;covers` or `…;misses`, the error in standard uncertainties.
    pub intervals: List,
}

impl CaseRecord {
    /// The reported intervals.
    pub fn intervals(&self) -> impl Iterator<Item = Interval> {
        self.intervals.0.iter().filter_map(|entry| Interval::of_entry(entry))
    }

    /// `ANALYSIS` and `CONDITION` of the name.
    pub fn condition(&self) -> (&str, &str) {
        let mut parts = self.id.split('/');
        (parts.next().unwrap_or_default(), parts.next().unwrap_or_default())
    }
}

impl Identified for CaseRecord {
    fn id(&self) -> &str {
        &self.id
    }
}

/// Simulates and evaluates the measurement of a name.
///
/// # Errors
/// There is no such measurement, or it cannot be simulated.
pub fn measured(id: &str) -> Result<(CaseRecord, String), String> {
    let unknown = || format!("{id}: not the name of a measurement");
    let parts: Vec<&str> = id.split('/').collect();
    let &[analysis, condition, seed] = parts.as_slice() else { return Err(unknown()) };
    let analysis = Analysis::ALL.into_iter().find(|a| a.name() == analysis).ok_or_else(unknown)?;
    let seed = seed.parse().map_err(|_| unknown())?;
    if !analysis.conditions().iter().any(|(name, ..)| name == condition) {
        return Err(unknown());
    }
    let begin = Instant::now();
    let Measured { inputs, intervals } = analysis.measured(condition, seed).map_err(|e| format!("{id}: {e}"))?;
    let (intervals, refused) = intervals.map_or_else(|reason| (Vec::new(), reason), |intervals| (intervals, String::new()));
    let misses: Vec<&str> = intervals.iter().filter(|i| !i.covers).map(|i| i.quantity.as_str()).collect();
    let line =
        if refused.is_empty() { format!("{} intervals, missed: {misses:?}", intervals.len()) } else { format!("refused: {refused}") };
    let line = format!("{line}, {:.1} s", begin.elapsed().as_secs_f64());
    let entries = intervals.iter().map(Interval::to_entry).collect();
    Ok((CaseRecord { id: id.to_owned(), inputs, refused, intervals: List(entries) }, line))
}

/// A folder of its own for the files of a measurement; dropping it removes the folder.
struct TemporaryFolder(std::path::PathBuf);

impl TemporaryFolder {
    fn new(name: &str) -> Self {
        Self(std::env::temp_dir().join(format!("stand-coverage-{}-{name}", std::process::id())))
    }
}

impl Drop for TemporaryFolder {
    fn drop(&mut self) {
        // A folder that remains does no harm.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_name_is_that_of_one_measurement() {
        let ids = ids(None);
        assert_eq!(ids.iter().collect::<BTreeSet<_>>().len(), ids.len());
        for id in ["fit/voltage-clean", "calibrate/gyro/x", "drift/none/1", "x/y/1"] {
            assert!(measured(id).is_err(), "{id}");
        }
    }

    #[test]
    fn an_interval_is_read_as_it_was_written() {
        for error_sigma in [Some(-1.25), None] {
            let interval = Interval { quantity: "scale".to_owned(), error_sigma, covers: error_sigma.is_none() };
            assert_eq!(Interval::of_entry(&interval.to_entry()), Some(interval));
        }
    }

    /// The same seed gives the same inputs and results; another seed gives others.
    #[test]
    fn a_name_determines_its_measurement() {
        let of = |id: &str| measured(id).expect("a measurement").0;
        let first = of("allan/mixture/9001");
        assert_eq!(first, of("allan/mixture/9001"));
        let second = of("allan/mixture/9002");
        assert!(first.inputs != second.inputs && first.intervals != second.intervals);
        assert!(first.refused.is_empty() && first.intervals().count() >= 3, "{first:?}");
    }
}
