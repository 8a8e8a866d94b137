//! Speed loop: the control law of the drive, one function for the 10 kHz timer interrupt.
//!
//! In: the encoder's counter and the age of its last edge, current, supply and the number of the tick ([`Sensed`]); commands of the tasks
//! ([`Command`]). Out: compare counts of the bridge ([`Drive`]) and, each millisecond, a [`Report`]. Modes: off, open-loop voltage, rate,
//! and angle. Rate and angle follow an integrated position ramp with a PI regulator; back-EMF, inertia and the learnt compensation
//! ([`crate::compensation`]) are fed forward. Limits in force (current, voltage, acceleration, slip) are a status; faults
//! ([`crate::supervision`]) switch the drive off and stay latched.
//!
//! Each tick: [`SpeedLoop::sense`] (encoder, rate estimate, fast supervision), then [`SpeedLoop::compute`], the law: estimate → ramp →
//! feed-forward → PI → limits. The output computed in tick n acts from tick n+1 on, so setpoint and platform are taken at n+1. A segment
//! that starts at tick s acts on the motor from exactly tick s on. In the last tick of each millisecond the law also does what is due once
//! in a millisecond: slow supervision, planning of the ramp, fading of the harmonics.
//!
//! The tick has no panic, no wait and no double-precision arithmetic.

mod active_segment;
mod approach;
mod encoder;
mod estimator;
mod feed_forward;
mod interrupt;
mod ramp;
mod regulator;
mod report;
mod segment;
mod settings;
#[cfg(test)]
mod tests;
mod units;

pub use crate::status::{Fault, Limits};
pub use feed_forward::{Compensating, CompensationGains};
pub use interrupt::{Interrupt, Mailboxes};
pub use report::Report;
pub use segment::{Command, Mode, ONE, Segment, Zero, rate_unit};
pub use settings::{Config, Settings};

use crate::board::{CONTROL_PER_ROW, Drive, EncoderCount, Sensed};
use crate::supervision::{DriveState, TickSupervisor};
use active_segment::ActiveSegment;
use encoder::Encoder;
use estimator::Estimator;
use feed_forward::FeedForward;
use ramp::Ramp;
use regulator::CurrentLimit;
use segment::{f32_to_fixed, fixed_to_f32};
use settings::ApproachConfig;

const TICKS_PER_MS: u32 = CONTROL_PER_ROW as u32;
/// The tick of a millisecond in which the current limit is updated: a tick with little other work.
const LIMIT_UPDATE: u8 = 5;

/// The law: configuration and state.
pub struct SpeedLoop {
    config: Config,
    state: LoopState,
}

struct LoopState {
    /// Number of this tick; `None` before the first.
    tick: Option<u64>,
    encoder: Encoder,
    estimator: Estimator,
    supervisor: TickSupervisor,
    /// Number of the last clearing of faults.
    clear: u16,
    /// The newest segment, until it starts.
    next_segment: Option<Segment>,
    segment: ActiveSegment,
    ramp: Ramp,
    feed_forward: FeedForward,
    current_limit: CurrentLimit,
    /// Ticks since the one that did the work of a millisecond.
    ticks_in_ms: u8,
    output: Output,
    limits: LimitLog,
}

/// The platform at the tick in which the output acts.
struct Platform {
    /// Position: a boundary between counts, and counts from there.
    boundary: i32,
    fraction: f32,
    /// Rate, counts per tick.
    rate: f32,
}

/// What the bridge is given.
#[derive(Default)]
struct Output {
    /// Compare counts: during this tick; after [`SpeedLoop::compute`] from the next tick on.
    duty: i16,
    /// Sum of all duties so far, `duty` included, wrapping.
    duty_sum: i32,
    /// Sum over all ticks so far of the sum of the duties before each, wrapping.
    duty_moment: i32,
    /// Rounding error of the last duty, which the next one makes up for, compare counts.
    rounding: f32,
}

impl Output {
    fn off(&mut self) -> Drive {
        self.duty = 0;
        self.rounding = 0.0;
        self.duty_moment = self.duty_moment.wrapping_add(self.duty_sum);
        Drive::Off
    }

    /// The last duty acts for further ticks.
    fn continue_for(&mut self, ticks: u32) {
        let (duty, n) = (i32::from(self.duty), ticks as i32);
        // 0 + 1 + … + (n − 1), with the even factor halved first.
        let pairs = if n & 1 == 0 { (n >> 1).wrapping_mul(n.wrapping_sub(1)) } else { n.wrapping_mul(n.wrapping_sub(1) >> 1) };
        self.duty_moment = self.duty_moment.wrapping_add(self.duty_sum.wrapping_mul(n)).wrapping_add(duty.wrapping_mul(pairs));
        self.duty_sum = self.duty_sum.wrapping_add(duty.wrapping_mul(n));
    }

    /// Rounds to whole compare counts; where a ramp is followed, rounding errors do not add up.
    #[inline]
    fn set(&mut self, duty: f32, follows: bool) -> Drive {
        let exact = if follows { duty + self.rounding } else { duty };
        let rounded = libm::roundf(exact);
        self.rounding = exact - rounded;
        self.duty = rounded as i16;
        self.duty_moment = self.duty_moment.wrapping_add(self.duty_sum);
        self.duty_sum = self.duty_sum.wrapping_add(i32::from(self.duty));
        Drive::Duty(self.duty)
    }
}

/// Limits in force.
#[derive(Default)]
struct LimitLog {
    /// Within this millisecond so far, and within the one before.
    now: Limits,
    last: Limits,
    /// For each limit, the number of milliseconds in which it was in force, wrapping.
    milliseconds: [u32; Limits::COUNT],
}

impl LimitLog {
    fn end_millisecond(&mut self) {
        self.last = core::mem::take(&mut self.now);
        for (bit, milliseconds) in self.milliseconds.iter_mut().enumerate() {
            *milliseconds = milliseconds.wrapping_add(u32::from(self.last.0 >> bit & 1));
        }
    }
}

impl SpeedLoop {
    /// The law at rest.
    pub fn new(config: Config) -> Self {
        Self { state: LoopState::new(&config), config }
    }

    /// Other settings; the drive must be off.
    pub fn set_config(&mut self, config: Config) {
        self.state.current_limit = CurrentLimit::new(&config.regulator);
        self.config = config;
        self.state.feed_forward.restart();
    }

    /// Another compensation; its harmonics fade in from zero.
    pub fn set_compensation(&mut self, gains: CompensationGains) {
        self.config.set_compensation(gains);
        self.state.feed_forward.restart();
    }

    /// The compensation in force.
    pub fn compensation(&self) -> CompensationGains {
        self.config.compensation()
    }

    /// The estimated rate, counts per tick.
    pub fn rate_estimate(&self) -> f32 {
        self.state.estimator.rate
    }

    /// The latched fault, and the tick in which it was detected, low word.
    #[inline]
    pub fn fault(&self) -> (Fault, u32) {
        (self.state.supervisor.fault, self.state.supervisor.fault_tick)
    }

    /// Compare counts of the bridge from the next tick on.
    #[inline]
    pub fn duty(&self) -> i16 {
        self.state.output.duty
    }

    /// The setpoint, for a recording: the rate, 2⁻¹⁶ counts per tick, or the voltage, 2⁻¹⁶ compare counts.
    #[inline]
    pub fn setpoint(&self) -> i32 {
        let value = match self.state.segment.mode {
            _ if self.state.supervisor.fault != Fault::None => 0,
            Mode::Off => 0,
            Mode::Voltage => self.state.segment.value,
            Mode::Rate | Mode::Position => self.state.ramp.rate,
        };
        (value >> 16) as i32
    }

    /// One tick: [`SpeedLoop::sense`], the command, [`SpeedLoop::compute`].
    pub fn tick(&mut self, sensed: &Sensed, command: Option<&Command>) -> Drive {
        self.sense(sensed, None);
        if let Some(command) = command {
            self.set_command(command, sensed);
        }
        self.compute(sensed)
    }

    /// Begins a tick: encoder, rate estimate, fast supervision. `index`: the count at which the index has come since the last tick.
    #[inline]
    pub fn sense(&mut self, sensed: &Sensed, index: Option<EncoderCount>) {
        let (config, state) = (&self.config, &mut self.state);
        let now = (sensed.tick as u32).wrapping_mul(config.period);
        if state.tick.is_none_or(|last| last.wrapping_add(1) != sensed.tick) {
            state.skip_ticks(sensed, config.period);
        }
        state.tick = Some(sensed.tick);
        state.encoder.update(sensed.encoder, sensed.edge_age, now, config.period);
        if let Some(at) = index {
            let since = EncoderCount(state.encoder.counts as u16).since(at);
            state.feed_forward.index.set(state.encoder.counts.wrapping_sub(i32::from(since)));
        }
        if begins_millisecond(sensed.tick) {
            state.encoder.update_rate(now);
        }
        state.estimator.update(&config.estimator, state.encoder.boundary, state.encoder.fraction());
        state.supervisor.each_tick(&config.thresholds, sensed);
    }

    /// The state at this tick, between [`SpeedLoop::sense`] and [`SpeedLoop::compute`]. Begins a new millisecond of limits.
    pub fn report(&mut self) -> Report {
        let state = &mut self.state;
        state.limits.end_millisecond();
        let mode = state.segment.mode;
        Report {
            tick: state.tick.unwrap_or(0),
            // The duty that acts from this tick on has not acted yet.
            duty_sum: state.output.duty_sum.wrapping_sub(i32::from(state.output.duty)),
            duty_moment: state.output.duty_moment,
            position_command: state.ramp.position,
            rate_command: state.ramp.rate,
            rate: state.encoder.rate(self.config.period),
            edge_age: state.encoder.age,
            mode,
            compensating: state.feed_forward.compensating(&self.config.feed_forward, mode.follows()),
            fault: state.supervisor.fault,
            limits: state.limits.last,
            limited_ms: state.limits.milliseconds,
        }
    }

    /// A command of the tasks.
    pub fn set_command(&mut self, command: &Command, sensed: &Sensed) {
        let state = &mut self.state;
        if command.trip != Fault::None {
            state.supervisor.trip(command.trip, sensed.tick as u32);
        } else if command.clear != state.clear {
            state.supervisor.clear(&self.config.thresholds, sensed, state.estimator.rate);
            // After a fault the drive starts from where the platform is, not from where the command has got to.
            state.segment = ActiveSegment::default();
        }
        state.clear = command.clear;
        state.next_segment = Some(command.segment);
    }

    /// The control law: what the bridge is given from the next tick on.
    #[inline]
    pub fn compute(&mut self, sensed: &Sensed) -> Drive {
        let next_tick = sensed.tick.wrapping_add(1);
        let platform = self.state.platform_at_next_tick();
        self.state.ramp.advance();
        self.update_segment(next_tick, &platform);
        if begins_millisecond(next_tick) {
            self.each_millisecond(sensed);
            self.state.ticks_in_ms = 0;
        } else {
            self.state.ticks_in_ms = self.state.ticks_in_ms.wrapping_add(1);
            if self.state.ticks_in_ms == LIMIT_UPDATE {
                self.update_current_limit(sensed);
            }
        }
        let mode = self.state.segment.mode;
        if self.state.supervisor.fault != Fault::None || mode == Mode::Off {
            return self.state.output.off();
        }
        let duty = if mode.follows() { self.follow(&platform) } else { fixed_to_f32(self.state.segment.value) };
        let limited = self.config.regulator.limit(&self.state.current_limit, duty, platform.rate, &mut self.state.limits.now);
        self.state.output.set(limited, mode.follows())
    }

    /// Rate and position mode: feed-forward and regulator on the ramp, compare counts.
    #[inline]
    fn follow(&mut self, platform: &Platform) -> f32 {
        let (config, state) = (&self.config, &mut self.state);
        let slipped = state.ramp.limit_slip(platform.boundary, &config.ramp);
        state.limits.now.set(Limits::SLIPPED, slipped);
        let rate = fixed_to_f32(state.ramp.rate);
        let acceleration = fixed_to_f32(state.ramp.acceleration);
        // On average the duty acts in the middle of its tick.
        let feed_forward = config.feed_forward.duty(rate + 0.5 * acceleration, acceleration)
            + state.feed_forward.harmonics(&config.feed_forward, platform.boundary, platform.fraction, platform.rate);
        let position_error = state.ramp.position_error(platform.boundary, platform.fraction);
        feed_forward + config.regulator.regulate(position_error, rate - platform.rate)
    }

    /// Advances the segment to `next_tick`, or starts the next one there.
    #[inline]
    fn update_segment(&mut self, next_tick: u64, platform: &Platform) {
        let state = &mut self.state;
        match state.next_segment.take_if(|segment| segment.start_tick <= next_tick) {
            Some(segment) => {
                let late = next_tick.saturating_sub(segment.start_tick);
                let followed = state.segment.mode.follows();
                state.segment = ActiveSegment::start(&segment, late);
                state.limits.now.set(Limits::STARVED, late > 0 && matches!(segment.mode, Mode::Voltage | Mode::Rate));
                if segment.mode.follows() && !followed {
                    let position = (i64::from(platform.boundary) << 32).wrapping_add(f32_to_fixed(platform.fraction));
                    state.ramp.start(position, f32_to_fixed(platform.rate));
                    state.feed_forward.restart();
                }
            }
            None => state.segment.advance(1),
        }
        // A segment of the ramp is judged by the millisecond.
        let starved = state.segment.mode == Mode::Voltage && state.segment.ends_within(1);
        state.limits.now.set(Limits::STARVED, starved);
    }

    /// Once in a millisecond, by the current of the present tick.
    fn update_current_limit(&mut self, sensed: &Sensed) {
        let (config, state) = (&self.config, &mut self.state);
        let is_in_force = state.limits.now.contains(Limits::CURRENT);
        let moves = state.encoder.age < config.period.wrapping_mul(TICKS_PER_MS);
        state.current_limit.update(&config.regulator, sensed, is_in_force, moves);
    }

    /// Once in a millisecond, for the millisecond that begins with the next tick.
    fn each_millisecond(&mut self, sensed: &Sensed) {
        let (config, state) = (&self.config, &mut self.state);
        let drive = DriveState {
            current: sensed.current.0,
            supply: sensed.supply.0,
            duty: state.current_limit.nominal_duty(state.output.duty),
            is_on: state.segment.mode != Mode::Off && state.supervisor.fault == Fault::None,
            counts: state.encoder.counts,
            rate: state.estimator.rate,
            limits: state.limits.last,
        };
        state.supervisor.each_millisecond(&config.thresholds, &drive, sensed.tick as u32);
        state.feed_forward.each_millisecond(&config.feed_forward, state.encoder.counts);
        let target = match state.segment.mode {
            Mode::Off | Mode::Voltage => return,
            Mode::Rate => {
                state.limits.now.set(Limits::STARVED, state.segment.ends_within(TICKS_PER_MS));
                state.segment.value_after(TICKS_PER_MS)
            }
            Mode::Position => state.approach_rate(&config.approach),
        };
        let limited = state.ramp.plan_millisecond(target, &config.ramp);
        state.limits.now.set(Limits::ACCELERATION, limited && state.segment.mode == Mode::Rate);
    }
}

impl LoopState {
    fn new(config: &Config) -> Self {
        Self {
            tick: None,
            encoder: Encoder::default(),
            estimator: Estimator::default(),
            supervisor: TickSupervisor::default(),
            clear: 0,
            next_segment: None,
            segment: ActiveSegment::default(),
            ramp: Ramp::default(),
            feed_forward: FeedForward::default(),
            current_limit: CurrentLimit::new(&config.regulator),
            ticks_in_ms: 0,
            output: Output::default(),
            limits: LimitLog::default(),
        }
    }

    /// Position mode: the rate that leads to the angle, 2⁻³² counts per tick.
    fn approach_rate(&mut self, config: &ApproachConfig) -> i64 {
        let unsmoothed = self.ramp.unsmoothed();
        let goal = match (self.segment.zero, self.feed_forward.index.counts) {
            (Zero::PowerOn, _) => self.segment.value,
            (Zero::Index, Some(index)) => self.segment.value.wrapping_add(i64::from(index) << 32),
            (Zero::Index, None) => {
                // The platform is held where it is.
                self.limits.now.set(Limits::NO_INDEX, true);
                unsmoothed.position
            }
        };
        let distance = fixed_to_f32(goal.wrapping_sub(unsmoothed.position));
        let max_rate = self.segment.approach_rate().map_or(config.max_rate, fixed_to_f32);
        f32_to_fixed(approach::next_rate(distance, fixed_to_f32(unsmoothed.rate), max_rate, config.acceleration))
    }
    /// The first tick, or the first after lost ones.
    #[cold]
    fn skip_ticks(&mut self, sensed: &Sensed, period: u32) {
        let tick = sensed.tick as u32;
        let Some(last) = self.tick else {
            self.encoder.start(sensed.encoder, tick.wrapping_sub(1).wrapping_mul(period));
            self.estimator.start(self.encoder.boundary);
            return;
        };
        let lost = tick.wrapping_sub(last as u32).wrapping_sub(1);
        self.output.continue_for(lost);
        self.encoder.skip(period.wrapping_mul(lost));
        if !(sensed.announced_stall && self.segment.mode == Mode::Off) {
            self.supervisor.trip(Fault::Clock, tick);
        }
    }

    /// The platform one tick ahead, by encoder and estimate.
    #[inline]
    fn platform_at_next_tick(&self) -> Platform {
        let Estimator { rate, acceleration, .. } = self.estimator;
        Platform {
            boundary: self.encoder.boundary,
            fraction: self.encoder.fraction() + rate + 0.5 * acceleration,
            rate: rate + acceleration,
        }
    }
}

/// Whether a millisecond begins with this tick.
#[inline]
pub(crate) fn begins_millisecond(tick: u64) -> bool {
    tick.is_multiple_of(CONTROL_PER_ROW)
}
