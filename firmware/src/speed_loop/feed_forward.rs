//! The learnt compensation in the tick: friction by the command, harmonics by the angle from the index.
//!
//! In: the commanded rate, the estimated rate, the encoder and what its index captured. Out: compare counts that are added to what the
//! regulator asks. Torque becomes duty through R/K. The angle is the one that the torque will meet: the count is read half a count low on
//! the mean, the duty acts on the mean one and a half ticks after the reading, and the winding is L/R late. At 720 °/s and order 14,
//! those 0.25 ms are 0.045 rad: without the lead a twentieth of the harmonic would stay.
//!
//! Harmonics act once the index was seen, and come in over a tenth of a second, so that the voltage does not jump. If the index fails to
//! come for more than a turn (a wire off), they go out again, and a status says so.

use crate::board::{CONTROL_HZ, EncoderCount, Hardware};
use crate::compensation::{Compensation, Harmonic, MOST_HARMONICS};
use crate::mailbox::Words;
use core::f64::consts::TAU;

/// One turn, in units of the angle.
const TURN: f64 = 4_294_967_296.0;
/// From reading an angle to the middle of the tick in which the answer acts, ticks.
const READ_TO_ACT_TICKS: f64 = 1.5;
/// What the harmonics' share gains in a tick: from nothing to all in 0.1 s.
const COMING_IN: f32 = 1e-3;

/// What of the compensation is at work; a set of flags.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Compensating(pub u8);

impl Compensating {
    /// The index was seen: the angle has a zero.
    pub const INDEX: Self = Self(1);
    /// Friction is fed forward.
    pub const FRICTION: Self = Self(2);
    /// Harmonics are fed forward.
    pub const HARMONICS: Self = Self(4);
    /// There are harmonics, and they wait for the index.
    pub const WAITS_FOR_INDEX: Self = Self(8);

    /// Whether all of `other` are set.
    pub fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }
}

/// One harmonic in the tick's units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Wave {
    /// Periods per turn; 0: none here.
    order: u32,
    /// Phase at the index, 2⁻³² turn.
    phase: u32,
    /// Amplitude, compare counts.
    duty: f32,
}

impl Wave {
    fn of(harmonic: &Harmonic, duty_per_torque: f64) -> Self {
        let turns = harmonic.phase_rad / TAU;
        let phase = ((turns - libm::floor(turns)) * TURN) as u64 as u32;
        Self { order: u32::from(harmonic.order), phase, duty: (harmonic.torque_N_m * duty_per_torque) as f32 }
    }
}

/// A [`Compensation`] in the tick's units; what the tasks post to the interrupt when something was learnt.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Learnt {
    /// Dry friction, compare counts.
    coulomb: f32,
    /// 1 / the rate of its fade, ticks per count.
    fade: f32,
    /// Viscous friction, compare counts per (count per tick).
    viscous: f32,
    /// From reading to torque, ticks.
    lead: f32,
    waves: [Wave; MOST_HARMONICS],
}

impl Learnt {
    /// `compensation`, which was checked, for a drive of this resistance and constant.
    pub(super) fn new(compensation: &Compensation, hardware: &Hardware, resistance_ohm: f64, motor_constant_N_m_A: f64) -> Self {
        let hz = CONTROL_HZ as f64;
        let rad_s_per_count_tick = hardware.rad_per_count() * hz;
        let duty_per_torque = resistance_ohm / motor_constant_N_m_A / hardware.volt_per_duty();
        let mut waves = [Wave::default(); MOST_HARMONICS];
        for (wave, harmonic) in waves.iter_mut().zip(compensation.harmonics.as_slice()) {
            *wave = Wave::of(harmonic, duty_per_torque);
        }
        Self {
            coulomb: (compensation.coulomb_N_m * duty_per_torque) as f32,
            fade: (rad_s_per_count_tick / compensation.coulomb_fade_rad_s) as f32,
            viscous: (compensation.viscous_N_m_s * rad_s_per_count_tick * duty_per_torque) as f32,
            lead: (READ_TO_ACT_TICKS + compensation.winding_lag_s * hz) as f32,
            waves,
        }
    }
}

/// Words of a [`Learnt`].
pub const LEARNT_WORDS: usize = 4 + 3 * MOST_HARMONICS;

impl Words<LEARNT_WORDS> for Learnt {
    fn to_words(&self) -> [u32; LEARNT_WORDS] {
        let mut words = [0; LEARNT_WORDS];
        let head = [self.coulomb, self.fade, self.viscous, self.lead].map(f32::to_bits);
        let waves = self.waves.iter().flat_map(|w| [w.order, w.phase, w.duty.to_bits()]);
        for (word, value) in words.iter_mut().zip(head.into_iter().chain(waves)) {
            *word = value;
        }
        words
    }

    fn from_words(words: &[u32; LEARNT_WORDS]) -> Self {
        let [coulomb, fade, viscous, lead, rest @ ..] = words;
        let [coulomb, fade, viscous, lead] = [coulomb, fade, viscous, lead].map(|bits| f32::from_bits(*bits));
        let mut waves = [Wave::default(); MOST_HARMONICS];
        for (wave, three) in waves.iter_mut().zip(rest.chunks_exact(3)) {
            if let [order, phase, duty] = three {
                *wave = Wave { order: *order, phase: *phase, duty: f32::from_bits(*duty) };
            }
        }
        Self { coulomb, fade, viscous, lead, waves }
    }
}

/// The angle from the index, by counting on from its last pulse.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct FromIndex {
    counts: i32,
    seen: bool,
}

impl FromIndex {
    /// One tick further: `step` counts have come, and perhaps the index.
    #[inline]
    pub fn take(&mut self, step: i16, encoder: EncoderCount, index: Option<EncoderCount>, lost_counts: i32) {
        match index {
            Some(at) => *self = Self { counts: i32::from(encoder.since(at)), seen: true },
            None => {
                self.counts = self.counts.wrapping_add(i32::from(step));
                // More than a turn without a pulse: it is not the index that was seen, or its wire is off.
                self.seen &= self.counts < lost_counts && self.counts > lost_counts.wrapping_neg();
            }
        }
    }
}

/// What is learnt, and how much of it is in.
#[derive(Clone, Copy, Debug)]
pub(super) struct FeedForward {
    pub learnt: Learnt,
    pub from_index: FromIndex,
    /// Share of the harmonics that has come in, 0 … 1.
    share: f32,
}

impl FeedForward {
    pub fn new(learnt: Learnt) -> Self {
        Self { learnt, from_index: FromIndex::default(), share: 0.0 }
    }

    /// Lets the harmonics come in anew.
    #[inline]
    pub fn restart(&mut self) {
        self.share = 0.0;
    }

    /// Compare counts to add; rates in counts per tick, `angle_per_count` in 2⁻³² turn.
    #[inline]
    pub fn duty(&mut self, command: f32, rate: f32, angle_per_count: u32) -> f32 {
        let learnt = &self.learnt;
        let mut duty = learnt.coulomb * (command * learnt.fade).clamp(-1.0, 1.0) + learnt.viscous * command;
        self.share = if self.from_index.seen { (self.share + COMING_IN).min(1.0) } else { (self.share - COMING_IN).max(0.0) };
        // At nothing the angle may have no zero yet: nothing is computed from it.
        if self.share > 0.0 {
            let ahead = (0.5 + rate * learnt.lead) * angle_per_count as f32;
            let angle = (self.from_index.counts as u32).wrapping_mul(angle_per_count).wrapping_add(ahead as i32 as u32);
            for wave in &learnt.waves {
                if wave.order == 0 {
                    break;
                }
                duty -= self.share * wave.duty * sine(angle.wrapping_mul(wave.order).wrapping_add(wave.phase));
            }
        }
        duty
    }

    /// What is at work while a rate is held.
    #[inline]
    pub fn compensating(&self, in_rate_mode: bool) -> Compensating {
        let [first, ..] = &self.learnt.waves;
        let mut flags = u8::from(self.from_index.seen);
        if in_rate_mode && (self.learnt.coulomb != 0.0 || self.learnt.viscous != 0.0) {
            flags |= Compensating::FRICTION.0;
        }
        if first.order != 0 {
            flags |= match (self.share > 0.0, self.from_index.seen) {
                (true, _) if in_rate_mode => Compensating::HARMONICS.0,
                (_, false) => Compensating::WAITS_FOR_INDEX.0,
                _ => 0,
            };
        }
        Compensating(flags)
    }
}

/// Sine of a phase in 2⁻³² turn, to 1e-3 of an amplitude: what the compensation leaves of a harmonic by that is a thousandth.
#[inline]
fn sine(phase: u32) -> f32 {
    let angle = (phase as i32) as f32 * (core::f32::consts::PI / 2_147_483_648.0);
    // By its full name: where the standard library is, `angle.sin()` would be another sine.
    micromath::F32Ext::sin(angle)
}

/// Units of the angle in one encoder count, 2⁻³² turn, and the counts without an index after which it is lost.
pub(super) fn units(hardware: &Hardware) -> (u32, i32) {
    (libm::round(TURN / hardware.counts_per_turn) as u32, (1.25 * hardware.counts_per_turn) as i32)
}
