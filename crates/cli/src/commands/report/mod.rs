//! `endowire report`: a recorded run, or the tables of an experiment, as one HTML page that any browser shows without
//! a network.

mod data;
mod tables;

use std::path::Path;

use endowire_recording::STEPS;
use endowire_report::{Run, run_page, tables_page};

use crate::args::ReportArgs;
use crate::cache::Cache;
use crate::failure::Failure;
use crate::output::{tell, whole};
use crate::scenes;

/// Key of the page's summary with a warning that the vessel is not that of the run.
const OTHER_SCENE: &str = "other_scene";

/// Writes the page of a folder, or of several runs.
pub(crate) fn report(args: &ReportArgs) -> Result<(), Failure> {
    let Some((first, others)) = args.dirs.split_first() else { return Ok(()) };
    let page = match run(args, first) {
        Ok(mut run) => {
            run.others = others.iter().map(|dir| self::run(args, dir)).collect::<Result<_, _>>()?;
            run_page(&run)
        }
        // An experiment leaves tables and no shapes.
        Err(failure) => match tables::collect(first)? {
            Some(tables) if !first.join(STEPS).exists() && others.is_empty() => tables_page(&tables),
            _ => return Err(failure),
        },
    };
    let unwritable = |e| Failure::Computation(format!("the report cannot be written as JSON: {e}"));
    let page = page.map_err(unwritable)?;
    let out = args.out.clone().unwrap_or_else(|| first.join("report.html"));
    whole::write_bytes(&out, page.as_bytes()).map_err(|e| Failure::write(&out, &e))?;
    tell(format_args!("{} kB in {}", page.len().div_ceil(1000), out.display()));
    Ok(())
}

/// The page data of a recorded run.
fn run(args: &ReportArgs, dir: &Path) -> Result<Run, Failure> {
    let recording = scenes::recording(dir, args.scene.as_deref())?;
    if recording.steps() == 0 {
        let text = "the run has recorded no step; run its scene again (endowire run)";
        return Err(Failure::Input(text.to_owned()).at(dir.display()));
    }
    scenes::check_recorded(&args.set)?;
    let given = args.scene.as_deref();
    let (path, scene) = scenes::of_recording(recording.about(), given, &args.set)?;
    let other = scenes::other_than_recorded(recording.about(), dir, given, &path)?;
    if let Some(other) = &other {
        tell(format_args!("endowire: {other}"));
    }
    let in_scene = |e: endowire_core::Error| Failure::from(e).at(path.display());
    let stack = scene.stack().map_err(in_scene)?;
    let vessel = scene.wall(&Cache::new(&args.cache)).map_err(in_scene)?;
    let mut run = data::collect(dir, &recording, &scene, &stack, vessel.mesh())?;
    if let (Some(summary), Some(other)) = (run.summary.as_object_mut(), other) {
        summary.insert(OTHER_SCENE.to_owned(), other.into());
    }
    Ok(run)
}
