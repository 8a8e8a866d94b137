//! The segment under way: how it is taken over, what it asks of the bridge, and how it lays out the milliseconds to come.
//!
//! A voltage is asked for as it is; a rate or an angle is a ramp with a regulator on it. What limits hold back is a status.

use super::approach::next_rate;
use super::ramp::fixed_to_f32;
use super::segment::{Mode, Order, Zero};
use super::{Active, LAST, LEAD, Limits, SLOTS, SpeedLoop};
use crate::mailbox::Words;

impl SpeedLoop {
    /// Takes the next segment over; `soon` is the tick for which output is computed.
    #[inline(always)]
    pub(super) fn switch_segment(&mut self, soon: u32) {
        let Order { segment: next, .. } = Order::from_words(&self.ordered);
        let begins = next.mode.follows() && !self.active.mode.follows();
        let late = soon.wrapping_sub(next.start_tick as u32);
        if begins && late > 0 && self.slot < LEAD {
            // What is late anyway waits for a slot that has the time.
            self.limits.set(Limits::STARVED, next.mode == Mode::Rate);
            return;
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

    /// The ramp begins where the stand is.
    #[inline(always)]
    fn anchor(&mut self) {
        let measured = (i64::from(self.edges.boundary) << 32).wrapping_add(i64::from((self.edges.part * 16_777_216.0) as i32) << 8);
        let rate = self.estimate.rate;
        self.owed = 0.0;
        self.feed_forward.restart();
        self.needed = self.config.back_emf * rate + self.feed_forward.friction(rate);
        self.ramp.anchor(measured, rate, self.needed + self.config.rate_gain * rate);
    }

    /// The voltage asked for at this tick, compare counts; moves on to the next.
    #[inline]
    pub(super) fn voltage(&mut self) -> f32 {
        let active = &mut self.active;
        let asked = fixed_to_f32(active.value);
        if active.left > 0 {
            active.left = active.left.wrapping_sub(1);
            active.value = active.value.wrapping_add(active.slope);
        } else {
            self.limits.set(Limits::STARVED, active.starved);
            active.starved = true;
        }
        asked
    }

    /// What the regulator on the ramp asks for, compare counts; moves the ramp to the next tick.
    #[inline]
    pub(super) fn follow(&mut self) -> f32 {
        let (error, slipped) = self.ramp.error(self.edges.boundary, self.config.slip);
        if slipped {
            self.limits.set(Limits::SLIPPED, true);
        }
        self.ramp.step(self.slot == LAST);
        let config = &self.config;
        self.ramp.feed() - config.rate_gain * self.estimate.rate
            + (config.fine_gain * error as f32 - config.position_gain * self.edges.part)
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
        // What is fed forward acts on the mean in the middle of the next tick; the rate that is measured is this tick's.
        let needs = config.back_emf * to + self.feed_forward.friction(to);
        let pushed = config.inertia * change + 0.05 * (needs - self.needed) - 0.1 * config.rate_gain * change;
        self.ramp
            .feed_forward(self.needed + config.rate_gain * from + pushed + waves_from, needs + config.rate_gain * to + pushed + waves_to);
        self.needed = needs;
    }

    /// The rate that leads to the angle.
    #[inline(always)]
    pub(super) fn approach(&mut self) -> i64 {
        let (rate, position) = self.ramp.straight();
        let goal = match self.active.zero {
            Zero::PowerOn => self.active.value,
            Zero::Index if self.feed_forward.from_index.seen => {
                self.active.value.wrapping_add(i64::from(self.feed_forward.from_index.at) << 32)
            }
            Zero::Index => {
                self.limits.set(Limits::NO_INDEX, true);
                return 0;
            }
        };
        let fastest = if self.active.slope == 0 { self.config.approach } else { fixed_to_f32(self.active.slope) };
        let next = next_rate(fixed_to_f32(goal.wrapping_sub(position)), fixed_to_f32(rate), fastest, self.config.braking);
        // Whole counts per tick and 2⁻²⁴ of one, in two integer halves.
        i64::from((next * 16_777_216.0) as i32) << 8
    }

    /// Current limit, then voltage limit. What is no number is within both.
    #[inline]
    pub(super) fn limit(&mut self, asked: f32) -> f32 {
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
