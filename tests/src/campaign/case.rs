//! A log with the user's model and the truth, by name.
//!
//! `GROUP/…` is a drawn stand ([`crate::draw::Drawn`]); `KIND:GROUP/…` the same log with an imperfection ([`crate::dirt::Dirt`]);
//! `empty:GROUP/…` the same log with a model that has no effects, so that all effects of the stand are hidden; `foreign/CASE` a log of
//! another simulator, in the folder that `STAND_DATA` names.

use std::path::Path;

use identification::log::Log;
use identification::model::Model;

use super::inputs::InputHash;
use crate::dirt::Dirt;
use crate::draw::Drawn;
use crate::foreign;

/// A log whose truth is known.
pub struct Case {
    /// Its name.
    pub id: String,
    /// The log.
    pub log: Log,
    /// The user's model.
    pub user: Model,
    /// True structure with true values; `None` where the catalogue lacks it.
    pub truth: Option<Model>,
    /// Hidden effects of the catalogue.
    pub hidden: Vec<String>,
    /// A disturbance outside the catalogue is hidden.
    pub is_outsider: bool,
    /// The rate is derived from the encoder, without a note in the log.
    pub rate_from_encoder: bool,
    /// The stand, where it is one of our own.
    pub drawn: Option<Drawn>,
    /// The imperfection of the log.
    pub dirt: Dirt,
}

/// The group of a name, by which answers are counted: `own`, `nulls`, `jitter:nulls` …
pub fn group(id: &str) -> &str {
    let group = id.split('/').next().unwrap_or(id);
    if id.starts_with("several/2/") {
        "pairs"
    } else if id.starts_with("several/3/") {
        "triples"
    } else {
        group
    }
}

impl Case {
    /// The case of this name. `data`: the folder with logs of another simulator.
    ///
    /// # Errors
    /// There is none of this name, or it needs the folder.
    pub fn by_name(id: &str, data: Option<&Path>) -> Result<Case, String> {
        if let Some(name) = id.strip_prefix("foreign/") {
            let data = data.ok_or_else(|| format!("{id}: set STAND_DATA to the folder of the logs of another simulator"))?;
            return Ok(foreign(id, foreign::case(&data.join("cases").join(name))));
        }
        let (kind, name) = id.split_once(':').unwrap_or(("clean", id));
        let is_empty = kind == "empty";
        let dirt = if is_empty { Dirt::Clean } else { Dirt::by_name(kind).ok_or_else(|| format!("{id}: {kind:?} is no imperfection"))? };
        let drawn = Drawn::by_name(name).ok_or_else(|| format!("{id}: not the name of a log"))?;
        Ok(Case::of(id, drawn, dirt, is_empty))
    }

    fn of(id: &str, drawn: Drawn, dirt: Dirt, is_empty: bool) -> Case {
        let is_outsider = drawn.outsider.is_some();
        Case {
            id: id.to_owned(),
            log: dirt.on(&drawn.log(), drawn.seed()),
            user: if is_empty { drawn.empty_model() } else { drawn.user_model() },
            truth: (!is_outsider).then(|| drawn.true_model()),
            hidden: if is_empty { drawn.stand.effects.keys().cloned().collect() } else { drawn.hidden.clone() },
            is_outsider,
            rate_from_encoder: false,
            drawn: Some(drawn),
            dirt,
        }
    }

    /// SHA-256 of log and model: what `explain` is given.
    pub fn sha256(&self) -> String {
        InputHash::default().log(&self.log).text(&self.user.to_toml()).short()
    }
}

fn foreign(id: &str, case: foreign::Case) -> Case {
    Case {
        id: id.to_owned(),
        user: case.user_model(),
        truth: case.true_model(),
        hidden: Some(case.hidden.clone()).filter(|hidden| hidden != "none" && case.effects.is_some()).into_iter().collect(),
        is_outsider: case.effects.is_none(),
        rate_from_encoder: case.rate_from_encoder,
        log: case.log,
        drawn: None,
        dirt: Dirt::Clean,
    }
}
