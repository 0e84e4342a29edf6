//! Pages of tables: results of an experiment, a comparison or a sweep in a folder.

use std::path::{Path, PathBuf};

use endowire_report::base64;
use serde::Serialize;
use serde_json::Value;

use crate::failure::Failure;

/// Largest number of table rows on a page, largest number of pictures, and their largest total size in bytes.
const MOST_ROWS: usize = 2000;
const MOST_PICTURES: usize = 24;
const MOST_PICTURE_BYTES: usize = 2_500_000;
/// Columns with the provenance, shown at the foot of the page.
const SOURCE: [&str; 4] = ["version", "git_revision", "scene_hash", "seed"];

/// The document in the page.
#[derive(Serialize)]
pub(super) struct Tables {
    name: String,
    tables: Vec<Table>,
    pictures: Vec<(String, String)>,
    source: Vec<(String, Value)>,
}

#[derive(Serialize)]
struct Table {
    name: String,
    columns: Vec<String>,
    rows: Vec<Vec<String>>,
    /// Number of rows in the file.
    count: usize,
    /// Columns of the initial chart, horizontal and vertical; `None` without an obvious choice.
    chart: Option<[String; 2]>,
}

/// Gathers the tables (CSV, or the runs of a sweep), pictures (PNG) and sources (JSON) of a folder; `None` if it has
/// no table.
pub(super) fn collect(folder: &Path) -> Result<Option<Tables>, Failure> {
    let files = |extension: &str| -> Vec<PathBuf> {
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
        let mut found: Vec<_> =
            entries.filter(|path| path.extension().is_some_and(|e| e == extension)).collect();
        found.sort();
        found
    };
    let mut tables = files("csv").iter().map(|path| table(path)).collect::<Result<Vec<_>, _>>()?;
    let mut source = Vec::new();
    let sweep = if folder.is_dir() { endowire_sweep::table_of(folder)? } else { None };
    if let Some(sweep) = sweep {
        let (runs, reported) = of_sweep(sweep);
        tables.insert(0, runs);
        source = reported;
    }
    if tables.is_empty() {
        return Ok(None);
    }
    let mut left = MOST_PICTURE_BYTES;
    let mut pictures = Vec::new();
    for path in files("png").iter().take(MOST_PICTURES) {
        let Ok(bytes) = std::fs::read(path) else { continue };
        if let Some(rest) = left.checked_sub(bytes.len()) {
            left = rest;
            pictures.push((stem(path), base64(&bytes)));
        }
    }
    if source.is_empty() {
        let documents = files("json").into_iter().filter_map(|path| std::fs::read(path).ok());
        let reported = documents.filter_map(|bytes| serde_json::from_slice::<Value>(&bytes).ok()).next();
        let reported = reported.unwrap_or(Value::Null);
        let keys = SOURCE.iter().filter(|key| !reported[**key].is_null());
        source = keys.map(|key| ((*key).to_owned(), reported[*key].clone())).collect();
    }
    Ok(Some(Tables { name: stem(folder), tables, pictures, source }))
}

/// The runs of a sweep, and their common provenance. The latter, and columns without values, are left out of the
/// table.
fn of_sweep(sweep: endowire_sweep::Table) -> (Table, Vec<(String, Value)>) {
    let endowire_sweep::Table { columns, mut rows, runs } = sweep;
    let mut source = Vec::new();
    let mut shown = Vec::new();
    for (index, column) in columns.iter().enumerate() {
        let mut values = rows.iter().map(|row| &row[index]);
        let first = values.next();
        let same = first.filter(|first| values.all(|value| value == *first));
        if let (true, Some(value)) = (SOURCE.contains(&column.as_str()), same) {
            source.push((column.clone(), Value::from(value.as_str())));
        } else if column == "scene_hash" {
            // Different for each run; it is in the table of the sweep itself.
        } else if rows.iter().any(|row| !row[index].is_empty()) {
            shown.push(index);
        }
    }
    let count = rows.len();
    rows.truncate(MOST_ROWS);
    let rows = rows.into_iter().map(|row| shown.iter().map(|&index| row[index].clone()).collect()).collect();
    let columns: Vec<String> = shown.iter().map(|&index| columns[index].clone()).collect();
    // The first axis follows the number of the run.
    let up = ["push_force_n", "steps"].into_iter().find(|name| columns.iter().any(|column| column == name));
    let chart = columns.get(1).cloned().zip(up).map(|(across, up)| [across, up.to_owned()]);
    let name = if count < runs { format!("runs so far of {runs}") } else { "runs".to_owned() };
    (Table { name, columns, rows, count, chart }, source)
}

fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

fn table(path: &Path) -> Result<Table, Failure> {
    let unreadable = |e: csv::Error| Failure::Input(format!("{}: {e}", path.display()));
    let mut reader = csv::ReaderBuilder::new().flexible(true).from_path(path).map_err(unreadable)?;
    let words = |record: &csv::StringRecord| record.iter().map(str::to_owned).collect::<Vec<_>>();
    let columns = words(reader.headers().map_err(unreadable)?);
    let rows = reader.records().map(|row| row.as_ref().map(words).map_err(|e| e.to_string()));
    let rows = rows.collect::<Result<Vec<_>, _>>();
    let mut rows = rows.map_err(|e| Failure::Input(format!("{}: {e}", path.display())))?;
    let count = rows.len();
    rows.truncate(MOST_ROWS);
    Ok(Table { name: stem(path), columns, rows, count, chart: None })
}
