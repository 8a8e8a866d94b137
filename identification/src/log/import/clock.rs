//! The time of a recording from the clock of its logger: counters that overflow, midnight, a clock that restarts, rows that are written
//! twice.
//!
//! In: the clock of each row, in the unit of the file. Out: time in s that increases from row to row, with the events that were found. What
//! is none of these events, a clock that steps back, is an error.

use crate::log::warning::WordForm;
use crate::statistics::robust::median;

/// Rows of a run before and after a restart; fewer are disorder.
const MIN_RUN_ROWS: usize = 20;
/// Part of a run, from its begin, into which a clock that restarts falls back.
const RESTART_FRACTION: f64 = 0.1;
/// Median steps within which an overflow or midnight must be made good.
const MAX_STEPS_AT_OVERFLOW: f64 = 10.0;
/// Bits of the timers and counters of microcontrollers.
const COUNTER_BITS: [u32; 2] = [16, 32];
/// Seconds of a day.
const DAY_S: f64 = 86_400.0;
/// Median steps between two runs, so that the second is a segment of its own.
const STEPS_BETWEEN_RUNS: f64 = 1000.0;

/// Something that the clock did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ClockEvent {
    /// A counter of this number of bits overflowed before the row (index).
    Overflow(u32, usize),
    /// A time of day passed midnight before the row.
    Midnight(usize),
    /// The clock restarts at the row: another run begins.
    Restart(usize),
}

/// Time of rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Clock {
    /// Time from the first row, in the unit of the file, increasing.
    pub times: Vec<f64>,
    /// Events, in the order of the rows.
    pub events: Vec<ClockEvent>,
}

/// The clock that does not increase: row (index) and the two readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disorder {
    /// The row at which the clock repeats or steps back.
    pub row: usize,
    /// Reading of the row before.
    pub before: f64,
    /// Its reading.
    pub now: f64,
}

impl Clock {
    /// The time of `readings`; `is_time_of_day`: in seconds, of a day.
    ///
    /// # Errors
    /// The clock repeats or steps back.
    pub fn of(readings: &[f64], is_time_of_day: bool) -> Result<Clock, Disorder> {
        let step = median(readings.windows(2).map(|w| w[1] - w[0]).filter(|d| *d > 0.0)).unwrap_or(0.0);
        let is_whole = readings.iter().all(|t| t.fract() == 0.0);
        let first = readings.first().copied().unwrap_or(0.0);
        let (mut times, mut events) = (Vec::with_capacity(readings.len()), Vec::new());
        let (mut offset, mut run_begin) = (-first, 0);
        for (row, &now) in readings.iter().enumerate() {
            let Some(before) = row.checked_sub(1).map(|k| readings[k]) else {
                times.push(0.0);
                continue;
            };
            let change = now - before;
            if change <= 0.0 {
                let made_good = |period: f64| change + period > 0.0 && change + period <= MAX_STEPS_AT_OVERFLOW * step;
                let overflow = COUNTER_BITS.into_iter().find(|bits| is_whole && !is_time_of_day && made_good(2f64.powi(*bits as i32)));
                if let Some(bits) = overflow {
                    offset += 2f64.powi(bits as i32);
                    events.push(ClockEvent::Overflow(bits, row));
                } else if is_time_of_day && made_good(DAY_S) {
                    offset += DAY_S;
                    events.push(ClockEvent::Midnight(row));
                } else if is_restart(readings, run_begin, row) {
                    offset += before - now + STEPS_BETWEEN_RUNS * step;
                    run_begin = row;
                    events.push(ClockEvent::Restart(row));
                } else {
                    return Err(Disorder { row, before, now });
                }
            }
            times.push(now + offset);
        }
        // Rounding may let two times coincide that differ in the file.
        match times.windows(2).position(|w| w[1] <= w[0]) {
            Some(k) => Err(Disorder { row: k + 1, before: readings[k], now: readings[k + 1] }),
            None => Ok(Clock { times, events }),
        }
    }
}

/// The clock falls back to about its reading at the begin of the run, and counts on from there.
fn is_restart(readings: &[f64], begin: usize, row: usize) -> bool {
    let (first, last) = (readings[begin], readings[row - 1]);
    let after = &readings[row..(row + MIN_RUN_ROWS).min(readings.len())];
    row - begin >= MIN_RUN_ROWS
        && after.len() >= MIN_RUN_ROWS
        && after.windows(2).all(|w| w[1] > w[0])
        && readings[row] <= first + RESTART_FRACTION * (last - first)
}

/// Bits of a reading in a word.
const WORD_BITS: [u32; 3] = [8, 16, 32];

/// Continues a counter of 16 or 32 bits over its overflows; the bits and the number of overflows, if there are any.
pub fn continue_counter(counts: &mut [f64]) -> Option<(u32, usize)> {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for count in counts.iter() {
        (low, high) = (low.min(*count), high.max(*count));
        if count.fract() != 0.0 {
            return None;
        }
    }
    let bits = COUNTER_BITS.into_iter().find(|bits| high - low < 2f64.powi(*bits as i32))?;
    let period = 2f64.powi(bits as i32);
    let jumps = |step: f64| (step / period).round();
    let steps = || counts.windows(2).map(|w| w[1] - w[0]);
    // A step of a quarter of the range could be either.
    if steps().any(|d| (d - period * jumps(d)).abs() > 0.25 * period) {
        return None;
    }
    let overflows = steps().filter(|d| jumps(*d) != 0.0).count();
    if overflows == 0 {
        return None;
    }
    let (mut offset, mut before) = (0.0, counts[0]);
    for count in counts.iter_mut() {
        offset -= period * jumps(*count - before);
        before = *count;
        *count += offset;
    }
    Some((bits, overflows))
}

/// Part of half the range of a word below which the steps from row to row must be, when the sign is restored.
const MAX_SIGNED_STEP: f64 = 0.5;
/// Rows with the sign bit set at least: a single one is a disturbed reading.
const MIN_NEGATIVE_ROWS: usize = 3;

/// Restores the sign of readings that were logged as unsigned words; their bits, their form, and the number of negative rows. Nothing where
/// the readings are no such words. A motion is continuous: without the sign it jumps by more than half the range, with it nowhere.
pub fn sign_of_words(words: &mut [f64]) -> Option<(u32, WordForm, usize)> {
    let largest = words.iter().copied().fold(0.0, f64::max);
    let bits = WORD_BITS.into_iter().find(|bits| largest < 2f64.powi(*bits as i32))?;
    let half = 2f64.powi(bits as i32 - 1);
    let negative = words.iter().filter(|v| **v >= half).count();
    if negative < MIN_NEGATIVE_ROWS || words.iter().any(|v| *v < 0.0 || v.fract() != 0.0) {
        return None;
    }
    let largest_step = |value: &dyn Fn(f64) -> f64| words.windows(2).map(|w| (value(w[1]) - value(w[0])).abs()).fold(0.0, f64::max);
    let signed = |form: WordForm| {
        move |v: f64| match form {
            _ if v < half => v,
            WordForm::TwosComplement => v - 2.0 * half,
            WordForm::SignAndMagnitude => half - v,
        }
    };
    let steps = [WordForm::TwosComplement, WordForm::SignAndMagnitude].map(|form| (form, largest_step(&signed(form))));
    let (form, least) = if steps[0].1 <= steps[1].1 { steps[0] } else { steps[1] };
    if largest_step(&|v| v) < half || least > MAX_SIGNED_STEP * half {
        return None;
    }
    words.iter_mut().for_each(|v| *v = signed(form)(*v));
    Some((bits, form, negative))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sign_of_words_is_restored() {
        let rate: Vec<f64> = (0..2000).map(|k| (9000.0 * (f64::from(k) * 0.01).sin()).round()).collect();
        let negative = rate.iter().filter(|v| **v < 0.0).count();
        let mut complement: Vec<f64> = rate.iter().map(|v| v.rem_euclid(65_536.0)).collect();
        assert_eq!(sign_of_words(&mut complement), Some((16, WordForm::TwosComplement, negative)));
        assert_eq!(complement, rate);
        let mut magnitude: Vec<f64> = rate.iter().map(|v| if *v < 0.0 { 32_768.0 - v } else { *v }).collect();
        assert_eq!(sign_of_words(&mut magnitude), Some((16, WordForm::SignAndMagnitude, negative)));
        assert_eq!(magnitude, rate);
        // A rate that is one-sided, or that already has its sign, stays.
        for mut other in [rate.iter().map(|v| v + 40_000.0).collect::<Vec<_>>(), rate.clone()] {
            let before = other.clone();
            assert_eq!(sign_of_words(&mut other), None);
            assert_eq!(other, before);
        }
    }

    fn even(from: f64, n: usize) -> impl Iterator<Item = f64> {
        (0..n).map(move |k| from + k as f64)
    }

    #[test]
    fn overflow_of_a_timer_is_made_good() {
        for bits in COUNTER_BITS {
            let period = 2f64.powi(bits as i32);
            let t: Vec<f64> = even(period - 50.0, 100).map(|t| t.rem_euclid(period)).collect();
            let clock = Clock::of(&t, false).expect("a clock");
            assert_eq!((clock.times.last(), clock.events.as_slice()), (Some(&99.0), &[ClockEvent::Overflow(bits, 50)][..]));
        }
    }

    #[test]
    fn midnight_passes() {
        let t: Vec<f64> = (0..100).map(|k| (86_399.5 + 0.01 * f64::from(k)) % 86_400.0).collect();
        let clock = Clock::of(&t, true).expect("a clock");
        assert_eq!(clock.events, [ClockEvent::Midnight(50)]);
        assert!((clock.times[99] - 0.99).abs() < 1e-9);
        // Times that are no time of day begin another run there.
        assert_eq!(Clock::of(&t, false).expect("a clock").events, [ClockEvent::Restart(50)]);
    }

    #[test]
    fn restart_begins_another_run_and_disorder_is_an_error() {
        let t: Vec<f64> = even(0.0, 100).chain(even(3.0, 100)).collect();
        let clock = Clock::of(&t, false).expect("a clock");
        assert_eq!(clock.events, [ClockEvent::Restart(100)]);
        assert!((clock.times[100] - clock.times[99] - 1000.0).abs() < 1e-9);
        let middle: Vec<f64> = even(0.0, 100).chain(even(50.0, 100)).collect();
        assert_eq!(Clock::of(&middle, false), Err(Disorder { row: 100, before: 99.0, now: 50.0 }));
        let single: Vec<f64> = even(0.0, 100).chain([20.0]).chain(even(101.0, 100)).collect();
        assert_eq!(Clock::of(&single, false).map(|c| c.events), Err(Disorder { row: 100, before: 99.0, now: 20.0 }));
        let repeated: Vec<f64> = even(0.0, 50).chain(even(49.0, 50)).collect();
        assert!(Clock::of(&repeated, false).is_err());
    }

    #[test]
    fn counter_of_an_encoder_is_continued() {
        let angle: Vec<f64> = (0..4000).map(|k| (2e5 * (f64::from(k) * 2e-3).sin()).round()).collect();
        let mut counts: Vec<f64> = angle.iter().map(|a| (a + 32_768.0).rem_euclid(65_536.0) - 32_768.0).collect();
        let (bits, overflows) = continue_counter(&mut counts).expect("overflows");
        assert!(bits == 16 && overflows >= 10, "{overflows}");
        assert_eq!(counts, angle);
        let mut slow: Vec<f64> = (0..100).map(f64::from).collect();
        assert_eq!(continue_counter(&mut slow), None);
    }
}
