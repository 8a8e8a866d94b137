//! A seed gives one record on every machine: the simulated stand and the laws of its effects call no function of the system's C library.
//!
//! IEEE 754 defines + − × ÷, √ and rounding exactly. sin, exp, ln and the like of the standard library come from the C library of the
//! system and differ in the last digit between systems; `powi` has no defined precision either.
#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};

/// Methods of `f64` without a result that is the same everywhere.
const METHODS: &[&str] = &[
    "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sin_cos", "sinh", "cosh", "tanh", "asinh", "acosh", "atanh", "exp", "exp2",
    "exp_m1", "ln", "ln_1p", "log", "log2", "log10", "powf", "powi", "powd", "hypot", "cbrt",
];

fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") && path.file_name().is_some_and(|name| name != "tests.rs") {
            found.push(path);
        }
    }
}

/// Lines of the code before the tests of the file that call such a method, or such a crate.
fn calls(text: &str) -> Vec<String> {
    let code = text.split("#[cfg(test)]").next().unwrap_or_default();
    let called = |line: &str| {
        let function = METHODS
            .iter()
            .any(|name| [format!(".{name}("), format!("f64::{name}("), format!("f32::{name}(")].iter().any(|call| line.contains(call)));
        function || line.contains("rand_distr")
    };
    code.lines().filter(|line| !line.trim_start().starts_with("//") && called(line)).map(str::to_owned).collect()
}

#[test]
fn the_simulated_stand_calls_no_function_of_the_c_library() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut sources = Vec::new();
    files(&root.join("src"), &mut sources);
    files(&root.join("../drive-model/src"), &mut sources);
    assert!(sources.len() > 60, "{}", sources.len());
    for path in sources {
        let found = calls(&std::fs::read_to_string(&path).unwrap());
        assert!(found.is_empty(), "{}: use libm, or drive_model::Portable in a law:\n{}", path.display(), found.join("\n"));
    }
}

#[test]
fn a_call_is_found_in_code_and_not_in_comments_or_tests() {
    assert_eq!(calls("let a = x.sin();\n// y.sin()\nlet b = f64::exp(x);\n#[cfg(test)]\nlet c = x.cos();\n").len(), 2);
    assert!(calls("let a = libm::sin(x); let b = x.portable_exp().sqrt();\n").is_empty());
}

/// Values in bits, recorded on x86-64 Linux: any other machine must give the same.
#[test]
fn the_functions_give_the_recorded_bits() {
    use drive_model::Portable;
    let x = 1.234_567_890_123_f64;
    let bits =
        [x.portable_sin(), x.portable_sin_cos().1, x.portable_exp(), libm::log(x), libm::expm1(x), libm::atan2(x, 2.0)].map(f64::to_bits);
    assert_eq!(bits, RECORDED, "{bits:#x?}");
}

const RECORDED: [u64; 6] =
    [0x3fee354b7e89c6fd, 0x3fd51d8ed12b80cc, 0x400b7ec1cd28dd0a, 0x3fcaf8e80db63fe2, 0x40037ec1cd28dd0a, 0x3fe1b26efda04508];
