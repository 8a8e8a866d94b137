//! `stand model new|show|add|remove|set`: the model file.

use std::path::PathBuf;

use clap::Subcommand;

use super::error::CliError;
use super::output::print;
use crate::model::{Input, Model};
use crate::words::nearest;

#[derive(Debug, Subcommand)]
pub(super) enum ModelCommand {
    /// Write a new model file: the bare drive, with the effects named
    New {
        /// The file, .toml
        model: PathBuf,
        /// Its input: u_V, i_A, torque_N_m or theta_rad
        #[arg(long, default_value = "u_V")]
        input: String,
        /// Effects that it has from the start
        #[arg(long, value_delimiter = ',')]
        effects: Vec<String>,
        /// Overwrite a file that is there
        #[arg(long)]
        force: bool,
    },
    /// Show a model: input, outputs, effects, parameters
    Show {
        /// The file
        model: PathBuf,
    },
    /// Add an effect of the catalogue
    Add {
        /// The file
        model: PathBuf,
        /// The effect; one that is there already is added again as NAME#2
        effect: String,
    },
    /// Remove an effect, with its parameters
    Remove {
        /// The file
        model: PathBuf,
        /// The effect
        effect: String,
    },
    /// Set a parameter
    Set {
        /// The file
        model: PathBuf,
        /// Its name, e.g. inertia_kg_m2
        parameter: String,
        /// Its value, in the unit of the name
        #[arg(allow_negative_numbers = true)]
        value: f64,
        /// Hold it: a fit does not move it
        #[arg(long, conflicts_with = "free")]
        fixed: bool,
        /// Free it again
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
                    return Err(CliError::Input(format!("--input `{input}`: it is one of {}{hint}", known.join(", "))));
                };
                if model.exists() && !force {
                    return Err(CliError::Input(format!("{}: is there already; --force overwrites it", model.display())));
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
    let outputs = match model.outputs() {
        Some(outputs) => outputs.iter().map(|o| o.column()).collect::<Vec<_>>().join(", "),
        None => "all that the log has".to_owned(),
    };
    let effects = model.effect_names();
    let mut text = format!("{}\n", model.name());
    text += &format!("  input    {}\n  outputs  {outputs}\n", model.input().column());
    text += &format!("  effects  {}\n\n", if effects.is_empty() { "none: the bare drive".to_owned() } else { effects.join(", ") });
    let width = model.parameters().iter().map(|p| p.name.chars().count()).max().unwrap_or(0);
    for p in model.parameters() {
        let says = p.info.map_or("", |i| i.description);
        let mark = if p.fixed {
            "fixed"
        } else if p.filled_in {
            "start"
        } else {
            ""
        };
        text += &format!("  {:<width$}  {:>12}  {mark:<5}  {says}\n", p.name, crate::report::digits(p.value));
    }
    for own in model.user_effects() {
        text += &format!("\n  {}: {} += {}\n", own.name, own.summing_point.key(), own.expression);
    }
    for remark in model.remarks() {
        text += &format!("  {remark}\n");
    }
    print(&text)
}
