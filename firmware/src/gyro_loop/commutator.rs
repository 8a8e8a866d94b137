//! Commutator: switches between correction loop and pulses, sample by sample.
//!
//! Each cycle of a session: rest (loop closed), lead (loop open at zero output: the correction's current decays, then the current's zero is
//! measured), the two pulses, loop closed. Called once per sample, at t_k; the step returned acts from t_{k+1} on, when the next sample is
//! taken. Any error closes the loop with the next step.

use super::plan::nearest;
use super::{Cycle, Integrator, Plan, Polarity, Pulse, Rejection, Scales};
use crate::board::{GyroSample, Stamped, TICKS_PER_ROW, Ticks, TorquerStep};
use crate::status::Fault;

/// Samples of the lead, 0.5 s: with a noise of one code the current's zero is known to 0.002 °/h.
pub const LEAD_ROWS: u32 = 500;
/// Samples of the lead that are left out for the torquer's lag.
const LAG_ROWS: u32 = 100;
/// Samples after an edge for which the current may differ: lag of amplifier and torquer.
const EDGE_ROWS: u32 = 20;

/// Phase of a session.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Phase {
    /// No session; the loop is closed.
    #[default]
    Idle,
    /// Before a cycle, loop closed: samples left.
    Rest(u32),
    /// Loop open at zero output: samples left.
    Lead(u32),
    /// Loop open, pulses.
    Pulses,
}

impl Phase {
    /// Whether the correction loop is closed.
    pub fn is_closed(self) -> bool {
        matches!(self, Self::Idle | Self::Rest(_))
    }
}

/// State of the session.
#[derive(Clone, Copy, Debug)]
pub struct Commutator {
    scales: Scales,
    plan: Plan,
    phase: Phase,
    /// The session is one cycle without pulses.
    zero_input: bool,
    /// Finished cycles of the session.
    finished: u32,
    /// Number of the cycle since power-on.
    number: u32,
    pulse: Pulse,
    integrator: Integrator,
    start: Ticks,
    rest_current: (i64, u32),
    /// Steps from the last sample on, and from the next one.
    steps: [TorquerStep; 2],
    since_edge: u32,
    aborted: bool,
}

impl Commutator {
    /// No session; the loop is closed.
    pub fn new(scales: Scales) -> Self {
        Self {
            scales,
            plan: Plan::default(),
            phase: Phase::Idle,
            zero_input: false,
            finished: 0,
            number: 0,
            pulse: Pulse::default(),
            integrator: Integrator::new(1),
            start: Ticks::default(),
            rest_current: (0, 0),
            steps: [TorquerStep::default(); 2],
            since_edge: 0,
            aborted: false,
        }
    }

    /// Other scales from the next sample on, unless a session runs.
    pub fn set_scales(&mut self, scales: Scales) {
        if self.phase == Phase::Idle {
            self.scales = scales;
        }
    }

    /// The scales in force.
    pub fn scales(&self) -> &Scales {
        &self.scales
    }

    /// Starts a session. `zero_input`: one cycle without pulses. Does nothing with a plan that fails [`Plan::pulse`].
    pub fn start(&mut self, plan: Plan, zero_input: bool) {
        if plan.pulse(0, &self.scales).is_err() || plan.cycles == 0 {
            return;
        }
        self.plan = plan;
        self.zero_input = zero_input;
        self.finished = 0;
        self.aborted = false;
        self.rest();
    }

    /// Ends the session with the next sample.
    pub fn abort(&mut self) {
        self.aborted = self.phase != Phase::Idle;
    }

    /// Phase of the session.
    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// Finished cycles of the session, and its number of cycles.
    pub fn progress(&self) -> (u32, u32) {
        (self.finished, if self.zero_input { 1 } else { self.plan.cycles })
    }

    /// Phase for a log: 1 in the first pulse, 2 in the second, else 0; plus four times the number of the newest cycle.
    pub fn mark(&self) -> u32 {
        let half = match self.phase {
            Phase::Pulses => 1 + u32::from(self.integrator.count() > self.pulse.samples),
            _ => 0,
        };
        self.number.wrapping_mul(4) | half
    }

    /// The sample of `at`, a whole millisecond, and the latched fault. Returns the torquer's step from the next millisecond on, and the
    /// cycle that ends with this sample.
    pub fn update(&mut self, sample: Option<Stamped<GyroSample>>, at: Ticks, fault: Fault) -> (TorquerStep, Option<Cycle>) {
        let fresh = sample.filter(|sample| sample.at == at).map(|sample| sample.value);
        let [last_step, _] = self.steps;
        let rejection = self.rejection(sample.is_some(), fresh.as_ref(), last_step, fault);
        let correction = fresh.map_or(TorquerStep::default(), |sample| self.scales.correction(sample.angle));
        let mut finished = None;
        let next = match (self.phase, rejection) {
            (Phase::Idle, _) => correction,
            (_, rejection) if rejection != Rejection::None => {
                finished = self.end(rejection);
                correction
            }
            (Phase::Rest(left), _) => {
                self.phase = if left > 1 { Phase::Rest(left - 1) } else { Phase::Lead(LEAD_ROWS) };
                self.rest_current = (0, 0);
                if left > 1 { correction } else { TorquerStep::default() }
            }
            (Phase::Lead(left), _) => {
                // The first samples belong to the torquer's lag.
                if let Some(sample) = fresh.filter(|_| left <= LEAD_ROWS - LAG_ROWS) {
                    self.rest_current.0 += i64::from(sample.torquer);
                    self.rest_current.1 += sample.conversions;
                }
                self.phase = if left > 1 { Phase::Lead(left - 1) } else { self.begin_pulses(at) };
                if left > 1 { TorquerStep::default() } else { self.pulse_step(0) }
            }
            (Phase::Pulses, _) => {
                if let Some(sample) = &fresh {
                    self.integrator.add(sample);
                }
                let interval = self.integrator.count();
                if self.integrator.sums().is_some() {
                    finished = self.end(Rejection::None);
                }
                // The first 2 N intervals are pulses; then the loop is closed.
                if interval < 2 * self.pulse.samples { self.pulse_step(interval) } else { correction }
            }
        };
        self.since_edge = if next.0.abs_diff(last_step.0) > 1 { 0 } else { self.since_edge.saturating_add(1) };
        self.steps = [self.steps[1], next];
        (next, finished)
    }

    fn pulse_step(&self, n: u32) -> TorquerStep {
        TorquerStep(self.pulse.step(n))
    }

    /// The first pulse begins with the next sample.
    fn begin_pulses(&mut self, at: Ticks) -> Phase {
        let mut pulse = self.plan.pulse(self.finished, &self.scales).unwrap_or_default();
        if self.zero_input {
            pulse.amplitude = 0;
        }
        self.pulse = pulse;
        self.integrator = Integrator::new(pulse.samples);
        self.start = at + TICKS_PER_ROW;
        self.number = self.number.wrapping_add(1);
        Phase::Pulses
    }

    fn rest(&mut self) {
        self.phase = Phase::Rest(nearest(self.plan.rest_s as f32 * 1e3).max(1));
    }

    /// Reason to reject this sample in the present phase. `has_sensor`: there is a sample, of whatever time; `step`: the torquer's.
    fn rejection(&self, has_sensor: bool, fresh: Option<&GyroSample>, step: TorquerStep, fault: Fault) -> Rejection {
        match (fresh, self.phase) {
            (_, Phase::Idle) => Rejection::None,
            _ if fault != Fault::None => Rejection::Fault(fault),
            _ if self.aborted => Rejection::Aborted,
            (None, _) if !has_sensor => Rejection::Silent,
            (None, Phase::Lead(_) | Phase::Pulses) => Rejection::SampleLost,
            (Some(sample), Phase::Lead(_) | Phase::Pulses) if self.scales.is_saturated(sample.angle) => Rejection::Saturated,
            (Some(sample), Phase::Pulses) if self.since_edge > EDGE_ROWS && self.scales.is_limited(sample, step) => Rejection::Limited,
            (Some(sample), Phase::Pulses) if self.integrator.count() > 1 && self.conversions_changed(sample) => Rejection::SampleLost,
            _ => Rejection::None,
        }
    }

    fn conversions_changed(&self, sample: &GyroSample) -> bool {
        self.integrator.partial_sums().conversions != sample.conversions
    }

    /// Ends the cycle, or the session before its first one.
    fn end(&mut self, rejection: Rejection) -> Option<Cycle> {
        let in_pulses = self.phase == Phase::Pulses;
        // A session aborted during rest has no rejected cycle; an error in the lead rejects a cycle that did not begin.
        let is_cycle = in_pulses || matches!(self.phase, Phase::Lead(_)) || rejection != Rejection::Aborted;
        if !in_pulses {
            self.number = self.number.wrapping_add(u32::from(is_cycle));
            self.integrator = Integrator::new(1);
        }
        let polarity = if self.zero_input { Polarity::Zero } else { self.plan.sequence.polarity(self.finished) };
        let cycle = Cycle {
            number: self.number,
            position: self.plan.position,
            polarity,
            samples: self.plan.samples(),
            start: self.start,
            sums: self.integrator.partial_sums(),
            rest_current: self.rest_current,
            rejection,
        };
        self.finished = self.finished.saturating_add(1);
        let (finished, cycles) = self.progress();
        if finished >= cycles || rejection.ends_session() {
            self.phase = Phase::Idle;
            self.aborted = false;
        } else {
            self.rest();
        }
        is_cycle.then_some(cycle)
    }
}
