//! Gradients of χ² by other courses of the input, without a Jacobian in memory.

use nalgebra::DVector;
use rayon::prelude::*;

use crate::identify::fit::parameters::Dual;
use crate::identify::fit::simulate::Simulation;
use crate::identify::fit::system::FitScalar;
use crate::identify::fit::{Iterate, Problem};
use crate::recording::PreparedLog;

/// Rows that are simulated at a time.
const BLOCK_ROWS: usize = 2048;

/// Gradients Σ w Jᵀ Δr by segment, one list for each of the `changed` data: Δr is the change of the residuals at `iterate` by the other input of
/// these data, J the sensitivities along the data of the problem. The simulations run side by side, so that no Jacobian is kept.
pub fn gradients_by_changes(problem: Problem, iterate: &Iterate, changed: &[PreparedLog]) -> Vec<Vec<DVector<f64>>> {
    match iterate.parameters.free().len() + iterate.initial_states.kinds.len() {
        0..=8 => gradients_in::<8>(problem, iterate, changed),
        9..=12 => gradients_in::<12>(problem, iterate, changed),
        13..=16 => gradients_in::<16>(problem, iterate, changed),
        _ => gradients_in::<32>(problem, iterate, changed),
    }
}

fn gradients_in<const N: usize>(problem: Problem, iterate: &Iterate, changed: &[PreparedLog]) -> Vec<Vec<DVector<f64>>>
where
    Dual<N>: FitScalar,
{
    let Problem { system, data, weights } = problem;
    let (parameters, states) = (&iterate.parameters, &iterate.initial_states);
    let (rig, plain) = (system.rig::<Dual<N>>(parameters, data.driven), system.rig::<f64>(parameters, data.driven));
    let free = parameters.free().len();
    let of_segment = |segment: usize| -> Vec<[f64; N]> {
        let rows = data.segments[segment].clone();
        let starts = (states.kinds.as_slice(), states.values[segment].as_slice());
        let mut sensitive = Simulation::new(&rig, data, segment, starts, free);
        let mut others: Vec<_> = changed.iter().map(|data| Simulation::new(&plain, data, segment, starts, 0)).collect();
        let mut gradients = vec![[0.0; N]; changed.len()];
        let mut block: Vec<Option<Dual<N>>> = Vec::new();
        for from in rows.clone().step_by(BLOCK_ROWS) {
            let to = (from + BLOCK_ROWS).min(rows.end);
            block.clear();
            block.resize((to - from) * data.channels.len(), None);
            let at = |channel: usize, row: usize| (row - from) * data.channels.len() + channel;
            sensitive.advance(to, &mut |channel, row, value| {
                if data.target(channel, row, rows.start).is_some() && !data.held_out(row) {
                    block[at(channel, row)] = Some(*value);
                }
                true
            });
            for (other, gradient) in others.iter_mut().zip(&mut gradients) {
                other.advance(to, &mut |channel, row, value| {
                    if let Some(here) = &block[at(channel, row)] {
                        let weighted = weights[channel] * (here.re - value);
                        gradient.iter_mut().zip(&here.slopes).for_each(|(sum, slope)| *sum += weighted * slope);
                    }
                    true
                });
            }
        }
        data.budget.spend(rows.len(), 1 + N + changed.len());
        gradients
    };
    let by_segment: Vec<Vec<[f64; N]>> = (0..data.segments.len()).into_par_iter().map(of_segment).collect();
    let unknowns = free + states.kinds.len();
    let of_change = |change: usize| by_segment.iter().map(|gradients| DVector::from_column_slice(&gradients[change][..unknowns])).collect();
    (0..changed.len()).map(of_change).collect()
}
