//! The tables of ARCHITECTURE.md as data.

use super::imports::workspace_root;
use std::collections::BTreeSet;

/// A row of the table of crates.
pub struct CrateRow {
    /// Folder in the workspace.
    pub folder: String,
    /// Name of the package.
    pub package: String,
    /// Packages of the workspace that it depends on.
    pub depends_on: BTreeSet<String>,
}

/// The cells of the table under a heading of ARCHITECTURE.md, without its header and the line under it.
fn table_under(heading: &str) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(workspace_root().join("ARCHITECTURE.md")).unwrap();
    let section = text.split(&format!("## {heading}\n")).nth(1).unwrap_or_else(|| panic!("ARCHITECTURE.md has no section {heading}"));
    let section = section.split("\n## ").next().unwrap_or_default();
    let rows = section.lines().filter(|line| line.starts_with('|')).skip(2);
    rows.map(|row| row.trim_matches('|').split('|').map(|cell| cell.trim().to_owned()).collect()).collect()
}

/// The names in backquotes of a cell, folders without their last slash.
fn code_names(cell: &str) -> BTreeSet<String> {
    cell.split('`').skip(1).step_by(2).map(|name| name.trim_end_matches('/').to_owned()).collect()
}

/// The table of crates: folder, package, dependencies.
pub fn crate_table() -> Vec<CrateRow> {
    let only_name = |cell: &str| {
        let names = code_names(cell);
        assert_eq!(names.len(), 1, "{cell}");
        names.into_iter().next().unwrap()
    };
    table_under("Crates")
        .iter()
        .map(|row| CrateRow { folder: only_name(&row[0]), package: only_name(&row[1]), depends_on: code_names(&row[2]) })
        .collect()
}

/// The layers of a crate's `src`, lowest first: the folders of each.
pub fn layer_table(folder: &str) -> Vec<BTreeSet<String>> {
    table_under(&format!("Layers of {folder}")).iter().map(|row| code_names(&row[0])).collect()
}
