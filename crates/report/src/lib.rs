//! Pages that any browser shows without a network: a run, or tables of results.
//!
//! A [`Run`] is what the page of a run has: the vessel, shapes step by step, numbers, events and frames. It comes from a recording on disk, or
//! from a [`Recorder`] that has followed a simulation. [`run_page`] and [`tables_page`] make one file of it, with all scripts and data in it;
//! [`assessed_page`] makes one of what trainees did.

mod base64;
mod recorder;
mod run;
mod vessel;

pub use base64::base64;
pub use recorder::Recorder;
pub use run::{Event, Frame, MOST_NODES, Moment, Row, Run, Series, events};
use serde::Serialize;
pub use vessel::Vessel;

/// The pages; their scripts read the data where the mark is.
const RUN: &str = concat!(include_str!("head.html"), include_str!("page.html"));
const TABLES: &str = concat!(include_str!("head.html"), include_str!("tables.html"));
const ASSESSED: &str = concat!(
    include_str!("head.html"),
    include_str!("assess/page.html"),
    include_str!("assess/parts.js"),
    include_str!("assess/roadmap.js"),
    include_str!("assess/timeline.js"),
    include_str!("assess/course.js"),
    include_str!("assess/page.js"),
    "</script>\n</body>\n</html>\n"
);
const MARK: &str = "/*DATA*/null";

/// The page of a run.
///
/// # Errors
/// A summary that JSON cannot say.
pub fn run_page(run: &Run) -> serde_json::Result<String> {
    page(RUN, run)
}

/// The page of tables, a document that the script of `tables.html` reads.
///
/// # Errors
/// What JSON cannot say.
pub fn tables_page(tables: &impl Serialize) -> serde_json::Result<String> {
    page(TABLES, tables)
}

/// The page of what trainees did, a document that the scripts of `assess` read.
///
/// # Errors
/// What JSON cannot say.
pub fn assessed_page(assessed: &impl Serialize) -> serde_json::Result<String> {
    page(ASSESSED, assessed)
}

fn page(page: &str, document: &impl Serialize) -> serde_json::Result<String> {
    Ok(page.replacen(MARK, &json(document)?, 1))
}

/// A document for a script. "<" stands in strings alone, and could end the script (`</script>`) or keep it from ending (`<!--<script>`).
fn json(document: &impl Serialize) -> serde_json::Result<String> {
    Ok(serde_json::to_string(document)?.replace('<', "\\u003c"))
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
