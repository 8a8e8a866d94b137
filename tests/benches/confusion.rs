//! How often `explain` names the hidden effect, and the effects named instead.
//!
//! `cargo bench -p stand-tests --bench confusion -- foreign | own [N] [SEED] | several [N] [SEED] | nulls [N] [SEED] | outsiders [N] [SEED]`
//! `… -- dirt KIND [N] [SEED]` (nulls with an imperfection), `… -- dirty-own KIND [N] [SEED] [FROM]` (effects with it, FROM how many are left out before),
//! `… -- logs [KIND] ID…` (these logs)
//!
//! The word `prediction-error` at the end chooses that engine. N is the number of logs; for `own` and `outsiders`, of seeds for each effect, experiment and mode. `own EFFECT` and `outsiders KIND` run that one alone. `write
//! ID FOLDER` writes a log with its models for `stand explain`. Tables go to standard output, a line per log into a CSV; `pooled CSV…` prints
//! a row for each kind of logs in these files, `engines CSV…` compares the two engines on the logs that both have answered.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use drive_model::cards;
use host_tools::identify::explain::Engine;
use rayon::ThreadPoolBuilder;
use stand_tests::campaigns;
use stand_tests::dirt::Dirt;
use stand_tests::draw::{Drawn, MODES, OUTSIDERS, PROFILES, mode_name};
use stand_tests::foreign::{cases, stand_data};
use stand_tests::tables::{self, Line};
use stand_tests::verdicts::{Known, judge};

fn main() -> ExitCode {
    // Cargo itself passes `--bench`.
    let words: Vec<String> = std::env::args().skip(1).filter(|w| !w.starts_with("--")).collect();
    let effects: Vec<&str> = cards().iter().map(|c| c.id).filter(|id| words.iter().any(|w| w == id)).collect();
    let numbers: Vec<u64> = words.iter().filter_map(|w| w.parse().ok()).collect();
    let number = |k: usize, otherwise: u64| numbers.get(k).copied().unwrap_or(otherwise);
    let first = number(1, 1);
    let group = words.first().map_or("", String::as_str);
    let engine = if words.iter().any(|w| w == "prediction-error") { Engine::PredictionError } else { Engine::Whitened };
    let campaign = Campaign { name: words.join("-"), group: group.to_owned(), engine };
    match group {
        "foreign" => foreign(&campaign),
        "own" => {
            let ids = each(group, &if effects.is_empty() { cards().iter().map(|c| c.id).collect() } else { effects }, number(0, 1), first);
            println!("{}", tables::own(&run(&campaign, &ids)));
        }
        "outsiders" => {
            let named: Vec<&str> = OUTSIDERS.into_iter().filter(|id| words.iter().any(|w| w == id)).collect();
            let of = if named.is_empty() { OUTSIDERS.to_vec() } else { named };
            println!("{}", tables::outsiders(&run(&campaign, &each(group, &of, number(0, 2), first))));
        }
        "several" => {
            let ids: Vec<String> = (0..number(0, 60)).map(|k| format!("several/{}/{}", 2 + k % 2, experiment(k / 2, first))).collect();
            println!("{}", tables::several(&run(&campaign, &ids)));
        }
        "nulls" => {
            let ids: Vec<String> = (0..number(0, 1000)).map(|k| null(k, first)).collect();
            let of = |id: &str| id.split('/').take(2).collect::<Vec<_>>().join(", ");
            println!("{}", tables::nulls(&run(&campaign, &ids), of));
        }
        "dirt" | "dirty-own" => {
            let Some(dirt) = words.get(1).and_then(|word| Dirt::by_name(word)) else {
                return usage(&format!("{group} KIND, one of {}", Dirt::ALL.map(Dirt::name).join(", ")));
            };
            let ids: Vec<String> = if group == "dirt" {
                (0..number(0, 100)).map(|k| null(k, first)).collect()
            } else {
                let all: Vec<&str> = cards().iter().map(|c| c.id).collect();
                // Neighbours differ by experiment, and so do the rounds of an effect.
                let n = all.len() as u64;
                let one = |k: u64| format!("own/{}/{}", all[(k % n) as usize], experiment(k % n + k / n, first));
                (number(2, 0)..number(2, 0) + number(0, 100)).map(one).collect()
            };
            let lines = run_dirty(&Campaign { group: format!("{group}-{}", dirt.name()), ..campaign }, &ids, dirt);
            if group == "dirt" {
                println!("{}", tables::nulls(&lines, |_| dirt.name().to_owned()));
            } else {
                println!("{}", tables::own(&lines));
            }
        }
        "logs" => {
            let dirt = words.iter().find_map(|word| Dirt::by_name(word)).unwrap_or(Dirt::Clean);
            let ids: Vec<String> = words.iter().filter(|word| word.contains('/')).cloned().collect();
            if ids.is_empty() {
                return usage("logs [KIND] ID…, where ID is the name of a log as in the tables");
            }
            if let Some(unknown) = ids.iter().find(|id| Drawn::by_name(id).is_none()) {
                return usage(&format!("{unknown}: not the name of a log"));
            }
            let one_each = Campaign { name: format!("{group}-{}", dirt.name()), ..campaign };
            println!("{}", tables::own(&run_dirty(&one_each, &ids, dirt)));
        }
        "engines" | "pooled" => {
            let table = campaigns::read(words.get(1..).unwrap_or_default())
                .and_then(|answers| if group == "engines" { campaigns::engines(&answers) } else { Ok(campaigns::pooled(&answers)) });
            match table {
                Ok(table) => println!("{table}"),
                Err(e) => return usage(&format!("{group} CSV…: {e}")),
            }
        }
        "write" => {
            let (Some(drawn), Some(folder)) = (words.get(1).and_then(|id| Drawn::by_name(id)), words.get(2)) else {
                return usage("write ID FOLDER, where ID is the name of a log as in the tables");
            };
            if let Err(e) = drawn.write(&PathBuf::from(folder), words.get(3).and_then(|word| Dirt::by_name(word)).unwrap_or(Dirt::Clean)) {
                return usage(&format!("{folder}: {e}"));
            }
            println!("{folder}: log.parquet, model.toml, truth.toml; hidden: {}", drawn.description());
        }
        _ => return usage("one of: foreign, own, several, nulls, outsiders, dirt, dirty-own, logs, engines, pooled, write"),
    }
    ExitCode::SUCCESS
}

fn usage(message: &str) -> ExitCode {
    eprintln!("{message}");
    ExitCode::from(2)
}

/// One call of this program.
struct Campaign {
    /// The words of the command, which name the CSV.
    name: String,
    /// Kind of the logs.
    group: String,
    engine: Engine,
}

/// Names of all combinations of `of`, experiment and mode, `count` seeds each.
fn each(group: &str, of: &[&str], count: u64, first: u64) -> Vec<String> {
    let mut ids = Vec::new();
    for name in of {
        for mode in MODES.map(mode_name) {
            for profile in PROFILES {
                ids.extend((first..first + count).map(|seed| format!("{group}/{name}/{mode}/{profile}/{seed}")));
            }
        }
    }
    ids
}

/// Experiments in rotation.
fn experiment(k: u64, first: u64) -> String {
    let mode = mode_name(MODES[(k / 3) as usize % 2]);
    format!("{mode}/{}/{}", PROFILES[k as usize % 3], first + k)
}

/// A third is closed-loop; one in nine has an additional effect that the user's model also has.
fn null(k: u64, first: u64) -> String {
    let mode = if k % 3 == 2 { "rate" } else { "voltage" };
    let group = if k % 9 >= 6 && k % 9 % 3 == (k / 9) % 3 { "known" } else { "nulls" };
    format!("{group}/{mode}/{}/{}", PROFILES[(k / 3) as usize % 3], first + k)
}

fn run(campaign: &Campaign, ids: &[String]) -> Vec<Line> {
    run_dirty(campaign, ids, Dirt::Clean)
}

/// Results on logs with an imperfection.
fn run_dirty(campaign: &Campaign, ids: &[String], dirt: Dirt) -> Vec<Line> {
    all(campaign, ids, |id| {
        let drawn = Drawn::by_name(id)?;
        let known = Known {
            user: drawn.user_model(),
            truth: Some(drawn.true_model()),
            hidden: &drawn.hidden,
            outsider: drawn.outsider.is_some(),
            rate_from_encoder: false,
            without: &|effect| Some(drawn.true_model_without(effect)),
        };
        let outcome = judge(dirt.on(&drawn.log(), drawn.seed()), &known, campaign.engine);
        let hidden = drawn.hidden.iter().chain(&drawn.outsider).cloned().collect();
        Some(Line { id: id.clone(), hidden, description: drawn.description(), outcome })
    })
}

fn foreign(campaign: &Campaign) {
    let data = stand_data();
    let lines = all(campaign, &cases(&data), |case| {
        let hidden: Vec<String> = Some(case.hidden.clone()).filter(|h| h != "none").into_iter().collect();
        let known = Known {
            user: case.user_model(),
            truth: case.true_model(),
            hidden: &hidden,
            outsider: case.effects.is_none(),
            rate_from_encoder: case.rate_from_encoder,
            without: &|_| None,
        };
        let outcome = judge(case.log.clone(), &known, campaign.engine);
        Some(Line { id: case.name.clone(), hidden: hidden.clone(), description: format!("{:?}", case.truth), outcome })
    });
    println!("{}", tables::foreign(&lines));
}

/// Results in the sequence of the inputs. Each core's thread explains one log at a time, single-threaded: an explanation that shares threads would
/// interleave with others, and its time would include theirs. A line is written to the CSV as soon as it is ready.
fn all<T: Sync>(campaign: &Campaign, of: &[T], answer: impl Fn(&T) -> Option<Line> + Sync) -> Vec<Line> {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("confusion-{}.csv", campaign.name));
    let begun = csv::Writer::from_path(&path).and_then(|mut csv| csv.write_record(tables::CSV_FIELDS).map(|()| csv));
    let csv = match begun {
        Ok(csv) => Some(csv),
        Err(e) => {
            eprintln!("{}: {e}", path.display());
            None
        }
    };
    eprintln!("a line per log: {}", path.display());
    let (next, begin, progress) = (AtomicUsize::new(0), Instant::now(), Mutex::new((Vec::new(), csv)));
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..cores {
            scope.spawn(|| {
                let alone = ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
                while let Some((k, one)) = Some(next.fetch_add(1, Ordering::Relaxed)).and_then(|k| of.get(k).map(|one| (k, one))) {
                    let Some(line) = alone.install(|| answer(one)) else { continue };
                    let mut progress = progress.lock().expect("no thread has failed");
                    let (lines, csv) = &mut *progress;
                    let mark = if tables::is_right(&line) { ' ' } else { '!' };
                    let (o, s) = (&line.outcome, begin.elapsed().as_secs_f64());
                    eprintln!(
                        "{}/{} {s:.0} s {mark} {}: {} {:?}, {:.1} s",
                        lines.len() + 1,
                        of.len(),
                        line.id,
                        o.verdict,
                        o.missing,
                        o.seconds
                    );
                    if let Some(csv) = csv {
                        // A line that cannot be written is still in the table.
                        let _ = csv.write_record(tables::csv_record(&campaign.group, campaigns::name(campaign.engine), &line));
                        let _ = csv.flush();
                    }
                    lines.push((k, line));
                }
            });
        }
    });
    let (mut lines, _) = progress.into_inner().expect("no thread has failed");
    lines.sort_by_key(|(k, _)| *k);
    lines.into_iter().map(|(_, line)| line).collect()
}
