//! The `endowire` command: parses arguments, runs the command, and reports the result by its exit code.

mod args;
mod cache;
mod commands;
mod environment;
mod failure;
mod output;
mod scenes;
mod subjects;

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    let args = args::Args::parse();
    if matches!(
        args.command,
        args::Command::Run(_)
            | args::Command::Sweep(_)
            | args::Command::Render(_)
            | args::Command::Play(_)
            | args::Command::Subject(_)
            | args::Command::Fluoro(_)
            | args::Command::Dataset(_)
            | args::Command::Doctor { .. }
            | args::Command::Experiment(_)
    ) {
        environment::without_desktop();
    }
    match commands::dispatch(&args) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            // A failure is always one line, whatever a library has put into it.
            let text = failure.to_string();
            let line =
                text.lines().map(str::trim).filter(|line| !line.is_empty()).collect::<Vec<_>>().join(" ");
            output::tell(format_args!("endowire: {line}"));
            failure.exit_code()
        }
    }
}
