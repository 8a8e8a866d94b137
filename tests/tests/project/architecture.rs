//! The layering that ARCHITECTURE.md states, checked against the source.
//!
//! The tables of ARCHITECTURE.md are the specification: a crate may depend on the crates of its row, a folder of `identification/src` may
//! import from its own layer or below, and no crate has an import circle (cycle) between files. The imports are read from the source with
//! `syn`: `use` declarations and paths, without test modules. A re-export (`pub use`) does not count as an import; a name imported through
//! a re-export counts as an import of the file that defines it. Names of a module's own submodules do not count either, so that a circle is
//! always between siblings or between folders; in `explain` they count.
#![allow(clippy::unwrap_used)]

mod circles;
mod imports;
mod tables;

use self::circles::circles;
use self::imports::{Crate, workspace_root};
use self::tables::{crate_table, layer_table};
use std::collections::BTreeSet;

/// The crates whose source files are checked for circles, with the root file of each.
const CRATES: [(&str, &str); 15] = [
    ("chip-sim", "src/lib.rs"),
    ("drive-model", "src/lib.rs"),
    ("drive-rig", "src/lib.rs"),
    ("firmware", "src/lib.rs"),
    ("hal-sim", "src/lib.rs"),
    ("identification", "src/lib.rs"),
    ("python", "src/lib.rs"),
    ("stand", "src/main.rs"),
    ("stand-acquire", "src/lib.rs"),
    ("stand-analysis", "src/lib.rs"),
    ("stand-lab", "src/lib.rs"),
    ("stand-panel", "src/lib.rs"),
    ("stand-records", "src/lib.rs"),
    ("stand-report", "src/lib.rs"),
    ("tests", "src/lib.rs"),
];

fn read_crate(folder: &str, root: &str) -> Crate {
    Crate::read(&workspace_root().join(folder).join(root)).unwrap()
}

#[test]
fn crates_depend_only_on_the_crates_of_their_row() {
    let table = crate_table();
    let names: BTreeSet<String> = table.iter().map(|row| row.package.clone()).collect();
    for row in &table {
        let manifest = std::fs::read_to_string(workspace_root().join(&row.folder).join("Cargo.toml")).unwrap();
        let manifest: toml::Table = manifest.parse().unwrap();
        let dependencies = manifest.get("dependencies").and_then(toml::Value::as_table).cloned().unwrap_or_default();
        let found: BTreeSet<String> = dependencies.keys().filter(|name| names.contains(*name)).cloned().collect();
        assert_eq!(found, row.depends_on, "{}: workspace dependencies in Cargo.toml (left) and in ARCHITECTURE.md (right)", row.package);
    }
}

#[test]
fn every_workspace_member_has_a_row() {
    let manifest = std::fs::read_to_string(workspace_root().join("Cargo.toml")).unwrap();
    let manifest: toml::Table = manifest.parse().unwrap();
    let members = manifest["workspace"]["members"].as_array().unwrap();
    let members: BTreeSet<&str> = members.iter().filter_map(toml::Value::as_str).collect();
    let table = crate_table();
    let rows: BTreeSet<&str> = table.iter().map(|row| row.folder.as_str()).collect();
    assert_eq!(members, rows, "workspace members in Cargo.toml (left) and in ARCHITECTURE.md (right)");
}

/// Folders with layers: the heading of their table, the crate, the folder in its source.
const LAYERED: [(&str, &str, &str); 2] = [("identification", "identification", ""), ("explain", "identification", "identify/explain/")];

#[test]
fn folders_import_only_from_their_own_layer_or_below() {
    let mut upward = Vec::new();
    for (name, package, within) in LAYERED {
        let layers = layer_table(name);
        let level = |folder: &str| {
            let found = layers.iter().position(|layer| layer.contains(folder));
            found.unwrap_or_else(|| panic!("ARCHITECTURE.md names no layer for {package}/src/{within}{folder}"))
        };
        let source = read_crate(package, "src/lib.rs");
        for (from, to) in source.imports() {
            // The root file may import from every layer.
            let (Some(from_folder), Some(to_folder)) = (source.top_folder(within, from), source.top_folder(within, to)) else { continue };
            if from_folder == to_folder {
                continue;
            }
            if level(&to_folder) > level(&from_folder) {
                upward.push(format!("{name}: {} -> {}", source.name(from), source.name(to)));
            }
        }
    }
    assert!(upward.is_empty(), "imports from a higher layer:\n{}", upward.join("\n"));
}

#[test]
fn layers_name_existing_folders() {
    for (name, package, within) in LAYERED {
        let source = workspace_root().join(package).join("src").join(within);
        for folder in layer_table(name).iter().flatten() {
            assert!(source.join(folder).is_dir() || source.join(format!("{folder}.rs")).is_file(), "{package}/src/{within}{folder}");
        }
    }
}

#[test]
fn no_crate_has_an_import_circle() {
    let mut found = Vec::new();
    for (folder, root) in CRATES {
        let source = read_crate(folder, root);
        for circle in circles(source.file_count(), &source.imports()) {
            let mut lines = vec![format!("{folder}: {} files", circle.len())];
            for (from, to) in source.imports() {
                if circle.contains(&from) && circle.contains(&to) {
                    lines.push(format!("  {} -> {}: {}", source.name(from), source.name(to), source.names_imported(from, to).join(", ")));
                }
            }
            found.push(lines.join("\n"));
        }
    }
    assert!(found.is_empty(), "import circles:\n{}", found.join("\n"));
}

/// Between the files of `explain` no circle leads through a module and its own submodules either.
#[test]
fn explain_has_no_import_circle_with_its_own_submodules() {
    let source = read_crate("identification", "src/lib.rs");
    let is_inside = |file: usize| source.top_folder("identify/explain/", file).is_some();
    let imports: Vec<_> = source.imports_and_own().into_iter().filter(|(from, to)| is_inside(*from) && is_inside(*to)).collect();
    assert!(imports.len() > 100, "{}", imports.len());
    let found = circles(source.file_count(), &imports);
    let names: Vec<Vec<String>> = found.iter().map(|circle| circle.iter().map(|file| source.name(*file)).collect()).collect();
    assert!(names.is_empty(), "{names:#?}");
}

#[test]
fn circle_of_two_files_is_found() {
    assert_eq!(circles(3, &[(0, 1), (1, 2), (2, 1)]), [BTreeSet::from([1, 2])]);
    assert!(circles(3, &[(0, 1), (1, 2), (0, 2)]).is_empty());
}

#[test]
fn import_through_a_re_export_counts_for_the_defining_file() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("lib.rs", "mod a;\nmod b;\npub use a::Item;\n");
    write("a.rs", "pub struct Item;\n#[cfg(test)]\nmod tests { use crate::b::other; }\n");
    write("b.rs", "use crate::Item;\npub fn other(_: Item) {}\n");
    let source = Crate::read(&folder.path().join("lib.rs")).unwrap();
    let named: Vec<_> = source.imports().into_iter().map(|(from, to)| (source.name(from), source.name(to))).collect();
    assert_eq!(named, [("b.rs".to_owned(), "a.rs".to_owned())]);
}
