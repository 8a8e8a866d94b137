//! The build of this program for the processor at hand.
//!
//! The archive of `scripts/dist.sh` holds two builds: `stand` for every x86-64, and the same for x86-64-v3 (AVX2; processors since about
//! 2015), whose fits are faster and give the same numbers: Rust neither reorders nor contracts floating-point operations.

/// Continues as the build for x86-64-v3 where the processor is one and the build lies beside this program; returns otherwise.
#[cfg(all(target_arch = "x86_64", unix))]
pub fn continue_as_faster_build() {
    use std::os::unix::process::CommandExt;

    // The levels of the x86-64 psABI; the faster build itself ends here.
    if cfg!(target_feature = "avx2") || !is_level_3() {
        return;
    }
    let name = concat!("lib/stand-", env!("CARGO_PKG_VERSION"), "-x86-64-v3");
    let Ok(program) = std::env::current_exe().map(|this| this.with_file_name(name)) else { return };
    if program.is_file() {
        let mut arguments = std::env::args_os();
        let called_as = arguments.next().unwrap_or_else(|| "stand".into());
        // It returns on failure only; this program then does the work.
        let _ = std::process::Command::new(program).arg0(called_as).args(arguments).exec();
    }
}

#[cfg(not(all(target_arch = "x86_64", unix)))]
pub fn continue_as_faster_build() {}

#[cfg(all(target_arch = "x86_64", unix))]
fn is_level_3() -> bool {
    is_x86_feature_detected!("avx2")
        && is_x86_feature_detected!("bmi1")
        && is_x86_feature_detected!("bmi2")
        && is_x86_feature_detected!("f16c")
        && is_x86_feature_detected!("fma")
        && is_x86_feature_detected!("lzcnt")
        && is_x86_feature_detected!("movbe")
}
