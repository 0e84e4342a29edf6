//! `endowire experiment`: the four experiments of Li et al. 2011, and coils in an aneurysm.

mod camera;
mod coil;
mod deformation;
mod lines;
mod looping;
mod navigation;
mod timing;

use std::path::Path;

use serde::Serialize;

use crate::args::ExperimentCommand;
use crate::failure::Failure;
use crate::output::{to_json, whole};

/// Runs the requested experiment.
pub(crate) fn experiment(command: &ExperimentCommand) -> Result<(), Failure> {
    let out = match command {
        ExperimentCommand::Timing(args) => &args.out,
        ExperimentCommand::Navigation(args) => &args.out,
        ExperimentCommand::Loop(args) => &args.out,
        ExperimentCommand::Coil(args) => &args.out,
        ExperimentCommand::Deformation(args) => &args.out,
    };
    if let Some(file) = out.as_ref().filter(|path| path.is_file()) {
        return Err(Failure::Input(format!("--out {}: is a file: give a folder", file.display())));
    }
    match command {
        ExperimentCommand::Timing(args) => timing::timing(args),
        ExperimentCommand::Navigation(args) => navigation::navigation(args),
        ExperimentCommand::Loop(args) => looping::looping(args),
        ExperimentCommand::Coil(args) => coil::coil(args),
        ExperimentCommand::Deformation(args) => deformation::deformation(args),
    }
}

/// Writes NAME.csv from the rows and NAME.json from the document.
fn write<R: Serialize>(
    folder: &Path,
    name: &str,
    rows: &[R],
    document: &impl Serialize,
) -> Result<(), Failure> {
    let save = || -> std::io::Result<()> {
        std::fs::create_dir_all(folder)?;
        let mut table = csv::Writer::from_path(folder.join(format!("{name}.csv")))?;
        for row in rows {
            table.serialize(row)?;
        }
        table.flush()
    };
    save().map_err(|e| Failure::write(folder, &e))?;
    let path = folder.join(format!("{name}.json"));
    whole::write_bytes(&path, (to_json(document)? + "\n").as_bytes()).map_err(|e| Failure::write(&path, &e))
}
