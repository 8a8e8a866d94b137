//! Cycles of a session that are disturbed, such as by a jump of the angle.
//!
//! Input: the cycles as the rows of a [`SessionFit`]. Output: those whose rates the others refute, with their deviations. A suspect gets an
//! unknown deviation of its own in a fit of the cycles around it; the one that is least likely to be zero is left out, and the others are
//! tested again (extreme studentised deviates: Rosner, Technometrics 25 (1983) 165, with the noise of this fit).

use identification::statistics::robust::median;

use super::session_fit::{FitRow, SessionFit};

/// Fewest cycles of which one can be called disturbed, and cycles for each one that is left out.
const MIN_CYCLES: usize = 8;
/// Probability with which one of a session's undisturbed cycles is called disturbed.
const DISTURBED_PROBABILITY: f64 = 1e-3;
/// Rows that a suspect is compared with to be one, and suspects that are tested.
const COMPARED: usize = 6;
const MAX_SUSPECTS: usize = 3;
/// Cycles around a suspect with which it is tested, at most: longer sessions would be averaged.
const AROUND: usize = 64;

/// Indices of the disturbed rows, with their deviations from the fit of the others, rad/s; at most one of [`MIN_CYCLES`] rows.
pub fn disturbed(rows: &[FitRow]) -> Vec<(usize, f64)> {
    let mut found: Vec<(usize, f64)> = Vec::new();
    while MIN_CYCLES * (found.len() + 1) <= rows.len() {
        let kept: Vec<usize> = (0..rows.len()).filter(|k| found.iter().all(|(known, _)| known != k)).collect();
        let tested = suspects(rows, &kept).into_iter().filter_map(|place| {
            let from = place.saturating_sub(AROUND / 2).min(kept.len().saturating_sub(AROUND));
            let around = &kept[from..kept.len().min(from + AROUND)];
            // Positions that these cycles do not have.
            let is_used = |column: &usize| around.iter().any(|&k| rows[k].regressors[*column] != 0.0);
            let used: Vec<usize> = (0..rows[0].regressors.len()).filter(is_used).collect();
            let of = |k: usize| {
                let own = f64::from(u8::from(k == kept[place]));
                FitRow { regressors: used.iter().map(|&column| rows[k].regressors[column]).chain([own]).collect(), ..rows[k].clone() }
            };
            let fit = SessionFit::new(&around.iter().map(|&k| of(k)).collect::<Vec<_>>())?;
            let mut own = vec![0.0; used.len()];
            own.push(1.0);
            Some((kept[place], fit.estimate(&own).value, fit.probability_within_visits(&own)))
        });
        match tested.min_by(|a, b| a.2.total_cmp(&b.2)) {
            Some((suspect, deviation, p)) if p * (kept.len() as f64) < DISTURBED_PROBABILITY => found.push((suspect, deviation)),
            _ => break,
        }
    }
    found
}

/// Places in `kept` of the rows that differ most from the median of the nearest rows of the same position.
fn suspects(rows: &[FitRow], kept: &[usize]) -> Vec<usize> {
    let excess = |place: usize| {
        let row = &rows[kept[place]];
        let mut beside: Vec<(usize, f64)> = (0..kept.len())
            .filter(|other| *other != place && rows[kept[*other]].regressors == row.regressors)
            .map(|other| (other.abs_diff(place), rows[kept[other]].reading))
            .collect();
        beside.sort_by_key(|(distance, _)| *distance);
        median(beside.iter().take(COMPARED).map(|(_, reading)| *reading)).map_or(0.0, |median| (row.reading - median).abs())
    };
    let mut places: Vec<(usize, f64)> = (0..kept.len()).map(|place| (place, excess(place))).collect();
    places.sort_by(|a, b| b.1.total_cmp(&a.1));
    places.into_iter().take(MAX_SUSPECTS).map(|(place, _)| place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use hal_sim::peripherals::Noise;

    /// Cycles in the order A B B A, with white noise of 0.1 and a drift that moves.
    fn session(cycles: usize, seed: u64, moves: fn(f64) -> f64) -> Vec<FitRow> {
        let mut noise = Noise::new(seed, 0, 0.1);
        let visits = [1.0, -1.0, -1.0, 1.0];
        (0..4 * cycles)
            .map(|k| {
                let (visit, time_s) = (k / cycles, 10.0 * k as f64);
                let side = visits[visit];
                FitRow {
                    time_s,
                    reading: 1.5 - 0.9 * side + moves(time_s) + noise.draw(),
                    sign: if k % 2 == 0 { 1 } else { -1 },
                    amplitude_rad_s: 1.0,
                    regressors: vec![f64::from(u8::from(side > 0.0)), f64::from(u8::from(side < 0.0))],
                    visit,
                    weight: 1.0,
                }
            })
            .collect()
    }

    /// Short sessions, and one whose cycles around a suspect are all of one position.
    #[test]
    fn a_disturbed_cycle_is_found_and_undisturbed_sessions_have_none() {
        let mut alarms = 0;
        for seed in 0..60 {
            for moves in [(|_| 0.0) as fn(f64) -> f64, |t| 2e-3 * t] {
                let mut rows = session(if seed % 20 == 0 { 100 } else { 4 }, seed, moves);
                alarms += disturbed(&rows).len();
                let at = seed as usize * 7 % rows.len();
                rows[at].reading += 5.0;
                let found = disturbed(&rows);
                assert!(found.len() <= 2 && found.iter().any(|(row, size)| *row == at && (size - 5.0).abs() < 0.6), "{seed}: {found:?}");
            }
        }
        // 1e-3 of 120 sessions.
        assert!(alarms <= 2, "{alarms}");
    }
}
