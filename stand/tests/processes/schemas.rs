//! The answers of the commands are valid against the schemas that `stand schema` prints, by the package `jsonschema` of Python.

use std::process::Command;

use crate::common;
use common::stand;

const SCRIPT: &str = r#"
import json, jsonschema
schemas = json.load(open("schemas.json"))
for schema in schemas.values():
    jsonschema.Draft202012Validator.check_schema(schema)

def closed(schema):
    """The same without further properties: a key that the schema does not name is an error."""
    if isinstance(schema, list):
        return [closed(part) for part in schema]
    if not isinstance(schema, dict):
        return schema
    schema = {key: closed(value) for key, value in schema.items()}
    if "properties" in schema and "additionalProperties" not in schema and not {"allOf", "$ref", "oneOf", "anyOf"} & set(schema):
        schema["additionalProperties"] = False
    return schema

for command, name in json.load(open("answers.json")):
    jsonschema.Draft202012Validator(closed(schemas[command])).validate(json.load(open(name)))
print("valid")
"#;

/// Answers: the schema's name, and the words of the command.
const ANSWERS: [(&str, &[&str]); 18] = [
    ("sim", &["sim", "--out", "sim.parquet", "--seconds", "5", "--hidden", "3", "--reveal"]),
    ("model", &["model", "show", "model.toml"]),
    ("compare", &["compare", "log.parquet", "--model", "model.toml"]),
    ("fit", &["fit", "log.parquet", "--model", "model.toml"]),
    ("explain", &["explain", "log.parquet", "--model", "model.toml"]),
    ("log inspect", &["log", "inspect", "log.parquet"]),
    ("convert", &["convert", "log.parquet", "log2.csv"]),
    ("allan", &["allan", "log.parquet", "--column", "omega_rad_s"]),
    ("stability", &["stability", "steady.parquet"]),
    ("effects", &["effects"]),
    ("effects ID", &["effects", "cogging"]),
    ("observer design", &["observer", "design", "rate-observer"]),
    ("observer bode", &["observer", "bode", "rate-observer"]),
    ("observer simulate", &["observer", "simulate", "astatic-identifier"]),
    ("drift run, drift compute", &["drift", "run", "--cycles", "2", "--pulse", "1", "--rest", "2"]),
    ("lab list", &["lab", "list"]),
    ("lab start", &["lab", "start", "1", "--student", "Ada", "--out", "work"]),
    ("lab check", &["lab", "check", "work"]),
];

#[test]
#[ignore = "needs python3 with jsonschema"]
fn answers_are_valid_against_the_schemas() {
    let folder = common::folder();
    let path = folder.path();
    stand(path, &["sim", "--out", "steady.parquet", "--profile", "constant", "--amplitude", "5", "--seconds", "10"]).succeeded();
    std::fs::write(path.join("schemas.json"), stand(path, &["schema"]).succeeded().out).unwrap();
    let mut answers = Vec::new();
    for (k, (schema, words)) in ANSWERS.iter().enumerate() {
        let name = format!("answer-{k}.json");
        let ran = stand(path, &[words, &["--json", &name][..]].concat());
        assert!(path.join(&name).exists(), "{words:?}: {}", ran.err);
        answers.push((*schema, name));
    }
    std::fs::write(path.join("answers.json"), serde_json::to_string(&answers).unwrap()).unwrap();
    let output = Command::new("python3").args(["-c", SCRIPT]).current_dir(path).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}
