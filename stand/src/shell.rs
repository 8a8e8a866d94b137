//! `stand completions SHELL` and `stand man`: completion scripts and man pages, generated from the tree of commands and options.
//!
//! Both take the tree as an argument: the parser that defines the tree also defines these commands.

use std::path::{Path, PathBuf};

use clap::Args;
use clap_complete::Shell;
use clap_mangen::Man;

use super::error::CliError;
use super::output;

/// Print a completion script for a shell.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    stand completions bash > ~/.local/share/bash-completion/completions/stand\n  \
    stand completions zsh > ~/.zfunc/_stand            # with fpath+=~/.zfunc before compinit in ~/.zshrc\n  \
    stand completions fish > ~/.config/fish/completions/stand.fish\n  \
    stand completions powershell >> $PROFILE")]
pub(super) struct Completions {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
}

impl Completions {
    /// Prints the script for the command `tree` on standard output.
    pub(super) fn run(self, mut tree: clap::Command) -> Result<(), CliError> {
        let name = tree.get_name().to_owned();
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut tree, name, &mut script);
        output::print(&String::from_utf8_lossy(&script))
    }
}

/// Print the man page of stand, or write the man pages of all commands to a folder.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    stand man | man -l -                               # read the page\n  \
    stand man --out ~/.local/share/man/man1            # then: man stand, man stand-record")]
pub(super) struct ManPages {
    /// Write one page for each command to this folder, which is created if it does not exist
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
}

impl ManPages {
    /// Prints the page of the command `tree`, or writes the pages of the tree.
    pub(super) fn run(self, tree: clap::Command) -> Result<(), CliError> {
        // `stand help record` shows `stand record --help`: no pages of its own.
        let mut tree = tree.disable_help_subcommand(true);
        tree.build();
        match &self.out {
            None => output::print(&page(&tree)?.1),
            Some(folder) => {
                create_folder(folder)?;
                write_pages(&tree, folder)
            }
        }
    }
}

/// File name and text (roff) of the page of one command.
fn page(command: &clap::Command) -> Result<(String, String), CliError> {
    let man = Man::new(command.clone());
    let mut text = Vec::new();
    man.render(&mut text).map_err(|e| CliError::file(Path::new(&man.get_filename()), "write", &e))?;
    Ok((man.get_filename(), String::from_utf8_lossy(&text).into_owned()))
}

fn create_folder(folder: &Path) -> Result<(), CliError> {
    if folder.exists() && !folder.is_dir() {
        return Err(CliError::in_file(folder, "cannot write man pages: this is a file; give the name of a folder"));
    }
    std::fs::create_dir_all(folder).map_err(|e| CliError::file(folder, "create", &e))
}

fn write_pages(command: &clap::Command, folder: &Path) -> Result<(), CliError> {
    let (name, text) = page(command)?;
    output::write(&folder.join(name), &text)?;
    command.get_subcommands().filter(|c| !c.is_hide_set()).try_for_each(|c| write_pages(c, folder))
}
