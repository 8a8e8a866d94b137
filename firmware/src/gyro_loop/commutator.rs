//! The switch between correction loop and pulses, sample by sample.
//!
//! A session: rest (loop closed), lead (loop open, nothing given: the correction's current has died away, and the current's zero is
//! measured), the two pulses, the loop closed again; as often as was asked. Called once for each sample, at t_k; what it returns acts from t_{k+1}
//! on, when the next sample is taken. Whatever goes wrong closes the loop with the next step.

use super::plan::nearest;
use super::{Bad, Cycle, Integrator, Plan, Polarity, Pulse, Scales};
use crate::board::{GyroSample, Stamped, TICKS_PER_ROW, Ticks, TorquerStep};
use crate::status::Fault;

/// Samples of the lead: half a second, so that noise of a code in the current's zero is 0.002 °/h.
pub const LEAD_ROWS: u32 = 500;
/// Of these, what the torquer's lag may take.
const LAG_ROWS: u32 = 100;
/// After an edge the current may be another for so many samples: the amplifier's and the torquer's lag.
const EDGE_ROWS: u32 = 20;

/// Where a session is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Phase {
    /// None runs; the loop is closed.
    #[default]
    Idle,
    /// The loop is closed before a cycle; so many samples are left.
    Rest(u32),
    /// It is open, and nothing is given; so many are left.
    Lead(u32),
    /// It is open, and the pulses run.
    Pulses,
}

impl Phase {
    /// Whether the correction loop is closed.
    pub fn is_closed(self) -> bool {
        matches!(self, Self::Idle | Self::Rest(_))
    }
}

/// The session's state between samples.
#[derive(Clone, Copy, Debug)]
pub struct Commutator {
    scales: Scales,
    plan: Plan,
    phase: Phase,
    /// The session is one cycle without pulses.
    nulls: bool,
    /// Cycles of the session that are over.
    done: u32,
    number: u32,
    pulse: Pulse,
    integrator: Integrator,
    began: Ticks,
    rest_current: (i64, u32),
    /// What was given from the last sample on, and from the next.
    given: [TorquerStep; 2],
    since_edge: u32,
    aborted: bool,
}

impl Commutator {
    /// Nothing runs, the loop is closed.
    pub fn new(scales: Scales) -> Self {
        Self {
            scales,
            plan: Plan::default(),
            phase: Phase::Idle,
            nulls: false,
            done: 0,
            number: 0,
            pulse: Pulse::default(),
            integrator: Integrator::new(1),
            began: Ticks::default(),
            rest_current: (0, 0),
            given: [TorquerStep::default(); 2],
            since_edge: 0,
            aborted: false,
        }
    }

    /// Other scales from the next sample on. Not within a session.
    pub fn scale(&mut self, scales: Scales) {
        if self.phase == Phase::Idle {
            self.scales = scales;
        }
    }

    /// The scales in force.
    pub fn scales(&self) -> &Scales {
        &self.scales
    }

    /// Begins a session; `nulls`: one cycle without pulses. The plan was checked ([`Plan::pulse`]); one that cannot be is none.
    pub fn start(&mut self, plan: Plan, nulls: bool) {
        if plan.pulse(0, &self.scales).is_err() || plan.cycles == 0 {
            return;
        }
        self.plan = plan;
        self.nulls = nulls;
        self.done = 0;
        self.aborted = false;
        self.rest();
    }

    /// Ends the session with the next sample.
    pub fn abort(&mut self) {
        self.aborted = self.phase != Phase::Idle;
    }

    /// Where the session is.
    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// Cycles of the session that are over, and how many it has.
    pub fn progress(&self) -> (u32, u32) {
        (self.done, if self.nulls { 1 } else { self.plan.cycles })
    }

    /// 1 in the first pulse, 2 in the second, else 0; and four times the number of the cycle that runs or has run: what a log carries.
    pub fn mark(&self) -> u32 {
        let half = match self.phase {
            Phase::Pulses => 1 + u32::from(self.integrator.taken() > self.pulse.samples),
            _ => 0,
        };
        self.number.wrapping_mul(4) | half
    }

    /// Takes the sample of `at`, whole milliseconds one after the other, and the latched fault. What the torquer is given from the next on, and
    /// the cycle that is over with this sample.
    pub fn step(&mut self, sample: Option<Stamped<GyroSample>>, at: Ticks, fault: Fault) -> (TorquerStep, Option<Cycle>) {
        let fresh = sample.filter(|sample| sample.at == at).map(|sample| sample.value);
        let [before, _] = self.given;
        let bad = self.wrong(sample.is_some(), fresh.as_ref(), before, fault);
        let corrected = fresh.map_or(TorquerStep::default(), |sample| self.scales.correction(sample.angle));
        let mut over = None;
        let next = match (self.phase, bad) {
            (Phase::Idle, _) => corrected,
            (_, bad) if bad != Bad::No => {
                over = self.end(bad);
                corrected
            }
            (Phase::Rest(left), _) => {
                self.phase = if left > 1 { Phase::Rest(left - 1) } else { Phase::Lead(LEAD_ROWS) };
                self.rest_current = (0, 0);
                if left > 1 { corrected } else { TorquerStep::default() }
            }
            (Phase::Lead(left), _) => {
                // The first belong to the torquer's lag.
                if let Some(sample) = fresh.filter(|_| left <= LEAD_ROWS - LAG_ROWS) {
                    self.rest_current.0 += i64::from(sample.torquer);
                    self.rest_current.1 += sample.conversions;
                }
                self.phase = if left > 1 { Phase::Lead(left - 1) } else { self.first(at) };
                if left > 1 { TorquerStep::default() } else { self.pulse_step(0) }
            }
            (Phase::Pulses, _) => {
                if let Some(sample) = &fresh {
                    self.integrator.take(sample);
                }
                let taken = self.integrator.taken();
                if self.integrator.sums().is_some() {
                    over = self.end(Bad::No);
                }
                // The step of interval `taken`: the first 2 N are pulses, then the loop is closed again.
                if taken < 2 * self.pulse.samples { self.pulse_step(taken) } else { corrected }
            }
        };
        self.since_edge = if next.0.abs_diff(before.0) > 1 { 0 } else { self.since_edge.saturating_add(1) };
        self.given = [self.given[1], next];
        (next, over)
    }

    fn pulse_step(&self, n: u32) -> TorquerStep {
        TorquerStep(self.pulse.step(n))
    }

    /// The first pulse begins with the next sample.
    fn first(&mut self, at: Ticks) -> Phase {
        let mut pulse = self.plan.pulse(self.done, &self.scales).unwrap_or_default();
        if self.nulls {
            pulse.amplitude = 0;
        }
        self.pulse = pulse;
        self.integrator = Integrator::new(pulse.samples);
        self.began = at + TICKS_PER_ROW;
        self.number = self.number.wrapping_add(1);
        Phase::Pulses
    }

    fn rest(&mut self) {
        self.phase = Phase::Rest(nearest(self.plan.rest_s as f32 * 1e3).max(1));
    }

    /// What is wrong with this sample, as far as the phase minds.
    fn wrong(&self, is_there: bool, fresh: Option<&GyroSample>, given: TorquerStep, fault: Fault) -> Bad {
        match (fresh, self.phase) {
            (_, Phase::Idle) => Bad::No,
            _ if fault != Fault::None => Bad::Fault(fault),
            _ if self.aborted => Bad::Aborted,
            (None, _) if !is_there => Bad::Silent,
            (None, Phase::Lead(_) | Phase::Pulses) => Bad::SampleLost,
            (Some(sample), Phase::Lead(_) | Phase::Pulses) if self.scales.is_saturated(sample.angle) => Bad::Saturated,
            (Some(sample), Phase::Pulses) if self.since_edge > EDGE_ROWS && self.scales.is_limited(sample, given) => Bad::Limited,
            (Some(sample), Phase::Pulses) if self.integrator.taken() > 1 && self.conversions_changed(sample) => Bad::SampleLost,
            _ => Bad::No,
        }
    }

    fn conversions_changed(&self, sample: &GyroSample) -> bool {
        self.integrator.so_far().conversions != sample.conversions
    }

    /// A cycle is over, or the session before its first.
    fn end(&mut self, bad: Bad) -> Option<Cycle> {
        let in_pulses = self.phase == Phase::Pulses;
        // A session that ends between two cycles has no bad one; what goes wrong in the lead is a cycle that did not begin.
        let told = in_pulses || matches!(self.phase, Phase::Lead(_)) || bad != Bad::Aborted;
        if !in_pulses {
            self.number = self.number.wrapping_add(u32::from(told));
            self.integrator = Integrator::new(1);
        }
        let polarity = if self.nulls { Polarity::Zero } else { self.plan.sequence.polarity(self.done) };
        let cycle = Cycle {
            number: self.number,
            position: self.plan.position,
            polarity,
            samples: self.plan.samples(),
            at: self.began,
            sums: self.integrator.so_far(),
            rest_current: self.rest_current,
            bad,
        };
        self.done = self.done.saturating_add(1);
        let (done, cycles) = self.progress();
        if done >= cycles || bad.ends_session() {
            self.phase = Phase::Idle;
            self.aborted = false;
        } else {
            self.rest();
        }
        told.then_some(cycle)
    }
}
