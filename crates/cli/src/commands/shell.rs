//! `endowire completions` and `endowire man`: shell completions and manual pages, from the same texts as `--help`.

use clap::CommandFactory;
use clap_complete::Shell;

use crate::args::Args;
use crate::failure::Failure;
use crate::output::print;

/// Prints a completion script for a shell.
pub(crate) fn completions(shell: Shell) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Args::command(), "endowire", &mut script);
    print(String::from_utf8_lossy(&script).trim_end())
}

/// Prints the manual page of the program, or of one of its commands.
pub(crate) fn man(command: Option<&str>) -> Result<(), Failure> {
    let mut all = Args::command();
    all.build();
    let page = match command {
        None => all,
        Some(name) => all.find_subcommand(name).cloned().ok_or_else(|| {
            let known: Vec<&str> = all.get_subcommands().map(clap::Command::get_name).collect();
            Failure::Input(format!("man {name}: the commands are {}", known.join(", ")))
        })?,
    };
    let mut roff = Vec::new();
    let written = clap_mangen::Man::new(page).render(&mut roff);
    written.map_err(|e| Failure::Computation(format!("the manual page cannot be written: {e}")))?;
    print(String::from_utf8_lossy(&roff).trim_end())
}
