//! Works of the laboratory course on a real stand. The stand is the simulated controller with its console: in virtual time for each work,
//! and served behind a pseudo-terminal for the commands.
#![allow(clippy::unwrap_used)]

use crate::common;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use hal_sim::clock::VirtualClock;
use hal_sim::controller::{Controller, flash};
use hal_sim::gyro::{Orientation, OwnDrift, SingleAxis, Site};
use hal_sim::plant::{Plant, Stand};
use stand_acquire::calibration_session::drawn_dut::drawn_sensor;
use stand_acquire::calibration_session::run::Operator;
use stand_acquire::calibration_session::simulated::SimulatedOperator;
use stand_acquire::calibration_session::{Assumptions, DutKind, Instruction, Mounting};
use stand_acquire::connection::{SimulatedConnection, StandConnection};
use stand_analysis::drift::DEG_H;
use stand_lab::LabError;
use stand_lab::answers::{ANSWERS_FILE, Answers, HuntAnswer, NONE};
use stand_lab::check::check;
use stand_lab::course::{Lab, Language, Task};
use stand_lab::grade::{Grade, Objection, grade, grade_on_real_stand};
use stand_lab::journal::{ChainError, Event, JOURNAL_FILE, Journal, append, file_sha256};
use stand_lab::judge::Mark;
use stand_lab::measurement::{Hidden, LOGS_FOLDER, reference};
use stand_lab::seal::Key;
use stand_lab::stand_recording::WorkOperator;
use stand_lab::start::{RealStandStart, Started};
use stand_lab::teacher_reference::TeacherReference;
use stand_lab::work::{WORK_FILE, Work};
use tempfile::TempDir;

const MODEL: &str = include_str!("../../../labs/08-hunt/model.toml");

/// What stands on the bench.
#[derive(Clone, Default)]
struct Bench {
    stand: Stand,
    gyroscope: Option<SingleAxis>,
}

/// A folder with key and reference, in which a work is started.
struct Course {
    folder: TempDir,
    lab: Lab,
    key: Key,
}

impl Course {
    fn new(lab: &str, reference: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("teacher.key"), "5a".repeat(32)).unwrap();
        std::fs::write(folder.path().join("reference.toml"), reference).unwrap();
        let key = Key::read(&folder.path().join("teacher.key")).unwrap();
        Course { folder, lab: Lab::find(lab).unwrap(), key }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Starts the work on the bench, in virtual time; `interrupted_at`: part after which the user interrupts.
    fn start(&self, bench: &Bench, interrupted_at: f64) -> Result<Started, LabError> {
        let reference = TeacherReference::read(&self.path("reference.toml"), &self.lab)?;
        let model = self.lab.hunt().map(|_| MODEL);
        let work = self.path("work");
        let prepared = RealStandStart::new(&self.lab, ("anna", 1), self.key.clone(), (&reference, model), Language::En, &work)?;
        let clock = VirtualClock::default();
        // The gyroscope stands on the platform: its azimuth is that of the angle 0.
        let start_rad = if bench.gyroscope.is_some() { 0.0 } else { -2.0 };
        let plant = Plant::new(&bench.stand, start_rad).unwrap();
        let mut controller = Controller::new(&clock, &bench.stand.setup(), plant, flash(1), 1).unwrap();
        if let Some(gyroscope) = &bench.gyroscope {
            controller = controller.with_gyro(Box::new(gyroscope.clone().seeded(1)), 1);
        }
        let result = RefCell::new(None);
        let host = async {
            let mut line = SimulatedConnection::new(&controller);
            line.wait_s(0.5).await.unwrap();
            let mut operator = BenchOperator { controller: &controller, mount: None };
            if let Task::Session(task) = &self.lab.task {
                operator.mount = Some(SimulatedOperator::new(&controller, &self.lab.session(task.device).unwrap().session));
            }
            let started = prepared.run(&mut line, &mut operator, |part| part < interrupted_at).await;
            let output = line.query("OUTPut?").await.unwrap();
            result.replace(Some((started, output)));
        };
        controller.run(host, |_| ()).unwrap();
        let (started, output) = result.into_inner().unwrap();
        assert_eq!(output.trim(), "0", "the drive is off");
        started
    }

    /// Fills the result of the reference procedure in; the uncertainties are multiplied by `u_factor`.
    fn answer(&self, name: &str, u_factor: f64) {
        let work = self.path(name);
        let lab = Work::read(&work).unwrap().lab().unwrap();
        let values = reference(&lab, &work.join(LOGS_FOLDER)).unwrap();
        let mut given = answers(&work);
        for (quantity, answer) in &mut given.quantities {
            let (value, u) = values[quantity];
            (answer.value, answer.expanded_u) = (value, u_factor * u);
        }
        write(&work, &given);
    }

    fn grade(&self, name: &str) -> Grade {
        grade_on_real_stand(&self.path(name), Some(self.key.clone()), &self.path("reference.toml"), None).unwrap()
    }
}

/// Carries out the instructions on the simulated bench.
struct BenchOperator<'h, 'c> {
    controller: &'h Controller<'c>,
    mount: Option<SimulatedOperator<'h, 'c>>,
}

impl Operator for BenchOperator<'_, '_> {
    fn perform(&mut self, instruction: &Instruction, mounting: &Mounting, added_kg_m2: f64) -> Option<String> {
        self.mount.as_mut().unwrap().perform(instruction, mounting, added_kg_m2)
    }
}

impl WorkOperator for BenchOperator<'_, '_> {
    fn turn_gyroscope(&mut self, place: &Orientation) -> bool {
        self.controller.bench().borrow_mut().gyro().unwrap().gyro().set_orientation(*place);
        true
    }

    fn prepare_log(&mut self, hidden: &Hidden) -> bool {
        let added_kg_m2 = if hidden.description == "a mass on the platform" { 2e-5 } else { 0.0 };
        self.controller.bench().borrow_mut().plant_mut().set_load_inertia(added_kg_m2);
        true
    }
}

fn answers(work: &Path) -> Answers {
    Answers::parse(&std::fs::read_to_string(work.join(ANSWERS_FILE)).unwrap()).unwrap()
}

/// Writes the answers, with words, and checks them.
fn write(work: &Path, answers: &Answers) {
    let mut answers = answers.clone();
    answers.questions.values_mut().for_each(|answer| *answer = "an answer".to_owned());
    answers.quantities.values_mut().for_each(|answer| answer.budget = "type A and type B".to_owned());
    answers.conclusion = "a conclusion".to_owned();
    std::fs::write(work.join(ANSWERS_FILE), toml::to_string(&answers).unwrap()).unwrap();
    assert!(check(work).unwrap().complete);
}

/// A reference whose values deviate from the true ones by 0.3 U_X, with U_X the part `relative_u` of the value, at least `least_u`.
fn reference_text(lab: &str, truth: &[(&str, f64)], (relative_u, least_u): (f64, f64), more: &str) -> String {
    let lab = Lab::find(lab).unwrap();
    let quantities = lab.quantities().iter().map(|asked| {
        let (_, x) = truth.iter().find(|(name, _)| *name == asked.name).unwrap();
        let u = (relative_u * x.abs()).max(least_u);
        format!("[quantities.{}]\nvalue = {:e}\nU = {u:e}\nunit = \"{}\"\n", asked.name, x + 0.3 * u, asked.unit)
    });
    format!("source = \"certificate 7 of the institute\"\n{more}\n{}", quantities.collect::<String>())
}

fn drive() -> Stand {
    Stand::default()
}

fn motor_truth(stand: &Stand) -> [(&'static str, f64); 4] {
    [
        ("motor_constant_N_m_A", stand.drive.motor_constant_N_m_A),
        ("resistance_ohm", stand.drive.resistance_ohm),
        ("inductance_H", stand.effects["inductance"]["inductance_H"]),
        ("inertia_kg_m2", stand.drive.inertia_kg_m2),
    ]
}

/// A work is recorded, answered by the reference procedure and meets the criteria.
fn work_meets_the_criteria(lab: &str, bench: &Bench, reference: &str) {
    let course = Course::new(lab, reference);
    let started = course.start(bench, 2.0).unwrap();
    for check in &started.reference_checks {
        println!("{lab} {}: U_X {:.2e}, U_ref {:.2e}, E_n {:.2}", check.name, check.reference_u, check.procedure_u, check.normalized_error);
    }
    course.answer("work", 1.0);
    let judged = course.grade("work");
    assert_eq!(judged.objections, []);
    assert!(judged.criteria_met, "{lab}: {:#?}", judged.quantities);
    let stand = judged.work.real_stand.unwrap();
    assert_eq!((stand.identity.manufacturer.as_str(), stand.reference_source.as_str()), ("Rotary Stand", "certificate 7 of the institute"));
    let folder = common::files(&course.path("work"));
    let text = folder.values().map(|bytes| String::from_utf8_lossy(bytes)).collect::<String>();
    for value in TeacherReference::read(&course.path("reference.toml"), &course.lab).unwrap().quantities.values() {
        assert!(
            !text.contains(&value.value.to_string()) && !text.contains(&format!("{:e}", value.value)),
            "the folder has no reference value"
        );
    }
}

#[test]
fn friction_is_recorded_and_judged() {
    let mut stand = drive();
    for (effect, parameters) in [
        ("coulomb", vec![("coulomb_N_m", 8e-4)]),
        ("viscous", vec![("viscous_N_m_s", 2e-5)]),
        ("stribeck", vec![("stribeck_N_m", 9e-4), ("stribeck_rate_rad_s", 1.6)]),
    ] {
        stand.effects.insert(effect.to_owned(), parameters.into_iter().map(|(name, value)| (name.to_owned(), value)).collect());
    }
    let truth = [("coulomb_N_m", 8e-4), ("viscous_N_m_s", 2e-5), ("stribeck_N_m", 9e-4), ("stribeck_rate_rad_s", 1.6)];
    let known = format!(
        "[known]\nmotor_constant_N_m_A = {}\nmotor_constant_percent = 0.3\ncurrent_percent = 0.5\n",
        stand.drive.motor_constant_N_m_A
    );
    let bench = Bench { stand, gyroscope: None };
    work_meets_the_criteria("friction", &bench, &reference_text("friction", &truth, (0.02, 0.0), &known));
    let course = Course::new("friction", &reference_text("friction", &truth, (0.02, 0.0), ""));
    let missing = course.start(&bench, 2.0).unwrap_err().to_string();
    assert!(missing.contains("known.motor_constant_N_m_A is missing"), "{missing}");
    let other = reference_text("friction", &truth, (0.02, 0.0), &known.replace("current_percent", "latitude_deg"));
    let unknown = Course::new("friction", &other).start(&bench, 2.0).unwrap_err().to_string();
    assert!(unknown.contains("known.latitude_deg"), "{unknown}");
}

#[test]
fn once_per_turn_is_recorded_and_judged() {
    let mut stand = drive();
    let error = |size, order, phase: f64| {
        vec![("eccentricity_rad", size), ("eccentricity_order", order), ("eccentricity_phase_rad", phase.to_radians())]
    };
    for (effect, parameters) in [
        ("unbalance", vec![("unbalance_N_m", 4e-4), ("unbalance_phase_rad", 70_f64.to_radians())]),
        ("encoder-eccentricity", error(6e-3, 1.0, 200.0)),
        ("encoder-eccentricity#2", error(2e-3, 2.0, 120.0)),
    ] {
        stand.effects.insert(effect.to_owned(), parameters.into_iter().map(|(name, value)| (name.to_owned(), value)).collect());
    }
    let truth = [
        ("torque_N_m", 4e-4),
        ("torque_phase_deg", 70.0),
        ("error_1_rad", 6e-3),
        ("error_1_phase_deg", 200.0),
        ("error_2_rad", 2e-3),
        ("error_2_phase_deg", 120.0),
    ];
    let known = format!("[known]\ninertia_kg_m2 = {}\ninertia_percent = 1\n", stand.drive.inertia_kg_m2);
    let bench = Bench { stand, gyroscope: None };
    work_meets_the_criteria("once-per-turn", &bench, &reference_text("once-per-turn", &truth, (0.02, 0.0), &known));
}

/// A gyro and accelerometer with its true values.
fn sensor(device: DutKind) -> (Bench, Vec<(&'static str, f64)>) {
    let (imu, mut truth) = drawn_sensor(3, &Assumptions::default(), 10.0);
    if device == DutKind::Accel {
        truth.retain(|(name, _)| *name != "scale");
        truth.push(("scale", imu.accel_scale));
    } else {
        truth.retain(|(name, _)| *name != "bias_rad_s");
        truth.push(("bias_rad_s", imu.gyro_bias_rad_s));
    }
    (Bench { stand: Stand { imu: Some(imu), ..drive() }, gyroscope: None }, truth)
}

#[test]
fn gyro_is_recorded_and_judged() {
    let (bench, truth) = sensor(DutKind::Gyro);
    work_meets_the_criteria("gyro", &bench, &reference_text("gyro", &truth, (1e-4, 1e-4), "known = { crystal_ppm = 50, level_deg = 0.2 }"));
}

#[test]
fn accelerometer_is_recorded_and_judged() {
    let (bench, truth) = sensor(DutKind::Accel);
    work_meets_the_criteria("accelerometer", &bench, &reference_text("accelerometer", &truth, (0.01, 0.0), ""));
}

#[test]
fn drift_is_recorded_and_judged() {
    let mut gyroscope = SingleAxis::default();
    gyroscope.site = Site { latitude_rad: 48_f64.to_radians(), azimuth_rad: 75_f64.to_radians() };
    gyroscope.own = OwnDrift { constant_rad_s: 1.5 * DEG_H, ..OwnDrift::default() };
    let apparent = -gyroscope.site.horizontal_rad_s() * gyroscope.site.azimuth_rad.cos() / DEG_H;
    let truth = [("own_drift_deg_h", 1.5), ("apparent_drift_deg_h", apparent), ("azimuth_deg", 75.0)];
    let bench = Bench { stand: drive(), gyroscope: Some(gyroscope) };
    work_meets_the_criteria("drift", &bench, &reference_text("drift", &truth, (0.0, 0.02), "known = { latitude_deg = 48 }"));
}

#[test]
fn hunt_takes_what_is_hidden_from_the_reference() {
    let present = [("A", "none"), ("B", "unknown"), ("C", "none"), ("D", "unknown")];
    let entries = present.map(|(log, class)| {
        let description = if class == NONE { "nothing" } else { "a mass on the platform" };
        format!("[hunt.{log}]\npresent = [\"{class}\"]\ndescription = \"{description}\"\n")
    });
    let course = Course::new("hunt", &format!("source = \"the teacher\"\n{}", entries.concat()));
    let bench = Bench { stand: drive(), gyroscope: None };
    course.start(&bench, 2.0).unwrap();
    let work = course.path("work");
    assert_eq!(std::fs::read_to_string(work.join("model.toml")).unwrap(), MODEL);
    let mut given = answers(&work);
    for (log, class) in present {
        let certain = BTreeMap::from([(class.to_owned(), 1.0)]);
        let answer = HuntAnswer { before: BTreeMap::from([(NONE.to_owned(), 1.0)]), reason: "?".to_owned(), after: certain };
        given.hunt.insert(log.to_owned(), answer);
    }
    write(&work, &given);
    let judged = course.grade("work");
    assert!(judged.criteria_met, "{judged:#?}");
    assert_eq!(judged.hunt.unwrap().mean_score, 0.0);
}

#[test]
fn interrupted_recording_leaves_no_folder_and_a_drive_that_is_off() {
    let bench = Bench { stand: drive(), gyroscope: None };
    let reference = reference_text("motor", &motor_truth(&bench.stand), (0.02, 0.0), "");
    let course = Course::new("motor", &reference);
    let ended = course.start(&bench, 0.3).unwrap_err();
    assert!(ended.to_string().contains("interrupted"), "{ended}");
    assert!(!course.path("work").exists());
}

#[test]
fn observers_are_refused_with_the_reason() {
    // Before anything is asked of the reference.
    let course = Course::new("observers", "");
    let refused = course.start(&Bench::default(), 2.0).unwrap_err().to_string();
    assert!(refused.contains("`observers`") && refused.contains("real element"), "{refused}");
}

/// Copies a work folder.
fn copy(course: &Course, from: &str, to: &str) -> PathBuf {
    let (from, to) = (course.path(from), course.path(to));
    for (path, bytes) in common::files(&from) {
        let target = to.join(Path::new(&path).strip_prefix(&from).unwrap());
        if path.ends_with('/') {
            std::fs::create_dir_all(target).unwrap();
        } else {
            std::fs::create_dir_all(target.parent().unwrap()).unwrap();
            std::fs::write(target, bytes).unwrap();
        }
    }
    to
}

/// Writes the journal of a work anew, with the present hashes of the files of its first entry; the answers are checked again.
fn write_journal_anew(work: &Path) {
    let first = Journal::read(work).unwrap().unwrap().entries.remove(0);
    std::fs::remove_file(work.join(JOURNAL_FILE)).unwrap();
    let hashes = first.files.keys().map(|name| (name.clone(), file_sha256(&work.join(name)).unwrap())).collect();
    append(work, first.event, hashes).unwrap();
    check(work).unwrap();
}

#[test]
fn cheats_and_other_references_are_found() {
    let bench = Bench { stand: drive(), gyroscope: None };
    let text = reference_text("motor", &motor_truth(&bench.stand), (0.02, 0.0), "");
    let course = Course::new("motor", &text);
    course.start(&bench, 2.0).unwrap();
    course.answer("work", 1.0);
    let work = course.path("work");

    // The right answers, and an answer that is changed after the reference was shown.
    let honest = copy(&course, "work", "honest");
    let judged = course.grade("honest");
    assert!(judged.criteria_met && judged.values_shown, "{judged:#?}");
    assert!(judged.quantities.iter().all(|q| q.true_value_u > 0.0));
    assert!(matches!(Journal::read(&honest).unwrap().unwrap().entries.last().unwrap().event, Event::Graded));
    course.answer("honest", 0.9);
    assert_eq!(course.grade("honest").objections, [Objection::NotChecked]);

    // A wrong value, an uncertainty above its limit, and one that the reference cannot test.
    let mut wrong = answers(&copy(&course, "work", "wrong"));
    wrong.quantities.get_mut("resistance_ohm").unwrap().value *= 1.2;
    write(&course.path("wrong"), &wrong);
    let judged = course.grade("wrong");
    assert_eq!(judged.objections, []);
    let mark = |grade: &Grade, name: &str| grade.quantities.iter().find(|q| q.name == name).unwrap().mark;
    assert!(!judged.criteria_met && mark(&judged, "resistance_ohm") == Mark::Wrong, "{judged:#?}");
    copy(&course, "work", "wide");
    course.answer("wide", 3.0);
    assert!(course.grade("wide").quantities.iter().all(|q| q.mark == Mark::UncertaintyTooLarge));
    copy(&course, "work", "tiny");
    course.answer("tiny", 1e-6);
    // The error is tested where U_X is small beside it.
    let tiny = course.grade("tiny").quantities;
    assert!(tiny.iter().all(|q| [Mark::UncertaintyNotTested, Mark::Repeat, Mark::Wrong].contains(&q.mark)), "{tiny:#?}");
    assert!(tiny.iter().any(|q| q.mark == Mark::UncertaintyNotTested), "{tiny:#?}");

    // A replaced log: found by the journal, and with a journal written anew by the sealed hash.
    let replaced = copy(&course, "work", "replaced");
    std::fs::copy(replaced.join("logs/03-steps.parquet"), replaced.join("logs/04-coast.parquet")).unwrap();
    let log = || "logs/04-coast.parquet".to_owned();
    assert_eq!(course.grade("replaced").objections, [Objection::Changed { file: log() }, Objection::Replaced { file: log() }]);
    write_journal_anew(&replaced);
    let judged = course.grade("replaced");
    assert_eq!(judged.objections, [Objection::Replaced { file: log() }]);
    assert!(!judged.criteria_met && !judged.values_shown && judged.quantities.is_empty());

    // The sealed hash is changed too.
    let description = std::fs::read_to_string(replaced.join(WORK_FILE)).unwrap();
    let stand = Work::read(&replaced).unwrap().real_stand.unwrap();
    let now = file_sha256(&replaced.join(log())).unwrap();
    std::fs::write(replaced.join(WORK_FILE), description.replace(&stand.logs[&log()], &now)).unwrap();
    write_journal_anew(&replaced);
    assert_eq!(course.grade("replaced").objections, [Objection::Seal]);

    // An edited line of the journal.
    let edited = copy(&course, "work", "edited");
    let journal = std::fs::read_to_string(edited.join(JOURNAL_FILE)).unwrap().replacen("anna", "borys", 1);
    std::fs::write(edited.join(JOURNAL_FILE), journal).unwrap();
    assert_eq!(course.grade("edited").objections, [Objection::Journal { error: ChainError::Broken { line: 2 } }]);

    // Another reference, another key, no reference, a reference in the folder of the student.
    std::fs::write(course.path("other.toml"), text.replace("certificate 7", "certificate 8")).unwrap();
    let other = grade_on_real_stand(&work, Some(course.key.clone()), &course.path("other.toml"), None).unwrap();
    assert_eq!(other.objections, [Objection::OtherReference]);
    assert!(!other.values_shown && !other.criteria_met);
    std::fs::write(course.path("other.key"), "a5".repeat(32)).unwrap();
    let other_key = Key::read(&course.path("other.key")).unwrap();
    let judged = grade_on_real_stand(&work, Some(other_key), &course.path("reference.toml"), None).unwrap();
    assert_eq!(judged.objections, [Objection::Seal, Objection::OtherReference]);
    let missing = grade(&work, Some(course.key.clone()), None, |_| true).unwrap_err().to_string();
    assert!(missing.contains("--reference"), "{missing}");
    std::fs::copy(course.path("reference.toml"), work.join("reference.toml")).unwrap();
    let inside = grade_on_real_stand(&work, Some(course.key.clone()), &work.join("reference.toml"), None).unwrap_err().to_string();
    assert!(inside.contains("the reference is in the work folder"), "{inside}");
}

/// A record of `stand calibrate` is a reference: here of the same stand.
#[test]
fn calibration_record_is_a_reference() {
    let folder = tempfile::tempdir().unwrap();
    let session = folder.path().join("session.toml");
    std::fs::write(&session, include_str!("../../../labs/01-motor/session.toml")).unwrap();
    std::fs::write(folder.path().join("stand.toml"), "").unwrap();
    let words = ["calibrate", "drive", "--session", "session.toml", "--stand", "stand.toml", "--out", "c"];
    common::stand(folder.path(), &words).succeeded();
    let record = std::fs::read_to_string(folder.path().join("c/record.json")).unwrap();
    let course = Course::new("motor", &record);
    course.start(&Bench { stand: drive(), gyroscope: None }, 2.0).unwrap();
    course.answer("work", 1.0);
    let judged = course.grade("work");
    assert!(judged.criteria_met, "{judged:#?}");
    assert!(judged.work.real_stand.unwrap().reference_source.contains("calibration `drive`"));
    let gyro = TeacherReference::read(&course.path("reference.toml"), &Lab::find("gyro").unwrap()).unwrap_err().to_string();
    assert!(gyro.contains("no reference of the work `gyro`"), "{gyro}");
}

/// The commands, with the stand behind a pseudo-terminal.
#[cfg(unix)]
#[test]
fn motor_over_a_serial_port() {
    use common::served::{Served, send_lines};
    use common::{command, stand};
    let course = Course::new("motor", &reference_text("motor", &motor_truth(&drive()), (0.02, 0.0), ""));
    let folder = course.folder.path();
    let served = Served::new(folder, &["--speed", "4"]);
    let words = |out: &'static str| {
        [
            "lab",
            "start",
            "motor",
            "--student",
            "anna",
            "--key",
            "teacher.key",
            "--port",
            "port",
            "--reference",
            "reference.toml",
            "--out",
            out,
        ]
    };

    // Ctrl-C during the rates, when the platform turns.
    let mut child = command(folder, &words("ended")).stderr(std::process::Stdio::piped()).spawn().unwrap();
    std::thread::sleep(std::time::Duration::from_secs(27) / 4);
    assert!(std::process::Command::new("kill").args(["-s", "INT", &child.id().to_string()]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(1));
    assert!(!course.path("ended").exists());
    let reply = send_lines(folder, &served.port, "OUTPut?;:MEASure:RATE?\n").succeeded().out;
    let (output, rate) = reply.trim().split_once(';').unwrap();
    assert!(output == "0" && rate.split([',', ' ']).next().unwrap().parse::<f64>().unwrap().abs() < 0.5, "{reply}");

    let started = stand(folder, &[&words("work")[..], &["--language", "uk"]].concat()).succeeded().out;
    assert!(started.contains("real stand: Rotary Stand") && started.contains("certificate 7"), "{started}");
    assert!(std::fs::read_to_string(course.path("work/instructions.md")).unwrap().contains("certificate 7 of the institute"));
    let description = std::fs::read_to_string(course.path("work/work.toml")).unwrap();
    assert!(description.contains("[real_stand.identity]") && description.contains("manufacturer = \"Rotary Stand\""), "{description}");
    course.answer("work", 1.0);
    let checked = stand(folder, &["lab", "check", "work"]).succeeded().out;
    assert!(checked.contains("реальний стенд: Rotary Stand") && checked.contains("certificate 7"), "{checked}");
    let checked = stand(folder, &["lab", "check", "work", "--json", "-"]).succeeded().json();
    assert_eq!(checked["real_stand"]["identity"]["manufacturer"], "Rotary Stand");
    stand(folder, &["lab", "report", "work", "--html", "r.html", "--json", "r.json"]).succeeded();
    let read = |name: &str| std::fs::read_to_string(course.path(name)).unwrap();
    assert!(read("r.html").contains("реальний стенд") && read("r.json").contains("\"reference_source\""));
    let words = ["lab", "grade", "work", "--key", "teacher.key", "--reference", "reference.toml", "--html", "g.html", "--json", "g.json"];
    let graded = stand(folder, &words).succeeded().out;
    assert!(graded.contains("Числові критерії виконано") && graded.contains("еталонне") && !graded.contains("--attempt"), "{graded}");
    assert!(read("g.html").contains("X ± U_X") && read("g.json").contains("\"U_X\": "));
    assert_eq!(stand(folder, &["lab", "grade", "work", "--key", "teacher.key"]).status, Some(2), "a real stand needs the reference");
}
