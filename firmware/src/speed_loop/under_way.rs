//! The segment under way: how it is taken over, what it asks of the bridge, and how it lays out the milliseconds to come.
//!
//! A voltage is asked for as it is; a rate or an angle is a ramp with a regulator on it. What limits hold back is a status.

use super::approach::next_rate;
use super::ramp::fixed_to_f32;
use super::segment::{Mode, Order, Zero};
use super::{Active, LAST, Limits, SLOTS, SpeedLoop};
use crate::mailbox::Words;

/// Share of the current limit's voltage that is free at rest; what is left is more than the back-EMF gains in a millisecond.
const FREE_SHARE: f32 = 0.875;

impl SpeedLoop {
    /// Takes the next segment over; `soon` is the tick for which output is computed. Returns whether a ramp begins.
    #[inline(always)]
    pub(super) fn switch_segment(&mut self, soon: u32) -> bool {
        let Order { segment: next, .. } = Order::from_words(&self.ordered);
        let begins = next.mode.follows() && !self.active.mode.follows();
        let late = soon.wrapping_sub(next.start_tick as u32);
        if begins && late > 0 && self.slot != LAST {
            // What is late anyway begins with a millisecond.
            self.limits.set(Limits::STARVED, next.mode == Mode::Rate);
            return false;
        }
        self.waits = false;
        let left = u32::from(next.ticks);
        self.active = Active { mode: next.mode, zero: next.zero, value: next.value, slope: next.slope, left, starved: false };
        if late > 0 {
            self.catch_up(late);
        }
        if begins {
            self.anchor();
        }
        begins
    }

    /// The segment under way should have begun so many ticks ago.
    #[cold]
    #[inline(never)]
    fn catch_up(&mut self, late: u32) {
        let active = &mut self.active;
        self.limits.set(Limits::STARVED, active.mode != Mode::Off && active.mode != Mode::Position);
        let along = late.min(active.left);
        active.left = active.left.wrapping_sub(along);
        if active.mode != Mode::Position {
            active.value = active.value.wrapping_add(active.slope.wrapping_mul(i64::from(along)));
        }
    }

    /// The ramp begins where the stand was at the last decision.
    #[inline(always)]
    fn anchor(&mut self) {
        let measured = (i64::from(self.estimate.boundary) << 32).wrapping_add(i64::from((self.part * 16_777_216.0) as i32) << 8);
        let rate = self.estimate.rate;
        self.owed = 0.0;
        self.feed_forward.restart();
        self.needed = self.config.back_emf * rate + self.feed_forward.friction(rate);
        self.ramp.anchor(measured, rate, self.needed + self.config.command_gain * rate);
    }

    /// The voltage asked for from the next tick on, compare counts; moves on to the next decision.
    #[inline]
    pub(super) fn voltage(&mut self) -> f32 {
        let until_next = self.until_next();
        let active = &mut self.active;
        let asked = fixed_to_f32(active.value);
        self.command = (active.value >> 16) as i32;
        if active.left > 0 {
            let ticks = until_next.min(active.left);
            active.left = active.left.wrapping_sub(ticks);
            active.value = active.value.wrapping_add(active.slope.wrapping_mul(i64::from(ticks)));
        } else {
            self.limits.set(Limits::STARVED, active.starved);
            active.starved = true;
        }
        asked
    }

    /// What the regulator on the ramp asks for, compare counts; moves the ramp to the next tick.
    ///
    /// The position command is the next tick's and what is measured is this one's: what lies between is taken from what is fed forward.
    #[inline]
    pub(super) fn follow(&mut self) -> f32 {
        let begins = self.slot == LAST;
        self.ramp.step(begins);
        if begins {
            let slips = self.ramp.slips(self.estimate.boundary, self.config.slip);
            self.limits.set(Limits::SLIPPED, slips);
        }
        let error = self.ramp.error(self.estimate.boundary);
        let config = &self.config;
        self.command = self.ramp.mean_rate_16();
        self.ramp.feed() - config.rate_gain * self.estimate.rate + (config.fine_gain * error as f32 - config.position_gain * self.part)
    }

    /// Works out where the ramp is to be at the end of the millisecond after this.
    #[inline(always)]
    pub(super) fn lead(&mut self) {
        if !self.active.mode.follows() {
            return;
        }
        let target = if self.active.mode == Mode::Position {
            // An order that came since then is looked at in the next millisecond.
            if self.approaches { self.way } else { self.ramp.straight().0 }
        } else {
            // Where the segment will be at this millisecond's end.
            let active = &mut self.active;
            let ticks = active.left.min(SLOTS);
            self.limits.set(Limits::STARVED, ticks < SLOTS);
            active.left = active.left.wrapping_sub(ticks);
            active.value = active.value.wrapping_add(active.slope.wrapping_mul(i64::from(ticks)));
            active.value
        };
        let held_back = self.ramp.ahead(target, self.config.acceleration);
        self.limits.set(Limits::ACCELERATION, held_back && self.active.mode == Mode::Rate);
    }

    /// Lays out the next millisecond: what it needs, whatever is measured in it.
    #[inline(always)]
    pub(super) fn plan(&mut self) {
        if !self.active.mode.follows() {
            return;
        }
        let (from, to) = self.ramp.plan();
        let (waves_from, waves_to) = self.feed_forward.turn_over();
        let config = &self.config;
        let change = to - from;
        // What is fed forward acts on the mean in the middle of the next two ticks; the rate that is measured is this tick's.
        let needs = config.back_emf * to + self.feed_forward.friction(to);
        let pushed = config.inertia * change + 0.1 * (needs - self.needed - config.rate_gain * change);
        self.ramp.feed_forward(
            self.needed + config.command_gain * from + pushed + waves_from,
            needs + config.command_gain * to + pushed + waves_to,
        );
        self.needed = needs;
    }

    /// How far the angle is from where the ramp has come to, counts.
    #[inline(always)]
    pub(super) fn distance(&mut self) -> f32 {
        let (_, position) = self.ramp.straight();
        let goal = match self.active.zero {
            Zero::PowerOn => self.active.value,
            Zero::Index if self.feed_forward.from_index.seen => {
                self.active.value.wrapping_add(i64::from(self.feed_forward.from_index.at) << 32)
            }
            Zero::Index => {
                self.limits.set(Limits::NO_INDEX, true);
                return 0.0;
            }
        };
        fixed_to_f32(goal.wrapping_sub(position))
    }

    /// The rate that leads to the angle.
    #[inline(always)]
    pub(super) fn approach(&self) -> i64 {
        let (rate, _) = self.ramp.straight();
        let fastest = if self.active.slope == 0 { self.config.approach } else { fixed_to_f32(self.active.slope) };
        let next = next_rate(self.distance, fixed_to_f32(rate), fastest, self.config.braking);
        // Whole counts per tick and 2⁻²⁴ of one, in two integer halves.
        i64::from((next * 16_777_216.0) as i32) << 8
    }

    /// What may be asked for without a look at the limits, at the rate of this millisecond: some less than either allows.
    #[inline]
    pub(super) fn look_for_room(&mut self) {
        let config = &self.config;
        let current_duty = FREE_SHARE * config.current_window - (config.back_emf * self.estimate.rate).abs();
        self.free_duty = if current_duty < config.duty_limit { current_duty } else { config.duty_limit };
    }

    /// What of it is within the limits. What is no number is within both.
    #[inline]
    pub(super) fn limit(&mut self, asked: f32) -> f32 {
        if asked.abs() > self.free_duty { self.within_limits(asked) } else { asked }
    }

    /// Current limit, then voltage limit.
    #[inline]
    fn within_limits(&mut self, asked: f32) -> f32 {
        let config = &self.config;
        let back_emf = config.back_emf * self.estimate.rate;
        let drop = asked - back_emf;
        let mut held = asked;
        if drop.abs() > config.current_window {
            held = back_emf + config.current_window.copysign(drop);
            self.limits.set(Limits::CURRENT, true);
        }
        if held.abs() > config.duty_limit {
            held = config.duty_limit.copysign(held);
            self.limits.set(Limits::VOLTAGE, true);
        }
        held
    }
}
