//! Drives unlike the stand's: a bridge that coasts, a motor that is disconnected, a position servo. Each is simulated here with steps of 10
//! µs, switched and not averaged.

use identification::deadline::Deadline;
use identification::identify::evaluation::{Evaluation, EvaluationError, ParameterTreatment, evaluate};
use identification::identify::explain::{Explanation, Remark, Verdict, explain};
use identification::identify::fit::FitResult;
use identification::log::{Column, Log};
use identification::model::Model;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

pub(super) const STEP_S: f64 = 10e-6;
const ROW_S: f64 = 10e-3;
const SUPPLY_V: f64 = 12.0;

/// Random numbers.
pub(super) struct Draw(Xoshiro256PlusPlus);

impl Draw {
    pub(super) fn new(seed: u64) -> Draw {
        Draw(Xoshiro256PlusPlus::seed_from_u64(seed))
    }
    pub(super) fn even(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }
    pub(super) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.even()).sum::<f64>() - 6.0
    }
}

/// J, K, R, viscous and Coulomb friction.
#[derive(Clone, Copy)]
pub(super) struct Drive {
    pub inertia_kg_m2: f64,
    pub motor_constant_N_m_A: f64,
    pub resistance_ohm: f64,
    pub viscous_N_m_s: f64,
    pub coulomb_N_m: f64,
}

/// A small motor.
const MOTOR: Drive =
    Drive { inertia_kg_m2: 2.2e-4, motor_constant_N_m_A: 0.0234, resistance_ohm: 2.3, viscous_N_m_s: 2e-5, coulomb_N_m: 8e-4 };
/// A servo at its output shaft.
const SERVO: Drive = Drive { inertia_kg_m2: 0.02, motor_constant_N_m_A: 0.5, resistance_ohm: 3.0, viscous_N_m_s: 0.01, coulomb_N_m: 0.15 };

impl Drive {
    /// Rate and angle after a step with the motor's current.
    pub(super) fn step(&self, (omega, theta): (f64, f64), current_A: f64) -> (f64, f64) {
        let torque = self.motor_constant_N_m_A * current_A - self.viscous_N_m_s * omega;
        let rate_after = |omega: f64, sign: f64, time_s: f64| omega + time_s * (torque - self.coulomb_N_m * sign) / self.inertia_kg_m2;
        let sliding = rate_after(omega, omega.signum(), STEP_S);
        let next = if omega == 0.0 || sliding * omega < 0.0 {
            // From standstill on, for the rest of the step, it slides the other way or is held.
            let left_s = if omega == 0.0 { STEP_S } else { STEP_S * sliding / (sliding - omega) };
            if torque.abs() <= self.coulomb_N_m { 0.0 } else { rate_after(0.0, torque.signum(), left_s) }
        } else {
            sliding
        };
        (next, theta + STEP_S * 0.5 * (omega + next))
    }
    pub(super) fn current_A(&self, voltage_V: f64, omega: f64) -> f64 {
        (voltage_V - self.motor_constant_N_m_A * omega) / self.resistance_ohm
    }
}

/// Name of a column, and its value by time and level.
type LoggedColumn<'a> = (&'a str, &'a dyn Fn(f64, f64) -> f64);

/// A log of rows of 10 ms. `current` gives the current from (time, level of the row, state), `level` a new level each half second or so.
fn log(
    drive: &Drive,
    (rows, noise_rad_s): (usize, f64),
    level: impl Fn(&mut Draw, f64) -> f64,
    current: impl Fn(f64, f64, (f64, f64)) -> f64,
    columns: &[LoggedColumn],
    notes: &[(&str, &str)],
) -> Log {
    let mut draw = Draw::new(7);
    let (mut state, mut until_s, mut now) = ((0.0, 0.0), 0.0, 0.0);
    let mut values: Vec<Vec<f64>> = vec![Vec::new(); 4 + columns.len()];
    for row in 0..rows {
        let t_s = row as f64 * ROW_S;
        if t_s >= until_s {
            now = level(&mut draw, t_s);
            until_s = t_s + 0.2 + 0.6 * draw.even();
        }
        let count = std::f64::consts::TAU / 16_384.0;
        let begin: [f64; 3] = [t_s, state.0 + noise_rad_s * draw.normal(), (state.1 / count).floor() * count];
        let mut charge = 0.0;
        let steps = (ROW_S / STEP_S).round() as usize;
        for k in 0..steps {
            let i = current(t_s + k as f64 * STEP_S, now, state);
            charge += i;
            state = drive.step(state, i);
        }
        let mean = charge / steps as f64 + 2e-3 * draw.normal();
        let all = begin.into_iter().chain([mean]).chain(columns.iter().map(|(_, f)| f(t_s, now)));
        values.iter_mut().zip(all).for_each(|(column, value)| column.push(value));
    }
    let names = ["t_s", "omega_rad_s", "theta_rad", "i_A"].into_iter().chain(columns.iter().map(|(name, _)| *name));
    let columns = names.zip(values).map(|(name, values)| Column { name: name.to_owned(), values }).collect();
    let notes = notes.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect::<Vec<_>>();
    Log::new("bench.csv", columns, notes).expect("a log")
}

fn model(input: &str, effects: &str, more: &str) -> Model {
    let text = format!(
        "[drive]\ninput = \"{input}\"\neffects = [{effects}]\n[parameters]\ninertia_kg_m2 = 3e-4\nmotor_constant_N_m_A = 0.02\nresistance_ohm = 2\n{more}"
    );
    Model::parse(&text, "believed.toml").expect("a model")
}

const FRICTION: &str = "\"viscous\", \"coulomb\"";

pub(super) fn explained(log: Log, model: &Model) -> Explanation {
    explain(vec![log], model, &|_| {}).expect("an explanation")
}

pub(super) fn fitted(log: &Log, model: &Model) -> FitResult {
    match evaluate(log, model, ParameterTreatment::Fitted, Deadline::NEVER) {
        Ok(Evaluation::Evaluated(evaluated)) => evaluated.result,
        Ok(Evaluation::ImplausibleLog(defects)) => panic!("{defects:?}"),
        Err(e) => panic!("{e}"),
    }
}

/// Asserts that a parameter is within 4 σ of its true value, beside the error of the steps of this simulation, and known to a few percent.
fn near(result: &FitResult, name: &str, truth: f64) {
    let k = result.parameters.list.iter().position(|p| p.name == name).expect("a parameter");
    let (value, sigma) = (result.parameters.list[k].value, result.sigmas[k]);
    assert!((value - truth).abs() <= 4.0 * sigma + 2e-4 * truth && sigma < 0.05 * truth, "{name}: {value} ± {sigma}, true {truth}");
}

/// A log of a bridge that switches at 10 kHz and leaves the winding open in the off time; `friction_N_m` is the Coulomb torque.
fn coasting(rows: usize, notes: &[(&str, &str)]) -> Log {
    // Pulses in the middle of the period, as of a centred PWM: at its beginning, where the row is read, the ripple of the rate is zero.
    let on = |t_s: f64, u_V: f64| (((t_s + 0.5 * STEP_S) * 1e4).fract() - 0.5).abs() < 0.5 * u_V.abs() / SUPPLY_V;
    let current = |t_s: f64, u_V: f64, (omega, _): (f64, f64)| {
        if on(t_s, u_V) { MOTOR.current_A(SUPPLY_V * u_V.signum(), omega) } else { 0.0 }
    };
    // Whole fifths of the period, two steps of the simulation: −0.6 … 0.6.
    let level = |draw: &mut Draw, _: f64| SUPPLY_V * (3.5 * (2.0 * draw.even() - 1.0)).round() / 5.0;
    log(&MOTOR, (rows, 0.02), level, current, &[("u_V", &|_, u| u)], notes)
}

#[test]
fn bridge_that_coasts_is_described_by_its_note() {
    // How the current was recorded is not stated: values at t fit better while the friction is missing, means over the row beside it.
    let notes = [("u_V", "coasting"), ("supply_nominal_V", "12"), ("omega_rad_s", "tachometer")];
    let result = fitted(&coasting(3000, &notes), &model("u_V", FRICTION, ""));
    near(&result, "inertia_kg_m2", MOTOR.inertia_kg_m2);
    near(&result, "motor_constant_N_m_A", MOTOR.motor_constant_N_m_A);
    near(&result, "resistance_ohm", MOTOR.resistance_ohm);
    near(&result, "coulomb_N_m", MOTOR.coulomb_N_m);
    let e = explained(coasting(3000, &notes), &model("u_V", FRICTION, ""));
    let ratios: Vec<_> = e.given.channels.iter().map(|c| (c.channel, c.rms / c.noise, c.rms, c.noise)).collect();
    assert_eq!((e.verdict, e.missing.as_slice()), (Verdict::Adequate, &[][..]), "{ratios:?}");
    let e = explained(coasting(3000, &notes), &model("u_V", "\"viscous\"", ""));
    assert_eq!((e.verdict, e.missing.as_slice()), (Verdict::EffectFound, &["coulomb".to_owned()][..]));
}

#[test]
fn bridge_that_coasts_without_its_note_is_not_adequate() {
    let e = explained(coasting(1500, &[("omega_rad_s", "tachometer")]), &model("u_V", FRICTION, ""));
    assert!(matches!(e.verdict, Verdict::UnknownStructure | Verdict::PartlyExplained), "{:?} {:?}", e.verdict, e.missing);
    assert!(!e.remarks.iter().any(|r| matches!(r, Remark::MayCoast { .. })), "{:?}", e.remarks);
    // Where the supply is known, the bridge is asked for.
    let e = explained(coasting(1500, &[("omega_rad_s", "tachometer"), ("supply_nominal_V", "12")]), &model("u_V", FRICTION, ""));
    assert!(matches!(e.verdict, Verdict::UnknownStructure | Verdict::PartlyExplained), "{:?} {:?}", e.verdict, e.missing);
    assert!(e.remarks.iter().any(|r| matches!(r, Remark::MayCoast { decrease } if *decrease > 3.0)), "{:?}", e.remarks);
}

#[test]
fn bridge_that_coasts_needs_a_supply() {
    let error =
        evaluate(&coasting(3000, &[("u_V", "coasting")]), &model("u_V", FRICTION, ""), ParameterTreatment::Fitted, Deadline::NEVER).err();
    let text = error.as_ref().map(EvaluationError::to_string).unwrap_or_default();
    assert!(text.contains("bench.csv") && text.contains("supply_V"), "{text}");
}

#[test]
fn motor_is_disconnected_where_the_flag_says_so() {
    let open = |t_s: f64| t_s % 5.0 > 3.0;
    let current = |t_s: f64, u_V: f64, (omega, _): (f64, f64)| {
        if open((t_s / ROW_S + 1e-6).floor() * ROW_S) { 0.0 } else { MOTOR.current_A(u_V, omega) }
    };
    let level = |draw: &mut Draw, _: f64| 6.0 * (2.0 * draw.even() - 1.0);
    // The voltage column of the open motor is its back-EMF in such logs, or the last command; it must not matter.
    let flag = |t_s: f64, _: f64| f64::from(u8::from(open(t_s)));
    let log = log(&MOTOR, (3000, 0.02), level, current, &[("u_V", &|_, u| u), ("open_circuit", &flag)], &[("omega_rad_s", "tachometer")]);
    let result = fitted(&log, &model("u_V", FRICTION, ""));
    near(&result, "inertia_kg_m2", MOTOR.inertia_kg_m2);
    near(&result, "motor_constant_N_m_A", MOTOR.motor_constant_N_m_A);
    near(&result, "coulomb_N_m", MOTOR.coulomb_N_m);
    let e = explained(log, &model("u_V", "\"viscous\"", ""));
    assert_eq!((e.verdict, e.missing.as_slice()), (Verdict::EffectFound, &["coulomb".to_owned()][..]));
}

/// Gain, V/rad, and damping, V s/rad, of the servo.
const GAIN_V_RAD: f64 = 20.0;
const DAMPING_V_S_RAD: f64 = 0.4;

#[test]
fn servo_is_fitted_with_its_regulator() {
    let current = |_: f64, setpoint: f64, (omega, theta): (f64, f64)| {
        let u = GAIN_V_RAD * (setpoint - theta) - DAMPING_V_S_RAD * omega;
        SERVO.current_A(u.clamp(-SUPPLY_V, SUPPLY_V), omega)
    };
    let level = |draw: &mut Draw, _: f64| 2.0 * (2.0 * draw.even() - 1.0);
    let log = log(&SERVO, (3000, 0.005), level, current, &[("theta_cmd_rad", &|_, s| s)], &[("omega_rad_s", "tachometer")]);
    let servo = |effects: &str| {
        let text = format!(
            "[drive]\ninput = \"theta_cmd_rad\"\noutputs = [\"omega_rad_s\", \"theta_rad\"]\neffects = [{effects}]\n[parameters]\ninertia_kg_m2 = 0.03\n\
             motor_constant_N_m_A = {{ value = 0.5, fixed = true }}\nresistance_ohm = {{ value = 3, fixed = true }}\nservo_gain_V_rad = 15\n\
             servo_damping_V_s_rad = 0.1\nservo_limit_V = 10\nviscous_N_m_s = {{ value = 0.01, fixed = true }}\n"
        );
        Model::parse(&text, "servo.toml").expect("a model")
    };
    let result = fitted(&log, &servo(FRICTION));
    near(&result, "inertia_kg_m2", SERVO.inertia_kg_m2);
    near(&result, "servo_gain_V_rad", GAIN_V_RAD);
    near(&result, "servo_damping_V_s_rad", DAMPING_V_S_RAD);
    near(&result, "servo_limit_V", SUPPLY_V);
    near(&result, "coulomb_N_m", SERVO.coulomb_N_m);
    let e = explained(log, &servo("\"viscous\""));
    assert_eq!(e.missing.first().map(String::as_str), Some("coulomb"), "{:?} {:?}", e.verdict, e.missing);
}
