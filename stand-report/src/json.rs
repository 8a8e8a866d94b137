//! JSON that all reports share. Numbers that are not finite become `null`: JSON has no number for them.

use std::borrow::Cow;

use schemars::generate::SchemaSettings;
use schemars::transform::RecursiveTransform;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Serialize, Serializer};
use serde_json::{Value, json};

/// An answer as JSON. Each answer has a schema ([`crate::schema`]).
pub fn value(answer: &(impl Serialize + JsonSchema)) -> Value {
    // Fails only on maps whose keys are not strings; no answer has one.
    serde_json::to_value(answer).unwrap_or_else(|error| json!({"error": error.to_string()}))
}

/// The schema of an answer. A number that is not finite is written as `null`: each number may be `null`.
pub fn schema_of<T: JsonSchema>() -> Value {
    let settings = SchemaSettings::draft2020_12().for_serialize().with_transform(RecursiveTransform(|schema: &mut Schema| {
        if schema.get("format").and_then(Value::as_str) == Some("double") {
            schema.insert("type".to_owned(), json!(["number", "null"]));
        }
    }));
    settings.into_generator().into_root_schema_for::<T>().into()
}

/// An object whose keys are names of channels or parameters, in the given order.
pub struct Entries<T>(pub Vec<(String, T)>);

impl<T: Serialize> Serialize for Entries<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, entry)| (name, entry)))
    }
}

impl<T: JsonSchema> JsonSchema for Entries<T> {
    fn schema_name() -> Cow<'static, str> {
        format!("EntriesOf{}", T::schema_name()).into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        <std::collections::BTreeMap<String, T>>::json_schema(generator)
    }
}

/// For `skip_serializing_if`: flags are written only where they are set.
#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde passes fields by reference")]
pub fn is_false(flag: &bool) -> bool {
    !flag
}
