//! One bench for both integrators, the rig (the model) and the plant (the simulated drive), with the same input.
#![allow(dead_code, reason = "each test binary uses its part")]

pub mod host;
pub mod sensor_bench;

use drive_model::{Law, Reading};
use drive_rig::{Base, DriveState, Input, Rig, RowInput};
use hal_sim::board::PlantPort;
use hal_sim::plant::{Plant, Stand, stand};

/// The integrator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Rig,
    Plant,
}

/// Both integrators.
pub const BOTH: [Kind; 2] = [Kind::Rig, Kind::Plant];

/// Longest tick of the plant, s: the control tick of the stand.
pub const TICK_S: f64 = 1e-4;
/// The row of the stand's logs, s.
pub const ROW_S: f64 = 1e-3;

/// K = R of a plant whose voltage is a torque: i = (u − Kω)/R, K i = u − K ω, a brake of 9e-19 N m s. A power of two, so that the
/// division and the product are exact and a torque at the edge of the stick band stays there.
const UNIT: f64 = 1.0 / (1u64 << 60) as f64;

/// Motor and rotor of a test.
#[derive(Clone, Copy, Debug)]
pub struct Drive {
    pub inertia: f64,
    pub motor_constant: f64,
    pub resistance: f64,
}

/// Motor of docs/theory.md §4.
pub const THEORY: Drive = Drive { inertia: 1e-4, motor_constant: 0.02, resistance: 2.3 };

/// The drive on the bench, with its input.
#[derive(Clone, Debug)]
pub struct Setup {
    pub drive: Drive,
    /// `Input::Voltage` or `Input::Torque`.
    pub input: Input,
    pub effects: Vec<(String, Vec<f64>)>,
    pub theta: f64,
    /// Winding temperature, °C, constant; `None`: 25 °C at the start, then by the heat of the winding.
    pub temp_C: Option<f64>,
}

impl Setup {
    /// Driven by a voltage.
    pub fn by_voltage(drive: Drive, list: &[(&str, &[f64])]) -> Self {
        let effects = list.iter().map(|(id, p)| ((*id).to_owned(), p.to_vec())).collect();
        Setup { drive, input: Input::Voltage, effects, theta: 0.0, temp_C: None }
    }

    /// Driven by a torque, without back-EMF.
    pub fn by_torque(inertia: f64, list: &[(&str, &[f64])]) -> Self {
        let drive = Drive { inertia, motor_constant: UNIT, resistance: UNIT };
        Setup { input: Input::Torque, ..Self::by_voltage(drive, list) }
    }

    /// With another angle.
    pub fn at(self, theta: f64) -> Self {
        Setup { theta, ..self }
    }

    /// With a winding temperature.
    pub fn warm(self, temp_C: f64) -> Self {
        Setup { temp_C: Some(temp_C), ..self }
    }
}

/// The identifier of a repeated effect: `cogging` of `cogging#2`.
pub fn stem(name: &str) -> &str {
    name.split('#').next().unwrap()
}

/// The rig of these effects, in the order of the catalogue.
pub fn rig(drive: Drive, input: Input, list: &[(String, Vec<f64>)]) -> Rig<f64> {
    let base = Base { inertia: drive.inertia, motor_constant: drive.motor_constant, resistance: drive.resistance, servo: None };
    let laws: Vec<(Box<dyn Law<f64>>, Vec<f64>)> =
        list.iter().map(|(id, p)| (drive_model::law::<f64>(stem(id)).unwrap(), p.clone())).collect();
    Rig::new(base, input, laws)
}

/// A stand with these effects only.
pub fn stand_of(drive: Drive, list: &[(String, Vec<f64>)]) -> Stand {
    let named = |(id, p): &(String, Vec<f64>)| {
        let card = drive_model::card(stem(id)).unwrap();
        assert_eq!(card.parameters.len(), p.len(), "{id}");
        (id.clone(), card.parameters.iter().zip(p).map(|(c, v)| (c.name.to_owned(), *v)).collect())
    };
    Stand {
        effects: list.iter().map(named).collect(),
        drive: stand::Drive {
            inertia_kg_m2: drive.inertia,
            motor_constant_N_m_A: drive.motor_constant,
            resistance_ohm: drive.resistance,
            ..stand::Drive::default()
        },
        ..Stand::default()
    }
}

enum Machine {
    Rig { rig: Box<Rig<f64>>, state: DriveState<f64> },
    Plant(Box<Plant>),
}

/// A rig or a plant under test.
pub struct Bench {
    machine: Machine,
    temp_C: Option<f64>,
    pub t_s: f64,
    /// Mean current over the last [`Bench::hold`], A.
    pub current: f64,
    /// Longest tick of the plant, longest row of the rig.
    pub tick_s: f64,
}

impl Bench {
    pub fn new(kind: Kind, setup: &Setup) -> Self {
        let machine = match kind {
            Kind::Rig => Machine::Rig {
                rig: Box::new(rig(setup.drive, setup.input, &setup.effects)),
                state: DriveState { heat_K: setup.temp_C.map_or(0.0, |t| t - 25.0), ..DriveState::turning(0.0, setup.theta) },
            },
            Kind::Plant => {
                let mut stand = stand_of(setup.drive, &setup.effects);
                if let Some(temp_C) = setup.temp_C {
                    stand.drive.ambient_C = temp_C;
                    stand.drive.thermal_J_K = 1e12; // held
                }
                Machine::Plant(Box::new(Plant::new(&stand, setup.theta).unwrap()))
            }
        };
        let tick_s = if kind == Kind::Rig { ROW_S } else { TICK_S };
        Bench { machine, temp_C: setup.temp_C, t_s: 0.0, current: 0.0, tick_s }
    }

    /// Sets the rate of all rotating parts.
    pub fn spin(mut self, omega: f64) -> Self {
        match &mut self.machine {
            Machine::Rig { state, .. } => {
                state.omega = omega;
                state.motor_omega = omega;
            }
            Machine::Plant(plant) => plant.spin(omega),
        }
        self
    }

    /// Holds the input for `seconds`, in rows or ticks of equal length; returns the mean current.
    pub fn hold(&mut self, input: f64, seconds: f64) -> f64 {
        let n = (seconds / self.tick_s - 1e-6).ceil().max(1.0) as usize;
        let dt_s = seconds / n as f64;
        let begin_s = self.t_s;
        let mut charge = 0.0;
        for k in 0..n {
            match &mut self.machine {
                Machine::Rig { rig, state } => {
                    charge += rig.advance(state, &span(begin_s + k as f64 * dt_s, dt_s, input, self.temp_C));
                }
                Machine::Plant(plant) => {
                    plant.advance(input, dt_s);
                    charge += plant.mean_current_A();
                }
            }
        }
        self.t_s = begin_s + seconds;
        self.current = charge / n as f64;
        self.current
    }

    pub fn omega(&self) -> f64 {
        match &self.machine {
            Machine::Rig { state, .. } => state.omega,
            Machine::Plant(plant) => plant.true_rate_rad_s(),
        }
    }

    pub fn theta(&self) -> f64 {
        match &self.machine {
            Machine::Rig { state, .. } => state.theta,
            Machine::Plant(plant) => plant.true_theta_rad(),
        }
    }

    /// Present channel readings: reading of the rig, or sensor elements of the plant.
    pub fn seen(&self, rate_from_encoder: bool) -> Reading<f64> {
        self.seen_by(&RowInput { rate_from_encoder, ..span(self.t_s, ROW_S, 0.0, self.temp_C) })
    }

    /// The readings with this measured angle as input of the rig.
    pub fn seen_at(&self, theta: f64) -> Reading<f64> {
        self.seen_by(&RowInput { theta: Some((theta, theta)), ..span(self.t_s, ROW_S, 0.0, self.temp_C) })
    }

    fn seen_by(&self, span: &RowInput) -> Reading<f64> {
        match &self.machine {
            Machine::Rig { rig, state } => rig.read((state.omega, state.theta, state.heat_K), span, self.current),
            Machine::Plant(plant) => Reading::of(plant.rate_rad_s(), plant.theta_rad(), plant.mean_current_A()),
        }
    }

    pub fn state(&self) -> &DriveState<f64> {
        match &self.machine {
            Machine::Rig { state, .. } => state,
            Machine::Plant(_) => panic!("the state of the plant is private"),
        }
    }

    pub fn state_mut(&mut self) -> &mut DriveState<f64> {
        match &mut self.machine {
            Machine::Rig { state, .. } => state,
            Machine::Plant(_) => panic!("the state of the plant is private"),
        }
    }

    pub fn plant(&self) -> &Plant {
        match &self.machine {
            Machine::Plant(plant) => plant,
            Machine::Rig { .. } => panic!("a rig"),
        }
    }
}

/// A row without measured angle.
pub fn span(t_s: f64, dt_s: f64, input: f64, temp_C: Option<f64>) -> RowInput {
    RowInput { temp_C, ..RowInput::new(t_s, dt_s, input) }
}

/// |a − b| ≤ tolerance, with the values in the message.
#[track_caller]
pub fn close(a: f64, b: f64, tolerance: f64, what: &str) {
    assert!((a - b).abs() <= tolerance, "{what}: {a} is not {b} ± {tolerance:e} (off by {:e})", (a - b).abs());
}

/// As [`close`], relative to `b`.
#[track_caller]
pub fn close_rel(a: f64, b: f64, relative: f64, what: &str) {
    close(a, b, relative * b.abs(), what);
}

/// Pseudo-random numbers by seed (SplitMix64) for property tests.
pub struct Draw(pub u64);

impl Draw {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [a, b).
    pub fn even(&mut self, a: f64, b: f64) -> f64 {
        a + (b - a) * (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Log-uniform.
    pub fn log(&mut self, a: f64, b: f64) -> f64 {
        self.even(a.ln(), b.ln()).exp()
    }

    /// Log-uniform, with a random sign.
    pub fn signed_log(&mut self, a: f64, b: f64) -> f64 {
        let size = self.log(a, b);
        if self.next() & 1 == 0 { size } else { -size }
    }
}
