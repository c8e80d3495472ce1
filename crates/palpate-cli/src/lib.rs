//! The command line `palpate` as a library: one command, one file or folder under `commands`.
//!
//! `-` is standard input or output, where a file is read or written as a stream. Results go to standard output, messages and progress to standard error. Exit status 0: done; 1: the
//! input is bad or a check failed; 2: the command line is wrong.

mod commands;
#[cfg(doctest)]
mod documentation;
mod failure;
mod interrupt;
mod log_kind;
mod panic_hook;
mod progress;
mod secret_file;
mod standard_streams;
mod terminal;

pub use failure::Failure;

use clap::{CommandFactory, Parser, Subcommand};
use std::ffi::OsString;
use std::process::ExitCode;
use terminal::notify;

/// Touch elastic objects that are free to move: record a mesh once, then get contact forces at 1 kHz.
#[derive(Parser)]
#[command(name = "palpate", version, arg_required_else_help = true)]
#[command(
    after_help = "Start with `palpate demo`. `palpate COMMAND --help` has the options of each command. `-` is standard input or output, where a \
file is read or written as a stream."
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Demo(commands::demo::Arguments),
    Mesh(commands::mesh::Arguments),
    Materials(commands::materials::Arguments),
    Scenes(commands::scenes::Arguments),
    Record(Box<commands::record::Arguments>),
    Inspect(commands::inspect::Arguments),
    Run(commands::run::Arguments),
    Serve(commands::serve::Arguments),
    Replay(commands::replay::Arguments),
    Recover(commands::recover::Arguments),
    Render(commands::render::Arguments),
    Export(commands::export::Arguments),
    Device(Box<commands::device::Arguments>),
    Devices(commands::devices::Arguments),
    #[command(hide = true)]
    Guard(commands::guard::Arguments),
    Reproduce(commands::reproduce::Arguments),
    Verify(commands::verify::Arguments),
    Bench(commands::bench::Arguments),
    Completions(commands::completions::CompletionsArguments),
    Man(commands::completions::ManArguments),
}

/// Checks a command line, and runs nothing.
///
/// # Errors
/// What is wrong with it.
pub fn check_command_line(arguments: impl IntoIterator<Item = OsString>) -> Result<(), String> {
    Arguments::try_parse_from(arguments).map(|_| ()).map_err(|error| error.to_string())
}

/// Runs a command line, and prints its failure.
pub fn main(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let arguments = match Arguments::try_parse_from(arguments) {
        Ok(arguments) => arguments,
        Err(error) => error.exit(),
    };
    panic_hook::install();
    // A guardian outlives what ends the others.
    if !matches!(arguments.command, Command::Guard(_)) {
        interrupt::install_handler();
    }
    let done = match arguments.command {
        Command::Demo(arguments) => commands::demo::demo(&arguments),
        Command::Mesh(arguments) => commands::mesh::mesh(&arguments),
        Command::Materials(arguments) => commands::materials::materials(&arguments),
        Command::Scenes(arguments) => commands::scenes::scenes(&arguments),
        Command::Record(arguments) => commands::record::record(&arguments),
        Command::Inspect(arguments) => commands::inspect::inspect(&arguments),
        Command::Run(arguments) => commands::run::run(&arguments),
        Command::Serve(arguments) => commands::serve::serve(&arguments),
        Command::Render(arguments) => commands::render::render(&arguments),
        Command::Replay(arguments) => commands::replay::replay(&arguments),
        Command::Recover(arguments) => commands::recover::recover(&arguments),
        Command::Export(arguments) => commands::export::export(&arguments),
        Command::Device(arguments) => commands::device::device(&arguments),
        Command::Devices(arguments) => commands::devices::devices(&arguments),
        Command::Guard(arguments) => commands::guard::guard(&arguments),
        Command::Reproduce(arguments) => commands::reproduce::reproduce(&arguments),
        Command::Verify(arguments) => commands::verify::verify(&arguments),
        Command::Bench(arguments) => commands::bench::bench(&arguments),
        Command::Completions(arguments) => {
            commands::completions::completions(&arguments, Arguments::command())
        }
        Command::Man(arguments) => commands::completions::man(&arguments, Arguments::command()),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            notify(&format!("error: {failure}"));
            ExitCode::FAILURE
        }
    }
}
