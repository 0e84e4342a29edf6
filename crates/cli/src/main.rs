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

use clap::{CommandFactory, FromArgMatches};

/// A command whose options take negative numbers: whether they may be negative is said by what each of them is for.
fn with_negative_numbers(command: clap::Command) -> clap::Command {
    let takes = |one: &clap::Arg| !one.is_positional() && one.get_action().takes_values();
    let options = command.mut_args(|one| if takes(&one) { one.allow_negative_numbers(true) } else { one });
    options.mut_subcommands(with_negative_numbers)
}

fn main() -> ExitCode {
    let given = with_negative_numbers(args::Args::command()).get_matches();
    let args = args::Args::from_arg_matches(&given).unwrap_or_else(|error| error.exit());
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
