//! The search: which shape over which coordinate makes most of the misfit in all channels together; then which of what remains.
//!
//! Each round takes the family that lowers n ln(sum of squares) + k ln n most, if it is seen against the colour of what remains, and takes it
//! out of the residual. So a coordinate that only goes along with one found before has nothing left to account for and is not listed.

use drive_model::Coordinate;

use super::harmonics;
use super::rows::Rows;
use super::shapes::{self, Acts, Family, Kind, times};
use super::significance::{self, dot, less, orthonormal};
use crate::identify::fit::FitResult;
use crate::model::{Channel, Input};
use crate::statistics::Extremes;

/// Rows are gathered into blocks of this length, s, where the shape is slow enough.
const BLOCK_S: f64 = 0.020;
/// Rounds at most.
const ROUNDS: usize = 8;
/// Families that are tried in a round, the best first, until one is seen.
const TRIES: usize = 4;
/// Probability at which a failure is listed, over all that was tried.
pub const SEEN_LOG10: f64 = -3.0;
/// A part of the misfit below this tells nobody anything.
const TELLING: f64 = 0.01;
/// What makes at least this part of what the best makes does as well.
const AS_WELL: f64 = 0.97;

/// What was found in one channel.
#[derive(Debug, Clone)]
pub struct InChannel {
    /// The channel.
    pub channel: Channel,
    /// Part of its residual's variance; below 0 where another channel's gain is this one's loss.
    pub share: f64,
    /// log10 of the probability, over all that was tried.
    pub log10_p: f64,
}

/// One finding: a family, and what it makes in each channel.
#[derive(Debug, Clone)]
pub struct Found {
    /// Over what.
    pub coordinate: Coordinate,
    /// How it acts.
    pub acts: Acts,
    /// Which shape.
    pub kind: Kind,
    /// The channel that is read, where it is a reading's error.
    pub reads: Option<Channel>,
    /// The motion is prescribed: what the model needs is compared row by row, so that a torque and a reading look the same.
    pub prescribed: bool,
    /// Sum of squares that it takes out of all channels, in units of the noise.
    pub gain: f64,
    /// In each channel.
    pub channels: Vec<InChannel>,
}

/// A family ready to be tried: columns orthonormal to what is taken.
struct Tried {
    coordinate: Coordinate,
    acts: Acts,
    kind: Kind,
    columns: Vec<Vec<f64>>,
    gain: f64,
    merit: f64,
    /// Its columns are in rows, not in blocks.
    fine: bool,
}

/// Looks for all that the residual shows.
pub fn search(mut full: Rows, held: &FitResult) -> Vec<Found> {
    let per_block = ((BLOCK_S / full.dt_s).round() as usize).max(1);
    let starts = full.block_starts(per_block);
    let mut coarse = full.blocks(&starts, per_block);
    let mut taken = orthonormal(&[], &shapes::taken(&coarse, held));
    let mut families = shapes::families(&coarse);
    for family in &mut families {
        family.columns = orthonormal(&taken, &family.columns);
    }
    let mut found: Vec<Found> = Vec::new();
    let at_first = dot(&full.y, &full.y);
    for _ in 0..ROUNDS {
        let mut tried: Vec<Tried> = families.iter().map(|f| of_family(f, &coarse)).collect();
        let periodic = periods(&full, &coarse, &taken);
        let tests = (families.len() + periodic.0) as f64;
        tried.extend(periodic.1);
        let power = dot(&full.y, &full.y);
        for t in &mut tried {
            let n = full.len() as f64 * full.channels.len() as f64;
            let choices = match t.kind {
                Kind::Order(_) | Kind::Line(_) => 2.0 * (periodic.0 as f64).max(1.0).ln(),
                Kind::Step(_) => 2.0 * 32f64.ln(),
                _ => 0.0,
            };
            t.merit = -n * (1.0 - t.gain / power).max(1e-9).ln() - t.columns.len() as f64 * n.ln() - choices;
        }
        tried.sort_by(|a, b| b.merit.total_cmp(&a.merit));
        simplest_first(&mut tried);
        let mut seen = None;
        for t in tried
            .into_iter()
            .take(TRIES)
            .filter(|t| t.merit > 0.0 && t.gain > TELLING * (at_first - found.iter().map(|f| f.gain).sum::<f64>()).max(0.0))
        {
            let rows = if t.fine { &full } else { &coarse };
            let verdict = significance::test(&t.columns, &rows.y, rows.len());
            if verdict.log10_p + tests.log10() < SEEN_LOG10 {
                seen = Some((t, tests));
                break;
            }
        }
        let Some((t, tests)) = seen else { break };
        let rows = if t.fine { &full } else { &coarse };
        let channels = in_channels(&t, rows, tests);
        let reads = match t.acts {
            Acts::Reading(c) => rows.channels.get(c).map(|c| c.channel),
            _ => None,
        };
        found.push(Found {
            coordinate: t.coordinate,
            acts: t.acts,
            kind: t.kind,
            reads,
            prescribed: rows.driven == Input::Motion,
            gain: t.gain,
            channels,
        });
        take_out(&t, &mut full, &coarse, &starts);
        coarse.y = full.blocks(&starts, per_block).y;
        if !t.fine {
            for family in &mut families {
                family.columns = orthonormal(&t.columns, &family.columns);
            }
            taken.extend(t.columns);
        }
    }
    found
}

fn of_family(family: &Family, rows: &Rows) -> Tried {
    let gain = family.columns.iter().map(|q| dot(q, &rows.y).powi(2)).sum();
    let columns = family.columns.clone();
    Tried { coordinate: family.coordinate, acts: family.acts, kind: family.kind, columns, gain, merit: 0.0, fine: false }
}

/// Of those that do as well as the first, puts the one with fewest shapes in front; and a temperature before time, which goes along with
/// everything slow.
fn simplest_first(tried: &mut [Tried]) {
    let Some(best) = tried.first() else { return };
    let (enough, slow) = (AS_WELL * best.gain, best.coordinate == Coordinate::Time && !matches!(best.kind, Kind::Line(_)));
    let does = |t: &&(usize, &Tried)| t.1.gain >= enough && t.1.merit > 0.0;
    let all: Vec<(usize, &Tried)> = tried.iter().enumerate().collect();
    let warm = all.iter().filter(does).find(|t| slow && t.1.coordinate == Coordinate::Temperature);
    let simplest = all.iter().filter(does).min_by_key(|t| t.1.columns.len());
    if let Some(k) = warm.or(simplest).map(|t| t.0) {
        tried[..=k].rotate_right(1);
    }
}

/// Takes what was found out of the residual.
fn take_out(t: &Tried, full: &mut Rows, coarse: &Rows, starts: &[usize]) {
    let n = full.len();
    for q in &t.columns {
        if t.fine {
            let z = dot(q, &full.y);
            less(&mut full.y, z, q);
            continue;
        }
        let z = dot(q, &coarse.y);
        let blocks = coarse.len();
        for c in 0..full.channels.len() {
            for (b, &start) in starts.iter().enumerate() {
                let end = starts.get(b + 1).copied().unwrap_or(n);
                let at = c * blocks + b;
                let seen = coarse.mask[at];
                if seen > 0.0 {
                    let value = z * q[at] / seen;
                    for row in c * n + start..c * n + end {
                        full.y[row] -= value * full.mask[row];
                    }
                }
            }
        }
    }
}

/// What a finding makes of each channel by itself.
fn in_channels(t: &Tried, rows: &Rows, tests: f64) -> Vec<InChannel> {
    let n = rows.len();
    let mut after = rows.y.clone();
    for q in &t.columns {
        let z = dot(q, &rows.y);
        less(&mut after, z, q);
    }
    let mut list = Vec::new();
    for (c, channel) in rows.channels.iter().enumerate() {
        let part = c * n..(c + 1) * n;
        let own: Vec<Vec<f64>> = t.columns.iter().map(|q| q[part.clone()].to_vec()).collect();
        let largest = own.iter().map(|q| dot(q, q)).max_or_zero();
        // A channel that the shape hardly reaches is not asked.
        let own: Vec<Vec<f64>> = own.into_iter().filter(|q| dot(q, q) > 1e-6 * largest && largest > 1e-6).collect();
        let y = &rows.y[part.clone()];
        let verdict = significance::test(&orthonormal(&[], &own), y, n);
        let gain = dot(y, y) - dot(&after[part.clone()], &after[part]);
        let share = (gain - verdict.by_chance) / channel.power.max(f64::MIN_POSITIVE);
        let log10_p = (verdict.log10_p + tests.log10()).min(0.0);
        list.push(InChannel { channel: channel.channel, share, log10_p });
    }
    list
}

/// Peaks of each spectrum that are tried.
const PEAKS: usize = 2;
/// Orders that are tried in every way.
const ORDERS: usize = 3;

/// Orders and lines that stand out, ready to be tried; and how many were looked at.
fn periods(full: &Rows, coarse: &Rows, taken: &[Vec<f64>]) -> (usize, Vec<Tried>) {
    let mut list = Vec::new();
    let mut looked = 0;
    let n = full.len();
    if full.theta.len() == n && full.omega.len() == n {
        let highest = highest(full);
        let mut orders: Vec<(u32, f64)> = Vec::new();
        for c in 0..full.channels.len() {
            for weight in weights(full) {
                let s = harmonics::spectrum(&full.theta, &full.y[c * n..(c + 1) * n], weight, highest);
                looked += s.share.len();
                for (order, share) in harmonics::peaks(&s, PEAKS) {
                    // In units of the noise, so that channels can be set side by side.
                    let gain = share * dot(&full.y[c * n..(c + 1) * n], &full.y[c * n..(c + 1) * n]);
                    match orders.iter_mut().find(|o| o.0 == order) {
                        Some(o) => o.1 = o.1.max(gain),
                        None => orders.push((order, gain)),
                    }
                }
            }
        }
        orders.sort_by(|a, b| b.1.total_cmp(&a.1));
        for &(order, _) in orders.iter().take(ORDERS) {
            for acts in ways(full) {
                list.extend(an_order(full, order, acts));
            }
        }
    }
    if coarse.drive.is_some() || coarse.channels.len() == 1 {
        looked += coarse.len() / 2;
        list.extend(lines(coarse, taken));
    }
    (looked, list)
}

/// Highest order that is looked for in these rows.
pub fn highest(full: &Rows) -> usize {
    let rms = (dot(&full.omega, &full.omega) / full.len().max(1) as f64).sqrt();
    harmonics::resolved(rms, full.dt_s)
}

/// How an order's amplitude may go with the rate and the current.
pub fn weights(rows: &Rows) -> Vec<Box<dyn Fn(usize) -> f64 + '_>> {
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

/// The ways in which an order may enter.
fn ways(rows: &Rows) -> Vec<Acts> {
    let mut list: Vec<Acts> = Vec::new();
    if rows.drive.is_some() {
        list.push(Acts::Torque);
        if rows.current.len() == rows.len() {
            list.push(Acts::Constant);
        }
    }
    list.extend((0..rows.channels.len()).filter(|c| rows.channels[*c].channel != Channel::Angle).map(Acts::Reading));
    if rows.channel(Channel::Angle).is_some() {
        list.extend(rows.channel(Channel::Angle).map(Acts::Reading));
        if rows.channel(Channel::Rate).is_some() {
            list.push(Acts::Encoder);
        }
    }
    list
}

fn an_order(rows: &Rows, order: u32, acts: Acts) -> Option<Tried> {
    let angle = shapes::of(&rows.theta, |x| x * f64::from(order));
    let waves = [shapes::of(&angle, f64::cos), shapes::of(&angle, f64::sin)];
    let raw: Vec<Vec<f64>> = waves.iter().map(|w| shapes::response(rows, acts, w)).collect();
    let columns = orthonormal(&[], &raw);
    let gain = columns.iter().map(|q| dot(q, &rows.y).powi(2)).sum();
    (columns.len() == 2).then_some(Tried {
        coordinate: Coordinate::Theta,
        acts,
        kind: Kind::Order(order),
        columns,
        gain,
        merit: 0.0,
        fine: true,
    })
}

/// Lines in time: of the residual, and of what modulates the input.
fn lines(rows: &Rows, taken: &[Vec<f64>]) -> Vec<Tried> {
    let n = rows.len();
    let voltage = rows.drive.is_some() && rows.driven == Input::Voltage;
    let mut tried: Vec<(f64, Acts, bool)> = Vec::new();
    for (c, channel) in rows.channels.iter().enumerate() {
        let y = &rows.y[c * n..(c + 1) * n];
        let acts = if rows.drive.is_some() { Acts::Torque } else { Acts::Reading(c) };
        tried.extend(harmonics::frequencies(y, rows.dt_s, PEAKS).into_iter().map(|hz| (hz, acts, false)));
        if voltage && channel.channel == Channel::Current {
            let product: Vec<f64> = times(y, &rows.input);
            tried.extend(harmonics::frequencies(&product, rows.dt_s, PEAKS).into_iter().map(|hz| (hz, Acts::Voltage, true)));
        }
    }
    tried
        .into_iter()
        .map(|(hz, acts, modulates)| {
            let phase = shapes::of(&rows.t_s, |t| std::f64::consts::TAU * hz * t);
            let waves = [shapes::of(&phase, f64::cos), shapes::of(&phase, f64::sin)];
            let raw: Vec<Vec<f64>> =
                waves.iter().map(|w| shapes::response(rows, acts, &if modulates { times(w, &rows.input) } else { w.clone() })).collect();
            let columns = orthonormal(taken, &raw);
            let gain = columns.iter().map(|q| dot(q, &rows.y).powi(2)).sum();
            Tried { coordinate: Coordinate::Time, acts, kind: Kind::Line(hz), columns, gain, merit: 0.0, fine: false }
        })
        .collect()
}
