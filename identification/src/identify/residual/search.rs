//! Forward selection of the shapes that explain the residual of all channels together.
//!
//! Each round takes the shape family with the largest decrease of n ln(sum of squares) + k ln n (BIC), if it is significant against noise
//! of the remaining residual's colour, and removes it from the residual. A coordinate correlated with one found before has nothing left to
//! explain and is not listed.

use std::sync::Arc;

use drive_model::Coordinate;

use super::harmonics;
use super::rows::ResidualRows;
use super::shapes::{self, Entry, Family, ShapeKind, times};
use super::significance::{self, dot, orthonormal, subtract_scaled};
use crate::identify::fit::FitResult;
use crate::model::{Channel, Input};
use crate::statistics::Extremes;

/// Length of the blocks to which rows are averaged for slow shapes, s.
const BLOCK_S: f64 = 0.020;
/// Most rounds.
const MAX_ROUNDS: usize = 8;
/// Most families that are tested in a round, the best first, until one is significant.
const MAX_TESTS_PER_ROUND: usize = 4;
/// Decimal logarithm of the probability by chance below which a component is significant, corrected for the number of tests.
pub const MAX_LOG10_P: f64 = -3.0;
/// Least fraction of the remaining misfit that a component must explain.
const MIN_GAIN_FRACTION: f64 = 0.01;
/// Families with at least this fraction of the best gain are equivalent to the best.
const EQUIVALENT_GAIN_FRACTION: f64 = 0.97;
/// Steps in time have this many alternatives, which the BIC counts.
const STEP_CHOICES: f64 = 32.0;

/// Fraction that a component explains of one channel.
#[derive(Debug, Clone)]
pub struct ChannelShare {
    /// The channel.
    pub channel: Channel,
    /// Fraction of the residual's variance. Negative if the gain of the other channels costs this one.
    pub fraction: f64,
    /// Decimal logarithm of the probability by chance, corrected for the number of tests.
    pub log10_p: f64,
}

/// A shape family that was found, with its share of each channel.
#[derive(Debug, Clone)]
pub struct Component {
    /// The coordinate.
    pub coordinate: Coordinate,
    /// Where it enters the drive.
    pub entry: Entry,
    /// The shape.
    pub shape: ShapeKind,
    /// The channel concerned, for an error of a reading.
    pub reading: Option<Channel>,
    /// The motion is prescribed: a torque and an error of the reading are not distinguishable.
    pub prescribed_motion: bool,
    /// Decrease of the sum of squares of all channels, in units of the noise.
    pub gain: f64,
    /// Share of each channel.
    pub channels: Vec<ChannelShare>,
}

/// A family with columns orthonormal to the components found before.
struct Tested {
    coordinate: Coordinate,
    entry: Entry,
    shape: ShapeKind,
    /// Empty for a harmonic until it is tested: its columns have the length of the log, and a dozen of them would exceed the log many
    /// times.
    columns: Arc<[Vec<f64>]>,
    /// Number of columns.
    width: usize,
    gain: f64,
    /// Decrease of the BIC.
    bic_decrease: f64,
    /// The columns are per row, not per block.
    per_row: bool,
}

/// All significant components of the residual.
pub fn search(mut full: ResidualRows, fit: &FitResult) -> Vec<Component> {
    let per_block = ((BLOCK_S / full.dt_s).round() as usize).max(1);
    let starts = full.block_starts(per_block);
    let mut coarse = full.blocks(&starts, per_block);
    let mut taken = orthonormal(&[], &shapes::fitted_directions(&coarse, fit));
    let mut families = shapes::families(&coarse);
    for family in &mut families {
        family.columns = orthonormal(&taken, &family.columns).into();
    }
    let mut found: Vec<Component> = Vec::new();
    let initial_power = dot(&full.y, &full.y);
    for _ in 0..MAX_ROUNDS {
        let mut tried: Vec<Tested> = families.iter().map(|f| of_family(f, &coarse)).collect();
        let periodic = periodic_candidates(&full, &coarse, &taken);
        let tests = (families.len() + periodic.0) as f64;
        tried.extend(periodic.1);
        let power = dot(&full.y, &full.y);
        for t in &mut tried {
            let n = full.len() as f64 * full.channels.len() as f64;
            let choices = match t.shape {
                ShapeKind::Harmonic(_) | ShapeKind::Line { .. } => 2.0 * (periodic.0 as f64).max(1.0).ln(),
                ShapeKind::Step { .. } => 2.0 * STEP_CHOICES.ln(),
                _ => 0.0,
            };
            t.bic_decrease = -n * (1.0 - t.gain / power).max(1e-9).ln() - t.width as f64 * n.ln() - choices;
        }
        tried.sort_by(|a, b| b.bic_decrease.total_cmp(&a.bic_decrease));
        simplest_first(&mut tried);
        let mut best = None;
        for mut t in tried.into_iter().take(MAX_TESTS_PER_ROUND).filter(|t| {
            t.bic_decrease > 0.0 && t.gain > MIN_GAIN_FRACTION * (initial_power - found.iter().map(|f| f.gain).sum::<f64>()).max(0.0)
        }) {
            if let ShapeKind::Harmonic(order) = t.shape {
                t.columns = harmonic_columns(&full, &waves(&full, order), t.entry).into();
            }
            let rows = if t.per_row { &full } else { &coarse };
            let significance = significance::test(&t.columns, &rows.y, rows.len());
            if significance.log10_p + tests.log10() < MAX_LOG10_P {
                best = Some((t, tests));
                break;
            }
        }
        let Some((t, tests)) = best else { break };
        let rows = if t.per_row { &full } else { &coarse };
        let channels = channel_shares(&t, rows, tests);
        let reading = match t.entry {
            Entry::Reading(c) => rows.channels.get(c).map(|c| c.channel),
            _ => None,
        };
        found.push(Component {
            coordinate: t.coordinate,
            entry: t.entry,
            shape: t.shape,
            reading,
            prescribed_motion: rows.driven == Input::Motion,
            gain: t.gain,
            channels,
        });
        remove(&t, &mut full, &coarse, &starts);
        coarse.y = full.blocks(&starts, per_block).y;
        if !t.per_row {
            for family in &mut families {
                family.columns = orthonormal(&t.columns, &family.columns).into();
            }
            taken.extend(t.columns.iter().cloned());
        }
    }
    found
}

/// The candidate of a family.
fn of_family(family: &Family, rows: &ResidualRows) -> Tested {
    let gain = family.columns.iter().map(|q| dot(q, &rows.y).powi(2)).sum();
    let (columns, width) = (Arc::clone(&family.columns), family.columns.len());
    let (coordinate, entry, shape) = (family.coordinate, family.entry, family.shape);
    Tested { coordinate, entry, shape, columns, width, gain, bic_decrease: 0.0, per_row: false }
}

/// Moves the simplest of the candidates equivalent to the first to the front. A temperature has priority over time, which correlates with
/// everything slow.
fn simplest_first(tried: &mut [Tested]) {
    let Some(best) = tried.first() else { return };
    let (enough, is_slow) =
        (EQUIVALENT_GAIN_FRACTION * best.gain, best.coordinate == Coordinate::Time && !matches!(best.shape, ShapeKind::Line { .. }));
    let equivalent = |t: &&(usize, &Tested)| t.1.gain >= enough && t.1.bic_decrease > 0.0;
    let all: Vec<(usize, &Tested)> = tried.iter().enumerate().collect();
    let warm = all.iter().filter(equivalent).find(|t| is_slow && t.1.coordinate == Coordinate::Temperature);
    let simplest = all.iter().filter(equivalent).min_by_key(|t| t.1.width);
    if let Some(k) = warm.or(simplest).map(|t| t.0) {
        tried[..=k].rotate_right(1);
    }
}

/// Removes a component from the residual of the rows.
fn remove(t: &Tested, full: &mut ResidualRows, coarse: &ResidualRows, starts: &[usize]) {
    let n = full.len();
    for q in t.columns.iter() {
        if t.per_row {
            let z = dot(q, &full.y);
            subtract_scaled(&mut full.y, z, q);
            continue;
        }
        let z = dot(q, &coarse.y);
        let blocks = coarse.len();
        for c in 0..full.channels.len() {
            for (b, &start) in starts.iter().enumerate() {
                let end = starts.get(b + 1).copied().unwrap_or(n);
                let at = c * blocks + b;
                let weight = coarse.mask[at];
                if weight > 0.0 {
                    let value = z * q[at] / weight;
                    for row in c * n + start..c * n + end {
                        full.y[row] -= value * full.mask[row];
                    }
                }
            }
        }
    }
}

/// Share that a candidate explains of each channel, tested by channel.
fn channel_shares(t: &Tested, rows: &ResidualRows, tests: f64) -> Vec<ChannelShare> {
    let n = rows.len();
    let mut after = rows.y.clone();
    for q in t.columns.iter() {
        let z = dot(q, &rows.y);
        subtract_scaled(&mut after, z, q);
    }
    let mut list = Vec::new();
    for (c, channel) in rows.channels.iter().enumerate() {
        let part = c * n..(c + 1) * n;
        let own: Vec<Vec<f64>> = t.columns.iter().map(|q| q[part.clone()].to_vec()).collect();
        let largest = own.iter().map(|q| dot(q, q)).max_or_zero();
        // A shape without effect on this channel is not tested.
        let own: Vec<Vec<f64>> = own.into_iter().filter(|q| dot(q, q) > 1e-6 * largest && largest > 1e-6).collect();
        let y = &rows.y[part.clone()];
        let significance = significance::test(&orthonormal(&[], &own), y, n);
        let gain = dot(y, y) - dot(&after[part.clone()], &after[part]);
        let fraction = (gain - significance.by_chance) / channel.power.max(f64::MIN_POSITIVE);
        let log10_p = (significance.log10_p + tests.log10()).min(0.0);
        list.push(ChannelShare { channel: channel.channel, fraction, log10_p });
    }
    list
}

/// Peaks of each spectrum that become candidates.
const PEAKS_PER_SPECTRUM: usize = 2;
/// Harmonic orders that become candidates at every entry point.
const MAX_HARMONICS: usize = 3;

/// Fewest periods along the path of the motion, forth and back, of a harmonic.
const MIN_TRAVELLED_PERIODS: f64 = 1.5;

/// Number of harmonics and lines examined, and the candidates among them.
fn periodic_candidates(full: &ResidualRows, coarse: &ResidualRows, taken: &[Vec<f64>]) -> (usize, Vec<Tested>) {
    let mut list = Vec::new();
    let mut examined = 0;
    let n = full.len();
    if full.theta.len() == n && full.omega.len() == n {
        let highest = highest_order(full);
        let mut orders: Vec<(u32, f64)> = Vec::new();
        for c in 0..full.channels.len() {
            for weight in weights(full) {
                let s = harmonics::spectrum(&full.theta, &full.y[c * n..(c + 1) * n], weight, highest);
                examined += s.fraction.len();
                for (order, share) in harmonics::peaks(&s, PEAKS_PER_SPECTRUM) {
                    // In units of the noise: comparable between channels.
                    let gain = share * dot(&full.y[c * n..(c + 1) * n], &full.y[c * n..(c + 1) * n]);
                    match orders.iter_mut().find(|o| o.0 == order) {
                        Some(o) => o.1 = o.1.max(gain),
                        None => orders.push((order, gain)),
                    }
                }
            }
        }
        // A fraction of a period is a drift: any smooth error would fit it.
        let travelled = shapes::travelled_turns(full);
        orders.retain(|(order, _)| f64::from(*order) * travelled >= MIN_TRAVELLED_PERIODS);
        orders.sort_by(|a, b| b.1.total_cmp(&a.1));
        for &(order, _) in orders.iter().take(MAX_HARMONICS) {
            let waves = waves(full, order);
            list.extend(entries(full).into_iter().filter_map(|entry| harmonic(full, order, &waves, entry)));
        }
    }
    if coarse.drive.is_some() || coarse.channels.len() == 1 {
        examined += coarse.len() / 2;
        list.extend(lines(coarse, taken));
    }
    (examined, list)
}

/// Highest harmonic order that these rows resolve.
pub fn highest_order(full: &ResidualRows) -> usize {
    let rms = (dot(&full.omega, &full.omega) / full.len().max(1) as f64).sqrt();
    harmonics::resolvable_order(rms, full.dt_s)
}

/// Weights of the spectra: dependences of a harmonic's amplitude on rate and current (1/ω, 1, ω, i/ω).
pub fn weights(rows: &ResidualRows) -> Vec<Box<dyn Fn(usize) -> f64 + '_>> {
    let most = rows.omega.iter().fold(f64::MIN_POSITIVE, |m, w| m.max(w.abs()));
    let least = 0.03 * most;
    let inverse = move |k: usize| {
        let w = rows.omega[k];
        least * w / (w * w + least * least)
    };
    let mut list: Vec<Box<dyn Fn(usize) -> f64 + '_>> = vec![Box::new(inverse), Box::new(|_| 1.0), Box::new(move |k| rows.omega[k] / most)];
    if rows.current.len() == rows.len() {
        list.push(Box::new(move |k| rows.current[k] * inverse(k)));
    }
    list
}

/// Entry points of a harmonic.
fn entries(rows: &ResidualRows) -> Vec<Entry> {
    let mut list: Vec<Entry> = Vec::new();
    if rows.drive.is_some() {
        list.push(Entry::Torque);
        if rows.current.len() == rows.len() {
            list.push(Entry::MotorConstant);
        }
    }
    list.extend((0..rows.channels.len()).filter(|c| rows.channels[*c].channel != Channel::Angle).map(Entry::Reading));
    if rows.channel(Channel::Angle).is_some() {
        list.extend(rows.channel(Channel::Angle).map(Entry::Reading));
        if rows.channel(Channel::Rate).is_some() {
            list.push(Entry::Encoder);
        }
    }
    list
}

/// Cosine and sine of one harmonic order, row by row.
fn waves(rows: &ResidualRows, order: u32) -> [Vec<f64>; 2] {
    let order = f64::from(order);
    [shapes::map(&rows.theta, |x| (x * order).cos()), shapes::map(&rows.theta, |x| (x * order).sin())]
}

/// Orthonormal responses of all channels to a harmonic.
fn harmonic_columns(rows: &ResidualRows, waves: &[Vec<f64>; 2], entry: Entry) -> Vec<Vec<f64>> {
    orthonormal(&[], &waves.each_ref().map(|wave| shapes::response(rows, entry, wave)))
}

/// Candidate of one harmonic order, without its columns.
fn harmonic(rows: &ResidualRows, order: u32, waves: &[Vec<f64>; 2], entry: Entry) -> Option<Tested> {
    let columns = harmonic_columns(rows, waves, entry);
    let gain = columns.iter().map(|q| dot(q, &rows.y).powi(2)).sum();
    (columns.len() == 2).then(|| Tested {
        coordinate: Coordinate::Theta,
        entry,
        shape: ShapeKind::Harmonic(order),
        columns: Arc::new([]),
        width: columns.len(),
        gain,
        bic_decrease: 0.0,
        per_row: true,
    })
}

/// Candidates of lines in time: of the residual, and of modulations of the input.
fn lines(rows: &ResidualRows, taken: &[Vec<f64>]) -> Vec<Tested> {
    let n = rows.len();
    let voltage = rows.drive.is_some() && rows.driven == Input::Voltage;
    let mut tried: Vec<(f64, Entry, bool)> = Vec::new();
    for (c, channel) in rows.channels.iter().enumerate() {
        let y = &rows.y[c * n..(c + 1) * n];
        let entry = if rows.drive.is_some() { Entry::Torque } else { Entry::Reading(c) };
        tried.extend(harmonics::frequencies(y, rows.dt_s, PEAKS_PER_SPECTRUM).into_iter().map(|hz| (hz, entry, false)));
        if voltage && channel.channel == Channel::Current {
            let product: Vec<f64> = times(y, &rows.input);
            tried.extend(harmonics::frequencies(&product, rows.dt_s, PEAKS_PER_SPECTRUM).into_iter().map(|hz| (hz, Entry::Voltage, true)));
        }
    }
    tried
        .into_iter()
        .map(|(hz, entry, modulates)| {
            let phase = shapes::map(&rows.t_s, |t| std::f64::consts::TAU * hz * t);
            let waves = [shapes::map(&phase, f64::cos), shapes::map(&phase, f64::sin)];
            let raw: Vec<Vec<f64>> =
                waves.iter().map(|w| shapes::response(rows, entry, &if modulates { times(w, &rows.input) } else { w.clone() })).collect();
            let columns: Arc<[_]> = orthonormal(taken, &raw).into();
            let gain = columns.iter().map(|q| dot(q, &rows.y).powi(2)).sum();
            Tested {
                coordinate: Coordinate::Time,
                entry,
                shape: ShapeKind::Line { frequency_hz: hz },
                width: columns.len(),
                columns,
                gain,
                bic_decrease: 0.0,
                per_row: false,
            }
        })
        .collect()
}
