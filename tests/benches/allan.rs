//! Run time of the overlapping Allan deviation compared with allantools, and memory for a long log.
//!
//! `cargo bench -p stand-tests --bench allan`. Method: 10⁷ rates in memory (white noise and a random walk), 23 octaves; best of several
//! runs on identical numbers, results compared. allantools needs `python3` with the package, else it is skipped. Memory: two hours at 1 kHz
//! from Parquet and CSV, peak resident set of a separate process.

use std::path::Path;
use std::process::Command;
use std::time::Instant;

use hal_sim::peripherals::Noise;
use identification::log::{Column, Log};
use stand_analysis::allan::deviation::Series;
use stand_analysis::allan::{Request, Taus};
use stand_tests::memory::{peak_MiB, resident_MiB};

const ROWS: usize = 10_000_000;
const OCTAVES: usize = 23;
const RUNS: usize = 7;
const LONG_ROWS: usize = 7_200_000;

/// Reads `rates.f64`, prints the best time and the deviations.
const SCRIPT: &str = "
import time, numpy, allantools
rates = numpy.fromfile('rates.f64')
taus = 2.0 ** numpy.arange(23)
best = float('inf')
for run in range(3):
    begin = time.perf_counter()
    found = allantools.oadev(rates, rate=1.0, data_type='freq', taus=taus)
    best = min(best, time.perf_counter() - begin)
print(allantools.__version__, best, *map(repr, map(float, found[1])))
";

fn main() {
    if let Some(log) = std::env::args().nth(1).filter(|word| word.ends_with(".parquet") || word.ends_with(".csv")) {
        return one_log(&log);
    }
    let folder = std::env::temp_dir().join(format!("stand-allan-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder for the comparison");
    speed(&folder);
    memory(&folder);
    std::fs::remove_dir_all(&folder).expect("the folder is removed");
}

fn rates(rows: usize) -> Vec<f64> {
    let (mut white, mut walk) = (Noise::new(1, 0, 1e-3), Noise::new(1, 1, 1e-6));
    let mut bias = 0.02;
    (0..rows)
        .map(|_| {
            bias += walk.draw();
            bias + white.draw()
        })
        .collect()
}

fn speed(folder: &Path) {
    let rates = rates(ROWS);
    let factors: Vec<usize> = (0..OCTAVES).map(|k| 1 << k).collect();
    let rows = 0..rates.len();
    let mut deviations = Vec::new();
    let mut best = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        (0..RUNS).fold(f64::INFINITY, |best, _| {
            let mine = rates.clone();
            let begin = Instant::now();
            let series = Series::of_rates(mine, std::slice::from_ref(&rows));
            deviations = pool.install(|| series.overlapping(&factors)).iter().map(|v| v.variance.sqrt()).collect();
            best.min(begin.elapsed().as_secs_f64())
        })
    };
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let (one, all) = (best(1), best(cores));
    println!("| overlapping Allan deviation of {ROWS} rates, {OCTAVES} octaves | s | of allantools' time |");
    println!("|---|---|---|");
    let bytes: Vec<u8> = rates.iter().flat_map(|v| v.to_le_bytes()).collect();
    std::fs::write(folder.join("rates.f64"), bytes).expect("the rates");
    let ran = Command::new("python3").args(["-c", SCRIPT]).current_dir(folder).output();
    let printed = ran.map(|ran| String::from_utf8_lossy(&ran.stdout).into_owned()).unwrap_or_default();
    let words: Vec<&str> = printed.split_whitespace().collect();
    let theirs = words.get(1).and_then(|word| word.parse::<f64>().ok());
    let share = |seconds: f64| theirs.map_or("–".to_owned(), |theirs| format!("{:.3}", seconds / theirs));
    println!("| one core | {one:.3} | {} |", share(one));
    println!("| {cores} cores | {all:.3} | {} |", share(all));
    match theirs {
        Some(theirs) => println!("| allantools {} | {theirs:.3} | 1 |", words[0]),
        None => println!("\nskipped: python3 with allantools is not on this machine"),
    }
    let differ = words.iter().skip(2).zip(&deviations).filter_map(|(word, mine)| Some((word.parse::<f64>().ok()? / mine - 1.0).abs()));
    println!("\ngreatest difference of a deviation: {:.1e}", differ.fold(0.0, f64::max));
}

fn memory(folder: &Path) {
    let name = folder.join("long.parquet");
    let t_s: Vec<f64> = (0..LONG_ROWS).map(|k| k as f64 * 1e-3).collect();
    let columns = [("t_s", t_s), ("gyro_rad_s", rates(LONG_ROWS)), ("omega_rad_s", rates(LONG_ROWS)), ("u_V", rates(LONG_ROWS))];
    let columns = columns.map(|(name, values)| Column { name: name.to_owned(), values });
    let log = Log::new(&name, columns.into(), Vec::new()).expect("a log");
    println!(
        "\n| {LONG_ROWS} rows of four columns ({:.0} MiB each) | s | resident before, MiB | at most | per column |",
        LONG_ROWS as f64 / 131_072.0
    );
    println!("|---|---|---|---|---|");
    for file in ["long.parquet", "long.csv"] {
        let path = folder.join(file);
        log.write(&path).expect("the log");
        let this = std::env::current_exe().expect("this program");
        let ran = Command::new(this).arg(&path).output().expect("it runs");
        print!("{}", String::from_utf8_lossy(&ran.stdout));
    }
}

/// One line of the table, in a separate process.
fn one_log(log: &str) {
    let before = resident_MiB();
    let begin = Instant::now();
    let request =
        Request { log: log.into(), column: "gyro_rad_s".into(), from_s: None, to_s: None, taus: Taus::Octave, interpretation: None };
    let answer = request.answer().expect("an answer");
    let (seconds, peak) = (begin.elapsed().as_secs_f64(), peak_MiB());
    let form = if log.ends_with("csv") { "CSV" } else { "Parquet" };
    println!("| {form} | {seconds:.2} | {before:.0} | {peak:.0} | {:.2} |", (peak - before) / (answer.rows as f64 / 131_072.0));
}
