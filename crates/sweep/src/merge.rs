//! Merges shards into one table.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use endowire_core::{Error, Result};

use crate::journal::{Found, Header};
use crate::row::Row;
use crate::shard::STEM;
use crate::table;

/// Merges the rows in these folders, which together hold one sweep, into one table; returns the number of runs. The
/// file is identical, byte for byte, to that of an undivided sweep, whatever the shards and the order of the folders.
///
/// # Errors
/// A folder without rows, rows of different sweeps, runs that differ between shards or are missing, a file that
/// cannot be written.
pub fn merge(folders: &[PathBuf], out: &Path) -> Result<usize> {
    let Some((header, rows)) = gathered(folders)? else {
        let remedy = "no rows in these folders: give those of endowire sweep --out";
        return Err(Error::parameter("merge", listed(folders), remedy));
    };
    let missing: Vec<usize> = (0..header.runs).filter(|run| !rows.contains_key(run)).collect();
    if let Some(run) = missing.first() {
        let remedy = format!(
            "{} of {} runs are missing, run {run} the first: go on with the shards that have not ended, or give their folders too",
            missing.len(),
            header.runs
        );
        return Err(Error::parameter("merge", listed(folders), remedy));
    }
    let rows: Vec<Row> = rows.into_values().collect();
    table::write(out, &header.columns, &rows)?;
    Ok(rows.len())
}

/// The rows of a sweep in readable form.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Table {
    /// Column names, as in the Parquet table.
    pub columns: Vec<String>,
    /// Values, in order of run numbers; missing values are empty.
    pub rows: Vec<Vec<String>>,
    /// Number of runs of the sweep, including those without a row yet.
    pub runs: usize,
}

/// The rows of a sweep in a folder, also while it is running; `None` if there are no rows.
///
/// # Errors
/// As [`merge`], except for missing runs.
pub fn table_of(folder: &Path) -> Result<Option<Table>> {
    let Some((header, rows)) = gathered(&[folder.to_owned()])? else { return Ok(None) };
    let rows: Vec<Row> = rows.into_values().collect();
    let (columns, rows) = table::as_texts(&header.columns, &rows);
    Ok(Some(Table { columns, rows, runs: header.runs }))
}

/// All rows in these folders, by run number.
fn gathered(folders: &[PathBuf]) -> Result<Option<(Header, BTreeMap<usize, Row>)>> {
    let mut rows: BTreeMap<usize, Row> = BTreeMap::new();
    let mut first: Option<(PathBuf, Header)> = None;
    for path in journals(folders)? {
        let Some(found) = Found::read(&path)? else { continue };
        if let Some((other, header)) = &first
            && (&header.sweep, header.runs, &header.columns)
                != (&found.header.sweep, found.header.runs, &found.header.columns)
        {
            let reason = format!("has rows of another sweep than {}: merge shards of one", other.display());
            return Err(Error::content(&path, reason));
        }
        for row in found.rows {
            let run = row.run;
            if rows.get(&run).is_some_and(|other| *other != row) {
                let reason = format!("run {run} differs from that of another shard: leave one of them out");
                return Err(Error::content(&path, reason));
            }
            rows.insert(run, row);
        }
        first.get_or_insert((path, found.header));
    }
    Ok(first.map(|(_, header)| (header, rows)))
}

/// Paths of the journals in these folders, in a fixed order.
fn journals(folders: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut paths = Vec::new();
    for folder in folders {
        let failed = |e| Error::file(folder, e);
        for entry in std::fs::read_dir(folder).map_err(failed)? {
            let path = entry.map_err(failed)?.path();
            let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
            if stem.starts_with(STEM) && path.extension().is_some_and(|ending| ending == "jsonl") {
                paths.push(path);
            }
        }
    }
    paths.sort();
    Ok(paths)
}

fn listed(folders: &[PathBuf]) -> String {
    folders.iter().map(|folder| folder.display().to_string()).collect::<Vec<_>>().join(" ")
}
