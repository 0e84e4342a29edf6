//! Runs a sweep on several threads.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use endowire_core::vessel::WallStore;
use endowire_core::{Error, Result};
use endowire_recording::Program;

use crate::file::Sweep;
use crate::journal::{Header, Journal};
use crate::row::Row;
use crate::run::{Interrupted, Record, Workshop};
use crate::shard::Shard;
use crate::shared::{Shared, SharedWalls};
use crate::table;

/// How a sweep is carried out. The table does not depend on it.
pub struct Order<'a> {
    /// Folder for rows, table and recordings; created if missing.
    pub folder: &'a Path,
    /// The part of the sweep to carry out.
    pub shard: Shard,
    /// Number of simultaneous runs; by default the number of cores.
    pub jobs: Option<usize>,
    /// Store for walls that take long to compute.
    pub store: &'a (dyn WallStore + Sync),
    /// The program that computes the results.
    pub program: Program,
    /// The recorder of runs, if they are recorded.
    pub record: Option<&'a dyn Record>,
    /// Set to stop the sweep: unfinished runs are dropped and repeated when the sweep resumes.
    pub stop: &'a AtomicBool,
    /// Called at the beginning and after each run.
    pub progress: &'a (dyn Fn(Progress) + Sync),
}

/// Progress of a sweep.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Number of runs to carry out.
    pub runs: usize,
    /// Number of runs with a row.
    pub done: usize,
    /// Number of these that failed.
    pub failed: usize,
    /// Number of these with steps that did not converge.
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

/// Result of carrying out a sweep.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SweepReport {
    /// Progress.
    pub progress: Progress,
    /// Number of runs that had a row before.
    pub earlier: usize,
    /// Path of the table; `None` if runs are left.
    pub table: Option<PathBuf>,
}

impl Sweep {
    /// Carries out the runs of a sweep, or of a shard, that have no row yet, and writes the table when all have one.
    /// It can be called again after an interruption.
    ///
    /// # Errors
    /// A folder that cannot be written or holds another sweep; a run that cannot be recorded. Failures within a run
    /// are reported in its row.
    pub fn carry_out(&self, order: &Order<'_>) -> Result<SweepReport> {
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
            return Ok(SweepReport { progress, earlier, table: None });
        }
        rows.sort_by_key(|row| row.run);
        let path = order.folder.join(order.shard.file_name("parquet"));
        // A computation error rather than bad input: the folder was writable at the start.
        table::write(&path, self.columns(), &rows).map_err(|error| Error::Computation(error.to_string()))?;
        Ok(SweepReport { progress, earlier, table: Some(path) })
    }

    /// Carries out these runs, started in this order; returns their rows.
    fn work(
        &self,
        runs: &[usize],
        journal: &Journal,
        order: &Order<'_>,
        begun: Progress,
    ) -> Result<Vec<Row>> {
        let available = std::thread::available_parallelism().map_or(1, usize::from);
        let threads = order.jobs.unwrap_or(available).clamp(1, runs.len().max(1));
        // Neighbouring runs share data, and each thread works on its own neighbourhood.
        let walls = SharedWalls::new(order.store, 2 * threads + 2);
        let starts = Shared::new(threads + 1);
        // Set when the caller stops the sweep or another thread fails.
        let broken = AtomicBool::new(false);
        let workshop = Workshop {
            store: &walls,
            starts: &starts,
            record: order.record,
            stop: order.stop,
            program: order.program,
        };
        let next = AtomicUsize::new(0);
        let reported = Mutex::new((Vec::new(), begun, None::<Error>));
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
                let mut reported = reported.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
                match row {
                    Ok(row) => {
                        reported.1.add([&row]);
                        reported.0.push(row);
                        (order.progress)(reported.1);
                    }
                    Err(error) => {
                        broken.store(true, Ordering::Relaxed);
                        reported.2.get_or_insert(error);
                    }
                }
            }
        };
        std::thread::scope(|scope| {
            for _ in 0..threads {
                scope.spawn(work);
            }
        });
        let (rows, _, error) = reported.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        error.map_or(Ok(rows), Err)
    }

    /// The row of a run. A panic in one run must not end the others.
    fn row(&self, number: usize, workshop: &Workshop<'_>) -> std::result::Result<Row, Interrupted> {
        let run = self.run(number);
        let carried_out = catch_unwind(AssertUnwindSafe(|| run.carry_out(workshop)));
        carried_out.unwrap_or_else(|_| Ok(run.row(workshop.program, Some("panicked".to_owned()))))
    }
}
