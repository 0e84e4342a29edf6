//! `endowire bench`: bench tests of devices.

mod bend;
mod output;
mod push;
mod tip_load;
mod torque;
mod track;

use crate::args::BenchCommand;
use crate::failure::Failure;

/// Runs the requested test.
pub(crate) fn bench(command: &BenchCommand) -> Result<(), Failure> {
    match command {
        BenchCommand::Torque(args) => torque::torque(args),
        BenchCommand::Push(args) => push::push(args),
        BenchCommand::TipLoad(args) => tip_load::tip_load(args),
        BenchCommand::Bend(args) => bend::bend(args),
    }
}
