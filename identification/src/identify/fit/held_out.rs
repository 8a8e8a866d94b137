//! Held-out rows that a model does not describe, although it leaves only noise in the fitted rows: something happens there that happens
//! nowhere else.
//!
//! Blocks of 2 s are compared, because held-out rows come in such blocks. Where the model is right, the blocks are exchangeable: noise of
//! any colour, and what the errors of the parameters add, are alike in fitted and held-out blocks. A block departs if its mean square is
//! more than twice that of the worst fitted block. In a short block that may be chance: noise with twice the variance of the worst fitted
//! block must have such a mean square with a probability below 10⁻⁶ only.

use super::channel_fit::{ChannelFit, independent_every};
use crate::model::Channel;
use crate::recording::prepared_log::{HELD_OUT_BLOCK_S, PreparedLog};
use crate::statistics::Extremes;
use crate::statistics::distributions::ln_chi_squared_tail;

/// Ratio of mean squares from which a block may depart.
const MIN_RATIO: f64 = 2.0;
/// Greatest probability of a departing block by chance.
const MAX_P: f64 = 1e-6;

/// Held-out rows that depart from what the fitted rows let expect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Departure {
    /// The channel that departs most.
    pub channel: Channel,
    /// First row of the first such block, s.
    pub from_s: f64,
    /// Greatest rms of a held-out block over the noise of the channel.
    pub ratio: f64,
}

/// Rows in sequence, all fitted or all held out, at most as long as a block.
struct Block {
    first_row: usize,
    held_out: bool,
    /// Number of compared rows.
    rows: usize,
    /// Their mean square over the variance of the noise.
    chi2_per_n: f64,
}

/// Where the held-out rows depart from the fitted ones; `None` where they do not, and where none are held out.
pub fn departure(data: &PreparedLog, channels: &[ChannelFit]) -> Option<Departure> {
    data.held_out.as_ref()?;
    let of_channel = |(index, fit): (usize, &ChannelFit)| {
        let blocks = blocks(data, fit);
        let half_rows = 0.5 * HELD_OUT_BLOCK_S / data.dt_s;
        let whole = |b: &&Block| !b.held_out && b.rows as f64 >= half_rows;
        let expected = blocks.iter().filter(whole).map(|b| b.chi2_per_n).max_or_zero().max(1.0) * MIN_RATIO;
        let departs = |b: &&Block| {
            let independent = (b.rows as f64 / independent_every(data, index) as f64).max(1.0);
            let ratio = b.chi2_per_n / expected;
            b.held_out && ratio > 1.0 && ln_chi_squared_tail(ratio * independent, independent) < MAX_P.ln()
        };
        let departing: Vec<&Block> = blocks.iter().filter(departs).collect();
        let ratio = departing.iter().map(|b| b.chi2_per_n).max_or_zero().sqrt();
        Some(Departure { channel: fit.channel, from_s: data.t_s[departing.first()?.first_row], ratio })
    };
    channels.iter().enumerate().filter_map(of_channel).max_by(|a, b| a.ratio.total_cmp(&b.ratio))
}

/// The compared rows of a channel in blocks.
fn blocks(data: &PreparedLog, fit: &ChannelFit) -> Vec<Block> {
    let most_rows = ((HELD_OUT_BLOCK_S / data.dt_s).round() as usize).max(1);
    let mut blocks = Vec::new();
    for segment in &data.segments {
        let rows: Vec<usize> = segment.clone().collect();
        let runs = rows.chunk_by(|a, b| data.held_out(*a) == data.held_out(*b));
        for rows in runs.flat_map(|run| run.chunks(most_rows)) {
            let squares: Vec<f64> =
                rows.iter().map(|&row| (fit.residual[row] / fit.noise).powi(2)).filter(|square| !square.is_nan()).collect();
            if !squares.is_empty() {
                let chi2_per_n = squares.iter().sum::<f64>() / squares.len() as f64;
                blocks.push(Block { first_row: rows[0], held_out: data.held_out(rows[0]), rows: squares.len(), chi2_per_n });
            }
        }
    }
    blocks
}
