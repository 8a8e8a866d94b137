//! Writes the files of other programs of the tests into a folder, from a log of the simulated stand:
//! `cargo run -p stand-tests --example foreign_files -- LOG FOLDER`. Beside each, `NAME.words` has the options that its owner has to state.

use std::path::Path;

use identification::log::Log;
use stand_tests::programs::corpus;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [log, folder] = &words[..] else { return Err("two arguments are needed: LOG FOLDER".into()) };
    std::fs::create_dir_all(folder)?;
    for file in corpus(&Log::read(log)?) {
        std::fs::write(Path::new(folder).join(file.name), &file.bytes)?;
        std::fs::write(Path::new(folder).join(format!("{}.words", file.name)), file.stated.join("\n"))?;
    }
    Ok(())
}
