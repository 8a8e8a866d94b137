//! The drives of a hunt: what each of its logs hides, drawn by seed.
//!
//! Input: the task and a seed. Output: a stand per log with the classes that are present in it. The draw is repeated while one class is
//! in too many logs: a student who gives one answer to all logs must not meet the limit of the score.

use std::collections::BTreeSet;
use std::f64::consts::TAU;

use hal_sim::plant::Stand;
use hal_sim::plant::outsiders::{GrindingBearing, HuntingSupply, Outsiders, SectorRub, grinding_bearing, hunting_supply, sector_rub};

use super::LabError;
use super::answers::{NONE, UNKNOWN, class_of};
use super::course::HuntTask;
use super::draw::Draw;
use stand_acquire::hidden::add;

/// Largest relative deviation of the drive's parameters from the data sheet.
const MAX_DEVIATION: f64 = 0.1;
/// Number of kinds of disturbances outside the catalogue; [`outsider`] draws one.
const OUTSIDERS: usize = 3;

/// What a log hides.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct HiddenCase {
    /// Name of the log.
    pub(super) log: String,
    /// The drive.
    pub(super) stand: Stand,
    /// The classes that are present: effects or families, `none` or `unknown`.
    pub(super) present: BTreeSet<String>,
    /// The hidden effects with their parameters, in words.
    pub(super) description: String,
}

/// Number of logs in which the most frequent class is present.
fn greatest_count(cases: &[HiddenCase]) -> usize {
    let classes: BTreeSet<&String> = cases.iter().flat_map(|case| &case.present).collect();
    classes.into_iter().map(|class| cases.iter().filter(|case| case.present.contains(class)).count()).max().unwrap_or(0)
}

/// The cases of a hunt.
///
/// # Errors
/// The task names an effect that the catalogue lacks.
pub(super) fn cases(task: &HuntTask, seed: u64) -> Result<Vec<HiddenCase>, LabError> {
    let mut draw = Draw::new(seed);
    loop {
        let cases = task.logs.iter().map(|log| case(task, log, &mut draw)).collect::<Result<Vec<_>, _>>()?;
        if greatest_count(&cases) <= task.max_same {
            return Ok(cases);
        }
    }
}

fn case(task: &HuntTask, log: &str, draw: &mut Draw) -> Result<HiddenCase, LabError> {
    let mut stand = Stand::default();
    let drive = &mut stand.drive;
    for value in [&mut drive.inertia_kg_m2, &mut drive.motor_constant_N_m_A, &mut drive.resistance_ohm]
        .into_iter()
        .chain(stand.effects.values_mut().flat_map(|parameters| parameters.values_mut()))
    {
        *value *= 1.0 + draw.between((-MAX_DEVIATION, MAX_DEVIATION));
    }
    let shares = task.shares;
    let kind = draw.between((0.0, 1.0));
    let count = match kind {
        kind if kind < shares.none => 0,
        kind if kind < shares.none + shares.one => 1,
        kind if kind < shares.none + shares.one + shares.two => 2,
        _ => {
            let description = outsider(&mut stand.outsiders, draw).to_owned();
            return Ok(HiddenCase { log: log.to_owned(), stand, present: BTreeSet::from([UNKNOWN.to_owned()]), description });
        }
    };
    let (mut present, mut descriptions) = (BTreeSet::new(), Vec::new());
    while present.len() < count {
        let id = &task.effects[draw.below(task.effects.len())];
        let (card, class) = drive_model::card(id).zip(class_of(id)).ok_or_else(|| LabError::unknown(id, std::iter::empty()))?;
        // Two effects of one class would be one answer.
        if present.insert(class.to_owned()) {
            descriptions.push(add(card, draw.seed(), &mut stand).to_string());
        }
    }
    if present.is_empty() {
        present.insert(NONE.to_owned());
    }
    Ok(HiddenCase { log: log.to_owned(), stand, present, description: descriptions.join("; ") })
}

/// Adds a disturbance that the catalogue lacks; its name.
fn outsider(outsiders: &mut Outsiders, draw: &mut Draw) -> &'static str {
    match draw.below(OUTSIDERS) {
        0 => {
            outsiders.sector_rub = Some(SectorRub {
                rub_N_m: draw.between(sector_rub::TEST_RANGE_N_M),
                rub_N_m_s: 0.0,
                from_rad: draw.between((0.0, TAU)),
                width_rad: draw.between(sector_rub::TEST_WIDTH_RANGE_RAD),
            });
            "a rub in one sector of the turn"
        }
        1 => {
            outsiders.hunting_supply = Some(HuntingSupply {
                hunting: draw.between(hunting_supply::TEST_RANGE),
                hunting_Hz: draw.between(hunting_supply::TEST_RANGE_HZ),
                hunting_phase_rad: draw.between((0.0, TAU)),
            });
            "a supply that oscillates"
        }
        _ => {
            outsiders.grinding_bearing = Some(GrindingBearing {
                grinding_N_m: draw.between(grinding_bearing::TEST_RANGE_N_M),
                grinding_s: draw.between(grinding_bearing::TEST_RANGE_S),
                seed: draw.seed() >> 1,
            });
            "a bearing whose friction is random"
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::course::{Lab, Task};
    use crate::judge::brier_score;

    fn task() -> HuntTask {
        match Lab::find("hunt").expect("the hunt").task {
            Task::Hunt(task) => task,
            _ => panic!("the hunt is a hunt"),
        }
    }

    #[test]
    fn one_log_of_six_hides_nothing_and_every_kind_occurs() {
        let task = task();
        let all: Vec<HiddenCase> = (0..500).flat_map(|seed| cases(&task, seed).expect("cases")).collect();
        let share = |has: &dyn Fn(&HiddenCase) -> bool| all.iter().filter(|case| has(case)).count() as f64 / all.len() as f64;
        // Expected 0.222 of 2000 logs, standard deviation 0.009.
        assert!(share(&|case| case.present.contains(NONE)) > 1.0 / 6.0);
        assert!(share(&|case| case.present.len() == 2) > 0.08);
        assert!(share(&|case| case.present.contains(UNKNOWN)) > 0.08);
        for id in &task.effects {
            let class = class_of(id).expect("an effect");
            assert!(all.iter().any(|case| case.present.contains(class)), "{id}");
        }
        assert!(all.iter().all(|case| hal_sim::plant::Plant::new(&case.stand, 0.0).is_ok()));
    }

    /// The best constant answer states each class with its share of the logs of that seed; nobody knows these shares beforehand.
    #[test]
    fn best_constant_answer_does_not_meet_the_limit_on_any_seed() {
        let task = task();
        for seed in 0..2000 {
            let cases = cases(&task, seed).expect("cases");
            let share = |class: &String| cases.iter().filter(|case| case.present.contains(class)).count() as f64 / cases.len() as f64;
            let answer: BTreeMap<String, f64> =
                cases.iter().flat_map(|case| &case.present).map(|class| (class.clone(), share(class))).collect();
            let mean = cases.iter().map(|case| brier_score(&answer, &case.present)).sum::<f64>() / cases.len() as f64;
            assert!(mean >= task.max_brier_score, "seed {seed}: {mean}");
        }
    }

    #[test]
    fn seed_determines_the_cases() {
        assert_eq!(cases(&task(), 7).expect("cases"), cases(&task(), 7).expect("cases"));
        assert_ne!(cases(&task(), 7).expect("cases"), cases(&task(), 8).expect("cases"));
    }
}
