//! Stands with a hidden effect, drawn by seed: test cases for the explainer.
//!
//! The name of a case defines it completely and reproduces it: `own/cogging/voltage/sweep/3`, `several/2/rate/multi-step/17`,
//! `nulls/voltage/multisine/5`, `known/rate/sweep/5` (an additional effect that the user's model also has),
//! `outsiders/sector-rub/rate/sweep/1`. The user's model of each stand has the default stand's structure without the hidden effects, with
//! parameter errors of up to 25 %.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use drive_model::{Card, ParameterKind, PeriodOf, Screening, cards};
use hal_sim::peripherals::SensorSetup;
use hal_sim::plant::outsiders::{
    self, BadContact, BadLines, BallDefect, FluidRotor, GrindingBearing, HuntingSupply, Outsiders, SaggingConverter, SectorRub,
    SlippingClutch, StickyRateSensor, WanderingLoad,
};
use hal_sim::plant::{Plant, Stand};
use hal_sim::session::{self, SessionRequest};
use identification::identify::explain::DetectionLimit;
use identification::log::{Column, Log};
use identification::model::Model;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use stand_firmware::profile::ProfileKind;
use stand_firmware::speed_loop::Mode;

use crate::dirt::Dirt;

/// The experiments.
pub const PROFILES: [&str; 3] = ["multi-step", "multisine", "sweep"];
/// Voltage mode, and the firmware's speed loop.
pub const MODES: [Mode; 2] = [Mode::Voltage, Mode::Rate];
/// Disturbances outside the catalogue, by name.
pub const OUTSIDERS: [&str; 11] = [
    "sector-rub",
    "hunting-supply",
    "slipping-clutch",
    "grinding-bearing",
    "ball-defect",
    "bad-contact",
    "fluid-rotor",
    "wandering-load",
    "sagging-converter",
    "sticky-rate-sensor",
    "bad-lines",
];
/// Effects of the user's model of the default stand.
const MODEL_EFFECTS: [&str; 3] = ["viscous", "coulomb", "inductance"];
/// Largest relative parameter error of the user's model.
pub const MAX_PARAMETER_ERROR: f64 = 0.25;
/// Length of a record, s; and of a record with winding heating.
const SECONDS: f64 = 30.0;
const WARMING_S: f64 = 60.0;
/// Viscous brake of a stand with winding heating, N m s: 1 A at 15 rad/s; the default stand at 0.1 A stays cold.
const BRAKE_N_M_S: f64 = 1.5e-3;
/// Voltage amplitude of the braked stand: about 23 rad/s.
const BRAKED_V: f64 = 4.0;

/// A drawn stand with its experiment.
#[derive(Debug, Clone)]
pub struct Drawn {
    /// Name of the case.
    pub id: String,
    /// Operating mode.
    pub mode: Mode,
    /// Profile.
    pub profile: ProfileKind,
    /// Names of the hidden effects of the catalogue.
    pub hidden: Vec<String>,
    /// The hidden disturbance outside the catalogue, if any.
    pub outsider: Option<String>,
    /// The true stand.
    pub stand: Stand,
    seconds: f64,
    amplitude: f64,
    /// Seed of the profile.
    seed: u64,
    /// Seed of all noise; each log has its own, so that the logs are independent.
    noise: u64,
    /// Seed of the user's parameter errors.
    beliefs: u64,
}

/// Random numbers of a seed.
struct Draw(Xoshiro256PlusPlus);

impl Draw {
    fn even(&mut self, (low, high): (f64, f64)) -> f64 {
        low + (high - low) * (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn below(&mut self, n: usize) -> usize {
        ((self.even((0.0, 1.0)) * n as f64) as usize).min(n.saturating_sub(1))
    }

    /// The parameters of an effect from its card's ranges.
    fn effect(&mut self, card: &Card) -> BTreeMap<String, f64> {
        let mut parameters = BTreeMap::new();
        for p in card.parameters {
            let mut value = self.even(p.simulated_range);
            match p.kind {
                ParameterKind::HarmonicOrder => value = value.round(),
                ParameterKind::Signed if self.even((0.0, 1.0)) < 0.5 => value = -value,
                _ => {}
            }
            parameters.insert(p.name.to_owned(), value);
        }
        parameters
    }
}

impl Drawn {
    /// The case of this name; `None` if there is none.
    pub fn by_name(id: &str) -> Option<Drawn> {
        let parts: Vec<&str> = id.split('/').collect();
        let (&seed, &profile, &mode) = (parts.last()?, parts.iter().rev().nth(1)?, parts.iter().rev().nth(2)?);
        let (seed, profile): (u64, ProfileKind) = (seed.parse().ok()?, profile.parse().ok()?);
        let mode = MODES.into_iter().find(|m| mode_name(*m) == mode)?;
        // Each name has its own random stream, identical on every machine (FNV-1a).
        let stream = id.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |h, b| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3));
        let mut draw = Draw(Xoshiro256PlusPlus::seed_from_u64(stream));
        let mut drawn = Drawn {
            id: id.to_owned(),
            mode,
            profile,
            hidden: Vec::new(),
            outsider: None,
            stand: Stand::default(),
            seconds: SECONDS,
            amplitude: SessionRequest::usual_amplitude(mode),
            seed,
            noise: stream >> 1,
            beliefs: stream.rotate_left(32),
        };
        match (parts[0], parts.len()) {
            ("own", 5) => drawn.hidden.push(drive_model::card(parts[1])?.id.to_owned()),
            ("several", 5) => drawn.hidden = several(parts[1].parse().ok()?, &mut draw),
            ("outsiders", 5) => {
                drawn.outsider = Some(parts[1].to_owned());
                drawn.stand.outsiders = outside(parts[1], &mut draw)?;
            }
            ("nulls", 4) => {}
            ("known", 4) => {
                let known: Vec<&Card> =
                    drawn_cards().into_iter().filter(|c| !MODEL_EFFECTS.contains(&c.id) && is_identifiable(c.id)).collect();
                drawn.add_effect(known[draw.below(known.len())].id, &mut draw);
            }
            _ => return None,
        }
        for id in drawn.hidden.clone() {
            drawn.add_effect(&id, &mut draw);
        }
        Some(drawn)
    }

    /// Adds an effect to the stand, with the conditions that it needs to act.
    fn add_effect(&mut self, id: &str, draw: &mut Draw) {
        let Some(card) = drive_model::card(id) else { return };
        self.stand.effects.insert(id.to_owned(), draw.effect(card));
        if warms(id) {
            self.seconds = WARMING_S;
            if self.mode == Mode::Voltage {
                self.amplitude = BRAKED_V;
            }
            self.stand.effects.insert("viscous".to_owned(), BTreeMap::from([("viscous_N_m_s".to_owned(), BRAKE_N_M_S)]));
        }
    }

    /// The case with an effect planted whose amplitude is a detection limit of its log; the user's model lacks it.
    #[must_use]
    pub fn with_effect_at(mut self, limit: &DetectionLimit, fraction: f64) -> Drawn {
        let card = limit.card;
        let mut values: BTreeMap<String, f64> = card.parameters.iter().map(|p| (p.name.to_owned(), p.start)).collect();
        // Coefficients beside the one that is limited are zero.
        for p in card.parameters.iter().filter(|p| matches!(p.kind, ParameterKind::Signed | ParameterKind::NonNegative)) {
            values.insert(p.name.to_owned(), 0.0);
        }
        values.insert(card.parameters[limit.parameter].name.to_owned(), fraction * limit.size);
        // The winding warms as in the log for which the limit is stated.
        let drive = &self.stand.drive;
        for (name, value) in [("thermal_J_K", drive.thermal_J_K), ("thermal_K_W", drive.thermal_K_W)] {
            values.entry(name.to_owned()).and_modify(|own| *own = value);
        }
        if let Some((k, value)) = limit.at {
            let p = &card.parameters[k];
            // The time of the log begins with its first row.
            let begin = if p.kind == ParameterKind::EventTime { session::FIRST_ROW_S } else { 0.0 };
            values.insert(p.name.to_owned(), value + begin);
        }
        self.stand.effects.insert(card.id.to_owned(), values);
        self.hidden.push(card.id.to_owned());
        self
    }

    /// Seed of the experiment.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// True if the stand has a hidden effect or disturbance.
    pub fn hides(&self) -> bool {
        self.outsider.is_some() || !self.hidden.is_empty()
    }

    /// The session's log.
    ///
    /// # Panics
    /// The stand cannot be built: an error of the draw.
    pub fn log(&self) -> Log {
        let profile = SessionRequest::usual_profile(self.mode, self.profile, self.amplitude, self.seed);
        let request = SessionRequest { mode: self.mode, profile, seconds: self.seconds, seed: self.noise };
        let plant = Plant::new(&self.stand, 0.0).expect("a valid stand");
        let record = session::run(self.stand.setup(), plant, request).expect("a valid request");
        let columns = record.columns.into_iter().map(|(name, values)| Column { name: name.to_owned(), values }).collect();
        let mut notes = record.notes;
        notes.push(("supply_nominal_V".to_owned(), self.stand.drive.supply_V.to_string()));
        Log::new("session.parquet", columns, notes).expect("a valid log")
    }

    /// The user's model.
    pub fn user_model(&self) -> Model {
        let mut draw = Draw(Xoshiro256PlusPlus::seed_from_u64(self.beliefs));
        self.model(&self.hidden.iter().map(String::as_str).collect::<Vec<_>>(), |_, kind, value| match kind {
            ParameterKind::HarmonicOrder | ParameterKind::Periodicity | ParameterKind::EventTime => value,
            ParameterKind::Phase => (value + draw.even((-MAX_PARAMETER_ERROR, MAX_PARAMETER_ERROR))).rem_euclid(std::f64::consts::TAU),
            _ => value * (1.0 + draw.even((-MAX_PARAMETER_ERROR, MAX_PARAMETER_ERROR))),
        })
    }

    /// A model without effects, with the user's values of the base.
    pub fn empty_model(&self) -> Model {
        let mut empty = self.user_model();
        for effect in empty.effect_names() {
            empty.remove(&effect).expect("an effect of the model");
        }
        empty
    }

    /// The same stand and experiment, with sensors that have no noise.
    #[must_use]
    pub fn without_noise(&self) -> Drawn {
        let sensors = &self.stand.sensors;
        let quiet = SensorSetup { current_noise_A: 0.0, rate_noise_rad_s: 0.0, supply_noise_V: 0.0, temp_noise_K: 0.0, ..*sensors };
        Drawn { stand: Stand { sensors: quiet, ..self.stand.clone() }, ..self.clone() }
    }

    /// The same stand at rest.
    #[must_use]
    pub fn at_rest(&self, seconds: f64) -> Drawn {
        Drawn { mode: Mode::Voltage, amplitude: 0.0, seconds, ..self.clone() }
    }

    /// The true model, within the catalogue.
    pub fn true_model(&self) -> Model {
        self.model(&[], |_, _, value| value)
    }

    /// The true model without one effect.
    pub fn true_model_without(&self, effect: &str) -> Model {
        self.model(&[effect], |_, _, value| value)
    }

    fn model(&self, without: &[&str], mut model_value: impl FnMut(&str, ParameterKind, f64) -> f64) -> Model {
        let drive = &self.stand.drive;
        let names: Vec<&String> = self.stand.effects.keys().filter(|name| !without.contains(&name.as_str())).collect();
        let mut text = format!("[drive]\ninput = \"u_V\"\neffects = {names:?}\n\n[parameters]\n");
        let base = [
            ("inertia_kg_m2", drive.inertia_kg_m2),
            ("motor_constant_N_m_A", drive.motor_constant_N_m_A),
            ("resistance_ohm", drive.resistance_ohm),
        ];
        for (name, value) in base {
            text += &format!("{name} = {:e}\n", model_value(name, ParameterKind::Positive, value));
        }
        for name in names {
            let given = &self.stand.effects[name];
            let Some(card) = drive_model::card(name) else { continue };
            let values: Vec<f64> = card.parameters.iter().map(|p| given.get(p.name).copied().unwrap_or(p.start)).collect();
            for (p, value) in card.parameters.iter().zip(in_log(card, values)) {
                // A true coefficient of zero is fixed at zero.
                text += &match value == 0.0 && p.kind != ParameterKind::Phase {
                    true => format!("{} = {{ value = 0.0, fixed = true }}\n", p.name),
                    false => format!("{} = {:e}\n", p.name, model_value(p.name, p.kind, value)),
                };
            }
        }
        Model::parse(&text, &self.id).expect("a valid model")
    }

    /// The hidden effects with their parameters.
    pub fn description(&self) -> String {
        if !self.hides() {
            return "nothing".to_owned();
        }
        let mut list: Vec<String> = self.hidden.iter().map(|id| format!("{id} {:?}", self.stand.effects[id])).collect();
        list.extend(self.outsider.iter().map(|_| format!("{:?}", self.stand.outsiders)));
        list.join("; ")
    }

    /// Writes, with an imperfection, `log.parquet`, `model.toml`, `truth.toml` and `hidden.txt` into a folder, for `stand explain`.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write(&self, folder: &Path, dirt: Dirt) -> Result<(), Box<dyn std::error::Error>> {
        fs::create_dir_all(folder)?;
        dirt.on(&self.log(), self.seed).write(folder.join("log.parquet"))?;
        self.user_model().write(folder.join("model.toml"))?;
        self.true_model().write(folder.join("truth.toml"))?;
        fs::write(folder.join("hidden.txt"), format!("{}: {}\n", self.id, self.description()))?;
        Ok(())
    }
}

/// Converts the parameters of an effect of the stand to the time base of the log, which starts with the first row.
fn in_log(card: &Card, mut values: Vec<f64>) -> Vec<f64> {
    for (value, p) in values.iter_mut().zip(card.parameters) {
        if p.kind == ParameterKind::EventTime {
            *value -= session::FIRST_ROW_S;
        }
    }
    match (card.screening, values.as_mut_slice()) {
        (Screening::Periodicities(PeriodOf::Time), [_, frequency_Hz, phase]) => {
            *phase = (*phase + std::f64::consts::TAU * *frequency_Hz * session::FIRST_ROW_S).rem_euclid(std::f64::consts::TAU);
        }
        (Screening::LogFractions(_), [excesses @ .., time_constant_s]) => {
            excesses.iter_mut().for_each(|excess| *excess *= (-session::FIRST_ROW_S / *time_constant_s).exp());
        }
        _ => {}
    }
    values
}

/// Name of a mode in a case's name.
pub fn mode_name(mode: Mode) -> &'static str {
    mode.name()
}

/// True if the effect depends on the winding temperature.
fn warms(id: &str) -> bool {
    ["viscous-temperature", "resistance-temperature", "rate-bias-temperature"].contains(&id)
}

/// True if the effect is identifiable on logs of this stand. With a constant supply, supply droop equals a larger R; a current-scale error
/// equals a larger J with a smaller R.
fn is_identifiable(id: &str) -> bool {
    !["supply-droop", "current-scale"].contains(&id)
}

/// Effects of the catalogue that came after the figures of `several` and `known` were printed. These two draw from the others, so that the
/// name of a log keeps its meaning.
const LATER: [&str; 8] = [
    "gear-friction",
    "inertia-variation",
    "gear-ripple",
    "timed-torque",
    "friction-drift",
    "bridge-nonlinearity",
    "voltage-dead-zone",
    "lost-counts",
];

/// Effects that are drawn by chance.
fn drawn_cards() -> Vec<&'static Card> {
    cards().iter().copied().filter(|c| !LATER.contains(&c.id)).collect()
}

/// Several effects that do not exclude each other.
fn several(n: usize, draw: &mut Draw) -> Vec<String> {
    let cards = drawn_cards();
    let mut chosen: Vec<&Card> = Vec::new();
    while chosen.len() < n.min(5) {
        let card = cards[draw.below(cards.len())];
        // One shaft model; one effect per family; no effect that another one requires; the brake belongs to the user's model.
        let clash = |other: &&Card| {
            let pair = [card.id, other.id];
            let both = |a: &str, b: &str| pair.contains(&a) && pair.contains(&b);
            card.id == other.id
                || (!card.family.is_empty() && card.family == other.family)
                || both("compliance", "backlash")
                || both("coulomb", "presliding")
                || (pair.contains(&"viscous") && pair.iter().any(|id| warms(id)))
        };
        if is_identifiable(card.id) && !chosen.iter().any(clash) {
            chosen.push(card);
        }
    }
    chosen.iter().map(|c| c.id.to_owned()).collect()
}

/// A disturbance of that name.
fn outside(name: &str, draw: &mut Draw) -> Option<Outsiders> {
    use outsiders::{bad_contact as contact, bad_lines as lines, ball_defect as ball, fluid_rotor as fluid, grinding_bearing as grinding};
    use outsiders::{hunting_supply as hunting, sagging_converter as sag, sector_rub as rub, slipping_clutch as clutch};
    use outsiders::{sticky_rate_sensor as sticky, wandering_load as wander};
    let turn = (0.0, std::f64::consts::TAU);
    let mut outsiders = Outsiders::default();
    match name {
        "sector-rub" => {
            outsiders.sector_rub = Some(SectorRub {
                rub_N_m: draw.even(rub::TEST_RANGE_N_M),
                rub_N_m_s: 0.0,
                from_rad: draw.even(turn),
                width_rad: draw.even(rub::TEST_WIDTH_RANGE_RAD),
            });
        }
        "hunting-supply" => {
            outsiders.hunting_supply = Some(HuntingSupply {
                hunting: draw.even(hunting::TEST_RANGE),
                hunting_Hz: draw.even(hunting::TEST_RANGE_HZ),
                hunting_phase_rad: draw.even(turn),
            });
        }
        "slipping-clutch" => {
            outsiders.slipping_clutch = Some(SlippingClutch { clutch_N_m: draw.even(clutch::TEST_RANGE_N_M), motor_inertia_share: 0.3 });
        }
        "grinding-bearing" => {
            outsiders.grinding_bearing = Some(GrindingBearing {
                grinding_N_m: draw.even(grinding::TEST_RANGE_N_M),
                grinding_s: draw.even(grinding::TEST_RANGE_S),
                seed: draw.0.next_u64() >> 1,
            });
        }
        "ball-defect" => {
            outsiders.ball_defect = Some(BallDefect {
                ball_N_m: draw.even(ball::TEST_RANGE_N_M),
                ball_per_turn: draw.even(ball::TEST_RANGE_PER_TURN),
                ball_modulation: draw.even(ball::TEST_RANGE_MODULATION),
                ..BallDefect::default()
            });
        }
        "bad-contact" => {
            outsiders.bad_contact = Some(BadContact {
                contact_ohm: draw.even(contact::TEST_RANGE_OHM),
                good_for_s: draw.even(contact::TEST_RANGE_EVERY_S),
                bad_for_s: draw.even(contact::TEST_RANGE_FOR_S),
                seed: draw.0.next_u64() >> 1,
            });
        }
        "fluid-rotor" => {
            let fluid_kg_m2 = Stand::default().drive.inertia_kg_m2 * draw.even(fluid::TEST_RANGE_SHARE);
            outsiders.fluid_rotor = Some(FluidRotor { fluid_kg_m2, fluid_N_m_s: fluid_kg_m2 / draw.even(fluid::TEST_RANGE_S) });
        }
        "wandering-load" => {
            outsiders.wandering_load = Some(WanderingLoad { wander_N_m: draw.even(wander::TEST_RANGE_N_M), seed: draw.0.next_u64() >> 1 });
        }
        "sagging-converter" => {
            outsiders.sagging_converter =
                Some(SaggingConverter { sag_per_V: draw.even(sag::TEST_RANGE_PER_V), sag_s: draw.even(sag::TEST_RANGE_S) });
        }
        "sticky-rate-sensor" => {
            outsiders.sticky_rate_sensor = Some(StickyRateSensor { sticks_rad_s: draw.even(sticky::TEST_RANGE_RAD_S) });
        }
        "bad-lines" => {
            outsiders.bad_lines = Some(BadLines {
                lines_rad: draw.even(lines::TEST_RANGE_RAD),
                from_rad: draw.even(turn),
                width_rad: draw.even(lines::TEST_WIDTH_RANGE_RAD),
            });
        }
        _ => return None,
    }
    Some(outsiders)
}
