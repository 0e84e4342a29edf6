//! The commands, one file each.

mod assess;
mod centreline;
mod dataset;
mod device;
mod doctor;
mod export;
mod felt;
mod fluoro;
mod from_labels;
#[cfg_attr(not(feature = "lab"), path = "no_lab.rs")]
mod lab;
mod new;
mod passable;
pub(crate) mod play;
mod render;
mod report;
mod rod;
mod run;
mod sac;
mod shell;
mod straighten;
mod studio;
mod subject;
mod sweep;
mod vessel;

pub(crate) use centreline::parse_end;

use crate::args::{Args, Command, DeviceCommand, VesselCommand};
use crate::failure::Failure;

/// Runs the requested command.
pub(crate) fn dispatch(args: &Args) -> Result<(), Failure> {
    match &args.command {
        Command::Run(args) => run::run(args),
        Command::Sweep(args) => sweep::sweep(args),
        Command::Play(args) => play::play(args),
        Command::Assess(args) => assess::assess(args),
        Command::Subject(command) => subject::subject(command),
        Command::Render(args) => render::render(args),
        Command::Export(args) => export::export(args),
        Command::Fluoro(args) => fluoro::fluoro(args),
        Command::Dataset(args) => dataset::dataset(args),
        Command::Rod(args) => rod::rod(args),
        Command::Verify(args) => lab::verify(args),
        Command::Vessel(VesselCommand::Check { file, frame, septum_mm, repair, felt, json }) => {
            vessel::check_file(file, (*frame).into(), *septum_mm, repair, felt, *json)
        }
        Command::Vessel(VesselCommand::Generate(args)) => vessel::generate(args),
        Command::Vessel(VesselCommand::FromLabels(args)) => from_labels::from_labels(args),
        Command::Vessel(VesselCommand::Centreline(args)) => centreline::centreline(args),
        Command::Vessel(VesselCommand::Sac(args)) => sac::sac(args),
        Command::Vessel(VesselCommand::Passable(args)) => passable::passable_file(args),
        Command::Vessel(VesselCommand::Straighten(args)) => straighten::straighten(args),
        Command::Device(DeviceCommand::Show { file, out, json }) => device::show(file, out.as_deref(), *json),
        Command::Device(DeviceCommand::List { folder, out, json }) => {
            device::list(folder, out.as_deref(), *json)
        }
        Command::Evidence(args) => lab::evidence(args),
        Command::Bench(command) => lab::bench(command),
        Command::Compare(args) => lab::compare(args),
        Command::Report(args) => report::report(args),
        Command::New(args) => new::new(args),
        Command::Doctor { json } => doctor::doctor(*json),
        Command::Completions { shell } => shell::completions(*shell),
        Command::Man { command } => shell::man(command.as_deref()),
        Command::Experiment(command) => lab::experiment(command),
    }
}
