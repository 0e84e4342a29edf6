//! `endowire report`: a recorded run, or the tables of an experiment, as one page that any browser shows, without a network.

mod base64;
mod data;
mod tables;
mod wall;

use crate::args::ReportArgs;
use crate::cache::Cache;
use crate::failure::Failure;
use crate::output::recording::Recording;
use crate::output::{tell, whole};
use crate::scenes;

/// The pages; their scripts read the data where this mark is.
const RUN: &str = concat!(include_str!("head.html"), include_str!("page.html"));
const TABLES: &str = concat!(include_str!("head.html"), include_str!("tables.html"));
const MARK: &str = "/*DATA*/null";

/// Writes the page of a folder.
pub(crate) fn report(args: &ReportArgs) -> Result<(), Failure> {
    let (page, data) = match run(args) {
        Ok(data) => (RUN, json(&data)?),
        // An experiment leaves tables and no shapes.
        Err(failure) => match tables::collect(&args.dir)? {
            Some(data) if !args.dir.join("steps.csv").exists() => (TABLES, json(&data)?),
            _ => return Err(failure),
        },
    };
    let page = page.replacen(MARK, &data, 1);
    let out = args.out.clone().unwrap_or_else(|| args.dir.join("report.html"));
    whole::write_bytes(&out, page.as_bytes()).map_err(|e| Failure::write(&out, &e))?;
    tell(format_args!("{} kB in {}", page.len().div_ceil(1000), out.display()));
    Ok(())
}

/// What a recorded run shows.
fn run(args: &ReportArgs) -> Result<data::Data, Failure> {
    let recording = Recording::read(&args.dir, args.scene.as_deref())?;
    if recording.steps() == 0 {
        let text = "the run has recorded no step; run its scene again (endowire run)";
        return Err(Failure::Input(text.to_owned()).at(args.dir.display()));
    }
    let (path, scene) = scenes::of_recording(&recording.summary, args.scene.as_deref(), &args.set)?;
    let in_scene = |e: endowire_core::Error| Failure::from(e).at(path.display());
    let stack = scene.stack().map_err(in_scene)?;
    let vessel = scene.wall(&Cache::new(&args.cache)).map_err(in_scene)?;
    data::collect(&args.dir, &recording, &stack, vessel.mesh())
}

/// A document for a script. "<" stands in strings alone, and could end the script (`</script>`) or keep it from ending (`<!--<script>`).
fn json(document: &impl serde::Serialize) -> Result<String, Failure> {
    let text = serde_json::to_string(document);
    let text =
        text.map_err(|e| Failure::Computation(format!("the report cannot be written as JSON: {e}")))?;
    Ok(text.replace('<', "\\u003c"))
}

#[cfg(test)]
mod tests {
    use super::json;

    #[test]
    fn no_name_leaves_the_script_of_a_page() {
        let name = "<!--<script></script>\u{2028}";
        let text = json(&name).unwrap();
        assert!(!text.contains('<'), "{text}");
        assert_eq!(serde_json::from_str::<String>(&text).unwrap(), name);
    }
}
