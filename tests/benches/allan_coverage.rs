//! Coverage of Allan coefficients: mixtures of white noise, flicker noise and random walk. Prints the table of docs/metrology-coverage.md.
//!
//! `cargo bench -p stand-tests --bench allan_coverage -- [RECORDS] [FIRST SEED]`; the seeds are fixed beforehand, all misses are printed.

use stand_tests::allan_coverage::table;
use stand_tests::coverage_table::CoverageTable;

fn main() {
    // Cargo itself passes `--bench`.
    let numbers: Vec<u64> = std::env::args().skip(1).filter_map(|word| word.parse().ok()).collect();
    let (records, first) = (numbers.first().copied().unwrap_or(400), numbers.get(1).copied().unwrap_or(9001));
    let folder = std::env::temp_dir().join(format!("stand-allan-coverage-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder for the records");
    let table = table(first..first + records, &folder);
    std::fs::remove_dir_all(&folder).expect("the folder is removed");
    print!("{}{}", CoverageTable::header(), table.rows("mixture"));
    println!("\nmisses:");
    table.0.into_values().flat_map(|count| count.misses).for_each(|miss| println!("{miss}"));
}
