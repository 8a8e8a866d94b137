//! Time and memory of `compare`, `fit` and `explain` by the size of the log.
//!
//! `cargo bench -p stand-tests --bench sizes -- [compare] [fit] [explain] [import] [NAME of a size …]`. Each line is a process of its own;
//! memory is its peak resident set beside the size of the log's columns. The logs follow the equations of the model with white noise (the
//! simulated stand records at 1 kHz only): voltage steps, rate, current, angle.

use std::process::Command;
use std::time::Instant;

use identification::deadline::Deadline;
use identification::identify::evaluation::{Evaluation, ParameterTreatment, evaluate};
use identification::identify::explain::criteria::JoiningCriteria;
use identification::identify::explain::explain;
use identification::identify::explain::join;
use identification::log::import::{self, Statements};
use identification::log::{Column, Log};
use identification::model::Model;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use stand_tests::memory::peak_MiB;

/// Name, number of logs, duration of each, s, and row rate, Hz.
const SIZES: [(&str, usize, f64, f64); 6] = [
    ("5-logs-of-10-s", 5, 10.0, 1000.0),
    ("200-Hz", 1, 60.0, 200.0),
    ("1-kHz", 1, 60.0, 1000.0),
    ("20-kHz", 1, 60.0, 20_000.0),
    ("hour", 1, 3600.0, 1000.0),
    ("ten-million-rows", 1, 10_000.0, 1000.0),
];
const TASKS: [&str; 4] = ["import", "compare", "fit", "explain"];
/// Sizes that `explain` skips unless they are named: it takes minutes.
const LONG: [&str; 2] = ["hour", "ten-million-rows"];

/// Resolution of the angle, rad. Without it the steps of this simulation would be above the noise.
const COUNT_RAD: f64 = std::f64::consts::TAU / 20_000.0;

const MODEL: &str = "[drive]\ninput = \"u_V\"\neffects = [\"viscous\", \"coulomb\"]\n\n[parameters]\ninertia_kg_m2 = 2.5e-4\n\
    motor_constant_N_m_A = 0.0234\nresistance_ohm = 2.5\nviscous_N_m_s = 2e-5\ncoulomb_N_m = 9e-4\n";

fn even(draw: &mut Xoshiro256PlusPlus) -> f64 {
    (draw.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// White noise of standard deviation 1, the sum of twelve even numbers.
fn noise(draw: &mut Xoshiro256PlusPlus) -> f64 {
    (0..12).map(|_| even(draw)).sum::<f64>() - 6.0
}

/// A log of the equations J ω' = K i − b ω − c sign ω + load, i = (u − K ω)/R: the model of the file lacks the load.
fn log(seed: u64, duration_s: f64, rate_hz: f64) -> Log {
    let mut draw = Xoshiro256PlusPlus::seed_from_u64(seed);
    let (j, k, r, b, c, load) = (2.2e-4, 0.0234, 2.3, 1e-5, 8e-4, 4e-4);
    let rows = (duration_s * rate_hz) as usize;
    let dt = 1.0 / rate_hz;
    let inner = (dt / 1e-4).ceil().max(1.0);
    let mut columns: [Vec<f64>; 5] = std::array::from_fn(|_| Vec::with_capacity(rows));
    let (mut omega, mut theta, mut u, mut until) = (0.0_f64, 0.0, 0.0, 0.0);
    for row in 0..rows {
        let t = row as f64 * dt;
        if t >= until {
            u = 1.6 * (even(&mut draw) - 0.5);
            until = t + 0.2 + 0.6 * even(&mut draw);
        }
        columns[0].push(t);
        columns[1].push(u);
        columns[3].push(omega + 5e-3 * noise(&mut draw));
        columns[4].push((theta / COUNT_RAD).round() * COUNT_RAD);
        let mut charge = 0.0;
        for _ in 0..inner as usize {
            let h = dt / inner;
            let current = (u - k * omega) / r;
            let drive = k * current - b * omega + load;
            let next = omega + h * (drive - c * omega.signum()) / j;
            // Dry friction stops and holds the rotor.
            omega = if omega == 0.0 && drive.abs() <= c || next * omega < 0.0 { 0.0 } else { next };
            theta += h * omega;
            charge += h * current;
        }
        columns[2].push(charge / dt + 1e-3 * noise(&mut draw));
    }
    let names = ["t_s", "u_V", "i_A", "omega_rad_s", "theta_rad"];
    let columns = names.into_iter().zip(columns).map(|(name, values)| Column { name: name.to_owned(), values }).collect();
    Log::new(format!("{seed}.parquet"), columns, Vec::new()).expect("a log")
}

/// A text of another program with the numbers of a log.
fn foreign_text(log: &Log) -> String {
    use std::fmt::Write;
    let mut text = "Zeit [ms];Spannung [V];Strom [mA];Drehzahl [1/min];Winkel [°]\n".to_owned();
    let column = |name: &str| log.column(name).expect("a column");
    let (u, i, omega, theta) = (column("u_V"), column("i_A"), column("omega_rad_s"), column("theta_rad"));
    for (k, t) in log.t_s().iter().enumerate() {
        let line = format!("{:.3};{:.4};{:.2};{:.4};{:.3}", 1e3 * t, u[k], 1e3 * i[k], omega[k] * 9.549_296_6, theta[k].to_degrees());
        writeln!(text, "{}", line.replace('.', ",")).expect("memory");
    }
    text
}

/// Runs one task and prints its line.
fn run(task: &str, name: &str) {
    let (_, count, duration_s, rate_hz) = SIZES.into_iter().find(|s| s.0 == name).expect("a size");
    let model = Model::parse(MODEL, "bench.toml").expect("a model");
    if task == "import" {
        let folder = std::env::temp_dir().join(format!("stand-sizes-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        let path = folder.join("foreign.csv");
        std::fs::write(&path, foreign_text(&log(1, duration_s, rate_hz))).expect("a file");
        import::inspect(&path, &Statements::default()).expect("a table").mapping.write_beside(&path).expect("a file");
        let begin = Instant::now();
        let rows = Log::read(&path).expect("a log").len();
        line(task, name, rows, begin);
        let _ = std::fs::remove_dir_all(&folder);
        return;
    }
    let logs: Vec<Log> = (1..=count as u64).map(|seed| log(seed, duration_s, rate_hz)).collect();
    let rows = logs.iter().map(Log::len).sum();
    let begin = Instant::now();
    match task {
        "explain" => {
            let explained = explain(logs, &model, &|_| ()).expect("an explanation");
            assert!(!explained.missing.is_empty(), "the load is missing: {:?} {:?}", explained.verdict, explained.remarks);
        }
        _ => {
            let (log, _) = join(logs, &JoiningCriteria::default()).expect("one log");
            let treatment = if task == "fit" { ParameterTreatment::Fitted } else { ParameterTreatment::Kept };
            assert!(matches!(evaluate(&log, &model, treatment, Deadline::NEVER), Ok(Evaluation::Evaluated(_))));
        }
    }
    line(task, name, rows, begin);
}

fn line(task: &str, name: &str, rows: usize, begin: Instant) {
    let seconds = begin.elapsed().as_secs_f64();
    let columns_MiB = (rows * 5 * 8) as f64 / 1_048_576.0;
    println!("| {task} | {name} | {rows} | {seconds:.1} | {columns_MiB:.0} | {:.0} | {:.1} |", peak_MiB(), peak_MiB() / columns_MiB);
}

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|w| !w.starts_with("--")).collect();
    if let [first, task, name] = &words[..]
        && first == "one"
    {
        return run(task, name);
    }
    let wanted = |list: &[&str], word: &str| !list.iter().any(|w| words.iter().any(|x| x == w)) || words.iter().any(|w| w == word);
    let names = SIZES.map(|s| s.0);
    println!("| task | log | rows | time, s | columns, MiB | memory at most, MiB | ratio |\n|---|---|---|---|---|---|---|");
    for task in TASKS.into_iter().filter(|t| wanted(&TASKS, t)) {
        for name in names.into_iter().filter(|n| wanted(&names, n)) {
            if task == "explain" && LONG.contains(&name) && !words.iter().any(|w| w == name) {
                continue;
            }
            let status = Command::new(std::env::current_exe().expect("this program")).args(["one", task, name]).status();
            assert!(status.is_ok_and(|s| s.success()), "{task} {name}");
        }
    }
}
