//! Table of the external records of another simulator: χ²/n of the true model, and the fit from the usual start.
//!
//! `cargo bench -p stand-tests --bench foreign_cases`

use rayon::prelude::*;
use stand_tests::foreign::{cases, stand_data};

fn main() {
    let data = stand_data();
    println!("| case | χ²/n rate | χ²/n current | χ²/n angle | largest deviation, σ | of |");
    println!("|---|---|---|---|---|---|");
    let lines: Vec<(String, Vec<f64>)> = cases(&data)
        .par_iter()
        .map(|case| {
            let Some(truth) = case.true_model() else {
                return (format!("| {} | not in the catalogue | | | | |", case.name), Vec::new());
            };
            let compared = case.fit_or_compare(&truth, false).expect("a simulation");
            let chi2: Vec<String> = compared.channels.iter().map(|c| format!("{:.3}", c.chi2_per_n())).collect();
            let fitted = case.fit_or_compare(&case.start_model().expect("a model"), true).expect("a fit");
            let deviations = case.deviations(&fitted);
            let worst = deviations.iter().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
            let (name, sigma) = worst.map_or(("", 0.0), |(n, s)| (n.as_str(), *s));
            (format!("| {} | {} | {sigma:+.2} | {name} |", case.name, chi2.join(" | ")), deviations.iter().map(|d| d.1).collect())
        })
        .collect();
    let all: Vec<f64> = lines.iter().flat_map(|l| l.1.clone()).collect();
    for (line, _) in &lines {
        println!("{line}");
    }
    let beyond = |limit: f64| all.iter().filter(|d| d.abs() > limit).count();
    println!(
        "\n{} parameters; beyond 3 σ: {} ({:.1} %); beyond 6 σ: {}",
        all.len(),
        beyond(3.0),
        100.0 * beyond(3.0) as f64 / all.len() as f64,
        beyond(6.0)
    );
}
