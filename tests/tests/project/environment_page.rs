//! Every variable `STAND_…` and `LAB_…` that a source reads is in the table of docs/environment.md, and the table names no other.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Endings of sources; the scripts without one are named.
const ENDINGS: [&str; 4] = ["rs", "sh", "py", "mjs"];
const SCRIPTS: [&str; 2] = [".ci/run", "justfile"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Sources below a folder, without hidden folders and what builds leave.
fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() && !name.starts_with('.') && !["target", "out", "node_modules"].contains(&name.as_str()) {
            sources(&path, found);
        } else if path.extension().is_some_and(|ending| ENDINGS.iter().any(|known| ending == *known)) {
            found.push(path);
        }
    }
}

fn is_word(character: char) -> bool {
    character.is_ascii_alphanumeric() || character == '_'
}

/// Variables in a text: a name in quotes, behind `$`, `${` or `env.`, or assigned before a command.
fn variables(text: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for prefix in ["STAND_", "LAB_"] {
        for (at, _) in text.match_indices(prefix) {
            let (before, rest) = text.split_at(at);
            let name: String = rest.chars().take_while(|c| is_word(*c)).collect();
            let after = &rest[name.len()..];
            let is_read = ["$", "${", "env."].iter().any(|mark| before.ends_with(mark))
                || ['"', '\''].iter().any(|quote| before.ends_with(*quote) && after.starts_with(*quote))
                || !before.ends_with(is_word) && after.starts_with('=');
            if is_read && name.len() > prefix.len() && name.chars().all(|c| !c.is_ascii_lowercase()) {
                found.insert(name);
            }
        }
    }
    found
}

/// The names in backticks in the first column of a page's tables.
fn documented(page: &str) -> BTreeSet<String> {
    let cells = page.lines().filter_map(|line| line.strip_prefix('|')?.split('|').next());
    cells.flat_map(|cell| cell.split('`').skip(1).step_by(2)).map(str::to_owned).collect()
}

#[test]
fn names_are_found_in_every_language() {
    let text = "var_os(\"STAND_A\") const STAND_B: &str = env!(\"X\"); ${STAND_C:-} $LAB_D STAND_E=1 cargo os.environ['LAB_F'] process.env.STAND_G ROTARY_STAND_H=1 `STAND_I`";
    let names = ["LAB_D", "LAB_F", "STAND_A", "STAND_C", "STAND_E", "STAND_G"];
    assert_eq!(variables(text), names.map(str::to_owned).into());
    assert_eq!(documented("| name |\n|---|\n| `A`, `B` | `C` |\ntext `D`"), ["A", "B"].map(str::to_owned).into());
}

#[test]
fn every_variable_is_documented_and_every_documented_one_is_read() {
    let mut paths: Vec<PathBuf> = SCRIPTS.iter().map(|name| root().join(name)).collect();
    sources(&root(), &mut paths);
    // The examples of the test above.
    paths.retain(|path| !path.ends_with("tests/project/environment_page.rs"));
    let read: BTreeSet<String> = paths.iter().flat_map(|path| variables(&std::fs::read_to_string(path).unwrap())).collect();
    let page = documented(&std::fs::read_to_string(root().join("docs/environment.md")).unwrap());
    let page: BTreeSet<String> = page.into_iter().filter(|name| name.starts_with("STAND_") || name.starts_with("LAB_")).collect();
    assert_eq!(read, page, "left: read by sources; right: in docs/environment.md");
}
