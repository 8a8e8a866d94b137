//! The rig: a rotor, a shaft, an armature and a list of effects; one step, generic over the scalar.
//!
//! In `f64` it simulates; in dual numbers it also computes the exact derivatives with respect to each parameter and initial state. User
//! models are simulated by it. The simulated stand does not use it: `hal_sim::plant` integrates the same effects by other methods.
//!
//! The step is the explicit midpoint rule, with three parts solved exactly: Coulomb friction ([`slide`]: no smoothing, no event search),
//! the current of an inductive winding ([`armature`]) and a bristle. The twist of a shaft is a Taylor series; a stiff or stuck shaft uses
//! the implicit midpoint rule ([`shaft`]). Local error O(h³) while nothing sticks, O(h²) at a reversal.
//!
//! A *row* is one sample of the log with its input, over [t, t + dt). A *demand* is the torque, current and voltage of a prescribed motion.

mod armature;
mod demand;
mod servo;
mod shaft;
mod slide;

pub use demand::Demand;
pub use servo::Servo;
use shaft::TwoBodies;
pub use slide::slide;

use drive_model::{Contributions, Law, MAX_COLUMNS, Point, Reading, Scalar, Structure, T0_C};

/// Longest step, s: the row interval of the stand's logs.
const MAX_STEP_S: f64 = 1.0e-3;
/// Largest number of steps per row: a shaft of 2 kHz in rows of 1 ms, which no row resolves.
const MAX_STEPS: f64 = 64.0;
/// Longest step in which the rotor leaves or passes rest with an inductive winding, s: L/R of a small motor.
const REST_STEP_S: f64 = 0.1e-3;

/// Parameters of the model without effects: J ω' = K i, i = (u − K ω)/R.
#[derive(Debug, Clone, Copy)]
pub struct Base<S> {
    /// Inertia J of all rotating parts, kg m².
    pub inertia: S,
    /// Motor constant K, N m/A and V s.
    pub motor_constant: S,
    /// Resistance R of the winding, Ω.
    pub resistance: S,
    /// Regulator of a position servo; only with [`Input::Setpoint`].
    pub servo: Option<Servo<S>>,
}

/// The measured quantity that drives the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Input {
    /// `u_V`
    Voltage,
    /// `i_A`
    Current,
    /// `torque_N_m`
    Torque,
    /// `theta_cmd_rad`: the setpoint of a position servo, whose regulator gives the voltage.
    Setpoint,
}

impl Input {
    /// The winding is supplied by a voltage.
    fn is_voltage(self) -> bool {
        matches!(self, Input::Voltage | Input::Setpoint)
    }
}

/// One row with its input.
#[derive(Debug, Clone, Copy)]
pub struct RowInput {
    /// Start, s.
    pub t_s: f64,
    /// Length, s.
    pub dt_s: f64,
    /// Voltage, current or torque, mean over the row; or the setpoint of the angle.
    pub input: f64,
    /// Course of the voltage about its mean `input`: coefficients of the Legendre polynomials of degree 1, 2 and 3 over the row, V. Zero
    /// for other inputs.
    pub voltage_course_V: [f64; 3],
    /// Fraction of the row in which the bridge connects the winding. Below 1 the winding is open in the rest, and its current zero there: a
    /// bridge that coasts in the off time of the PWM, and 0 for a motor that is disconnected.
    pub connected: f64,
    /// Measured angle at start and end, rad; `None`: the simulated angle.
    pub theta: Option<(f64, f64)>,
    /// Measured winding temperature, °C; `None`: the simulated temperature, if an effect heats the winding.
    pub temp_C: Option<f64>,
    /// Supply over its nominal value; 1 where it is not measured.
    pub supply_ratio: f64,
    /// The rate channel is derived from the encoder.
    pub rate_from_encoder: bool,
    /// The measured angle is the input of the model.
    pub reference_angle: bool,
    /// Columns of the log that expressions of the user use.
    pub columns: [f64; MAX_COLUMNS],
    /// Time of the first row of the log, s.
    pub start_s: f64,
}

impl RowInput {
    /// A row of which nothing but its input is measured, in a log that begins at time 0.
    pub fn new(t_s: f64, dt_s: f64, input: f64) -> Self {
        RowInput {
            t_s,
            dt_s,
            input,
            voltage_course_V: [0.0; 3],
            connected: 1.0,
            theta: None,
            temp_C: None,
            supply_ratio: 1.0,
            rate_from_encoder: false,
            reference_angle: false,
            columns: [0.0; MAX_COLUMNS],
            start_s: 0.0,
        }
    }

    /// The voltage is the same in the whole row.
    #[inline]
    fn has_constant_voltage(&self) -> bool {
        self.voltage_course_V == [0.0; 3]
    }

    /// Mean of the voltage over a part of the row, V.
    #[inline]
    fn voltage_V(&self, part: Part) -> f64 {
        if self.has_constant_voltage() {
            return self.input;
        }
        let [c0, c1, c2, c3] = self.voltage_from_V(part);
        c0 + c1 / 2.0 + c2 / 3.0 + c3 / 4.0
    }

    /// The voltage over a part of the row as a polynomial of the fraction of the part, V.
    fn voltage_from_V(&self, part: Part) -> [f64; 4] {
        let [p1, p2, p3] = self.voltage_course_V;
        // In the fraction x of the row: P1 = 2 x − 1, P2 = 6 x² − 6 x + 1, P3 = 20 x³ − 30 x² + 12 x − 1.
        let (c0, c1, c2, c3) = (self.input - p1 + p2 - p3, 2.0 * p1 - 6.0 * p2 + 12.0 * p3, 6.0 * p2 - 30.0 * p3, 20.0 * p3);
        let (x, h) = (part.from, part.length_s / self.dt_s);
        [c0 + x * (c1 + x * (c2 + x * c3)), h * (c1 + x * (2.0 * c2 + x * 3.0 * c3)), h * h * (c2 + x * 3.0 * c3), h * h * h * c3]
    }

    fn whole(&self) -> Part {
        Part { from: 0.0, length_s: self.dt_s }
    }
}

/// A part of a row.
#[derive(Debug, Clone, Copy)]
struct Part {
    /// Its begin, fraction of the row.
    from: f64,
    /// Its length, s.
    length_s: f64,
}

impl Part {
    const BEGIN: Part = Part { from: 0.0, length_s: 0.0 };
    const END: Part = Part { from: 1.0, length_s: 0.0 };

    /// Its first half.
    fn half(self) -> Part {
        Part { length_s: 0.5 * self.length_s, ..self }
    }
}

/// State of the rig.
#[derive(Debug, Clone, Copy)]
pub struct DriveState<S> {
    /// Rate of the platform, rad/s.
    pub omega: S,
    /// Angle of the platform, rad.
    pub theta: S,
    /// Current at the end of the last step, A (mean over it where there is no inductance).
    pub current: S,
    /// Rate of the motor, rad/s (only with a shaft).
    pub motor_omega: S,
    /// Motor angle minus platform angle, rad (only with a shaft).
    pub twist: S,
    /// Deflection of the bristle, rad.
    pub bristle: S,
    /// Winding temperature above [`T0_C`], K (only where it is not measured).
    pub heat_K: S,
    /// Change of the rate of the winding over the last step, rad/s.
    pub rate_change_rad_s: S,
    /// Length of the last step, s.
    pub step_s: f64,
}

impl<S: Scalar> DriveState<S> {
    /// All parts turn at `omega`, without twist or current, at the reference temperature.
    pub fn turning(omega: S, theta: S) -> Self {
        let zero = S::zero();
        DriveState {
            omega,
            theta,
            current: zero,
            motor_omega: omega,
            twist: zero,
            bristle: zero,
            heat_K: zero,
            rate_change_rad_s: zero,
            step_s: 0.0,
        }
    }
}

/// A law with its parameters.
struct EffectAtParameters<S> {
    law: Box<dyn Law<S>>,
    parameters: Vec<S>,
}

/// The model of a drive with its effects, at one set of parameters.
pub struct Rig<S: Scalar> {
    base: Base<S>,
    input: Input,
    /// Indices of the laws with contributions; all laws.
    contributing: Vec<usize>,
    effects: Vec<EffectAtParameters<S>>,
    structure: Structure<S>,
}

impl<S: Scalar> Rig<S> {
    /// A rig with these effects, each with its parameters in the order of its card.
    pub fn new(base: Base<S>, input: Input, effects: Vec<(Box<dyn Law<S>>, Vec<S>)>) -> Self {
        let mut structure = Structure::default();
        let effects: Vec<_> = effects
            .into_iter()
            .map(|(law, parameters)| {
                law.configure(&parameters, &mut structure);
                EffectAtParameters { law, parameters }
            })
            .collect();
        let contributing = (0..effects.len()).filter(|&k| !effects[k].law.has_no_contribution()).collect();
        Rig { base, input, contributing, effects, structure }
    }

    /// Structure of the drive, as configured by the effects.
    pub fn structure(&self) -> &Structure<S> {
        &self.structure
    }

    /// Number of steps for a row of `dt_s`; see [`Rig::resolves`] for the limit.
    pub fn steps(&self, dt_s: f64) -> u32 {
        self.steps_needed(dt_s).clamp(1.0, MAX_STEPS) as u32
    }

    /// Whether the steps resolve the time constants over rows of `dt_s`. Extreme parameters (an inertia near zero) are too
    /// fast: the state would not stay finite.
    pub fn resolves(&self, dt_s: f64) -> bool {
        self.steps_needed(dt_s) <= MAX_STEPS
    }

    /// Number of steps for an error below the noise over a row of `dt_s`: by the fastest time constant.
    fn steps_needed(&self, dt_s: f64) -> f64 {
        let inertia = self.base.inertia.re();
        let (motor_constant, resistance) = (self.base.motor_constant.re(), self.base.resistance.re());
        let brake = if self.input.is_voltage() { motor_constant.powi(2) / resistance } else { 0.0 };
        let mut rate_1_s = brake / inertia / 0.03;
        if let Some(servo) = &self.base.servo {
            let per_inertia = motor_constant / resistance / inertia;
            let (swing_1_s, decay_1_s) = ((servo.gain_V_rad.re() * per_inertia).sqrt(), servo.damping_V_s_rad.re() * per_inertia);
            rate_1_s = rate_1_s.max(swing_1_s / 0.1).max(decay_1_s / 0.03);
        }
        if self.structure.needs_current {
            rate_1_s = rate_1_s.max(2.0 / MAX_STEP_S);
        }
        if let Some(shaft) = &self.structure.shaft {
            let share = shaft.motor_inertia_fraction.re();
            let reduced = inertia * share * (1.0 - share);
            let (swing_1_s, decay_1_s) = ((shaft.stiffness.re() / reduced).sqrt(), shaft.damping.re() / reduced);
            // With play, rounding can decide whether a flank is touched.
            let by_shaft = if shaft.gap.re() > 0.0 {
                (swing_1_s / 0.1).max(decay_1_s / 0.2)
            } else {
                (swing_1_s / 0.2).max(decay_1_s.min(swing_1_s / 0.025))
            };
            rate_1_s = rate_1_s.max(by_shaft).max(brake / (inertia * share) / 0.1);
        }
        if let Some(stiffness) = &self.structure.bristle_N_m_rad {
            rate_1_s = rate_1_s.max((stiffness.re() / inertia).sqrt() / 0.1);
        }
        let steps = (dt_s / MAX_STEP_S).max(dt_s * rate_1_s);
        // A small slack: rounding of dt must not add a step.
        (steps - 1e-6).ceil()
    }

    /// Advances the state over one row; returns the mean current over it, A.
    pub fn advance(&self, state: &mut DriveState<S>, row: &RowInput) -> S {
        let steps = self.steps(row.dt_s);
        let at_rest = (row.dt_s / REST_STEP_S).ceil() as u32;
        if self.structure.inductance_H.is_none() || !self.input.is_voltage() || steps >= at_rest {
            return self.advance_in(state, row, steps);
        }
        // While the current rises, a rotor that leaves rest or reverses is held by the Coulomb torque for a part of the step. The mean
        // torque of the step does not contain that part.
        let start = *state;
        let current = self.advance_in(state, row, steps);
        let (from, to) = (self.motor_omega(&start).re(), self.motor_omega(state).re());
        if from * to > 0.0 || (from == 0.0 && to == 0.0 && self.is_held(state, row)) {
            return current;
        }
        *state = start;
        self.advance_in(state, row, at_rest)
    }

    /// Whether a rotor at rest stays at rest with the present input.
    fn is_held(&self, state: &DriveState<S>, row: &RowInput) -> bool {
        let x = self.point(row, Part::END, state.theta, self.motor_omega(state), state.current, state.heat_K);
        let total = self.contributions(&x, row, state.theta);
        let motor = self.motor(&total, x.omega, state.current, row, row.whole());
        let shaft = self.structure.shaft.as_ref().map_or(0.0, |s| if s.gap.re() > 0.0 { 0.0 } else { s.stiffness.re() * state.twist.re() });
        (motor.torque.re() - shaft).abs() <= motor.coulomb_torque.re()
    }

    #[inline]
    fn advance_in(&self, state: &mut DriveState<S>, row: &RowInput, steps: u32) -> S {
        if steps == 1 {
            return self.step(state, row, row.whole());
        }
        let length_s = row.dt_s / f64::from(steps);
        let mut current = S::zero();
        for k in 0..steps {
            current += self.step(state, row, Part { from: f64::from(k) / f64::from(steps), length_s });
        }
        current / f64::from(steps)
    }

    /// Channel readings at the start of `row`, before lag and skew, for rate, angle and temperature rise there; `current` is the mean of
    /// the row.
    pub fn read(&self, (omega, theta, heat_K): (S, S, S), row: &RowInput, current: S) -> Reading<S> {
        let mut reading = Reading::of(omega, theta, current);
        let x = self.point(row, Part::BEGIN, theta, omega, current, heat_K);
        for effects in &self.effects {
            effects.law.measure(&effects.parameters, &x, &mut reading);
        }
        reading
    }

    /// Current at the start of `row`, A, for a log with instantaneous current samples.
    pub fn current_now(&self, state: &DriveState<S>, row: &RowInput) -> S {
        if self.input == Input::Current {
            return S::from(row.input);
        }
        let omega = self.motor_omega(state);
        let total = self.contributions(&self.point(row, Part::BEGIN, state.theta, omega, state.current, state.heat_K), row, state.theta);
        let motor_constant = total.motor_factor.times(self.base.motor_constant);
        let Some(inductance) = self.structure.inductance_H else {
            return self.armature(&total, motor_constant, omega, state.current, row, Part::BEGIN).0;
        };
        if state.step_s == 0.0 || state.current == 0.0 || row.connected < 1.0 {
            return state.current;
        }
        // Along a ramp of the rate the current follows the back-EMF with the delay L/R. A step of length h takes the back-EMF of its
        // middle: its mean current is right, but the current at its end has the delay h/(1 − exp(−h R/L)) − h/2.
        let time_constant_s = inductance / total.resistance_of(self.base.resistance);
        let settled = -(-S::from(state.step_s) / time_constant_s).exp_m1();
        let delay_s = settled.recip() * state.step_s - 0.5 * state.step_s;
        let acceleration_rad_s2 = state.rate_change_rad_s / state.step_s;
        state.current - motor_constant * acceleration_rad_s2 * (delay_s - time_constant_s) * time_constant_s / inductance
    }

    /// Sum of the contributions of all effects at `x`, a point of `row`, and of the regulator of a servo at the simulated angle `theta`.
    /// The regulator acts on that angle: a line between two measured ones lacks the curvature of the motion.
    #[inline]
    pub(crate) fn contributions(&self, x: &Point<S>, row: &RowInput, theta: S) -> Contributions<S> {
        let mut total = Contributions::none();
        for &k in &self.contributing {
            let effects = &self.effects[k];
            effects.law.contribute(&effects.parameters, x, &mut total);
        }
        if let Some(servo) = &self.base.servo {
            total.voltage += servo.voltage_V(row.input, theta, x.omega);
        }
        total
    }

    /// The evaluation point of a part of a row.
    #[inline]
    fn point(&self, row: &RowInput, part: Part, theta: S, omega: S, current: S, heat_K: S) -> Point<S> {
        let from_s = row.t_s + part.from * row.dt_s;
        let theta = match row.theta {
            Some((a, b)) => S::from(a + (b - a) * (part.from + 0.5 * part.length_s / row.dt_s)),
            None => theta,
        };
        Point {
            from_s,
            to_s: from_s + part.length_s,
            start_s: row.start_s,
            theta,
            theta_measured: row.theta.is_some(),
            omega,
            current,
            voltage: if self.input == Input::Voltage { S::from(row.voltage_V(part)) } else { S::zero() },
            temp_C: row.temp_C.map_or(heat_K + T0_C, S::from),
            supply_ratio: row.supply_ratio,
            rate_from_encoder: row.rate_from_encoder,
            reference_angle: row.reference_angle,
            columns: row.columns,
        }
    }

    /// One step over a part of the row; returns the mean current over it.
    #[inline]
    fn step(&self, state: &mut DriveState<S>, row: &RowInput, part: Part) -> S {
        if self.structure.is_plain() { self.step_plain(state, row, part) } else { self.step_structured(state, row, part) }
    }

    /// The step of a rotor with a winding: the case of most models, without copies of the whole state.
    #[inline]
    fn step_plain(&self, state: &mut DriveState<S>, row: &RowInput, part: Part) -> S {
        let half = part.half();
        let x = self.point(row, half, state.theta, state.omega, state.current, state.heat_K);
        let motor = self.motor(&self.contributions(&x, row, state.theta), state.omega, state.current, row, half);
        let (middle, turned) = slide(state.omega, motor.torque, motor.coulomb_torque, self.base.inertia, half.length_s);
        let x = self.point(row, part, state.theta + turned, middle, motor.last_A, state.heat_K);
        let motor = self.motor(&self.contributions(&x, row, state.theta + turned), middle, state.current, row, part);
        let (omega, turned) = slide(state.omega, motor.torque, motor.coulomb_torque, self.base.inertia, part.length_s);
        state.rate_change_rad_s = omega - state.omega;
        state.step_s = part.length_s;
        state.omega = omega;
        state.theta += turned;
        state.current = motor.last_A;
        motor.mean_A
    }

    /// The step with shaft, bristle, winding temperature, or a law that depends on the current.
    #[inline(never)]
    fn step_structured(&self, state: &mut DriveState<S>, row: &RowInput, part: Part) -> S {
        let start = *state;
        let half_part = part.half();
        let mut x = self.point(row, half_part, start.theta, self.motor_omega(&start), start.current, start.heat_K);
        if self.structure.needs_current && self.input.is_voltage() {
            // The voltage may have jumped: the laws get the current that the new voltage drives.
            x.current = self.motor(&self.contributions(&x, row, start.theta), x.omega, start.current, row, half_part).mean_A;
        }
        let (half, _) = self.stage(&start, &start, &self.contributions(&x, row, start.theta), row, half_part);
        let x = self.point(row, part, half.theta, self.motor_omega(&half), half.current, half.heat_K);
        let (end, current) = self.stage(&start, &half, &self.contributions(&x, row, half.theta), row, part);
        *state = end;
        state.rate_change_rad_s = self.motor_omega(&end) - self.motor_omega(&start);
        state.step_s = part.length_s;
        current
    }

    /// Rate at the friction and the winding.
    fn motor_omega(&self, state: &DriveState<S>) -> S {
        if self.structure.shaft.is_some() { state.motor_omega } else { state.omega }
    }

    /// Motor and friction over a part of the row at the rate `omega`.
    #[inline]
    fn motor(&self, total: &Contributions<S>, omega: S, current: S, row: &RowInput, part: Part) -> Motor<S> {
        let motor_constant = total.motor_factor.times(self.base.motor_constant);
        let (drive, mean_A, last_A) = match self.input {
            Input::Voltage | Input::Setpoint => {
                let (mean, last) = self.armature(total, motor_constant, omega, current, row, part);
                (motor_constant * mean, mean, last)
            }
            Input::Current => (motor_constant * row.input, S::from(row.input), S::from(row.input)),
            Input::Torque => (S::from(row.input), S::zero(), S::zero()),
        };
        let torque = total.torque.added_to(drive);
        let torque = total.viscous_N_m_s().map_or(torque, |viscous| torque - viscous * omega);
        Motor { torque, coulomb_torque: total.coulomb_torque_under(drive), mean_A, last_A }
    }

    /// Inertia of the platform side beside `constant`, kg m², and the torque −½ J′ ω² of Lagrange's equation: (J ω)′ − ½ J′ ω² is the
    /// torque.
    #[inline]
    fn varying_inertia(&self, total: &Contributions<S>, constant: S, omega: S) -> (S, S) {
        let inertia = constant + self.base.inertia * total.inertia_variation.value();
        (inertia, -(self.base.inertia * total.inertia_slope.value() * omega * omega * 0.5))
    }

    /// From `start` over a part of the row, with the contributions `total` at the state `mid`; returns the end state and the mean current.
    fn stage(
        &self,
        start: &DriveState<S>,
        mid: &DriveState<S>,
        total: &Contributions<S>,
        row: &RowInput,
        part: Part,
    ) -> (DriveState<S>, S) {
        let mut end = *start;
        let h = part.length_s;
        let omega = self.motor_omega(mid);
        let Motor { mut torque, coulomb_torque: mut coulomb, mean_A: current, last_A } = self.motor(total, omega, start.current, row, part);
        end.current = last_A;
        if let (Some(thermal), None) = (&self.structure.thermal, row.temp_C) {
            let loss_W = total.resistance_factor.times(self.base.resistance) * current * current;
            end.heat_K = start.heat_K + (loss_W - mid.heat_K / thermal.K_W) / thermal.J_K * h;
        }
        if let Some(stiffness) = self.structure.bristle_N_m_rad {
            let (mean, last) = bristle(start.bristle, omega, coulomb, stiffness, h);
            torque -= stiffness * mean;
            coulomb = S::zero();
            end.bristle = last;
        }
        match &self.structure.shaft {
            None => {
                let mut inertia = self.base.inertia;
                if self.structure.varying_inertia {
                    let (varying, reaction) = self.varying_inertia(total, inertia, omega);
                    inertia = varying;
                    torque += reaction;
                }
                let (omega, turned) = slide(start.omega, torque, coulomb, inertia, h);
                end.omega = omega;
                end.motor_omega = omega;
                end.theta = start.theta + turned;
            }
            Some(shaft) => {
                let motor_inertia = self.base.inertia * shaft.motor_inertia_fraction;
                let mut bodies = TwoBodies {
                    motor_torque: torque,
                    coulomb_torque: coulomb,
                    motor_inertia,
                    platform_inertia: self.base.inertia - motor_inertia,
                    platform_torque: S::zero(),
                };
                if self.structure.varying_inertia {
                    (bodies.platform_inertia, bodies.platform_torque) = self.varying_inertia(total, bodies.platform_inertia, mid.omega);
                }
                bodies.twist(shaft, start, &mut end, h);
            }
        }
        (end, current)
    }
}

/// Motor and friction over a part of a row.
struct Motor<S> {
    /// Torque on the rotor without the Coulomb torque, N m.
    torque: S,
    /// Coulomb torque, N m.
    coulomb_torque: S,
    /// Mean current, A.
    mean_A: S,
    /// Current at the end, A.
    last_A: S,
}

/// Dahl's bristle z' = ω − σ|ω|z/c over `h` at constant rate: (mean, last) deflection. Exact in z for any step length.
fn bristle<S: Scalar>(z: S, omega: S, coulomb: S, stiffness: S, h: f64) -> (S, S) {
    if coulomb <= 0.0 || omega == 0.0 {
        return (z, z);
    }
    let limit = coulomb / stiffness * omega.signum();
    let decay = -(omega.abs() * stiffness / coulomb * h);
    let toward = -decay.exp_m1();
    let last = z + (limit - z) * toward;
    // Mean of the exponential; by series for a small exponent.
    let mean_part = if decay < -1e-6 { (toward / decay) + 1.0 } else { decay * -0.5 };
    (z + (limit - z) * mean_part, last)
}
