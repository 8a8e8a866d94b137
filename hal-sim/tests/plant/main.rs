//! The plant: its effects and accuracy, and the rig of the fits beside it.
#![allow(clippy::unwrap_used)]

#[path = "../common/mod.rs"]
mod common;
mod effects_electrical;
mod effects_energy;
mod effects_gear_and_crank;
mod effects_measurement;
mod effects_over_time;
mod effects_torque;
mod plant_accuracy;
mod plant_outsiders;
mod portable_functions;
mod rig_agrees_with_plant;
mod rig_derivatives;
mod rig_step;
mod rig_voltage_course;
