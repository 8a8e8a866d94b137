//! Logs are read by pandas and pyarrow, with all numbers and notes.
#![allow(clippy::unwrap_used)]

use crate::common;
use std::path::Path;
use std::process::{Command, Output};

use identification::log::Log;
use serde_json::json;

/// Reads both logs and compares them with `expected.json`; numbers are compared as bits.
const SCRIPT: &str = r##"
import hashlib, json, struct
import pandas, pyarrow.parquet

expected = json.load(open("expected.json"))
bits = lambda values: ["%016x" % struct.unpack("<Q", struct.pack("<d", float(v)))[0] for v in values]

table = pyarrow.parquet.read_table("log.parquet")
frames = {
    "pandas.read_parquet": pandas.read_parquet("log.parquet"),
    "pyarrow": table.to_pandas(),
    "pandas.read_csv": pandas.read_csv("log.csv", comment="#", float_precision="round_trip"),
}
for reader, frame in frames.items():
    assert list(frame.columns) == [name for name, _ in expected["columns"]], (reader, list(frame.columns))
    for name, values in expected["columns"]:
        assert frame[name].dtype == "float64", (reader, name, frame[name].dtype)
        assert bits(frame[name]) == values, (reader, name)

notes = [[key, value] for key, value in expected["notes"]]
metadata = {key.decode(): value.decode() for key, value in (table.schema.metadata or {}).items()}
for key, value in notes:
    assert metadata.get(key) == value, ("parquet note", key, value, metadata.get(key))
lines = [line[1:].strip().split(": ", 1) for line in open("log.csv", encoding="utf-8") if line.startswith("#")]
# A CSV also announces and states its number of rows and their SHA-256.
assert lines[0] == ["ends_with", "rows, sha256"] and lines[-2] == ["rows", str(len(table))], (lines[0], lines[-2:])
rows = [line.rstrip("\n") for line in open("log.csv", encoding="utf-8") if not line.startswith("#")][1:]
assert lines[-1] == ["sha256", hashlib.sha256("".join(row + "\n" for row in rows).encode()).hexdigest()], lines[-1]
assert lines[1:-2] == notes, ("csv notes", lines, notes)
print("read", len(frames["pyarrow"]))
"##;

fn python(folder: &Path, script: &str) -> std::io::Result<Output> {
    Command::new("python3").args(["-c", script]).current_dir(folder).output()
}

#[test]
#[ignore = "needs python3 with pandas and pyarrow"]
fn pandas_and_pyarrow_read_all_numbers_and_notes() {
    let folder = common::folder();
    let path = folder.path();
    let log = Log::read(path.join("log.parquet")).unwrap();
    let columns: Vec<_> = log
        .columns()
        .iter()
        .map(|c| (c.name.clone(), c.values.iter().map(|v| format!("{:016x}", v.to_bits())).collect::<Vec<_>>()))
        .collect();
    let expected = json!({ "columns": columns, "notes": log.notes().to_vec() });
    std::fs::write(path.join("expected.json"), expected.to_string()).unwrap();
    let output = python(path, SCRIPT).unwrap();
    let text_of = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert!(output.status.success(), "{}", text_of(&output.stderr));
    assert_eq!(text_of(&output.stdout), format!("read {}\n", log.len()));
}

/// The opposite direction: a file written by pandas is a log, with notes in the schema's metadata and columns of other number types.
#[test]
#[ignore = "needs python3 with pandas and pyarrow"]
fn log_written_by_pandas_is_read() {
    let folder = common::folder();
    let path = folder.path();
    const WRITE: &str = r#"
import pandas, pyarrow, pyarrow.parquet
frame = pandas.read_parquet("log.parquet")
frame["temp_C"] = frame["temp_C"].astype("float32")
frame["label"] = "some text"
frame.to_parquet("pandas.parquet")
table = pyarrow.Table.from_pandas(frame).replace_schema_metadata({"stand": "from Python", "u_V": "terminal"})
pyarrow.parquet.write_table(table, "pyarrow.parquet", compression="zstd")
frame.to_csv("pandas.csv", index=False)
"#;
    let output = python(path, WRITE).unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let ours = Log::read(path.join("log.parquet")).unwrap();
    for name in ["pandas.parquet", "pyarrow.parquet", "pandas.csv"] {
        let theirs = Log::read(path.join(name)).unwrap();
        for column in ours.columns().iter().filter(|c| c.name != "temp_C") {
            assert_eq!(theirs.column(&column.name), Some(column.values.as_slice()), "{name}: {}", column.name);
        }
        assert_eq!(theirs.ignored(), ["label"], "{name}");
        let warm = theirs.column("temp_C").unwrap();
        // Single precision of 25 °C.
        assert!(warm.iter().zip(ours.column("temp_C").unwrap()).all(|(a, b)| (a - b).abs() < 2e-6), "{name}");
        common::stand(path, &["compare", name, "--model", "model.toml"]).succeeded();
    }
    let log = Log::read(path.join("pyarrow.parquet")).unwrap();
    assert_eq!(log.note("stand"), Some("from Python"));
    assert_eq!(log.voltage(), identification::log::VoltageSource::Terminals);
}
