//! What was measured, kept from run to run.

use std::collections::BTreeMap;
use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use endowire_core::{Error, Result, Vec3};

use super::rows::Row;
use super::scenes::Outcome;

/// A scene with all numbers as they are and with those of a row.
pub(super) struct Measured {
    pub(super) whole: Outcome,
    pub(super) changed: Outcome,
}

/// The folder of a commit.
pub(super) struct Results {
    pub(super) commit: String,
    folder: PathBuf,
}

/// What git prints.
fn git(root: &Path, arguments: &[&str]) -> Result<String> {
    let done = Command::new("git").arg("-C").arg(root).args(arguments).output();
    let done = done.map_err(|error| Error::file(root, error))?;
    Ok(String::from_utf8_lossy(&done.stdout).trim().to_owned())
}

impl Results {
    /// Those of the commit of the working tree; with uncommitted changes, only those that this run makes, unless they are
    /// only to be read.
    pub(super) fn of_this_commit(root: &Path, is_read: bool) -> Result<Self> {
        let mut commit = git(root, &["rev-parse", "--short", "HEAD"])?;
        let what = ["status", "--porcelain", "--", "crates", "benches", "assets", "Cargo.toml", "Cargo.lock"];
        let is_changed = !git(root, &what)?.is_empty();
        if is_changed {
            commit += "-changed";
        }
        let folder = root.join("target/ablation").join(&commit);
        if is_changed && !is_read && folder.exists() {
            fs::remove_dir_all(&folder).map_err(|error| Error::file(&folder, error))?;
        }
        fs::create_dir_all(&folder).map_err(|error| Error::file(&folder, error))?;
        Ok(Self { commit, folder })
    }

    fn path(&self, row: &Row) -> PathBuf {
        let is_plain = |c: char| c.is_alphanumeric() || matches!(c, '.' | '-');
        let name: String = row.name.chars().map(|c| if is_plain(c) { c } else { '_' }).collect();
        self.folder.join(format!("{name}.tsv"))
    }

    /// What is known of a row, by scene. A line that a kill has cut short is none.
    pub(super) fn of(&self, row: &Row) -> Result<BTreeMap<String, Measured>> {
        let path = self.path(row);
        if !path.exists() {
            return Ok(BTreeMap::new());
        }
        let text = fs::read_to_string(&path).map_err(|error| Error::file(&path, error))?;
        let lines = text.split_inclusive('\n').filter_map(|line| line.strip_suffix('\n'));
        Ok(lines.filter_map(read).collect())
    }

    /// Keeps a scene of a row.
    pub(super) fn keep(&self, row: &Row, scene: &str, measured: &Measured) -> Result<()> {
        let path = self.path(row);
        let mut text = String::from(scene);
        [&measured.whole, &measured.changed].into_iter().for_each(|outcome| write(outcome, &mut text));
        // A line that a kill has cut short gets an end of its own.
        let cut = fs::read(&path).is_ok_and(|before| before.last().is_some_and(|last| *last != b'\n'));
        let text = format!("{}{text}\n", if cut { "\n" } else { "" });
        let file = OpenOptions::new().create(true).append(true).open(&path);
        file.and_then(|mut file| file.write_all(text.as_bytes())).map_err(|error| Error::file(&path, error))
    }
}

/// Columns of an outcome.
const COLUMNS: usize = 9;

fn write(outcome: &Outcome, to: &mut String) {
    let Outcome { iterations, solves, seconds, jumps, unbalanced, tip_mm, end } = outcome;
    let end = end.as_deref().unwrap_or("").replace(['\t', '\n'], " ");
    let [x, y, z] = [tip_mm.x, tip_mm.y, tip_mm.z];
    *to += &format!("\t{iterations}\t{solves}\t{seconds}\t{jumps}\t{unbalanced}\t{x:?}\t{y:?}\t{z:?}\t{end}");
}

fn read(line: &str) -> Option<(String, Measured)> {
    let words: Vec<&str> = line.split('\t').collect();
    let [scene, outcomes @ ..] = &words[..] else { return None };
    let (whole, changed) = outcomes.split_at_checked(COLUMNS)?;
    Some(((*scene).to_owned(), Measured { whole: outcome(whole)?, changed: outcome(changed)? }))
}

fn outcome(words: &[&str]) -> Option<Outcome> {
    let [iterations, solves, seconds, jumps, unbalanced, x, y, z, end] = words else { return None };
    Some(Outcome {
        iterations: iterations.parse().ok()?,
        solves: solves.parse().ok()?,
        seconds: seconds.parse().ok()?,
        jumps: jumps.parse().ok()?,
        unbalanced: unbalanced.parse().ok()?,
        tip_mm: Vec3::new(x.parse().ok()?, y.parse().ok()?, z.parse().ok()?),
        end: (!end.is_empty()).then(|| (*end).to_owned()),
    })
}
