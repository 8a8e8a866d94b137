//! The learnt compensation in the tick: friction by the command, harmonics by the angle from the index.
//!
//! In: the commanded rate, the estimated rate, the encoder and what its index captured. Out: compare counts that are added to what the
//! regulator asks. Torque becomes duty through R/K. The angle is the one that the torque will meet: the duty acts on the mean in the
//! middle of its two ticks, and the winding is L/R late. At 720 °/s and order 14, those 0.2 ms are 0.04 rad.
//!
//! Harmonics act once the index was seen, and come in over a tenth of a second, so that the voltage does not jump. If the index fails to
//! come for more than a turn (a wire off), they go out again, and a status says so.

use crate::board::{CONTROL_HZ, Hardware};
use crate::compensation::{Compensation, HIGHEST_ORDER, Harmonic, MOST_HARMONICS};
use crate::mailbox::Words;
use core::f64::consts::TAU;

/// One turn, in units of the angle.
const TURN: f64 = 4_294_967_296.0;
/// Half of it.
const HALF_TURN: f32 = 2_147_483_648.0;
/// From the tick from which on a duty acts to the middle of its time, in which it acts on the mean.
const TO_THE_MIDDLE_TICKS: f64 = 0.5 * super::BEAT as f64;
/// What the harmonics' share gains in a millisecond: from nothing to all in 0.1 s.
const COMING_IN: f32 = 0.01;
/// A radian and a half in ten ticks, 2⁻³² turn per tick.
const FASTEST: f32 = 0.15 / core::f32::consts::TAU * 4_294_967_296.0;
/// What makes a half wave of the first parabola.
const ROUGH: f32 = 4.0 / HALF_TURN / HALF_TURN;
/// Harmonics that are worked out in the first of two slots.
const EARLY: usize = 7;
/// Added to a float below 2²², it leaves the nearest whole number in the low bits.
const ROUND: f32 = 12_582_912.0;

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

/// A [`Compensation`] in the tick's units; what the tasks post to the interrupt when something was learnt.
///
/// As words, so that it comes out of its mailbox in the place where it is used: four of friction and winding, then three for each harmonic.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Learnt([u32; LEARNT_WORDS]);

impl Default for Learnt {
    fn default() -> Self {
        Self([0; LEARNT_WORDS])
    }
}

/// Words of a [`Learnt`].
pub const LEARNT_WORDS: usize = 4 + 3 * MOST_HARMONICS;

impl Learnt {
    /// `compensation`, which was checked, for a drive of this resistance and constant.
    pub(super) fn new(compensation: &Compensation, hardware: &Hardware, resistance_ohm: f64, motor_constant_N_m_A: f64) -> Self {
        let hz = CONTROL_HZ as f64;
        let rad_s_per_count_tick = hardware.rad_per_count() * hz;
        let duty_per_torque = resistance_ohm / motor_constant_N_m_A / hardware.volt_per_duty();
        let mut words = [0; LEARNT_WORDS];
        let [coulomb, fade, viscous, lead, waves @ ..] = &mut words;
        *coulomb = ((compensation.coulomb_N_m * duty_per_torque) as f32).to_bits();
        *fade = ((rad_s_per_count_tick / compensation.coulomb_fade_rad_s) as f32).to_bits();
        *viscous = ((compensation.viscous_N_m_s * rad_s_per_count_tick * duty_per_torque) as f32).to_bits();
        *lead = ((TO_THE_MIDDLE_TICKS + compensation.winding_lag_s * hz) as f32).to_bits();
        for (wave, harmonic) in waves.as_chunks_mut::<3>().0.iter_mut().zip(compensation.harmonics.as_slice()) {
            *wave = wave_of(harmonic, duty_per_torque);
        }
        Self(words)
    }

    /// Dry friction, compare counts.
    #[inline]
    fn coulomb(&self) -> f32 {
        f32::from_bits(self.0[0])
    }

    /// 1 / the rate of its fade, ticks per count.
    #[inline]
    fn fade(&self) -> f32 {
        f32::from_bits(self.0[1])
    }

    /// Viscous friction, compare counts per (count per tick).
    #[inline]
    fn viscous(&self) -> f32 {
        f32::from_bits(self.0[2])
    }

    /// From the tick from which on it acts to its torque, ticks.
    #[inline]
    fn lead(&self) -> f32 {
        f32::from_bits(self.0[3])
    }

    /// The harmonics: periods per turn, 0 from the first that is none on; phase at the index, 2⁻³² turn; amplitude, compare counts as bits of an `f32`.
    #[inline]
    fn waves(&self) -> &[[u32; 3]] {
        let [_, _, _, _, waves @ ..] = &self.0;
        waves.as_chunks().0
    }

    /// Whether any friction and any harmonic is learnt. Zero has two signs.
    #[inline]
    fn offers(&self) -> u8 {
        let friction = if (self.0[0] | self.0[2]) << 1 != 0 { Compensating::FRICTION.0 } else { 0 };
        let harmonics = if self.0[4] != 0 { Compensating::HARMONICS.0 } else { 0 };
        friction | harmonics
    }
}

/// One harmonic in the tick's units: see [`Learnt::waves`].
fn wave_of(harmonic: &Harmonic, duty_per_torque: f64) -> [u32; 3] {
    let turns = harmonic.phase_rad / TAU;
    let phase = crate::maths::to_u64((turns - crate::maths::floor(turns)) * TURN) as u32;
    [u32::from(harmonic.order), phase, ((harmonic.torque_N_m * duty_per_torque) as f32).to_bits()]
}

impl Words<LEARNT_WORDS> for Learnt {
    fn to_words(&self) -> [u32; LEARNT_WORDS] {
        self.0
    }

    fn from_words(words: &[u32; LEARNT_WORDS]) -> Self {
        Self(*words)
    }
}

/// The angle from the index, by counting on from its last pulse.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct FromIndex {
    /// The unwrapped counter at the index, as it was last seen.
    pub at: i32,
    pub seen: bool,
}

impl FromIndex {
    /// The index has come; the counter is at `counts`, `since` counts further.
    #[inline]
    pub fn see(&mut self, counts: i32, since: i16) {
        *self = Self { at: counts.wrapping_sub(i32::from(since)), seen: true };
    }

    /// Counts from the index.
    #[inline]
    pub fn counts(&self, counts: i32) -> i32 {
        counts.wrapping_sub(self.at)
    }

    /// More than a turn without a pulse: it is not the index that was seen, or its wire is off.
    #[inline]
    pub fn check(&mut self, counts: i32, lost_counts: i32) {
        let from = self.counts(counts);
        self.seen &= from < lost_counts && from > lost_counts.wrapping_neg();
    }
}

/// What is learnt, and how much of it is in.
///
/// The harmonics are worked out for the beginnings of the milliseconds, a millisecond ahead, in two ticks of it, and go straight
/// between: at order 14 and 720 °/s that is off by 4·10⁻³ of an amplitude.
#[derive(Clone, Copy, Debug)]
pub(super) struct FeedForward {
    /// What acts, and the room into which the next lesson comes; which of both.
    learnt: [Learnt; 2],
    odd: bool,
    /// What of it could be at work: friction, harmonics.
    offers: u8,
    pub from_index: FromIndex,
    /// The platform's angle from the index at the end of the millisecond to come, when the torque acts, 2⁻³² turn; and the highest order that is
    /// a wave still at this rate.
    angle: u32,
    highest: u32,
    /// Compare counts that the harmonics add at the end of this millisecond.
    wave: f32,
    /// What the harmonics worked out so far add up to at the end of the millisecond to come.
    coming: f32,
    /// Share of the harmonics that has come in, 0 … 1.
    share: f32,
}

impl FeedForward {
    pub fn new(learnt: Learnt) -> Self {
        Self {
            offers: learnt.offers(),
            learnt: [learnt, Learnt::default()],
            odd: false,
            from_index: FromIndex::default(),
            angle: 0,
            highest: 0,
            wave: 0.0,
            coming: 0.0,
            share: 0.0,
        }
    }

    /// The compensation in force.
    #[inline]
    pub fn learnt(&self) -> &Learnt {
        let [even, odd] = &self.learnt;
        if self.odd { odd } else { even }
    }

    /// The room into which the next lesson comes, and which [`FeedForward::learn`] lets act.
    #[inline]
    pub fn lesson(&mut self) -> &mut [u32; LEARNT_WORDS] {
        let [even, odd] = &mut self.learnt;
        if self.odd { &mut even.0 } else { &mut odd.0 }
    }

    /// The lesson acts from now on.
    #[inline]
    pub fn learn(&mut self) {
        self.odd = !self.odd;
        self.offers = self.learnt().offers();
        self.restart();
    }

    /// Lets the harmonics come in anew.
    #[inline]
    pub fn restart(&mut self) {
        self.highest = 0;
        self.wave = 0.0;
        self.coming = 0.0;
        self.share = 0.0;
    }

    /// Friction at a commanded rate, compare counts.
    #[inline(always)]
    pub fn friction(&self, command: f32) -> f32 {
        let learnt = self.learnt();
        let fade = command * learnt.fade();
        let sign = if fade.abs() > 1.0 { 1.0_f32.copysign(fade) } else { fade };
        learnt.coulomb() * sign + learnt.viscous() * command
    }

    /// Where the harmonics will be `ahead` ticks after this one; rate in counts per tick, `angle_per_count` in 2⁻³² turn.
    #[inline]
    pub fn aim(&mut self, counts: i32, part: f32, rate: f32, ahead: f32, angle_per_count: u32, fastest_wave: f32) {
        // At nothing the angle may have no zero yet: nothing is computed from it.
        self.highest = 0;
        if self.from_index.seen || self.share > 0.0 {
            // Faster than a radian and a half in a millisecond a straight line is no wave any more; the inertia takes it there.
            let highest = fastest_wave / rate.abs();
            self.highest = if highest < f32::from(HIGHEST_ORDER) { whole(highest - 0.5) } else { u32::from(HIGHEST_ORDER) };
            // Parts of a count by 256.
            let on = whole((part + rate * (ahead + self.learnt().lead())) * 256.0);
            self.angle =
                (self.from_index.counts(counts) as u32).wrapping_mul(angle_per_count).wrapping_add(on.wrapping_mul(angle_per_count >> 8));
        }
    }

    /// Adds the harmonics as they will be where [`FeedForward::aim`] says: in one slot the first [`EARLY`], in another the rest.
    #[inline(never)]
    pub fn add(&mut self, late: bool) {
        let (first, rest) = self.learnt().waves().split_at_checked(EARLY).unwrap_or_default();
        let (highest, angle) = (self.highest, self.angle);
        let mut sum = 0.0;
        for wave in if late { rest } else { first } {
            // What is not there has the order 0.
            if wave[0].wrapping_sub(1) < highest {
                sum += harmonic(wave, angle);
            }
        }
        self.coming -= sum;
    }

    /// A millisecond begins: what the harmonics add at its beginning and at its end, compare counts.
    #[inline]
    pub fn turn_over(&mut self) -> (f32, f32) {
        self.share = if self.from_index.seen {
            if self.share >= 1.0 { 1.0 } else { self.share + COMING_IN }
        } else if self.share <= COMING_IN {
            0.0
        } else {
            self.share - COMING_IN
        };
        let begins = self.wave;
        self.wave = self.coming * self.share;
        self.coming = 0.0;
        (begins, self.wave)
    }

    /// What is at work while a rate is held.
    #[inline]
    pub fn compensating(&self, follows: bool) -> Compensating {
        let mut flags = u8::from(self.from_index.seen);
        if follows {
            flags |= self.offers & Compensating::FRICTION.0;
        }
        if self.offers & Compensating::HARMONICS.0 != 0 {
            // The share is never below nothing.
            if follows && self.share.to_bits() != 0 {
                flags |= Compensating::HARMONICS.0;
            } else if !self.from_index.seen {
                flags |= Compensating::WAITS_FOR_INDEX.0;
            }
        }
        Compensating(flags)
    }
}

/// A harmonic at this angle of the platform, compare counts.
#[inline(always)]
fn harmonic(&[order, phase, duty]: &[u32; 3], angle: u32) -> f32 {
    f32::from_bits(duty) * sine(angle.wrapping_mul(order).wrapping_add(phase))
}

/// The nearest whole number, modulo 2³², by what lies below a float's last bit; ± 2²².
#[inline]
fn whole(x: f32) -> u32 {
    (x + ROUND).to_bits().wrapping_sub(ROUND.to_bits())
}

/// Sine of a phase in 2⁻³² turn, to 1e-3 of an amplitude: what the compensation leaves of a harmonic by that is a thousandth.
/// Two parabolas, the second through what the first is off: micromath's, without its reduction of an angle that is reduced by itself here.
#[inline(always)]
fn sine(phase: u32) -> f32 {
    // Half turns, −1 … 1, are 2⁻³¹ of it; what they are scaled by is in the constants.
    let x = (phase as i32) as f32;
    let rough = x * (HALF_TURN - x.abs());
    rough * (0.775 * ROUGH + 0.225 * ROUGH * ROUGH * rough.abs())
}

/// Order and rate, counts per tick, whose product is no wave within a millisecond any more.
pub(super) fn fastest_wave(angle_per_count: u32) -> f32 {
    FASTEST / angle_per_count as f32
}

/// Units of the angle in one encoder count, 2⁻³² turn, and the counts without an index after which it is lost.
pub(super) fn units(hardware: &Hardware) -> (u32, i32) {
    (crate::maths::to_u32(crate::maths::round(TURN / hardware.counts_per_turn)), crate::maths::to_i32(1.25 * hardware.counts_per_turn))
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

    /// The harmonic at the end of a millisecond that is worked out `ahead` ticks before, all of it in.
    fn worked_out(counts: i32, part: f32, rate: f32, ahead: f32) -> f64 {
        let (learnt, angle_per_count, _) = learnt();
        let mut forward = FeedForward::new(learnt);
        forward.from_index.see(0, 0);
        forward.aim(counts, part, rate, ahead, angle_per_count, fastest_wave(angle_per_count));
        forward.add(false);
        f64::from(forward.coming)
    }

    #[test]
    fn what_is_learnt_passes_the_mailbox_unchanged() {
        let (learnt, ..) = learnt();
        assert_eq!(Learnt::from_words(&learnt.to_words()), learnt);
    }

    #[test]
    fn the_duty_is_the_opposite_of_the_torque_at_the_angle_that_it_will_meet() {
        // Half of two ticks, and 0.238 mH over 2.32 Ω in ticks of 0.1 ms.
        let (lead_ticks, rate) = (1.0 + 2.38 / 2.32, 4.0_f32);
        for counts in (-24_000..24_000).step_by(313) {
            for (part, ahead) in [(0.5_f32, 1.0_f32), (0.1, 20.0)] {
                let duty = worked_out(counts, part, rate, ahead);
                let theta = (f64::from(counts) + f64::from(part) + f64::from(rate) * (f64::from(ahead) + lead_ticks)) / 20_000.0 * TAU;
                let wanted = -2e-3 * 2.32 / 0.0234 / (12.0 / 4500.0) * libm::sin(7.0 * theta - 0.4);
                // The sine is good to 1e-3 of the amplitude of 74 counts, the angle to 1e-4 rad.
                assert!((duty - wanted).abs() < 0.15, "{counts}: {duty} {wanted}");
            }
        }
    }

    #[test]
    fn a_harmonic_too_fast_for_a_millisecond_is_left_to_the_inertia() {
        // Order 7 and 1.5 rad in a millisecond are 214 rad/s: 68 counts per tick.
        assert!(worked_out(1_000, 0.5, 60.0, 1.0) != 0.0);
        assert_eq!(worked_out(1_000, 0.5, 70.0, 1.0), 0.0);
    }

    #[test]
    fn harmonics_wait_for_the_index_come_in_slowly_and_go_out_where_it_is_lost() {
        let (learnt, angle_per_count, lost) = learnt();
        let mut forward = FeedForward::new(learnt);
        let millisecond = |forward: &mut FeedForward, counts: i32| {
            forward.aim(counts, 0.5, 0.0, 1.0, angle_per_count, fastest_wave(angle_per_count));
            forward.add(false);
            forward.turn_over();
        };
        millisecond(&mut forward, 10);
        assert_eq!(forward.wave, 0.0);
        assert!(forward.compensating(true).contains(Compensating::WAITS_FOR_INDEX));
        forward.from_index.see(10, 10);
        millisecond(&mut forward, 10);
        let first = forward.wave.abs();
        assert!(first > 0.0 && first < 0.8, "a hundredth of 74 counts: {first}");
        assert_eq!(forward.compensating(true).0 & !Compensating::FRICTION.0, Compensating::INDEX.0 | Compensating::HARMONICS.0);
        (0..200).for_each(|_| millisecond(&mut forward, 10));
        let all = forward.wave;
        assert!((all - 100.0 * first.copysign(all)).abs() < 0.5, "{all}");
        forward.from_index.check(24_990, lost);
        assert!(forward.from_index.seen, "24 990 counts are less than a turn and a quarter");
        forward.from_index.check(25_000, lost);
        assert!(!forward.from_index.seen);
        (0..200).for_each(|_| millisecond(&mut forward, 25_000));
        assert!(forward.wave.abs() < 1e-3);
        assert!(forward.compensating(false).contains(Compensating::WAITS_FOR_INDEX));
    }

    #[test]
    fn dry_friction_follows_the_command_and_is_nothing_at_rest() {
        let (learnt, ..) = learnt();
        let whole = 9e-4 * 2.32 / 0.0234 / (12.0 / 4500.0);
        let duty = |rad_s: f64| f64::from(FeedForward::new(learnt).friction((rad_s / TAU * 20_000.0 / 1e4) as f32));
        for (rad_s, share) in [(0.0, 0.0), (0.01, 0.5), (0.02, 1.0), (5.0, 1.0), (-0.01, -0.5), (-5.0, -1.0)] {
            assert!((duty(rad_s) - share * whole).abs() < 1e-3, "{rad_s}: {}", duty(rad_s));
        }
    }
}
