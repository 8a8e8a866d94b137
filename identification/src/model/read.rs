//! Parsing of a model file into a checked model.

use std::ops::Range;

use drive_model::{Parameter, ParameterKind};
use toml_edit::{Document, Item, TableLike};

use super::catalogue;
use super::error::{ModelError, ModelErrorKind};
use super::{Model, ModelParameter};
use crate::log::Axis;
use crate::words::nearest;

/// Parses and checks `text`.
pub(super) fn parse(text: &str, file: &str) -> Result<Model, ModelError> {
    let document = Document::parse(text.to_owned())
        .map_err(|e| ModelError::at(file, text, e.span(), "", ModelErrorKind::Toml(e.message().to_owned())))?;
    let reader = Reader { file, text, axis: Axis::default(), given: Vec::new(), parameters: Vec::new(), remarks: Vec::new() };
    let parts = reader.model(document.as_table())?;
    Ok(Model { document: document.into_mut(), ..parts })
}

/// A name in a list, and its span.
pub(super) type Named<'i> = (&'i str, Option<Range<usize>>);

/// A parameter in the file.
pub(super) struct Given {
    pub name: String,
    value: f64,
    fixed: bool,
    pub key: String,
    pub span: Option<Range<usize>>,
    pub taken: bool,
}

/// State of the parser: the file, and what was read so far.
pub(super) struct Reader<'a> {
    file: &'a str,
    text: &'a str,
    pub axis: Axis,
    pub given: Vec<Given>,
    pub parameters: Vec<ModelParameter>,
    pub remarks: Vec<String>,
}

impl Reader<'_> {
    pub(super) fn fail<T>(&self, span: Option<Range<usize>>, key: &str, kind: ModelErrorKind) -> Result<T, ModelError> {
        Err(ModelError::at(self.file, self.text, span, key, kind))
    }

    fn model(mut self, root: &dyn TableLike) -> Result<Model, ModelError> {
        self.only(root, "", &["drive", "parameters", "effect"], "table")?;
        let Some(drive) = root.get("drive") else { return self.fail(None, "", ModelErrorKind::Missing("[drive]")) };
        let drive_table = self.table(drive, "[drive]")?;
        self.only(drive_table, "[drive] ", &["axis", "input", "outputs", "rate_column", "columns", "effects"], "key")?;
        self.axis = self.axis(drive_table)?;
        let input = self.input(drive_table, drive.span())?;
        let outputs = self.outputs(drive_table, input)?;
        let rate_column = self.rate_column(drive_table)?;
        if let Some(parameters) = root.get("parameters") {
            let table = self.table(parameters, "[parameters]")?;
            self.collect(table, "[parameters]", |name| name.to_owned(), true)?;
        }
        let empty = toml_edit::Table::new();
        let own_table: &dyn TableLike = match root.get("effect") {
            Some(item) => self.table(item, "[effect]")?,
            None => &empty,
        };
        let columns = self.columns(drive_table)?;
        let names = self.effect_names(drive_table)?;
        let listed = self.listed(&names, own_table)?;
        self.base(input, outputs.as_deref(), drive.span())?;
        self.effect_tables(own_table, &listed)?;
        let effects = listed.into_iter().map(|(card, instance)| self.effect(card, instance)).collect::<Result<Vec<_>, _>>()?;
        let own = self.own_effects(own_table, &columns)?;
        self.nothing_left(&effects)?;
        self.remark_on(&effects, &own);
        let (name, document) = (self.file.to_owned(), toml_edit::DocumentMut::new());
        Ok(Model {
            name,
            axis: self.axis,
            input,
            outputs,
            rate_column,
            columns,
            effects,
            own,
            parameters: self.parameters,
            remarks: self.remarks,
            document,
        })
    }

    /// The axis of the drive; rotary, if the file does not state it.
    fn axis(&self, drive: &dyn TableLike) -> Result<Axis, ModelError> {
        let Some(item) = drive.get("axis") else { return Ok(Axis::Rotary) };
        match item.as_str().and_then(Axis::named) {
            Some(axis) => Ok(axis),
            None => self.fail(item.span(), "[drive] axis", ModelErrorKind::Wants("\"rotary\" or \"linear\"")),
        }
    }

    /// Checks that every key of `table` is one of `known`.
    pub(super) fn only(&self, table: &dyn TableLike, prefix: &str, known: &[&str], what: &'static str) -> Result<(), ModelError> {
        for (key, item) in table.iter() {
            if !known.contains(&key) {
                let span = table.key(key).and_then(|k| k.span()).or(item.span());
                let near = nearest(key, known.iter().copied());
                let known = format!("known keys: {}", known.join(", "));
                return self.fail(span, &format!("{prefix}{key}"), ModelErrorKind::Unknown { what, name: key.to_owned(), near, known });
            }
        }
        Ok(())
    }

    pub(super) fn table<'i>(&self, item: &'i Item, key: &str) -> Result<&'i dyn TableLike, ModelError> {
        match item.as_table_like() {
            Some(table) => Ok(table),
            None => self.fail(item.span(), key, ModelErrorKind::Wants("a table")),
        }
    }

    pub(super) fn strings<'i>(&self, item: &'i Item, key: &str) -> Result<Vec<Named<'i>>, ModelError> {
        let Some(array) = item.as_array() else {
            return self.fail(item.span(), key, ModelErrorKind::Wants("a list of names, e.g. [\"viscous\", \"coulomb\"]"));
        };
        let mut list = Vec::new();
        for value in array {
            match value.as_str() {
                Some(text) => list.push((text, value.span())),
                None => return self.fail(value.span(), key, ModelErrorKind::Wants("a name in quotes")),
            }
        }
        Ok(list)
    }

    /// Reads every entry of a parameter table; `rename` returns the name in the model.
    ///
    /// `of_catalogue`: its names are those of the catalogue on the axis of the model.
    pub(super) fn collect(
        &mut self,
        table: &dyn TableLike,
        prefix: &str,
        rename: impl Fn(&str) -> String,
        of_catalogue: bool,
    ) -> Result<(), ModelError> {
        for (key, item) in table.iter() {
            let path = format!("{prefix} {key}");
            let span = table.key(key).and_then(|k| k.span()).or(item.span());
            let name = match if of_catalogue { catalogue::rotary_name(self.axis, key) } else { Ok(key.to_owned()) } {
                Ok(name) => rename(&name),
                Err(linear) => return self.fail(span, &path, ModelErrorKind::OtherAxis { name: key.to_owned(), linear }),
            };
            if self.given.iter().any(|g| g.name == name) {
                let hint = ": in [parameters] and in the table of the effect".to_owned();
                return self.fail(span, &path, ModelErrorKind::Twice { what: "parameter", name, hint });
            }
            let (value, fixed) = self.number(item, &path)?;
            self.given.push(Given { name, value, fixed, key: path, span, taken: false });
        }
        Ok(())
    }

    /// A number, or `{ value = …, fixed = … }`.
    fn number(&self, item: &Item, key: &str) -> Result<(f64, bool), ModelError> {
        const WANTS: &str = "a number or { value = …, fixed = true }";
        let plain = |item: &Item| item.as_float().or_else(|| item.as_integer().map(|i| i as f64));
        let (value, fixed) = match item.as_table_like() {
            Some(table) => {
                self.only(table, &format!("{key} "), &["value", "fixed"], "key")?;
                match table.get("fixed").map_or(Some(false), Item::as_bool) {
                    Some(fixed) => (table.get("value").and_then(plain), fixed),
                    None => (None, false),
                }
            }
            None => (plain(item), false),
        };
        match value {
            Some(value) if value.is_finite() => Ok((value, fixed)),
            Some(value) => self.fail(item.span(), key, ModelErrorKind::NotFinite(value)),
            None => self.fail(item.span(), key, ModelErrorKind::Wants(WANTS)),
        }
    }

    /// The parameter of that name in the file, checked against its catalogue entry.
    pub(super) fn take(&mut self, name: &str, info: Option<&'static Parameter>) -> Result<Option<ModelParameter>, ModelError> {
        let Some(given) = self.given.iter_mut().find(|g| g.name == name) else { return Ok(None) };
        given.taken = true;
        let (mut value, fixed, key, span) = (given.value, given.fixed, given.key.clone(), given.span.clone());
        if let Some(info) = info {
            let (low, high) = info.range;
            match info.kind {
                ParameterKind::Phase => value = value.rem_euclid(std::f64::consts::TAU),
                ParameterKind::HarmonicOrder if value.fract() != 0.0 => return self.fail(span, &key, ModelErrorKind::NotWhole(value)),
                ParameterKind::Positive if value <= 0.0 => {
                    return self.fail(span, &key, ModelErrorKind::Range { value, range: range(info) });
                }
                _ if value < low || value > high => return self.fail(span, &key, ModelErrorKind::Range { value, range: range(info) }),
                _ => {}
            }
        }
        Ok(Some(ModelParameter { name: name.to_owned(), value, fixed, filled_in: false, info }))
    }
}

fn range(info: &Parameter) -> String {
    let (low, high) = info.range;
    let above = if info.kind == ParameterKind::Positive && low == 0.0 { "above 0".to_owned() } else { format!("from {low}") };
    let to = if high.is_finite() { format!(" to {high}") } else { String::new() };
    format!("{above}{to} {}", info.unit)
}
