//! `stand model new|show|add|remove|set`: create, show and edit a model file.

use std::path::PathBuf;

use clap::Subcommand;

use super::error::CliError;
use super::output::print;
use crate::model::{Input, Model};
use crate::report;
use crate::words::nearest;

#[derive(Debug, Subcommand)]
pub(super) enum ModelCommand {
    /// Create a model file: base parameters and the listed effects
    New {
        /// The model file, .toml
        model: PathBuf,
        /// Input of the model: u_V, i_A, torque_N_m or theta_rad
        #[arg(long, default_value = "u_V")]
        input: String,
        /// Effects of the model, separated by commas
        #[arg(long, value_delimiter = ',')]
        effects: Vec<String>,
        /// Overwrite an existing file
        #[arg(long)]
        force: bool,
    },
    /// Show a model: input, outputs, effects, parameters
    Show {
        /// The model file, .toml
        model: PathBuf,
    },
    /// Add an effect of the catalogue with its start values
    Add {
        /// The model file, .toml
        model: PathBuf,
        /// The effect; a further instance of a repeatable effect is added as NAME#2
        effect: String,
    },
    /// Remove an effect and its parameters
    Remove {
        /// The model file, .toml
        model: PathBuf,
        /// The effect, as `stand model show` lists it
        effect: String,
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
    },
}

impl ModelCommand {
    pub(super) fn run(self) -> Result<(), CliError> {
        match self {
            ModelCommand::New { model, input, effects, force } => {
                let known = Input::ALL.map(Input::column);
                let Some(input) = Input::ALL.into_iter().find(|i| i.column() == input) else {
                    let hint = nearest(&input, known).map_or(String::new(), |n| format!("; did you mean `{n}`?"));
                    return Err(CliError::Input(format!("--input `{input}`: must be one of {}{hint}", known.join(", "))));
                };
                if model.exists() && !force {
                    return Err(CliError::Input(format!("{}: the file exists; --force overwrites it", model.display())));
                }
                let mut new = Model::new(input, &model.display().to_string())?;
                for effect in &effects {
                    new.add(effect)?;
                }
                new.write(&model)?;
                show(&new)
            }
            ModelCommand::Show { model } => show(&Model::read(&model)?),
            ModelCommand::Add { model, effect } => {
                let mut changed = Model::read(&model)?;
                let name =
                    if changed.effect_names().contains(&effect) && !effect.contains('#') { changed.next_name(&effect) } else { effect };
                changed.add(&name)?;
                changed.write(&model)?;
                show(&changed)
            }
            ModelCommand::Remove { model, effect } => {
                let mut changed = Model::read(&model)?;
                changed.remove(&effect)?;
                changed.write(&model)?;
                show(&changed)
            }
            ModelCommand::Set { model, parameter, value, fixed, free } => {
                let mut changed = Model::read(&model)?;
                changed.set(&parameter, value)?;
                if fixed || free {
                    changed.fix(&parameter, fixed)?;
                }
                changed.write(&model)?;
                show(&changed)
            }
        }
    }
}

fn show(model: &Model) -> Result<(), CliError> {
    print(&report::model::text(model))
}
