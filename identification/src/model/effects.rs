//! Base parameters, effects of the catalogue and user effects of the model file.

use std::ops::Range;

use drive_model::Card;
use toml_edit::TableLike;

use super::catalogue::{self, BaseParameter, with_instance};
use super::error::{ModelError, ModelErrorKind};
use super::read::Reader;
use super::user_effects::{MAX_VISIBLE, SummingPoint, UserEffect};
use super::{Channel, Input, ModelEffect, ModelParameter};
use crate::model::expression::{Expression, is_name, is_reserved};
use crate::words::nearest;

impl Reader<'_> {
    pub(super) fn base(&mut self, input: Input, outputs: Option<&[Channel]>, span: Option<Range<usize>>) -> Result<(), ModelError> {
        let mut needed = catalogue::needed(input).to_vec();
        if let (Input::Motion, Some(outputs)) = (input, outputs) {
            let voltage = outputs.contains(&Channel::Voltage);
            needed.extend((voltage || outputs.contains(&Channel::Current)).then_some(BaseParameter::MotorConstant));
            needed.extend(voltage.then_some(BaseParameter::Resistance));
        }
        // The regulator of a servo is a part of the model only if the servo is.
        let drive = BaseParameter::ALL.into_iter().filter(|base| !base.is_of_servo() || needed.contains(base));
        for base in drive {
            let info = base.info();
            match self.take(info.name, Some(info))? {
                Some(parameter) => self.parameters.push(parameter),
                None if needed.contains(&base) => {
                    let example = catalogue::number(info.start);
                    return self.fail(
                        span,
                        "",
                        ModelErrorKind::Needed { name: self.axis.parameter(info.name), input: self.axis.column(input.column()), example },
                    );
                }
                None => {}
            }
        }
        Ok(())
    }

    /// Tables of the form `[effect."cogging#2"]`, which contain only parameters of an effect of the catalogue.
    pub(super) fn effect_tables(&mut self, tables: &dyn TableLike, listed: &[(&'static Card, u32)]) -> Result<(), ModelError> {
        for (name, item) in tables.iter() {
            let span = tables.key(name).and_then(|k| k.span()).or(item.span());
            let table_name = format!("[effect.{name}]");
            let (card, instance) = match catalogue::effect(name) {
                None => continue,
                Some(Err(kind)) => return self.fail(span, &table_name, kind),
                Some(Ok(found)) => found,
            };
            let table = self.table(item, &table_name)?;
            if SummingPoint::ALL.iter().any(|p| table.contains_key(p.key_on(self.axis))) {
                return self.fail(span, &table_name, ModelErrorKind::Taken(name.to_owned()));
            }
            if !listed.iter().any(|l| l.0.id == card.id && l.1 == instance) {
                let hint = format!("; add \"{name}\" to [drive] effects or remove this table");
                return self.fail(span, &table_name, ModelErrorKind::Unused { name: name.to_owned(), hint });
            }
            let stem = |key: &str| with_instance(key.split('#').next().unwrap_or(key), instance);
            self.collect(
                table,
                &table_name,
                |key| {
                    if card.parameters.iter().any(|p| with_instance(p.name, instance) == key) { key.to_owned() } else { stem(key) }
                },
                true,
            )?;
        }
        Ok(())
    }

    pub(super) fn effect(&mut self, card: &'static Card, instance: u32) -> Result<ModelEffect, ModelError> {
        let mut parameters = Vec::with_capacity(card.parameters.len());
        for info in card.parameters {
            let name = with_instance(info.name, instance);
            let parameter = match self.take(&name, Some(info))? {
                Some(parameter) => parameter,
                None => {
                    let start = catalogue::number(info.start);
                    let (shown, unit) = (self.axis.parameter(&name), self.axis.unit(info.unit));
                    self.remarks.push(format!("{shown} is missing in the model file; its start value is {start} {unit}"));
                    ModelParameter { name, value: info.start, fixed: false, filled_in: true, info: Some(info) }
                }
            };
            parameters.push(self.parameters.len());
            self.parameters.push(parameter);
        }
        Ok(ModelEffect { card, instance, parameters })
    }

    pub(super) fn own_effects(&mut self, tables: &dyn TableLike, columns: &[String]) -> Result<Vec<UserEffect>, ModelError> {
        let mut own = Vec::new();
        for (name, item) in tables.iter().filter(|(name, _)| catalogue::effect(name).is_none()) {
            let table_name = format!("[effect.{name}]");
            let table = self.table(item, &table_name)?;
            let keys = SummingPoint::ALL.map(|p| p.key_on(self.axis));
            let known: Vec<&str> = keys.iter().copied().chain(["parameters"]).collect();
            self.only(table, &format!("{table_name} "), &known, "key")?;
            let points: Vec<SummingPoint> = SummingPoint::ALL.into_iter().filter(|p| table.contains_key(p.key_on(self.axis))).collect();
            let &[summing_point] = points.as_slice() else {
                let span = tables.key(name).and_then(|k| k.span()).or(item.span());
                return self.fail(span, &table_name, ModelErrorKind::Expressions(points.len()));
            };
            let mut names = Vec::new();
            let mut spans = Vec::new();
            if let Some(item) = table.get("parameters") {
                let key = format!("{table_name} parameters");
                let parameters = self.table(item, &key)?;
                for (parameter, item) in parameters.iter() {
                    let span = parameters.key(parameter).and_then(|k| k.span()).or(item.span());
                    if !is_name(parameter) || is_reserved(parameter) {
                        return self.fail(span, &key, ModelErrorKind::ParameterName(parameter.to_owned()));
                    }
                    names.push(parameter.to_owned());
                    spans.push(span);
                }
                self.collect(parameters, &key, |parameter| format!("{name}.{parameter}"), false)?;
            }
            let key = format!("{table_name} {}", summing_point.key_on(self.axis));
            let Some(text) = table.get(summing_point.key_on(self.axis)) else { continue };
            let Some(expression) = text.as_str() else {
                return self.fail(text.span(), &key, ModelErrorKind::Wants("an expression in quotes"));
            };
            // Besides its own parameters: columns of the log, and the parameters of the rest of the model.
            let own_names = names.iter().chain(columns).map(String::as_str);
            let others: Vec<String> = self
                .parameters
                .iter()
                .map(|p| self.axis.parameter(&p.name))
                .filter(|n| is_name(n) && !own_names.clone().any(|o| o == n))
                .collect();
            let visible: Vec<String> = names.iter().chain(columns).chain(&others).cloned().collect();
            let expression = match Expression::parse(expression, &visible) {
                Ok(expression) => expression,
                Err(error) => return self.fail(text.span(), &key, ModelErrorKind::Expression(error)),
            };
            if let Some(k) = (0..names.len()).find(|&k| !expression.uses_parameter(k)) {
                return self.fail(spans[k].clone(), &table_name, ModelErrorKind::ParameterUnused(names[k].clone()));
            }
            let mut parameters = Vec::new();
            for parameter in &names {
                if let Some(parameter) = self.take(&format!("{name}.{parameter}"), None)? {
                    parameters.push(self.parameters.len());
                    self.parameters.push(parameter);
                }
            }
            let others = others.iter().enumerate().filter(|(k, _)| expression.uses_parameter(names.len() + columns.len() + k));
            let shared = others.map(|(k, other)| (names.len() + columns.len() + k, other));
            let shared: Vec<(usize, usize)> = shared
                .filter_map(|(at, other)| Some((at, self.parameters.iter().position(|p| self.axis.parameter(&p.name) == *other)?)))
                .collect();
            if visible.len() > MAX_VISIBLE {
                return self.fail(text.span(), &key, ModelErrorKind::Wants("an expression with fewer parameters"));
            }
            own.push(UserEffect { name: name.to_owned(), summing_point, expression, parameters, columns: columns.len(), shared });
        }
        Ok(own)
    }

    /// Checks that every parameter of the file belongs to an effect.
    pub(super) fn nothing_left(&self, effects: &[ModelEffect]) -> Result<(), ModelError> {
        let Some(left) = self.given.iter().find(|g| !g.taken) else { return Ok(()) };
        let stem = left.name.split('#').next().unwrap_or(&left.name);
        let owners = catalogue::owners(stem);
        let is_of_servo = BaseParameter::ALL.iter().any(|base| base.is_of_servo() && base.name() == stem);
        let kind = if is_of_servo {
            let input = self.axis.column(Input::Setpoint.column());
            ModelErrorKind::Unused { name: left.name.clone(), hint: format!("; it belongs to a servo, input = \"{input}\"") }
        } else if owners.is_empty() {
            let known: Vec<String> = catalogue::parameter_names().map(|n| self.axis.parameter(n)).collect();
            let near = nearest(&left.name, self.parameters.iter().map(|p| p.name.as_str()).chain(known.iter().map(String::as_str)));
            ModelErrorKind::Unknown {
                what: "parameter",
                name: left.name.clone(),
                near,
                known: "`stand effects` lists all parameters".to_owned(),
            }
        } else {
            let mark = left.name.strip_prefix(stem).unwrap_or("");
            let repeats = effects.iter().any(|e| owners.contains(&e.card.id));
            let wants = owners.iter().map(|o| format!("\"{o}{mark}\"")).collect::<Vec<_>>().join(" or ");
            let hint = if repeats && mark.is_empty() {
                String::new()
            } else {
                format!("; add {wants} to [drive] effects or remove the parameter")
            };
            ModelErrorKind::Unused { name: left.name.clone(), hint }
        };
        self.fail(left.span.clone(), &left.key, kind)
    }

    pub(super) fn remark_on(&mut self, effects: &[ModelEffect], own: &[UserEffect]) {
        let has = |id: &str| effects.iter().any(|e| e.card.id == id);
        for card in effects.iter().map(|e| e.card).filter(|c| c.inert_alone && !c.rests_on.iter().any(|id| has(id))) {
            self.remarks.push(format!("{} has no effect: it needs {} in [drive] effects", card.id, card.rests_on.join(" or ")));
        }
        for effect in own.iter().filter(|o| o.summing_point == SummingPoint::Torque && o.expression.to_string().contains("sign(omega)")) {
            let name = &effect.name;
            self.remarks.push(format!(
                "effect {name}: sign(omega) is discontinuous at rest and slows the simulation; use the effect coulomb, or tanh(omega / w0)"
            ));
        }
    }
}
