//! A hidden error of the sensor under test, found on the stand's own logs: the platform's angle is the known motion, the sensor's rate the
//! output.
//!
//! `cargo bench -p stand-tests --bench sensor -- [N] [SEED]`: N logs, the errors in turn.
//! `cargo bench -p stand-tests --bench sensor -- write SEED FOLDER`: writes the log and the model of a seed.

use stand_tests::sensor::{self, KINDS};

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    if let Some(at) = words.iter().position(|w| w == "write") {
        let (seed, folder) = (words[at + 1].parse().expect("a seed"), std::path::Path::new(&words[at + 2]));
        let (kind, log, model) = sensor::case(seed);
        log.write(folder.join(format!("sensor-{seed}.parquet"))).expect("the folder is writable");
        std::fs::write(folder.join(format!("sensor-{seed}.toml")), model).expect("the folder is writable");
        println!("{seed} {}", kind.name());
        return;
    }
    let numbers: Vec<u64> = words.iter().filter_map(|w| w.parse().ok()).collect();
    let (count, first) = (numbers.first().copied().unwrap_or(300), numbers.get(1).copied().unwrap_or(1));
    let answers: Vec<_> = (first..first + count).map(sensor::answer).inspect(|a| eprintln!("{a}")).collect();
    println!(
        "| error of the sensor | logs | named, alone | named, and another beside it | adequate | no effect explains it | another error named |"
    );
    println!("|---|---|---|---|---|---|---|");
    for kind in KINDS {
        let of = |test: &dyn Fn(&sensor::Answer) -> bool| answers.iter().filter(|a| a.kind == kind && test(a)).count();
        let (alone, beside) = (of(&|a| a.is_named() && a.added.len() == 1), of(&|a| a.is_named() && a.added.len() > 1));
        let (adequate, unknown) = (of(&|a| a.verdict == "adequate"), of(&|a| a.added.is_empty() && a.verdict != "adequate"));
        let wrong = of(&|a| !a.added.is_empty() && !a.is_named());
        println!("| {} | {} | {alone} | {beside} | {adequate} | {unknown} | {wrong} |", kind.name(), of(&|_| true));
    }
}
