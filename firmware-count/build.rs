//! Selects the link script for QEMU's board when the target is the chip's instruction set.
use std::env;

fn main() {
    println!("cargo::rerun-if-changed=count.x");
    println!("cargo::rerun-if-changed=build.rs");
    if env::var_os("CARGO_FEATURE_QEMU").is_some()
        && let Ok(here) = env::var("CARGO_MANIFEST_DIR")
    {
        println!("cargo::rustc-link-arg-bins=-T{here}/count.x");
    }
}
