//! `palpate completions` and `palpate man`: what shells and manuals need to know of the command line.

use crate::failure::Failure;
use crate::terminal::{print, print_bytes};
use clap::{Args, Command};
use clap_complete::Shell;
use std::path::PathBuf;

/// Print a script with which a shell completes commands and options
#[derive(Args, Debug, Clone)]
#[command(after_help = "For example:
  palpate completions bash > ~/.local/share/bash-completion/completions/palpate
  palpate completions zsh > ~/.zfunc/_palpate             # with fpath+=~/.zfunc before compinit
  palpate completions fish > ~/.config/fish/completions/palpate.fish
  palpate completions powershell >> $PROFILE")]
pub struct CompletionsArguments {
    /// Shell
    #[arg(value_enum)]
    shell: Shell,
}

/// Write the manual: a page for each command, for `man`
#[derive(Args, Debug, Clone)]
#[command(after_help = "For example:
  palpate man -o ~/.local/share/man/man1
  man palpate-record")]
pub struct ManArguments {
    /// Folder for the pages, which is made if it is missing
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

/// Runs `palpate completions`.
pub fn completions(arguments: &CompletionsArguments, mut command: Command) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut command, "palpate", &mut script);
    print_bytes(&script)
}

/// Runs `palpate man`.
pub fn man(arguments: &ManArguments, command: Command) -> Result<(), Failure> {
    let folder = &arguments.output;
    let failed = |error: std::io::Error| Failure::file("write the pages into", folder, &error);
    std::fs::create_dir_all(folder).map_err(failed)?;
    let mut command = command.disable_help_subcommand(true);
    command.build();
    let mut names = Vec::new();
    for (name, command) in pages(&command, "palpate") {
        let mut page = Vec::new();
        let command = command.clone().display_name(name.clone());
        clap_mangen::Man::new(command).render(&mut page).map_err(failed)?;
        let path = folder.join(format!("{name}.1"));
        palpate_export::write_atomically(&path, &page)?;
        names.push(name);
    }
    print(&format!("{} pages in {}: man {}\n", names.len(), folder.display(), names.join(", ")))
}

/// Commands that are not hidden, with the names of their pages.
fn pages<'c>(command: &'c Command, name: &str) -> Vec<(String, &'c Command)> {
    let mut found = vec![(name.to_string(), command)];
    for sub in command.get_subcommands().filter(|sub| !sub.is_hide_set()) {
        found.extend(pages(sub, &format!("{name}-{}", sub.get_name())));
    }
    found
}
