//! Copies memory.x of the workspace's root to where the linker finds it. Used by the image only, not by host builds.
use std::{env, fs, path::PathBuf};

fn main() {
    println!("cargo::rerun-if-changed=../memory.x");
    println!("cargo::rerun-if-changed=build.rs");
    if env::var_os("CARGO_FEATURE_STM32").is_none() {
        return;
    }
    let Some(out) = env::var_os("OUT_DIR").map(PathBuf::from) else { return };
    if let Err(error) = fs::copy("../memory.x", out.join("memory.x")) {
        println!("cargo::error=memory.x of the root cannot be copied: {error}");
    }
    println!("cargo::rustc-link-search={}", out.display());
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
    println!("cargo::rustc-link-arg-bins=-Tdefmt.x");
    // One copy of functions that came out the same; both rust-lld and ld.lld know it.
    println!("cargo::rustc-link-arg-bins=--icf=all");
}
