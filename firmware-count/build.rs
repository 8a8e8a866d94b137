//! Links by the script for QEMU's board; for the chip's instruction set alone.
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
