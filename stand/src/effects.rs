//! `stand effects [ID]`: the catalogue of effects, or the description of one.

use clap::Args;
use drive_model::cards;

use super::error::CliError;
use super::output::{ReportOutput, is_terminal};
use identification::words::nearest;
use stand_report::effects;

/// List the catalogue of physical effects, or describe one effect.
#[derive(Debug, Args)]
pub(super) struct Effects {
    /// Identifier of an effect, e.g. cogging; without it the catalogue
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
            let hint = nearest(id, cards().iter().map(|c| c.id)).map_or(String::new(), |n| format!("; did you mean `{n}`?"));
            CliError::Input(format!("`{id}` is not an effect of the catalogue{hint} (`stand effects` lists all)"))
        })?;
        self.output.text(&effects::effect_text(card, is_terminal()))?;
        self.output.json(|| effects::effect_json(card))?;
        self.output.html(|| effects::effect_html(card))
    }
}
