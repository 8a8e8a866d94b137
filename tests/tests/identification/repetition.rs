//! A periodic excitation measures the noise of the channels without a model.

use hal_sim::plant::{Plant, Stand};
use hal_sim::session::{self, SessionRequest};
use identification::deadline::Deadline;
use identification::identify::evaluation::{Evaluation, EvaluationRemark, ParameterTreatment, evaluate};
use identification::log::{Column, Log};
use identification::model::Channel;
use stand_firmware::profile::{ProfileConfig, ProfileKind};
use stand_firmware::speed_loop::Mode;
use stand_tests::draw::Drawn;

fn log(from_Hz: f64, seconds: f64) -> Log {
    let stand = Stand::default();
    let profile = ProfileConfig { from_Hz, ..ProfileConfig::new(ProfileKind::Multisine, 0.7, 1) };
    let plant = Plant::new(&stand, 0.0).expect("a valid stand");
    let record = session::run(stand.setup(), plant, SessionRequest { mode: Mode::Voltage, profile, seconds, seed: 5 }).expect("a session");
    let columns = record.columns.into_iter().map(|(name, values)| Column { name: name.to_owned(), values }).collect();
    Log::new("session.parquet", columns, record.notes).expect("a log")
}

fn remarks(log: &Log) -> (Vec<EvaluationRemark>, Vec<(Channel, f64)>) {
    let model = Drawn::by_name("nulls/voltage/multisine/1").expect("a stand").true_model();
    match evaluate(log, &model, ParameterTreatment::Kept, Deadline::NEVER).expect("a comparison") {
        Evaluation::Evaluated(e) => (e.remarks, e.result.channels.iter().map(|c| (c.channel, c.noise)).collect()),
        Evaluation::ImplausibleLog(defects) => panic!("{defects:?}"),
    }
}

#[test]
fn noise_from_repetitions_is_that_of_the_channels() {
    let (remarks, noise) = remarks(&log(0.2, 20.0));
    let repeated = remarks.iter().find_map(|r| if let EvaluationRemark::Repetition(r) = r { Some(r) } else { None }).expect("a repetition");
    assert!((repeated.period_s - 5.0).abs() < 1e-3, "{repeated:?}");
    assert!(repeated.periods >= 3, "{repeated:?}");
    for (channel, not_repeatable) in &repeated.not_repeatable {
        let (_, noise) = noise.iter().find(|(c, _)| c == channel).expect("the channel");
        let ratio = not_repeatable / noise;
        assert!((0.9..1.2).contains(&ratio), "{channel:?}: {ratio} × the noise that the residual gives");
    }
}

#[test]
fn one_period_and_a_half_measures_nothing() {
    let (remarks, _) = remarks(&log(0.075, 20.0));
    assert!(!remarks.iter().any(|r| matches!(r, EvaluationRemark::Repetition(_))));
}
