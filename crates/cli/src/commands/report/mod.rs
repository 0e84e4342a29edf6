//! `endowire report`: a recorded run as one page that any browser shows, without a network.

mod data;
mod wall;

use endowire_methods::Scene;

use crate::args::ReportArgs;
use crate::cache::Cache;
use crate::failure::Failure;
use crate::output::recording::Recording;
use crate::output::{tell, whole};

/// The page; its script reads the data where this mark is.
const PAGE: &str = include_str!("page.html");
const MARK: &str = "/*DATA*/null";

/// Writes the page of a recorded run.
pub(crate) fn report(args: &ReportArgs) -> Result<(), Failure> {
    let recording = Recording::read(&args.dir, args.scene.as_deref())?;
    if recording.steps() == 0 {
        let text = "the run has recorded no step; run its scene again (endowire run)";
        return Err(Failure::Input(text.to_owned()).at(args.dir.display()));
    }
    let path = args.scene.as_ref().unwrap_or(&recording.summary.scene_file);
    let scene = Scene::read(path)?;
    let in_scene = |e: endowire_core::Error| Failure::from(e).at(path.display());
    let stack = scene.stack().map_err(in_scene)?;
    let vessel = scene.wall(&Cache::new(&args.cache)).map_err(in_scene)?;
    let data = data::collect(&args.dir, &recording, &stack, vessel.mesh())?;
    let text = serde_json::to_string(&data)
        .map_err(|e| Failure::Computation(format!("the report cannot be written as JSON: {e}")))?;
    // In a script, "</" would end it.
    let page = PAGE.replacen(MARK, &text.replace("</", "<\\/"), 1);
    let out = args.out.clone().unwrap_or_else(|| args.dir.join("report.html"));
    whole::write_bytes(&out, page.as_bytes()).map_err(|e| Failure::write(&out, &e))?;
    tell(format_args!("{:.1} MB in {}", page.len() as f64 / 1e6, out.display()));
    Ok(())
}
