//! `stand help`, `stand completions` and `stand man`.
#![allow(clippy::unwrap_used)]

use crate::common;
use std::path::Path;
use std::process::Command;

use common::stand;

/// Runs a program; its standard output. Fails if the program fails or writes to standard error.
#[track_caller]
fn quiet(program: &str, arguments: &[&str]) -> String {
    let output = Command::new(program).args(arguments).output().unwrap_or_else(|e| panic!("{program}: {e}"));
    let errors = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success() && errors.is_empty(), "{program} {arguments:?}: {}\n{errors}", output.status);
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Writes the script of `shell` to the folder; its path.
fn script(folder: &Path, shell: &str) -> String {
    let path = folder.join(format!("stand.{shell}"));
    std::fs::write(&path, stand(folder, &["completions", shell]).succeeded().out).unwrap();
    path.to_str().unwrap().to_owned()
}

/// What bash offers for the words of a line, the last one incomplete.
fn bash_offers(script: &str, words: &[&str]) -> Vec<String> {
    let (last, previous) = (words[words.len() - 1], words[words.len() - 2]);
    let line = format!(
        "source {script}; COMP_WORDS=({words}); COMP_CWORD={cword}; _stand stand '{last}' '{previous}'; printf '%s\\n' \"${{COMPREPLY[@]}}\"",
        words = words.join(" "),
        cword = words.len() - 1,
    );
    quiet("bash", &["--norc", "-c", &line]).lines().map(str::to_owned).collect()
}

#[test]
fn help_describes_a_command_as_its_option_does() {
    let folder = tempfile::tempdir().unwrap();
    let run = |words: &[&str]| stand(folder.path(), words).succeeded().out;
    assert_eq!(run(&["help"]), run(&["--help"]));
    assert_eq!(run(&["help", "records", "trend"]), run(&["records", "trend", "--help"]));
}

#[test]
fn help_of_an_unknown_command_is_an_input_error_that_names_it() {
    let folder = tempfile::tempdir().unwrap();
    let run = stand(folder.path(), &["help", "recrod"]);
    assert_eq!(run.status, Some(2), "{run:?}");
    assert!(run.err.contains("recrod") && run.err.lines().count() == 1, "{run:?}");
}

#[test]
fn bash_completes_commands_and_options() {
    let folder = tempfile::tempdir().unwrap();
    let script = script(folder.path(), "bash");
    quiet("bash", &["-n", &script]);
    assert_eq!(bash_offers(&script, &["stand", "rec"]), ["records", "record"]);
    assert_eq!(bash_offers(&script, &["stand", "compare", "--mod"]), ["--model"]);
    assert_eq!(bash_offers(&script, &["stand", "completions", "po"]), ["powershell"]);
}

#[test]
fn every_shell_has_a_script_that_names_the_commands() {
    let folder = tempfile::tempdir().unwrap();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let text = stand(folder.path(), &["completions", shell]).succeeded().out;
        for name in ["explain", "calibrate", "completions", "--model"] {
            assert!(text.contains(name.trim_start_matches('-')), "{shell}: {name} is missing");
        }
    }
    let run = stand(folder.path(), &["completions", "tcsh"]);
    assert!(run.status == Some(2) && run.err.contains("tcsh") && run.err.contains("powershell"), "{run:?}");
}

#[test]
#[ignore = "needs zsh and fish"]
fn zsh_and_fish_accept_their_scripts() {
    let folder = tempfile::tempdir().unwrap();
    quiet("zsh", &["-n", &script(folder.path(), "zsh")]);
    quiet("fish", &["--no-execute", &script(folder.path(), "fish")]);
}

#[test]
fn each_command_has_a_man_page_with_its_options() {
    let folder = tempfile::tempdir().unwrap();
    stand(folder.path(), &["man", "--out", "new/man1"]).succeeded();
    let page = |name: &str| std::fs::read_to_string(folder.path().join("new/man1").join(name)).unwrap();
    assert_eq!(page("stand.1"), stand(folder.path(), &["man"]).succeeded().out);
    assert!(page("stand.1").contains("stand\\-explain(1)"));
    assert!(page("stand-compare.1").contains("\\-\\-model"));
    assert!(page("stand-records-trend.1").contains("stand records trend"));
}

#[test]
fn man_pages_are_not_written_in_place_of_a_file() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("notes"), "mine").unwrap();
    let run = stand(folder.path(), &["man", "--out", "notes"]);
    assert!(run.status == Some(2) && run.err.contains("notes: cannot write man pages"), "{run:?}");
    assert_eq!(std::fs::read_to_string(folder.path().join("notes")).unwrap(), "mine");
}

#[test]
#[ignore = "needs groff"]
fn groff_renders_each_man_page_without_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    stand(folder.path(), &["man", "--out", "man1"]).succeeded();
    for entry in std::fs::read_dir(folder.path().join("man1")).unwrap() {
        quiet("groff", &["-man", "-ww", "-Tutf8", "-K", "utf8", entry.unwrap().path().to_str().unwrap()]);
    }
}
