//! Self-contained HTML pages, shown by any browser without a network: of a run, of tables of results, of assessments.
//!
//! A [`Run`] holds the data of a run's page: the vessel, shapes step by step, numbers, events and frames. It is made
//! from a recording on disk, or from a [`Recorder`] that follows a simulation. [`run_page`] and [`tables_page`] each
//! make one HTML file that contains all scripts and data; [`study_page`] does so for bench tests and studies,
//! [`assessed_page`] for the assessments of trainees.

mod base64;
mod recorder;
mod run;
mod vessel;

pub use base64::base64;
pub use recorder::Recorder;
pub use run::{Event, Frame, MOST_NODES, Moment, Run, Series, events, setup};
use serde::Serialize;
pub use vessel::Vessel;

/// Templates of the pages; their scripts read the data that replace the marker.
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
const STUDY: &str = concat!(include_str!("head.html"), include_str!("study.html"));
const MARK: &str = "/*DATA*/null";

/// The page of a run, and of others that it is compared with.
///
/// # Errors
/// A summary that cannot be written as JSON.
pub fn run_page(run: &Run) -> serde_json::Result<String> {
    page(RUN, run)
}

/// The page of tables; the document is read by the script in `tables.html`.
///
/// # Errors
/// Data that cannot be written as JSON.
pub fn tables_page(tables: &impl Serialize) -> serde_json::Result<String> {
    page(TABLES, tables)
}

/// The page of a study: pictures, tables and text; the document is read by the script in `study.html`.
///
/// # Errors
/// Data that cannot be written as JSON.
pub fn study_page(study: &impl Serialize) -> serde_json::Result<String> {
    page(STUDY, study)
}

/// The page of assessments; the document is read by the scripts in `assess`.
///
/// # Errors
/// Data that cannot be written as JSON.
pub fn assessed_page(assessed: &impl Serialize) -> serde_json::Result<String> {
    page(ASSESSED, assessed)
}

fn page(page: &str, document: &impl Serialize) -> serde_json::Result<String> {
    Ok(page.replacen(MARK, &json(document)?, 1))
}

/// Serialises a document for a script element. "<" occurs only in strings and is escaped, since it could end the
/// script (`</script>`) or keep it from ending (`<!--<script>`).
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
