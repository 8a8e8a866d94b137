//! The mapping of a table's columns to those of the project, and its file `NAME.import.toml` beside the log.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::guess::{self, Belief, Evidence, quantity_of};
use super::questions::{self, Question};
use super::table::{Dialect, Table};
use super::units::{Quantity, Unit};
use crate::files;
use crate::log::error::{LogError, LogErrorKind};
use crate::log::{axis, known};
use crate::words::nearest;

/// How the columns of a file are used.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImportMapping {
    /// Name of the file that it was written for. It is not of another file of the same stem beside it, as a conversion makes one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Row rate where the file has no time, Hz.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sample_rate_Hz: Option<f64>,
    /// How the text is separated; found from the file where it is missing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub text: Option<TextFormat>,
    /// By name in the file.
    #[serde(default)]
    pub columns: BTreeMap<String, MappedColumn>,
    /// Notes on how the columns were made, as in a log of the project.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub notes: BTreeMap<String, String>,
}

/// One used column.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MappedColumn {
    /// Name of the column of the project, or of the user's own.
    pub is: String,
    /// Unit of the numbers in the file; that of the project where it is missing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
}

/// Separators of a text file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TextFormat {
    /// Between cells: one character; a space stands for spaces and tabs.
    pub separator: char,
    /// Decimal mark: a point or a comma.
    pub decimal: char,
}

/// What the user states about a file: `--map SOURCE=TARGET`, `--unit COLUMN=UNIT`, `--sample-rate HZ`, `--note KEY=TEXT`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Statements {
    /// Columns: name (or number) in the file, and name in the project; `-` for a column that is not used.
    pub columns: Vec<(String, String)>,
    /// Units: name in the file or in the project, and unit.
    pub units: Vec<(String, String)>,
    /// Row rate, Hz.
    pub sample_rate_Hz: Option<f64>,
    /// Notes on columns; an empty text removes the note.
    pub notes: Vec<(String, String)>,
}

impl Statements {
    /// Nothing is stated.
    pub fn is_empty(&self) -> bool {
        *self == Statements::default()
    }
}

/// The import file of a log: `run.import.toml` beside `run.csv`.
pub fn file_of(log: &Path) -> PathBuf {
    log.with_extension("import.toml")
}

impl ImportMapping {
    /// The mapping in the import file of `log`; `None` where there is none.
    ///
    /// # Errors
    /// The file cannot be read or is no mapping.
    pub fn beside(log: &Path) -> Result<Option<ImportMapping>, LogError> {
        let path = file_of(log);
        if path == log || !path.is_file() {
            return Ok(None);
        }
        let text = std::fs::read_to_string(&path).map_err(|e| LogError::new(&path, LogErrorKind::Read(e)))?;
        let one_line = |e: toml::de::Error| LogErrorKind::ImportFile(e.to_string().trim().replace('\n', " "));
        let mut mapping: ImportMapping = toml::from_str(&text).map_err(|e| LogError::new(&path, one_line(e)))?;
        // A conversion leaves a file of the same stem with another ending, which is read by itself. An import file that was copied or
        // renamed with its log is meant for it.
        let is_of_another = |file: &String| {
            let other = log.with_file_name(file);
            log.file_name().is_some_and(|own| own != file.as_str()) && other.file_stem() == log.file_stem() && other.is_file()
        };
        if mapping.file.as_ref().is_some_and(is_of_another) {
            return Ok(None);
        }
        for column in mapping.columns.values_mut() {
            if let Some(rotary) = axis::of_linear_column(&column.is) {
                column.is = rotary.to_owned();
                let own = quantity_of(rotary).map(|quantity| Unit::of_linear_axis(quantity).text);
                column.unit = column.unit.take().or(own);
            }
        }
        for (source, column) in &mapping.columns {
            let wrong = |kind: LogErrorKind| LogError::new(&path, kind).column(source);
            check_target(&column.is).map_err(wrong)?;
            column.checked_unit().map_err(wrong)?;
        }
        Ok(Some(mapping))
    }

    /// Writes the import file of `log`.
    ///
    /// # Errors
    /// The file system fails.
    pub fn write_beside(&self, log: &Path) -> Result<PathBuf, LogError> {
        let path = file_of(log);
        let fail = |e: std::io::Error| LogError::new(&path, LogErrorKind::Write(e));
        let name = log.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let of_this = ImportMapping { file: Some(name.clone()), ..self.clone() };
        let body = toml::to_string(&of_this).map_err(|e| fail(std::io::Error::other(e)))?;
        let text = format!(
            "# How stand reads {name}: \"name in the file\" = {{ is = \"column of the project\", unit = \"unit in the file\" }}\n{body}"
        );
        files::replace_text(&path, &text).map_err(fail)?;
        Ok(path)
    }

    /// The mapping that these beliefs make.
    pub fn of(beliefs: &[Belief], table: &Table) -> ImportMapping {
        let column = |b: &Belief| {
            let target = b.target.clone()?;
            let own_unit = quantity_of(&target).map(|q| q.si());
            let unit = b.unit.as_ref().map(|u| u.text.clone()).filter(|text| Some(text.as_str()) != own_unit);
            Some((b.source.clone(), MappedColumn { is: target, unit }))
        };
        let text = table.dialect.filter(|d| (d.separator, d.decimal) != (',', '.'));
        ImportMapping {
            columns: beliefs.iter().filter_map(column).collect(),
            text: text.map(|Dialect { separator, decimal, .. }| TextFormat { separator, decimal }),
            ..ImportMapping::default()
        }
    }
}

impl MappedColumn {
    /// The unit of the numbers; `None` for a column of the user's own without one.
    pub fn checked_unit(&self) -> Result<Option<Unit>, LogErrorKind> {
        let own = quantity_of(&self.is);
        let Some(text) = &self.unit else { return Ok(own.map(Unit::si)) };
        let unit = Unit::parse(text).ok_or_else(|| LogErrorKind::UnknownUnit(text.clone()))?;
        match own {
            Some(quantity) if quantity != unit.quantity => {
                Err(LogErrorKind::WrongUnit { unit: text.clone(), column: self.is.clone(), example: quantity.si() })
            }
            _ => Ok(Some(unit)),
        }
    }
}

fn check_target(name: &str) -> Result<(), LogErrorKind> {
    if known(name).is_some() || (crate::log::is_own_name(name) && !name.is_empty()) {
        return Ok(());
    }
    Err(LogErrorKind::NoSuchTarget { name: name.to_owned(), near: nearest(name, crate::log::KNOWN.iter().map(|c| c.name)) })
}

/// The beliefs about a table, with what the import file and then the user state in their place, and what is left to decide.
///
/// # Errors
/// A statement names no column of the file, no column of the project, or no unit.
pub fn beliefs(
    path: &Path,
    table: &Table,
    stored: Option<&ImportMapping>,
    stated: &Statements,
) -> Result<(Vec<Belief>, Vec<Question>), LogError> {
    let mut list = match stored {
        None => guess::beliefs(table),
        Some(mapping) => {
            let of = |name: &str| mapping.columns.get(name);
            let belief = |source: &str| Belief {
                target: of(source).map(|c| c.is.clone()),
                unit: of(source).and_then(|c| c.checked_unit().ok().flatten()),
                evidence: Evidence::Stated,
                ..Belief::unknown(source)
            };
            table.columns.iter().map(|c| belief(&c.name)).collect()
        }
    };
    let names: Vec<&str> = table.columns.iter().map(|c| c.name.as_str()).collect();
    let find = |name: &str| {
        let number = name.parse::<usize>().ok().and_then(|n| table.columns.iter().position(|c| c.position == n));
        names.iter().position(|n| *n == name).or_else(|| names.iter().position(|n| n.eq_ignore_ascii_case(name))).or(number)
    };
    let fail = |name: &str, kind| LogError::new(path, kind).column(name);
    let unknown = |name: &str| fail(name, LogErrorKind::NoColumn { has: names.join(", ") });
    for (source, target) in &stated.columns {
        let k = find(source).ok_or_else(|| unknown(source))?;
        if target == "-" {
            list[k] = Belief { target: None, unit: None, evidence: Evidence::Stated, ..list[k].clone() };
            continue;
        }
        let linear = axis::of_linear_column(target);
        let target = &linear.map_or(target.clone(), str::to_owned);
        check_target(target).map_err(|kind| fail(source, kind))?;
        for other in list.iter_mut().filter(|b| b.target.as_ref() == Some(target)) {
            (other.target, other.evidence) = (None, Evidence::Unknown);
        }
        // A unit of the file's own stays. Without one the name that the user states has the unit; a time and counts are decided by their
        // values.
        let column = &table.columns[k];
        let in_file = Unit::parse(&column.unit).or(super::units::split_name(&list[k].source).1.map(|u| u.0));
        let quantity = quantity_of(target);
        let may_be_counts = quantity == Some(Quantity::Angle) && questions::may_be_counts(column);
        let (unit, evidence) = match (in_file, quantity) {
            (Some(unit), Some(quantity)) if unit.quantity == quantity => (Some(unit), Evidence::Stated),
            (Some(unit), Some(_)) => (Some(unit), Evidence::OtherUnit),
            (None, Some(Quantity::Time)) if !column.is_date => (Some(Unit::si(Quantity::Time)), Evidence::NameOnly),
            (None, Some(quantity)) if may_be_counts => (Some(Unit::si(quantity)), Evidence::NameOnly),
            (None, Some(quantity)) if linear.is_some() => (Some(Unit::of_linear_axis(quantity)), Evidence::Stated),
            (None, Some(quantity)) => (Some(Unit::si(quantity)), Evidence::Stated),
            (_, None) => (None, Evidence::Stated),
        };
        list[k] = Belief { target: Some(target.clone()), unit, evidence, alternatives: Vec::new(), rivals: Vec::new(), ..list[k].clone() };
    }
    for (column, unit) in &stated.units {
        let inside = axis::of_linear_column(column).unwrap_or(column);
        let k = find(column).or_else(|| list.iter().position(|b| b.target.as_deref() == Some(inside))).ok_or_else(|| unknown(column))?;
        let parsed = Unit::parse(unit).ok_or_else(|| fail(column, LogErrorKind::UnknownUnit(unit.clone())))?;
        let target = list[k].target.clone();
        match target.as_deref().and_then(quantity_of) {
            Some(quantity) if quantity != parsed.quantity => {
                let kind = LogErrorKind::WrongUnit { unit: unit.clone(), column: target.unwrap_or_default(), example: quantity.si() };
                return Err(fail(column, kind));
            }
            _ => {}
        }
        list[k] = Belief { unit: Some(parsed), evidence: Evidence::Stated, alternatives: Vec::new(), ..list[k].clone() };
    }
    let mut open = questions::settle(table, &mut list);
    if stated.sample_rate_Hz.is_some() || stored.is_some_and(|m| m.sample_rate_Hz.is_some()) {
        open.retain(|q| !matches!(q, Question::NoTime { .. }));
    }
    Ok((list, open))
}
