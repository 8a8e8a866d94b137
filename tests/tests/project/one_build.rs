//! `cargo run`, the wheel and the tests share one build: no crate of theirs is compiled with other features than the workspace has. A crate
//! that differs is compiled again with all that depends on it, which doubles the time of a fresh clone.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

/// Each crate of a selection with its features, `name v1.2.3 [features]`.
fn crates(selection: &[&str]) -> BTreeSet<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut tree = Command::new(cargo);
    tree.args(["tree", "--locked", "--prefix", "none", "--format", "{p} [{f}]", "--target", "x86_64-unknown-linux-gnu"])
        .args(selection)
        .current_dir(root);
    let output = tree.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    text.lines().map(|line| line.trim_end_matches(" (*)").replace(" (proc-macro)", "")).collect()
}

#[test]
fn command_and_wheel_have_the_features_of_the_workspace() {
    let workspace = crates(&["--workspace", "--edges", "normal,build,dev"]);
    assert!(workspace.len() > 200, "{}", workspace.len());
    for package in ["stand", "rotary-stand-python"] {
        let all = crates(&["--package", package, "--edges", "normal,build"]);
        let other: Vec<&String> = all.iter().filter(|name| !workspace.contains(*name)).collect();
        assert!(other.is_empty(), "{package} builds again, raise their features in stand-acquire/Cargo.toml: {other:#?}");
    }
}
