//! One file a command.

mod run;
mod timing;
mod vessel;

use crate::args::{Args, Command, ExperimentCommand, VesselCommand};
use crate::failure::Failure;

/// Runs the command that was asked for.
pub(crate) fn dispatch(args: &Args) -> Result<(), Failure> {
    match &args.command {
        Command::Run(args) => run::run(args),
        Command::Vessel(VesselCommand::Check { file, unit_mm, json }) => vessel::check(file, *unit_mm, *json),
        Command::Vessel(VesselCommand::Generate { tree, out, edge_mm, json }) => {
            vessel::generate(tree, out, *edge_mm, *json)
        }
        Command::Experiment(ExperimentCommand::Timing(args)) => timing::timing(args),
    }
}
