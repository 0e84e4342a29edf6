//! The runs of a sweep on several threads.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use endowire_core::vessel::WallStore;
use endowire_core::{Error, Result};

use crate::file::Sweep;
use crate::journal::{Header, Journal};
use crate::provenance::Program;
use crate::row::Row;
use crate::run::{Interrupted, Record, Workshop};
use crate::shard::Shard;
use crate::shared::{Shared, SharedWalls};
use crate::table;

/// How a sweep is carried out. The table does not depend on it.
pub struct Order<'a> {
    /// Where rows, table and recordings go; made if it is not there.
    pub folder: &'a Path,
    /// The part of the sweep to do.
    pub shard: Shard,
    /// Runs at the same time; the number of cores if absent.
    pub jobs: Option<usize>,
    /// Where walls that take long to make are kept.
    pub store: &'a (dyn WallStore + Sync),
    /// The program that computes.
    pub program: Program,
    /// What records runs, if they are recorded.
    pub record: Option<&'a dyn Record>,
    /// Set when no more is to be done: what is under way is dropped, and done when the sweep goes on.
    pub stop: &'a AtomicBool,
    /// Told at the beginning and after each run.
    pub progress: &'a (dyn Fn(Progress) + Sync),
}

/// How far a sweep is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Runs to do in all.
    pub runs: usize,
    /// Those that have a row.
    pub done: usize,
    /// Those of them that failed.
    pub failed: usize,
    /// Those of them with steps that are no equilibria.
    pub unconverged: usize,
}

impl Progress {
    /// Counts rows.
    fn add<'a>(&mut self, rows: impl IntoIterator<Item = &'a Row>) {
        for row in rows {
            self.done += 1;
            self.failed += usize::from(row.failure().is_some());
            self.unconverged += usize::from(row.is_unconverged());
        }
    }
}

/// What has come of a sweep.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Told {
    /// How far it is.
    pub progress: Progress,
    /// Runs that had a row before.
    pub earlier: usize,
    /// The table; none where runs are left to do.
    pub table: Option<PathBuf>,
}

impl Sweep {
    /// Does the runs of a sweep, or of a shard of it, that have no row yet, and writes the table when all have one. May be called again after it
    /// was stopped or killed.
    ///
    /// # Errors
    /// A folder that cannot be written or holds another sweep; a run that cannot be recorded. What fails in a run is in its row.
    pub fn carry_out(&self, order: &Order<'_>) -> Result<Told> {
        std::fs::create_dir_all(order.folder).map_err(|e| Error::file(order.folder, e))?;
        let header = Header::new(self.hash().to_owned(), self.len(), order.shard, self.columns().clone());
        let (journal, mut rows) = Journal::open(&order.folder.join(order.shard.file_name("jsonl")), &header)?;
        let mut has_row = vec![false; self.len()];
        rows.iter().for_each(|row| has_row[row.run] = true);
        let left: Vec<usize> =
            (0..self.len()).filter(|run| order.shard.has(*run) && !has_row[*run]).collect();
        let earlier = rows.len();
        let mut progress = Progress { runs: earlier + left.len(), done: 0, failed: 0, unconverged: 0 };
        progress.add(&rows);
        (order.progress)(progress);
        let new = self.work(&left, &journal, order, progress)?;
        progress.add(&new);
        rows.extend(new);
        if progress.done < progress.runs {
            return Ok(Told { progress, earlier, table: None });
        }
        rows.sort_by_key(|row| row.run);
        let path = order.folder.join(order.shard.file_name("parquet"));
        // What cannot be written now could be when the folder was made.
        table::write(&path, self.columns(), &rows).map_err(|error| Error::Computation(error.to_string()))?;
        Ok(Told { progress, earlier, table: Some(path) })
    }

    /// Does these runs, in this order as far as there are threads; their rows.
    fn work(
        &self,
        runs: &[usize],
        journal: &Journal,
        order: &Order<'_>,
        begun: Progress,
    ) -> Result<Vec<Row>> {
        let available = std::thread::available_parallelism().map_or(1, usize::from);
        let threads = order.jobs.unwrap_or(available).clamp(1, runs.len().max(1));
        // Neighbours share what they have in common, and as many neighbourhoods are under way as threads.
        let walls = SharedWalls::new(order.store, 2 * threads + 2);
        let starts = Shared::new(threads + 1);
        // Stopped by the caller, or by a failure of another thread.
        let broken = AtomicBool::new(false);
        let workshop = Workshop {
            store: &walls,
            starts: &starts,
            record: order.record,
            stop: order.stop,
            program: order.program,
        };
        let next = AtomicUsize::new(0);
        let told = Mutex::new((Vec::new(), begun, None::<Error>));
        let work = || {
            while !order.stop.load(Ordering::Relaxed) && !broken.load(Ordering::Relaxed) {
                let Some(run) = runs.get(next.fetch_add(1, Ordering::Relaxed)) else { break };
                let row = match self.row(*run, &workshop) {
                    Ok(row) => journal.push(&row).map(|()| row),
                    Err(Interrupted::Stopped) => break,
                    Err(Interrupted::Unrecorded(what)) => {
                        Err(Error::Computation(format!("run {run} cannot be recorded: {what}")))
                    }
                };
                let mut told = told.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
                match row {
                    Ok(row) => {
                        told.1.add([&row]);
                        told.0.push(row);
                        (order.progress)(told.1);
                    }
                    Err(error) => {
                        broken.store(true, Ordering::Relaxed);
                        told.2.get_or_insert(error);
                    }
                }
            }
        };
        std::thread::scope(|scope| {
            for _ in 0..threads {
                scope.spawn(work);
            }
        });
        let (rows, _, error) = told.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        error.map_or(Ok(rows), Err)
    }

    /// The row of a run. One that panics must not take the others with it.
    fn row(&self, number: usize, workshop: &Workshop<'_>) -> std::result::Result<Row, Interrupted> {
        let run = self.run(number);
        let carried_out = catch_unwind(AssertUnwindSafe(|| run.carry_out(workshop)));
        carried_out.unwrap_or_else(|_| Ok(run.row(workshop.program, Some("panicked".to_owned()))))
    }
}
