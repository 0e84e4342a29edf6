//! A cohort of simulated trainees in the training subjects, the score of each kind, and how well scores tell those whom a
//! teacher would pass from the others (area under the receiver operating characteristic):
//! `cargo run --release -p endowire-play --example cohort -- out/cohort left_carotid`, or without a name in all of them.
//!
//! Each score is kept in the folder as soon as it is there, and is not computed again: a run that was stopped goes on.
//! After a change, give a new folder.

#![allow(clippy::unwrap_used, reason = "a subject that cannot be played is to stop it")]

mod kept;
mod plan;
mod table;
mod trainee;

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use kept::{Kept, Row};
use plan::Place;
use table::Table;
use trainee::KINDS;

fn main() {
    let mut arguments = std::env::args().skip(1);
    let folder = PathBuf::from(arguments.next().expect("give a folder for the scores, as out/cohort"));
    let named: Vec<String> = arguments.collect();
    let subjects = subjects();
    let unknown: Vec<_> =
        named.iter().filter(|name| !subjects.iter().any(|path| stem(path) == **name)).collect();
    assert!(unknown.is_empty(), "no such subject: {unknown:?}");
    let mut table = Table::default();
    for path in subjects.iter().filter(|path| named.is_empty() || named.contains(&stem(path))) {
        let name = stem(path);
        println!("{name}");
        let kept = Kept::open(&folder, &name);
        finish(path, &kept);
        let rows = kept.rows();
        rows.iter().for_each(|row| println!("  {row}"));
        println!("  {:.0} s of computing", rows.iter().map(|row| row.took_s).sum::<f64>());
        table.add(&name, &rows);
    }
    println!("\n{table}");
}

/// The files of all subjects, in the order of their names.
fn subjects() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/subjects");
    let mut files: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|end| end == "toml"));
    files.sort();
    files
}

fn stem(path: &Path) -> String {
    path.file_stem().unwrap().to_string_lossy().into_owned()
}

/// Computes the scores that are not kept yet, on all cores.
fn finish(path: &Path, kept: &Kept) {
    let rows = kept.rows();
    let left: Vec<_> =
        KINDS.iter().filter(|kind| !rows.iter().any(|row| row.kind.name == kind.name)).collect();
    if left.is_empty() {
        return;
    }
    let plan = Place::of(path).plan();
    let (next, kept) = (AtomicUsize::new(0), Mutex::new(kept));
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                let place = Place::of(path);
                while let Some(kind) = left.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let begun = Instant::now();
                    let score = kind.score(&place, &plan);
                    let row = Row::of(kind, &score, begun.elapsed().as_secs_f64());
                    kept.lock().unwrap().add(&row);
                }
            });
        }
    });
}
