//! `stand effects [ID]`: the catalogue, and the account of one effect.

use clap::Args;
use drive_model::CATALOGUE;

use super::error::CliError;
use super::output::{ReportOutput, is_terminal};
use crate::report::effects;
use crate::words::nearest;

/// The catalogue of physical effects, or the account of one.
#[derive(Debug, Args)]
pub(super) struct Effects {
    /// An effect, e.g. cogging
    id: Option<String>,
    #[command(flatten)]
    output: ReportOutput,
}

impl Effects {
    pub(super) fn run(self) -> Result<(), CliError> {
        self.output.check()?;
        let Some(id) = &self.id else {
            self.output.text(&effects::list_text(is_terminal()))?;
            self.output.json(effects::list_json)?;
            return self.output.html(effects::list_html);
        };
        let card = drive_model::card(id).ok_or_else(|| {
            let hint = nearest(id, CATALOGUE.iter().map(|c| c.id)).map_or(String::new(), |n| format!("; did you mean `{n}`?"));
            CliError::Input(format!("`{id}` is no effect of the catalogue{hint} (`stand effects` lists them)"))
        })?;
        self.output.text(&effects::effect_text(card, is_terminal()))?;
        self.output.json(|| effects::effect_json(card))?;
        self.output.html(|| effects::effect_html(card))
    }
}
