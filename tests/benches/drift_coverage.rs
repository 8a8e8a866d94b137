//! Coverage of drift sessions: whole sessions on the simulated stand, steady, with a random walk and with a ramp. Prints the table of
//! docs/metrology-coverage.md.
//!
//! `cargo bench -p stand-tests --bench drift_coverage -- [SESSIONS OF EACH CASE] [FIRST SEED]`; the seeds are fixed beforehand, all misses are printed.

use stand_tests::coverage_table::CoverageTable;
use stand_tests::drift_coverage::DriftCase;

fn main() {
    // Cargo itself passes `--bench`.
    let numbers: Vec<u64> = std::env::args().skip(1).filter_map(|word| word.parse().ok()).collect();
    let (sessions, first) = (numbers.first().copied().unwrap_or(100), numbers.get(1).copied().unwrap_or(7001));
    print!("{}", CoverageTable::header());
    let mut misses = Vec::new();
    for case in DriftCase::ALL {
        let table = case.table(first..first + sessions);
        print!("{}", table.rows(case.name));
        misses.extend(table.0.into_values().flat_map(|count| count.misses));
    }
    println!("\nmisses:");
    misses.iter().for_each(|miss| println!("{miss}"));
}
