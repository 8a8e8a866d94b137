//! Logs of simulated and real drives: fit, residual and `explain`.
#![allow(clippy::unwrap_used)]

mod closed_loop;
mod detection_limits;
mod dirty_logs;
mod explains;
mod foreign_cases;
mod frozen_logs;
mod known_motion;
mod missing_effect_example;
mod other_drives;
mod own_firmware;
mod plain_benches;
mod real_records;
mod repetition;
mod several_logs;
mod where_it_fails;
