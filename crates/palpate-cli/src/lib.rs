//! The command `palpate` as a library: one verb, one file under `verbs`.
//!
//! Results go to standard output, messages and progress to standard error. Exit status 0: done; 1: the
//! input is bad or a check failed; 2: the command line is wrong.

mod dense;
mod drawing;
mod failure;
mod log_shows;
mod logged_run;
mod logs;
mod outputs;
mod plot;
mod progress;
mod report;
mod reproduction;
mod scene_file;
mod selection;
mod source;
mod stages;
mod verbs;
mod whole_file;

pub use failure::Failure;

use clap::{Parser, Subcommand};
use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;

/// Touch elastic objects that are free to move: record a mesh once, then get contact forces at 1 kHz.
#[derive(Parser)]
#[command(name = "palpate", version, arg_required_else_help = true)]
#[command(after_help = "Start with `palpate demo`. `palpate VERB --help` tells more about each verb.")]
struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Subcommand)]
enum Verb {
    Demo(verbs::demo::Arguments),
    Record(Box<verbs::record::Arguments>),
    Inspect(verbs::inspect::Arguments),
    Run(verbs::run::Arguments),
    Serve(verbs::serve::Arguments),
    Replay(verbs::replay::Arguments),
    Render(verbs::render::Arguments),
    Export(verbs::export::Arguments),
    Device(Box<verbs::device::Arguments>),
    Devices(verbs::devices::Arguments),
    Reproduce(verbs::reproduce::Arguments),
    Verify(verbs::verify::Arguments),
    Bench(verbs::bench::Arguments),
}

/// Say something on standard error; a reader that has gone away is no failure.
fn tell(text: &str) {
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// Run a command line and print what went wrong.
pub fn main(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let arguments = match Arguments::try_parse_from(arguments) {
        Ok(arguments) => arguments,
        Err(error) => error.exit(),
    };
    whole_file::remove_unfinished_on_interrupt();
    let done = match arguments.verb {
        Verb::Demo(arguments) => verbs::demo::demo(&arguments),
        Verb::Record(arguments) => verbs::record::record(&arguments),
        Verb::Inspect(arguments) => verbs::inspect::inspect(&arguments),
        Verb::Run(arguments) => verbs::run::run(&arguments),
        Verb::Serve(arguments) => verbs::serve::serve(&arguments),
        Verb::Render(arguments) => verbs::render::render(&arguments),
        Verb::Replay(arguments) => verbs::replay::replay(&arguments),
        Verb::Export(arguments) => verbs::export::export(&arguments),
        Verb::Device(arguments) => verbs::device::device(&arguments),
        Verb::Devices(arguments) => verbs::devices::devices(&arguments),
        Verb::Reproduce(arguments) => verbs::reproduce::reproduce(&arguments),
        Verb::Verify(arguments) => verbs::verify::verify(&arguments),
        Verb::Bench(arguments) => verbs::bench::bench(&arguments),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            tell(&format!("error: {failure}"));
            ExitCode::FAILURE
        }
    }
}
