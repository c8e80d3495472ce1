//! The command `palpate`.

use std::process::ExitCode;

fn main() -> ExitCode {
    palpate_cli::main(std::env::args_os())
}
