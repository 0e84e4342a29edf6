//! Scores that are kept from run to run: a file for each subject, a line for each kind.

use std::fmt;
use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};

use endowire_assess::{EndedBy, Score};

use super::trainee::{KINDS, Kind};

/// The score of a kind in a subject.
pub(crate) struct Row {
    pub(crate) kind: &'static Kind,
    pub(crate) score: f64,
    /// How it ended: at the goal, at a limit, or left.
    ended: String,
    /// Time of the session, s.
    total_s: f64,
    /// Kerma at the entrance, µGy.
    entrance_ugy: f64,
    /// How long it took to compute, s.
    pub(crate) took_s: f64,
    /// The thresholds that were missed, with their values.
    missed: String,
}

impl Row {
    /// What a kind has reached.
    pub(crate) fn of(kind: &'static Kind, score: &Score, took_s: f64) -> Self {
        let missed = score.asked().filter(|(one, _)| one.passed != Some(true));
        let missed: Vec<String> =
            missed.map(|(one, _)| format!("{} {}", one.metric.name, one.value_words())).collect();
        let of = |name: &str| {
            score.metrics.iter().find(|one| one.metric.name == name).and_then(|one| one.metric.value)
        };
        let ended = score.verdict.ended.map_or("left", |ended| match ended.by {
            EndedBy::Goal => "goal",
            _ => "limit",
        });
        Self {
            kind,
            score: score.verdict.score,
            ended: ended.to_owned(),
            total_s: of("total_s").unwrap_or(0.0),
            entrance_ugy: of("entrance_ugy").unwrap_or(0.0),
            took_s,
            missed: missed.join(", "),
        }
    }

    /// A line of a file. One that a kill has cut short is none.
    fn read(line: &str) -> Option<Self> {
        let cells: Vec<&str> = line.strip_suffix('\n')?.split('\t').collect();
        let [name, score, ended, total_s, entrance_ugy, took_s, missed] = cells[..] else { return None };
        Some(Self {
            kind: KINDS.iter().find(|kind| kind.name == name)?,
            score: score.parse().ok()?,
            ended: ended.to_owned(),
            total_s: total_s.parse().ok()?,
            entrance_ugy: entrance_ugy.parse().ok()?,
            took_s: took_s.parse().ok()?,
            missed: missed.to_owned(),
        })
    }

    fn line(&self) -> String {
        let Self { kind, score, ended, total_s, entrance_ugy, took_s, missed } = self;
        format!("{}\t{score}\t{ended}\t{total_s}\t{entrance_ugy}\t{took_s}\t{missed}\n", kind.name)
    }
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { kind, score, ended, total_s, entrance_ugy, took_s, missed } = self;
        write!(
            f,
            "{:<9} {:<18} {score:>5.1}  {ended:<5} {total_s:>6.1} s  {entrance_ugy:>8.1} µGy  took {took_s:>5.0} s  {missed}",
            format!("{:?}", kind.class),
            kind.name,
        )
    }
}

/// The file of a subject.
pub(crate) struct Kept {
    path: PathBuf,
}

impl Kept {
    /// That of a subject in a folder, which is made.
    pub(crate) fn open(folder: &Path, subject: &str) -> Self {
        std::fs::create_dir_all(folder).unwrap();
        Self { path: folder.join(format!("{subject}.tsv")) }
    }

    /// What is kept, in the order of kinds.
    pub(crate) fn rows(&self) -> Vec<Row> {
        let text = std::fs::read_to_string(&self.path).unwrap_or_default();
        let mut rows: Vec<Row> = text.split_inclusive('\n').filter_map(Row::read).collect();
        let place = |row: &Row| KINDS.iter().position(|kind| kind.name == row.kind.name);
        rows.sort_by_key(place);
        rows
    }

    /// Keeps one more.
    pub(crate) fn add(&self, row: &Row) {
        // A line that a kill has cut short gets an end of its own.
        let cut = std::fs::read(&self.path).is_ok_and(|text| text.last().is_some_and(|last| *last != b'\n'));
        let mut file = OpenOptions::new().create(true).append(true).open(&self.path).unwrap();
        file.write_all(format!("{}{}", if cut { "\n" } else { "" }, row.line()).as_bytes()).unwrap();
    }
}
