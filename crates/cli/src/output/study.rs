//! The page of a bench test or a study: a picture, a table, and text.

use std::path::Path;

use endowire_report::study_page;
use serde::Serialize;

use super::curves::Curves;
use super::{chart, whole};
use crate::failure::Failure;

/// A table of words.
#[derive(Debug, Serialize)]
pub(crate) struct Table {
    pub(crate) columns: Vec<&'static str>,
    pub(crate) rows: Vec<Vec<String>>,
}

/// What a page shows.
pub(crate) struct Page<'a> {
    pub(crate) title: &'a str,
    /// A paragraph each.
    pub(crate) about: &'a [String],
    pub(crate) curves: &'a Curves,
    pub(crate) table: &'a Table,
    pub(crate) source: String,
}

/// The document of the page.
#[derive(Serialize)]
struct Document<'a> {
    title: &'a str,
    about: &'a [String],
    /// Pictures as SVG.
    pictures: [String; 1],
    tables: [&'a Table; 1],
    source: String,
}

/// Writes a page; its file was named on the command line after `--page`.
pub(crate) fn write(path: &Path, page: Page<'_>) -> Result<(), Failure> {
    if path.extension().is_none_or(|extension| extension != "html") {
        return Err(Failure::Input(format!(
            "--page {}: name a file .html, and other arguments before the flag",
            path.display()
        )));
    }
    let Page { title, about, curves, table, source } = page;
    let pictures = [chart::svg(curves.size(), curves)?];
    let unwritable = |e| Failure::Computation(format!("the page cannot be written as JSON: {e}"));
    let text =
        study_page(&Document { title, about, pictures, tables: [table], source }).map_err(unwritable)?;
    whole::write_bytes(path, text.as_bytes()).map_err(|e| Failure::write(path, &e))
}
