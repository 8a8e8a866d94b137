//! Copies memory.x of the workspace's root to where the linker finds it (the image only), and passes the build's commit to the library as
//! `STAND_COMMIT`.
//!
//! The commit is the short hash, with `-dirty` where the firmware's sources differ from it, or `unknown` where the sources are not in their
//! own git repository (an archive) or git is not installed. The script runs again when HEAD or the firmware's sources change.
use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

/// The files that determine the image, from this folder.
const SOURCES: [&str; 7] = ["build.rs", "Cargo.toml", "src", "../Cargo.toml", "../Cargo.lock", "../memory.x", "../.cargo/config.toml"];

fn main() {
    for source in SOURCES.iter().filter(|source| Path::new(source).exists()) {
        println!("cargo::rerun-if-changed={source}");
    }
    println!("cargo::rustc-env=STAND_COMMIT={}", commit().unwrap_or_else(|| "unknown".to_owned()));
    let has = |feature: &str| env::var_os(feature).is_some();
    if !has("CARGO_FEATURE_STM32") && !has("CARGO_FEATURE_REACH") {
        return;
    }
    let Some(out) = env::var_os("OUT_DIR").map(PathBuf::from) else { return };
    if let Err(error) = fs::copy("../memory.x", out.join("memory.x")) {
        println!("cargo::error=memory.x of the root cannot be copied: {error}");
    }
    println!("cargo::rustc-link-search={}", out.display());
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
    if has("CARGO_FEATURE_STM32") {
        println!("cargo::rustc-link-arg-bins=-Tdefmt.x");
    }
    // One copy of functions that came out the same; both rust-lld and ld.lld know it.
    println!("cargo::rustc-link-arg-bins=--icf=all");
}

/// The commit of the sources; `None` where they are not in their own git repository.
fn commit() -> Option<String> {
    // An archive that was unpacked inside another repository must not carry that repository's commit.
    let top = PathBuf::from(git(&["rev-parse", "--show-toplevel"])?);
    if top.canonicalize().ok()? != Path::new("..").canonicalize().ok()? {
        return None;
    }
    let hash = git(&["rev-parse", "--short=7", "HEAD"])?;
    // In a worktree `.git` is a file, and HEAD and the branch are in two other folders: git resolves the paths.
    watch("HEAD");
    if let Some(branch) = git(&["symbolic-ref", "--quiet", "HEAD"]) {
        watch(&branch);
        watch("packed-refs");
    }
    let changes = git(&[&["status", "--porcelain", "--"], &SOURCES[..]].concat())?;
    Some(if changes.is_empty() { hash } else { format!("{hash}-dirty") })
}

/// Runs the script again when this file of git changes. A branch that is only in `packed-refs` has no file yet: its next commit creates the
/// file, so the nearest folder that exists is watched. (Cargo would run the script at each build for a file that does not exist.)
fn watch(name: &str) {
    let Some(path) = git(&["rev-parse", "--git-path", name]) else { return };
    let existing = Path::new(&path).ancestors().find(|path| path.exists());
    match existing {
        Some(folder) if folder != Path::new(&path) && !name.starts_with("refs/") => {}
        Some(existing) => println!("cargo::rerun-if-changed={}", existing.display()),
        None => {}
    }
}

/// Standard output of a git command in this folder; `None` if it failed.
fn git(arguments: &[&str]) -> Option<String> {
    // The variables that git sets for its hooks would select another repository.
    let output = Command::new("git").args(arguments).env_remove("GIT_DIR").env_remove("GIT_WORK_TREE").output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}
