//! Edits of a model. They change the text of the file, which keeps comments and order, and parse it again, so that an invalid edit changes
//! nothing.

use toml_edit::{Array, InlineTable, Item, Table, TableLike, Value};

use super::catalogue;
use super::error::{ModelError, ModelErrorKind};
use super::user_effects::SummingPoint;
use super::{Input, Model};
use crate::words::nearest;

impl Model {
    /// Adds an effect of the catalogue (`cogging`, `cogging#2`) with its start values.
    ///
    /// # Errors
    /// The name is unknown or already used, or the effect excludes another one of the model.
    pub fn add(&mut self, effect: &str) -> Result<(), ModelError> {
        self.edit(|model, document| {
            let drive = table(document, "drive")?;
            let effects = drive.entry("effects").or_insert(Item::Value(Value::Array(Array::new())));
            if let Some(list) = effects.as_array_mut() {
                list.push(effect);
            }
            let Some(Ok((card, instance))) = catalogue::effect(effect) else { return Ok(()) };
            let parameters = table(document, "parameters")?;
            for info in card.parameters {
                let name = catalogue::with_instance(info.name, instance);
                let key = model.axis.parameter(&name);
                if model.index(&name).is_none() && !parameters.contains_key(&key) {
                    parameters.insert(&key, Item::Value(number(info.start)));
                }
            }
            Ok(())
        })
    }

    /// Name of a further instance of an effect: `cogging`, or `cogging#2` if the model has `cogging`.
    pub fn next_name(&self, id: &str) -> String {
        let taken = |instance: &u32| !self.effects.iter().any(|e| e.card.id == id && e.instance == *instance);
        catalogue::with_instance(id, (1..).find(taken).unwrap_or(1))
    }

    /// Adds a user effect; `parameters` are names and start values.
    ///
    /// # Errors
    /// The name is used already, or the expression is invalid.
    pub fn add_user_effect(
        &mut self,
        name: &str,
        summing_point: SummingPoint,
        expression: &str,
        parameters: &[(&str, f64)],
    ) -> Result<(), ModelError> {
        self.edit(|model, document| {
            if model.own.iter().any(|o| o.name == name) {
                let twice = ModelErrorKind::Twice { what: "effect", name: name.to_owned(), hint: "; choose another name".to_owned() };
                return Err(ModelError::file(&model.name, twice));
            }
            let effects = document.entry("effect").or_insert_with(|| {
                let mut table = Table::new();
                table.set_implicit(true);
                Item::Table(table)
            });
            let mut own = Table::new();
            own.insert(summing_point.key_on(model.axis), toml_edit::value(expression));
            let mut starts = InlineTable::new();
            for (parameter, start) in parameters {
                starts.insert(*parameter, number(*start));
            }
            if !parameters.is_empty() {
                own.insert("parameters", Item::Value(Value::InlineTable(starts)));
            }
            if let Some(effects) = effects.as_table_like_mut() {
                effects.insert(name, Item::Table(own));
            }
            Ok(())
        })
    }

    /// Removes an effect of the catalogue or a user effect, with its parameters.
    ///
    /// # Errors
    /// The model has no such effect.
    pub fn remove(&mut self, effect: &str) -> Result<(), ModelError> {
        let names = self.effect_names();
        if !names.iter().any(|n| n == effect) {
            let near = nearest(effect, names.iter().map(String::as_str));
            let known =
                if names.is_empty() { "the model has no effects".to_owned() } else { format!("the model has {}", names.join(", ")) };
            let name = effect.to_owned();
            return Err(ModelError::file(&self.name, ModelErrorKind::Absent { what: "effect", name, near, known }));
        }
        self.edit(|model, document| {
            if let Some(list) = table(document, "drive")?.get_mut("effects").and_then(Item::as_array_mut) {
                remove_from(list, effect);
            }
            if let Some(found) = model.effects.iter().find(|e| e.name() == effect) {
                for &k in &found.parameters {
                    table(document, "parameters")?.remove(&model.axis.parameter(&model.parameters[k].name));
                }
            }
            let tables = document.get_mut("effect").and_then(Item::as_table_like_mut);
            let left = tables.map(|tables| {
                tables.remove(effect);
                tables.len()
            });
            if left == Some(0) {
                document.remove("effect");
            }
            Ok(())
        })
    }

    /// Sets one parameter.
    ///
    /// # Errors
    /// The model has no such parameter, or the value is outside its physical range.
    pub fn set(&mut self, parameter: &str, value: f64) -> Result<(), ModelError> {
        self.set_all([(parameter, value)])
    }

    /// Sets several parameters: all of them, or none if one is invalid.
    ///
    /// # Errors
    /// As [`Model::set`].
    pub fn set_all<'a>(&mut self, values: impl IntoIterator<Item = (&'a str, f64)>) -> Result<(), ModelError> {
        let values: Vec<(&str, f64)> = values.into_iter().collect();
        self.edit(|model, document| {
            for &(name, value) in &values {
                let name = &model.known(name)?.0;
                match entry(document, name) {
                    Some(item) => match item.as_table_like_mut() {
                        Some(parts) => replace(parts.entry("value").or_insert(Item::None), number(value)),
                        None => replace(item, number(value)),
                    },
                    None => {
                        table(document, "parameters")?.insert(name, Item::Value(number(value)));
                    }
                }
            }
            Ok(())
        })
    }

    /// Fixes a parameter at its value, or frees it.
    ///
    /// # Errors
    /// The model has no such parameter.
    pub fn fix(&mut self, parameter: &str, fixed: bool) -> Result<(), ModelError> {
        self.edit(|model, document| {
            let (parameter, value) = model.known(parameter)?;
            let parameter = &parameter;
            let mut parts = InlineTable::new();
            parts.insert("value", number(value));
            parts.insert("fixed", Value::from(true));
            let whole = if fixed { Value::InlineTable(parts) } else { number(value) };
            match entry(document, parameter) {
                Some(item) => replace(item, whole),
                None => {
                    table(document, "parameters")?.insert(parameter, Item::Value(whole));
                }
            }
            Ok(())
        })
    }

    /// Changes the input of the model.
    ///
    /// # Errors
    /// The outputs or base parameters of the file do not suit the input.
    pub fn set_input(&mut self, input: Input) -> Result<(), ModelError> {
        self.edit(|model, document| {
            replace(table(document, "drive")?.entry("input").or_insert(Item::None), Value::from(model.axis.column(input.column())));
            Ok(())
        })
    }

    /// Name in the file and value of a parameter, by its name in the file or in the program.
    fn known(&self, parameter: &str) -> Result<(String, f64), ModelError> {
        let in_file = |name: &str| self.axis.parameter(name);
        let found = self.parameters.iter().find(|p| in_file(&p.name) == parameter).or_else(|| self.parameter(parameter));
        found.map(|p| (in_file(&p.name), p.value)).ok_or_else(|| {
            let names: Vec<String> = self.parameters.iter().map(|p| in_file(&p.name)).collect();
            let near = nearest(parameter, names.iter().map(String::as_str));
            let known = format!("the model has {}", names.join(", "));
            let name = parameter.to_owned();
            ModelError::file(&self.name, ModelErrorKind::Absent { what: "parameter", name, near, known })
        })
    }

    /// Changes a copy of the document, parses it, and keeps it if it is valid.
    fn edit(&mut self, change: impl FnOnce(&Model, &mut toml_edit::Table) -> Result<(), ModelError>) -> Result<(), ModelError> {
        let mut document = self.document.clone();
        change(self, document.as_table_mut())?;
        *self = Model::parse(&document.to_string(), &self.name)?;
        Ok(())
    }
}

/// The table of that name, created if it is missing.
fn table<'d>(document: &'d mut Table, name: &str) -> Result<&'d mut dyn TableLike, ModelError> {
    let item = document.entry(name).or_insert_with(|| Item::Table(Table::new()));
    item.as_table_like_mut().ok_or_else(|| ModelError::file(name, ModelErrorKind::Wants("a table")))
}

/// The entry of a parameter: in `[parameters]`, in the table of its effect, or in that of a user effect.
fn entry<'d>(document: &'d mut Table, name: &str) -> Option<&'d mut Item> {
    let in_parameters = document.get("parameters").and_then(Item::as_table_like).is_some_and(|t| t.contains_key(name));
    if in_parameters {
        return document.get_mut("parameters")?.as_table_like_mut()?.get_mut(name);
    }
    let effects = document.get_mut("effect")?.as_table_like_mut()?;
    if let Some((effect, parameter)) = name.rsplit_once('.') {
        return effects.get_mut(effect)?.as_table_like_mut()?.get_mut("parameters")?.as_table_like_mut()?.get_mut(parameter);
    }
    let (stem, instance) = catalogue::split_instance(name)?;
    let has = |table: &dyn TableLike, key: &str| table.contains_key(key);
    let owner =
        catalogue::owners(&catalogue::any_rotary_name(stem)).into_iter().map(|o| catalogue::with_instance(o, instance)).find_map(|owner| {
            let table = effects.get(&owner)?.as_table_like()?;
            let key = [name, stem].into_iter().find(|key| has(table, key))?;
            Some((owner, key))
        });
    let (owner, key) = owner?;
    effects.get_mut(&owner)?.as_table_like_mut()?.get_mut(key)
}

/// Replaces a value and keeps the spaces and comments around it.
fn replace(item: &mut Item, mut value: Value) {
    if let Some(before) = item.as_value() {
        *value.decor_mut() = before.decor().clone();
    }
    *item = Item::Value(value);
}

/// Removes a name from a list and keeps the text before the first name.
fn remove_from(list: &mut Array, name: &str) {
    let Some(k) = list.iter().position(|v| v.as_str() == Some(name)) else { return };
    let removed = list.remove(k);
    if k == 0
        && let Some(first) = list.get_mut(0)
        && let Some(prefix) = removed.decor().prefix()
    {
        first.decor_mut().set_prefix(prefix.clone());
    }
}

/// A number in short notation.
fn number(value: f64) -> Value {
    catalogue::number(value).parse().unwrap_or_else(|_| Value::from(value))
}
