//! Sample of the comparison with QEMU's instruction set: `tests/compare_with_unicorn.py` with 2000 random cases.
use std::path::{Path, PathBuf};
use std::process::Command;

/// The example `execute` beside this test's own binary: target/…/deps/unicorn-… and target/…/examples/execute.
fn example() -> PathBuf {
    let test = std::env::current_exe().expect("path of the test");
    test.ancestors().nth(2).expect("folder of the profile").join("examples/execute")
}

#[test]
#[ignore = "needs the Python module unicorn; PYTHON selects the interpreter"]
fn instructions_agree_with_qemu() {
    let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".into());
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/compare_with_unicorn.py");
    let output = Command::new(python).arg(script).arg(example()).args(["--cases", "2000"]).output().expect("Python starts");
    assert!(output.status.success(), "{}\n{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
}
