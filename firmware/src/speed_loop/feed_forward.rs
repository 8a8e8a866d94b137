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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compensation::Harmonics;

    const HARMONIC: Harmonic = Harmonic { order: 7, torque_N_m: 2e-3, phase_rad: -0.4 };

    fn learnt() -> (Learnt, u32, i32) {
        let hardware = Hardware::default();
        let compensation = Compensation { coulomb_N_m: 9e-4, harmonics: Harmonics::of([HARMONIC]).unwrap(), ..Compensation::default() };
        let (angle_per_count, lost) = units(&hardware);
        (Learnt::new(&compensation, &hardware, 2.32, 0.0234), angle_per_count, lost)
    }

    #[test]
    fn what_is_learnt_passes_the_mailbox_unchanged() {
        let (learnt, ..) = learnt();
        assert_eq!(Learnt::from_words(&learnt.to_words()), learnt);
    }

    #[test]
    fn the_duty_is_the_opposite_of_the_torque_at_the_angle_that_it_will_meet() {
        let (learnt, angle_per_count, lost) = learnt();
        // 0.238 mH over 2.32 Ω, in ticks of 0.1 ms.
        let (lead_ticks, rate) = (1.5 + 2.38 / 2.32, 4.0_f32);
        for counts in (-19_000..19_000).step_by(313) {
            let mut forward = FeedForward::new(learnt);
            forward.from_index.take(0, EncoderCount(0), Some(EncoderCount(0)), lost);
            forward.share = 1.0;
            forward.from_index.counts = counts;
            // No command: the friction is silent.
            let duty = f64::from(forward.duty(0.0, rate, angle_per_count));
            let theta = (f64::from(counts) + 0.5 + f64::from(rate) * lead_ticks) / 20_000.0 * TAU;
            let wanted = -2e-3 * 2.32 / 0.0234 / (12.0 / 4500.0) * libm::sin(7.0 * theta - 0.4);
            // micromath's sine is good to 2e-3 of the amplitude of 74 counts.
            assert!((duty - wanted).abs() < 0.15, "{counts}: {duty} {wanted}");
        }
    }

    #[test]
    fn harmonics_wait_for_the_index_come_in_slowly_and_go_out_where_it_is_lost() {
        let (learnt, angle_per_count, lost) = learnt();
        let mut forward = FeedForward::new(learnt);
        assert_eq!(forward.duty(0.0, 0.0, angle_per_count), 0.0);
        assert!(forward.compensating(true).contains(Compensating::WAITS_FOR_INDEX));
        forward.from_index.take(0, EncoderCount(100), Some(EncoderCount(90)), lost);
        let first = forward.duty(0.0, 0.0, angle_per_count).abs();
        assert!(first > 0.0 && first < 0.1, "a thousandth of 74 counts: {first}");
        assert_eq!(forward.compensating(true).0 & !Compensating::FRICTION.0, Compensating::INDEX.0 | Compensating::HARMONICS.0);
        for _ in 0..2_498 {
            forward.from_index.take(10, EncoderCount(0), None, lost);
        }
        assert!(forward.from_index.seen, "10 + 24 980 counts are less than a turn and a quarter");
        forward.from_index.take(10, EncoderCount(0), None, lost);
        assert!(!forward.from_index.seen);
        assert!(forward.compensating(false).contains(Compensating::WAITS_FOR_INDEX));
    }

    #[test]
    fn dry_friction_follows_the_command_and_is_nothing_at_rest() {
        let (learnt, angle_per_count, _) = learnt();
        let whole = 9e-4 * 2.32 / 0.0234 / (12.0 / 4500.0);
        let duty = |rad_s: f64| {
            let counts_tick = rad_s / TAU * 20_000.0 / 1e4;
            f64::from(FeedForward::new(learnt).duty(counts_tick as f32, 0.0, angle_per_count))
        };
        for (rad_s, share) in [(0.0, 0.0), (0.01, 0.5), (0.02, 1.0), (5.0, 1.0), (-0.01, -0.5), (-5.0, -1.0)] {
            assert!((duty(rad_s) - share * whole).abs() < 1e-3, "{rad_s}: {}", duty(rad_s));
        }
    }
}
