//! Puts memory.x of the house's root where the linker finds it; for the image alone, host builds have no use for it.
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
}
