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
            eprintln!("endowire: {failure}");
            failure.exit_code()
        }
    }
}
