//! Extension module `rotary_stand._native`: the library's logs, models, analyses and stand for the Python package around it.
//!
//! No analysis is here. A call converts its arguments, runs one function of the library on a thread of its own without the interpreter's
//! lock ([`task`]), and returns the answer in the forms of [`stand_report`] ([`answer`]). Errors become exceptions of `rotary_stand.errors`
//! ([`error`]).

mod answer;
mod arrow;
mod calibrate;
mod catalogue;
mod compare;
mod drift;
mod error;
mod explain;
mod fleet;
mod inspection;
mod log;
mod model;
mod noise;
mod observer;
mod sim;
mod stand;
mod table;
mod task;

use pyo3::prelude::*;

/// Instruction sets beyond the baseline of x86-64 that the compiler was allowed to use; empty in a wheel for every machine.
#[pyfunction]
fn instruction_sets() -> Vec<&'static str> {
    let sets = [
        ("sse4.2", cfg!(target_feature = "sse4.2")),
        ("avx", cfg!(target_feature = "avx")),
        ("avx2", cfg!(target_feature = "avx2")),
        ("avx512f", cfg!(target_feature = "avx512f")),
        ("fma", cfg!(target_feature = "fma")),
    ];
    sets.into_iter().filter_map(|(name, is_used)| is_used.then_some(name)).collect()
}

#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("DRIFT_COLUMNS", stand_analysis::drift::compute::COLUMNS.to_vec())?;
    module.add("OBSERVER_COLUMNS", stand_analysis::observer::recorded::COLUMNS.to_vec())?;
    module.add_class::<answer::Answer>()?;
    module.add_class::<fleet::FleetSession>()?;
    module.add_class::<log::Log>()?;
    module.add_class::<model::Model>()?;
    module.add_class::<stand::Stand>()?;
    module.add_function(wrap_pyfunction!(instruction_sets, module)?)?;
    module.add_function(wrap_pyfunction!(inspection::inspect_file, module)?)?;
    module.add_function(wrap_pyfunction!(inspection::inspect_columns, module)?)?;
    module.add_function(wrap_pyfunction!(catalogue::effects, module)?)?;
    module.add_function(wrap_pyfunction!(compare::compare, module)?)?;
    module.add_function(wrap_pyfunction!(compare::simulate, module)?)?;
    module.add_function(wrap_pyfunction!(explain::explain, module)?)?;
    module.add_function(wrap_pyfunction!(fleet::fleet_logs, module)?)?;
    module.add_function(wrap_pyfunction!(fleet::fleet_hash, module)?)?;
    module.add_function(wrap_pyfunction!(fleet::fleet_row, module)?)?;
    module.add_function(wrap_pyfunction!(fleet::fleet_report, module)?)?;
    module.add_function(wrap_pyfunction!(noise::allan, module)?)?;
    module.add_function(wrap_pyfunction!(drift::drift, module)?)?;
    module.add_function(wrap_pyfunction!(drift::drift_platform, module)?)?;
    module.add_function(wrap_pyfunction!(calibrate::calibrate, module)?)?;
    module.add_function(wrap_pyfunction!(calibrate::calibrate_simulated, module)?)?;
    module.add_function(wrap_pyfunction!(observer::observer_design, module)?)?;
    module.add_function(wrap_pyfunction!(observer::observer_bode, module)?)?;
    module.add_function(wrap_pyfunction!(observer::observer_track, module)?)?;
    module.add_function(wrap_pyfunction!(sim::simulated_log, module)?)?;
    Ok(())
}
