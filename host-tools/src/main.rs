//! The command `stand`.

use std::process::ExitCode;

fn main() -> ExitCode {
    host_tools::command::run(std::env::args_os())
}
