//! The `endowire` command: parse, resolve, run, and say with the exit code how it went.

mod args;
mod commands;
mod failure;
mod output;

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    match commands::dispatch(&args::Args::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            // One failure, one line, whatever a library has put into it.
            let text = failure.to_string();
            let line =
                text.lines().map(str::trim).filter(|line| !line.is_empty()).collect::<Vec<_>>().join(" ");
            output::tell(format_args!("endowire: {line}"));
            failure.exit_code()
        }
    }
}
