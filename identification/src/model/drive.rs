//! The table `[drive]` of the model file: input, outputs, names of effects.

use std::ops::Range;

use drive_model::{Card, MAX_COLUMNS, cards};
use toml_edit::TableLike;

use super::catalogue;
use super::error::{ModelError, ModelErrorKind};
use super::expression::{is_name, is_reserved};
use super::read::{Named, Reader};
use super::{Channel, Input};
use crate::words::nearest;

impl Reader<'_> {
    pub(super) fn input(&self, drive: &dyn TableLike, span: Option<Range<usize>>) -> Result<Input, ModelError> {
        let key = "[drive] input";
        let Some(item) = drive.get("input") else { return self.fail(span, "[drive]", ModelErrorKind::Missing("input")) };
        let Some(name) = item.as_str() else {
            return self.fail(item.span(), key, ModelErrorKind::Wants("a column name in quotes, e.g. \"u_V\""));
        };
        let names = Input::ALL.map(|i| self.axis.column(i.column()));
        if let Some(input) = Input::ALL.into_iter().find(|i| self.axis.column(i.column()) == name) {
            return Ok(input);
        }
        let near = nearest(name, names);
        let known = format!("valid inputs: {}", names.join(", "));
        self.fail(item.span(), key, ModelErrorKind::Unknown { what: "input", name: name.to_owned(), near, known })
    }

    pub(super) fn outputs(&self, drive: &dyn TableLike, input: Input) -> Result<Option<Vec<Channel>>, ModelError> {
        const ALL: [Channel; 5] = [Channel::Rate, Channel::Angle, Channel::Current, Channel::Voltage, Channel::Torque];
        let Some(item) = drive.get("outputs") else { return Ok(None) };
        let key = "[drive] outputs";
        let mut outputs = Vec::new();
        for (name, span) in self.strings(item, key)? {
            let column = |channel: Channel| self.axis.column(channel.compared_column(input));
            let found = ALL.into_iter().find(|c| column(*c) == name);
            // An output of other inputs, or one that is the input here.
            if found.is_none_or(|c| !input.outputs().contains(&c))
                && let Some(other) = ALL.into_iter().find(|c| self.axis.column(c.column()) == name)
            {
                let possible = input.outputs().iter().map(|c| column(*c)).collect::<Vec<_>>().join(", ");
                let (output, input) = (self.axis.column(other.column()), self.axis.column(input.column()));
                return self.fail(span, key, ModelErrorKind::Output { output, input, possible });
            }
            let Some(channel) = found else {
                let known = ALL.map(column);
                let near = nearest(name, known);
                let known = format!("valid outputs: {}", known.join(", "));
                return self.fail(span, key, ModelErrorKind::Unknown { what: "output", name: name.to_owned(), near, known });
            };
            if outputs.contains(&channel) {
                return self.fail(span, key, ModelErrorKind::Twice { what: "output", name: name.to_owned(), hint: String::new() });
            }
            outputs.push(channel);
        }
        if outputs.is_empty() {
            return self.fail(
                item.span(),
                key,
                ModelErrorKind::Wants("at least one output; omit the key for all outputs that the log has"),
            );
        }
        Ok(Some(outputs))
    }

    /// The column that is compared as the rate.
    pub(super) fn rate_column(&self, drive: &dyn TableLike) -> Result<Option<String>, ModelError> {
        let Some(item) = drive.get("rate_column") else { return Ok(None) };
        match item.as_str() {
            Some(name) => Ok(Some(name.to_owned()).filter(|name| name != self.axis.column(Channel::Rate.column()))),
            None => self.fail(item.span(), "[drive] rate_column", ModelErrorKind::Wants("a column name in quotes, e.g. \"gyro_rad_s\"")),
        }
    }

    /// Columns of the log that expressions may use.
    pub(super) fn columns(&self, drive: &dyn TableLike) -> Result<Vec<String>, ModelError> {
        let Some(item) = drive.get("columns") else { return Ok(Vec::new()) };
        let key = "[drive] columns";
        let mut columns: Vec<String> = Vec::new();
        for (name, span) in self.strings(item, key)? {
            if !is_name(name) || is_reserved(name) {
                return self.fail(span, key, ModelErrorKind::ParameterName(name.to_owned()));
            }
            if columns.iter().any(|c| c == name) {
                return self.fail(span, key, ModelErrorKind::Twice { what: "column", name: name.to_owned(), hint: String::new() });
            }
            columns.push(name.to_owned());
        }
        if columns.len() > MAX_COLUMNS {
            return self.fail(item.span(), key, ModelErrorKind::Wants("at most four columns"));
        }
        Ok(columns)
    }

    pub(super) fn effect_names<'i>(&self, drive: &'i dyn TableLike) -> Result<Vec<Named<'i>>, ModelError> {
        drive.get("effects").map_or(Ok(Vec::new()), |item| self.strings(item, "[drive] effects"))
    }

    /// The listed effects of the catalogue; names of user effects are only checked.
    pub(super) fn listed(&self, names: &[Named<'_>], own: &dyn TableLike) -> Result<Vec<(&'static Card, u32)>, ModelError> {
        let key = "[drive] effects";
        let mut listed: Vec<(&'static Card, u32)> = Vec::new();
        for (k, (name, span)) in names.iter().enumerate() {
            if names[..k].iter().any(|(n, _)| n == name) {
                let hint =
                    if catalogue::effect(name).is_some() { format!("; write '{name}#2' for a second instance") } else { String::new() };
                return self.fail(span.clone(), key, ModelErrorKind::Twice { what: "effect", name: (*name).to_owned(), hint });
            }
            match catalogue::effect(name) {
                Some(Ok((card, instance))) => {
                    let shares = |c: &&(&Card, u32)| {
                        c.0.id != card.id && c.0.parameters.iter().any(|p| card.parameters.iter().any(|q| p.name == q.name))
                    };
                    if let Some((rival, _)) = listed.iter().find(shares) {
                        return self.fail(span.clone(), key, ModelErrorKind::Rivals(rival.id, card.id));
                    }
                    listed.push((card, instance));
                }
                Some(Err(kind)) => return self.fail(span.clone(), key, kind),
                None if own.contains_key(name) => {}
                None => {
                    let known = cards().iter().map(|c| c.id).chain(own.iter().map(|(k, _)| k));
                    let near = nearest(name, known);
                    let known = "`stand effects` lists all effects".to_owned();
                    return self.fail(span.clone(), key, ModelErrorKind::Unknown { what: "effect", name: (*name).to_owned(), near, known });
                }
            }
        }
        Ok(listed)
    }
}
