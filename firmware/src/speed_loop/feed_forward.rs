//! Feed-forward: the voltage that the command needs whatever is measured. Back-EMF, inertia, and the learnt compensation: friction by the
//! commanded rate, harmonics by the angle from the index.
//!
//! Torque becomes duty through R/K. The harmonics' angle is the one that the torque will meet: the duty acts on average in the middle of
//! its tick, and the winding delays the current by L/R. Harmonics need the index; they fade in over 0.1 s, so that the voltage does not
//! jump. Without an index for more than a turn (a broken wire) they fade out, and a status says so.

use super::units::TickUnits;
use crate::board::{CONTROL_HZ, Hardware};
use crate::compensation::{Compensation, Harmonic, MAX_HARMONICS};
use core::f32::consts::PI;
use core::f64::consts::TAU;
use micromath::F32Ext;

/// One turn, in units of the angle, 2⁻³² turn.
const TURN: f64 = 4_294_967_296.0;
/// Radians in one unit of the angle.
const RAD_PER_UNIT: f32 = PI / 2_147_483_648.0;
/// From the tick at which a duty begins to act to the middle of its time, ticks.
const HALF_TICK: f64 = 0.5;
/// Change of the harmonics' share in a millisecond: they fade in over 0.1 s.
const FADE_PER_MS: f32 = 0.01;
/// Turns without an index after which it is lost.
const INDEX_LOST_TURNS: f64 = 1.25;

/// Parts of the compensation that are active; a set of flags.
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

    #[inline]
    fn set(&mut self, other: Self, when: bool) {
        if when {
            self.0 |= other.0;
        }
    }
}

/// A [`Compensation`] in the tick's units; the tasks post it to the interrupt.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CompensationGains {
    /// Coulomb friction, compare counts.
    coulomb: f32,
    /// 1 / the rate below which it is reduced in proportion, ticks per count.
    coulomb_slope: f32,
    /// Viscous friction, compare counts per (count per tick).
    viscous: f32,
    /// From the tick at which the duty begins to act to its torque, ticks.
    lead_ticks: f32,
    harmonics: [HarmonicGains; MAX_HARMONICS],
    harmonic_count: usize,
}

/// One harmonic in the tick's units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct HarmonicGains {
    /// Periods per turn.
    order: u32,
    /// Phase at the index, 2⁻³² turn.
    phase: u32,
    /// Amplitude, compare counts.
    duty: f32,
}

impl HarmonicGains {
    fn new(harmonic: &Harmonic, units: &TickUnits) -> Self {
        let turns = harmonic.phase_rad / TAU;
        Self {
            order: u32::from(harmonic.order),
            phase: ((turns - libm::floor(turns)) * TURN) as u64 as u32,
            duty: (harmonic.torque_N_m * units.duty_per_N_m) as f32,
        }
    }

    /// The disturbance at this angle from the index, compare counts. The sine is good to 1e-3: as much of the harmonic is left.
    #[inline]
    fn at(&self, angle: u32) -> f32 {
        let phase = angle.wrapping_mul(self.order).wrapping_add(self.phase) as i32;
        self.duty * F32Ext::sin(phase as f32 * RAD_PER_UNIT)
    }
}

impl CompensationGains {
    /// `compensation`, which has been checked, in the units of this drive.
    pub(super) fn new(compensation: &Compensation, units: &TickUnits) -> Self {
        let mut gains = Self {
            coulomb: (compensation.coulomb_N_m * units.duty_per_N_m) as f32,
            coulomb_slope: (units.rad_s_per_count_tick / compensation.coulomb_fade_rad_s) as f32,
            viscous: (compensation.viscous_N_m_s * units.rad_s_per_count_tick * units.duty_per_N_m) as f32,
            lead_ticks: (HALF_TICK + compensation.winding_lag_s * CONTROL_HZ as f64) as f32,
            ..Self::default()
        };
        for (place, harmonic) in gains.harmonics.iter_mut().zip(compensation.harmonics.as_slice()) {
            *place = HarmonicGains::new(harmonic, units);
            gains.harmonic_count += 1;
        }
        gains
    }

    #[inline]
    fn harmonics(&self) -> &[HarmonicGains] {
        self.harmonics.get(..self.harmonic_count).unwrap_or_default()
    }

    /// Friction at a commanded rate (counts per tick), compare counts.
    #[inline]
    fn friction(&self, rate: f32) -> f32 {
        self.coulomb * (rate * self.coulomb_slope).clamp(-1.0, 1.0) + self.viscous * rate
    }
}

/// Gains of the feed-forward.
#[derive(Clone, Copy, Debug)]
pub(super) struct Config {
    /// Compare counts per count per tick.
    pub back_emf: f32,
    /// Compare counts per count per tick².
    pub inertia: f32,
    pub compensation: CompensationGains,
    /// One encoder count, 2⁻³² turn.
    angle_per_count: u32,
    /// Counts without an index after which it is lost.
    index_lost: i32,
}

impl Config {
    pub fn new(back_emf: f32, inertia: f32, compensation: CompensationGains, hardware: &Hardware) -> Self {
        let angle_per_count = libm::round(TURN / hardware.counts_per_turn) as u32;
        Self { back_emf, inertia, compensation, angle_per_count, index_lost: (INDEX_LOST_TURNS * hardware.counts_per_turn) as i32 }
    }

    /// Compare counts for a commanded rate (counts per tick) and acceleration (counts per tick²), harmonics apart.
    #[inline]
    pub fn duty(&self, rate: f32, acceleration: f32) -> f32 {
        self.back_emf * rate + self.inertia * acceleration + self.compensation.friction(rate)
    }
}

/// The index, as it was last seen.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Index {
    /// The unwrapped counter at the index; `None` where it was not seen, or not for more than a turn.
    pub counts: Option<i32>,
    /// The last one that was seen.
    last: i32,
}

impl Index {
    /// The index has come at this unwrapped count.
    #[inline]
    pub fn set(&mut self, counts: i32) {
        *self = Self { counts: Some(counts), last: counts };
    }

    fn check(&mut self, counts: i32, lost_counts: i32) {
        if counts.wrapping_sub(self.last).wrapping_abs() >= lost_counts {
            self.counts = None;
        }
    }
}

/// State of the harmonics.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct FeedForward {
    pub index: Index,
    /// Share of the harmonics that is fed forward, 0 … 1.
    share: f32,
}

impl FeedForward {
    /// Lets the harmonics fade in from zero.
    pub fn restart(&mut self) {
        self.share = 0.0;
    }

    /// Once in a millisecond: looks whether the index is lost, and fades the harmonics in or out.
    pub fn each_millisecond(&mut self, config: &Config, counts: i32) {
        self.index.check(counts, config.index_lost);
        let change = if self.index.counts.is_some() { FADE_PER_MS } else { -FADE_PER_MS };
        self.share = (self.share + change).clamp(0.0, 1.0);
    }

    /// Compare counts against the harmonics in the next tick. `boundary` and `fraction`: position at that tick; `rate`: counts per tick.
    #[inline]
    pub fn harmonics(&self, config: &Config, boundary: i32, fraction: f32, rate: f32) -> f32 {
        if self.share <= 0.0 {
            return 0.0;
        }
        let gains = &config.compensation;
        // 2⁻⁸ counts: whole ones have the precision of an integer.
        let ahead = ((fraction + rate * gains.lead_ticks) * 256.0) as i32 as u32;
        let from_index = boundary.wrapping_sub(self.index.last) as u32;
        let angle = from_index.wrapping_mul(config.angle_per_count).wrapping_add(ahead.wrapping_mul(config.angle_per_count >> 8));
        let disturbance: f32 = gains.harmonics().iter().map(|harmonic| harmonic.at(angle)).sum();
        -self.share * disturbance
    }

    /// Parts of the compensation that are active; `follows`: a ramp is followed.
    pub fn compensating(&self, config: &Config, follows: bool) -> Compensating {
        let gains = &config.compensation;
        let has_index = self.index.counts.is_some();
        let has_harmonics = gains.harmonic_count > 0;
        let fades = follows && self.share > 0.0;
        let mut flags = Compensating::default();
        flags.set(Compensating::INDEX, has_index);
        flags.set(Compensating::FRICTION, follows && (gains.coulomb != 0.0 || gains.viscous != 0.0));
        flags.set(Compensating::HARMONICS, has_harmonics && fades);
        flags.set(Compensating::WAITS_FOR_INDEX, has_harmonics && !fades && !has_index);
        flags
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compensation::Harmonics;
    use crate::speed_loop::Settings;

    const HARMONIC: Harmonic = Harmonic { order: 7, torque_N_m: 2e-3, phase_rad: -0.4 };

    fn config() -> Config {
        let hardware = Hardware::default();
        let compensation = Compensation { coulomb_N_m: 9e-4, harmonics: Harmonics::of([HARMONIC]).unwrap(), ..Compensation::default() };
        let settings = Settings::default();
        let units = TickUnits::new(settings.resistance_ohm / settings.motor_constant_N_m_A, &hardware);
        Config::new(0.0, 0.0, CompensationGains::new(&compensation, &units), &hardware)
    }

    /// The harmonic with its index at count 0, faded in.
    fn faded_in() -> FeedForward {
        let mut forward = FeedForward { share: 1.0, ..FeedForward::default() };
        forward.index.set(0);
        forward
    }

    #[test]
    fn duty_opposes_the_torque_at_the_angle_that_it_will_meet() {
        // Half of a tick, and 0.238 mH over 2.32 Ω in ticks of 0.1 ms.
        let lead_ticks = 0.5 + 2.38 / 2.32;
        for (fraction, rate) in [(0.5_f32, 4.0_f32), (0.1, 31.0), (-0.3, -4.0)] {
            for counts in (-24_000..24_000).step_by(313) {
                let duty = f64::from(faded_in().harmonics(&config(), counts, fraction, rate));
                let theta = (f64::from(counts) + f64::from(fraction) + f64::from(rate) * lead_ticks) / 20_000.0 * TAU;
                let wanted = -2e-3 * 2.32 / 0.0234 / (12.0 / 4500.0) * libm::sin(7.0 * theta - 0.4);
                // The sine is good to 1e-3 of the amplitude of 74 counts, the angle to 1e-4 rad.
                assert!((duty - wanted).abs() < 0.15, "{counts}: {duty} {wanted}");
            }
        }
    }

    #[test]
    fn harmonics_wait_for_the_index_fade_in_and_fade_out_without_it() {
        let config = config();
        let mut forward = FeedForward::default();
        let millisecond = |forward: &mut FeedForward, counts: i32| {
            forward.each_millisecond(&config, counts);
            forward.harmonics(&config, counts, 0.5, 0.0)
        };
        assert_eq!(millisecond(&mut forward, 10), 0.0);
        assert!(forward.compensating(&config, true).contains(Compensating::WAITS_FOR_INDEX));
        forward.index.set(0);
        let first = millisecond(&mut forward, 10);
        assert!(first.abs() > 0.0 && first.abs() < 0.8, "a hundredth of 74 counts: {first}");
        assert_eq!(forward.compensating(&config, true).0 & !Compensating::FRICTION.0, Compensating::INDEX.0 | Compensating::HARMONICS.0);
        (0..200).for_each(|_| {
            millisecond(&mut forward, 10);
        });
        let all = millisecond(&mut forward, 10);
        assert!((all - 100.0 * first).abs() < 0.5, "{all}");
        forward.each_millisecond(&config, 24_999);
        assert!(forward.index.counts.is_some(), "less than a turn and a quarter");
        forward.each_millisecond(&config, 25_000);
        assert!(forward.index.counts.is_none());
        (0..200).for_each(|_| {
            millisecond(&mut forward, 25_000);
        });
        assert_eq!(millisecond(&mut forward, 25_000), 0.0);
        assert!(forward.compensating(&config, false).contains(Compensating::WAITS_FOR_INDEX));
    }

    #[test]
    fn coulomb_friction_follows_the_command_and_is_zero_at_rest() {
        let whole = 9e-4 * 2.32 / 0.0234 / (12.0 / 4500.0);
        let duty = |rad_s: f64| f64::from(config().compensation.friction((rad_s / TAU * 20_000.0 / 1e4) as f32));
        for (rad_s, share) in [(0.0, 0.0), (0.01, 0.5), (0.02, 1.0), (5.0, 1.0), (-0.01, -0.5), (-5.0, -1.0)] {
            assert!((duty(rad_s) - share * whole).abs() < 1e-3, "{rad_s}: {}", duty(rad_s));
        }
    }
}
