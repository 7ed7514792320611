//! The command line of servobee.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    match cli::run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("servobee: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}
