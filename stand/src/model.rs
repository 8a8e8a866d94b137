//! `stand model new|show|add|remove|set`: create, show and edit a model file.

use std::path::{Path, PathBuf};

use clap::{Subcommand, ValueEnum};

use super::error::CliError;
use super::output::{JsonOutput, Overwrite};
use identification::files;
use identification::log::Axis;
use identification::model::{Input, Model, ModelError};
use identification::words::nearest;
use stand_report as report;

/// Values of `--axis`.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub(super) enum AxisOption {
    /// Angle, rate, torque
    Rotary,
    /// Position, velocity, force
    Linear,
}

impl AxisOption {
    fn axis(self) -> Axis {
        match self {
            AxisOption::Rotary => Axis::Rotary,
            AxisOption::Linear => Axis::Linear,
        }
    }
}

#[derive(Debug, Subcommand)]
pub(super) enum ModelCommand {
    /// Create a model file: base parameters and the listed effects
    New {
        /// The model file, .toml
        model: PathBuf,
        /// Input of the model: u_V, i_A, torque_N_m or theta_rad; on a linear axis u_V, i_A, force_N or x_m
        #[arg(long, default_value = "u_V")]
        input: String,
        /// Axis of the drive: rotary, or linear with mass_kg, coulomb_N and so on
        #[arg(long, value_enum, default_value_t = AxisOption::Rotary)]
        axis: AxisOption,
        /// Effects of the model, separated by commas
        #[arg(long, value_delimiter = ',')]
        effects: Vec<String>,
        #[command(flatten)]
        overwrite: Overwrite,
        #[command(flatten)]
        json: JsonOutput,
    },
    /// Show a model: input, outputs, effects, parameters
    Show {
        /// The model file, .toml
        model: PathBuf,
        #[command(flatten)]
        json: JsonOutput,
    },
    /// Add an effect of the catalogue with its start values
    Add {
        /// The model file, .toml
        model: PathBuf,
        /// The effect; a further instance of a repeatable effect is added as NAME#2
        effect: String,
        #[command(flatten)]
        json: JsonOutput,
    },
    /// Remove an effect and its parameters
    Remove {
        /// The model file, .toml
        model: PathBuf,
        /// The effect, as `stand model show` lists it
        effect: String,
        #[command(flatten)]
        json: JsonOutput,
    },
    /// Set the value of a parameter, fix it or free it
    Set {
        /// The model file, .toml
        model: PathBuf,
        /// Name of the parameter, e.g. inertia_kg_m2
        parameter: String,
        /// Value, in the unit that the name ends with
        #[arg(allow_negative_numbers = true)]
        value: f64,
        /// Fix the parameter: a fit does not change it
        #[arg(long, conflicts_with = "free")]
        fixed: bool,
        /// Free the parameter: a fit estimates it
        #[arg(long)]
        free: bool,
        #[command(flatten)]
        json: JsonOutput,
    },
}

impl ModelCommand {
    pub(super) fn run(self) -> Result<(), CliError> {
        match self {
            ModelCommand::New { model, input, axis, effects, overwrite, json } => {
                json.check()?;
                let axis = axis.axis();
                let known = Input::ALL.map(|i| axis.column(i.column()));
                let Some(input) = Input::ALL.into_iter().find(|i| axis.column(i.column()) == input) else {
                    let hint = nearest(&input, known).map_or(String::new(), |n| format!("; did you mean `{n}`?"));
                    return Err(CliError::Input(format!("--input `{input}`: must be one of {}{hint}", known.join(", "))));
                };
                overwrite.check(&model)?;
                let mut new = Model::new_on(axis, input, &model.display().to_string())?;
                for effect in &effects {
                    new.add(effect)?;
                }
                new.write(&model)?;
                show(&new, &json)
            }
            ModelCommand::Show { model, json } => {
                json.check()?;
                show(&Model::read(&model)?, &json)
            }
            ModelCommand::Add { model, effect, json } => edit(&model, &json, |changed| {
                let name =
                    if changed.effect_names().contains(&effect) && !effect.contains('#') { changed.next_name(&effect) } else { effect };
                changed.add(&name)
            }),
            ModelCommand::Remove { model, effect, json } => edit(&model, &json, |changed| changed.remove(&effect)),
            ModelCommand::Set { model, parameter, value, fixed, free, json } => edit(&model, &json, |changed| {
                changed.set(&parameter, value)?;
                if fixed || free { changed.fix(&parameter, fixed) } else { Ok(()) }
            }),
        }
    }
}

/// Edits a model file, while other processes that edit it wait, and shows the result.
fn edit(path: &Path, json: &JsonOutput, change: impl FnOnce(&mut Model) -> Result<(), ModelError>) -> Result<(), CliError> {
    json.check()?;
    let _locked = files::lock(path).map_err(|error| CliError::file(path, "read", &error))?;
    let mut model = Model::read(path)?;
    change(&mut model)?;
    model.write(path)?;
    show(&model, json)
}

fn show(model: &Model, json: &JsonOutput) -> Result<(), CliError> {
    json.text(&report::model::text(model))?;
    json.json(|| report::model::json(model))
}
