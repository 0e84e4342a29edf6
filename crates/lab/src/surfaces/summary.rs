//! Summary of the matrix in one line.

use serde::Serialize;

use super::{CellRow, Ending};

/// Largest acceptable number of Newton iterations per millimetre of a command: a real insertion advances by a few
/// tens of millimetres per second.
pub const ITERATIONS_PER_MM: f64 = 300.0;

/// Totals over all rows.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Summary {
    /// Insertions.
    pub cells: usize,
    /// Insertions that carried out all commands.
    pub arrived: usize,
    /// Insertions whose tip left the vessel.
    pub left: usize,
    /// Insertions whose vessel was too narrow.
    pub blocked: usize,
    /// Insertions whose computation failed.
    pub failed: usize,
    /// Insertions that were rejected.
    pub refused: usize,
    /// Percentage of insertions that arrived, left or were blocked.
    pub good_percent: f64,
    /// Commands carried out.
    pub steps: usize,
    /// Newton iterations.
    pub iterations: u64,
    /// Commands with more than [`ITERATIONS_PER_MM`].
    pub slow_steps: usize,
    /// Insertions that crossed given triangles.
    pub cells_crossing: usize,
    /// Commands after which the device's axis was behind a given triangle.
    pub crossings: usize,
    /// Largest amount by which a reported penetration was too small there, mm.
    pub missing_mm: f64,
    /// The same behind the triangles of the contact surface, mm.
    pub missing_felt_mm: f64,
    /// Commands after which that exceeded the stated deviation of the contact surface.
    pub unreported: usize,
    /// Sub-steps with relaxation as last resort.
    pub relaxations: u64,
    /// Jumps.
    pub jumps: usize,
    /// Time of the slowest command, ms.
    pub slowest_ms: f64,
    /// The insertion of the slowest command.
    pub slowest: String,
}

impl Summary {
    /// Computes the totals.
    pub fn of(rows: &[CellRow]) -> Self {
        let mut sum = Self { cells: rows.len(), ..Self::default() };
        for row in rows {
            match row.ending {
                Ending::Arrived => sum.arrived += 1,
                Ending::Left => sum.left += 1,
                Ending::Blocked => sum.blocked += 1,
                Ending::Failed => sum.failed += 1,
                Ending::Refused => sum.refused += 1,
            }
            sum.steps += row.steps;
            sum.iterations += row.iterations;
            sum.slow_steps += row.slow_steps;
            sum.cells_crossing += usize::from(row.crossings > 0);
            sum.crossings += row.crossings;
            sum.missing_mm = sum.missing_mm.max(row.missing_mm);
            sum.missing_felt_mm = sum.missing_felt_mm.max(row.missing_felt_mm);
            sum.unreported += row.unreported;
            sum.relaxations += row.relaxations;
            sum.jumps += row.jumps;
            if row.slowest_ms > sum.slowest_ms {
                (sum.slowest_ms, sum.slowest) = (row.slowest_ms, row.name.clone());
            }
        }
        let good = sum.arrived + sum.left + sum.blocked;
        sum.good_percent = 100.0 * good as f64 / rows.len().max(1) as f64;
        sum
    }
}

impl std::fmt::Display for Summary {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { cells, arrived, left, blocked, failed, refused, good_percent, .. } = self;
        write!(
            f,
            "{cells} cells: {arrived} arrived, {left} left, {blocked} blocked, {failed} failed, {refused} refused; \
             {good_percent:.1} % good ends; {} commands, {} over {ITERATIONS_PER_MM} iterations/mm, {} last resorts, {} \
             jumps; in given triangles after {} commands in {} cells, {:.3} mm more than told, behind felt ones {:.3} mm; {} \
             crossings beyond what is stated",
            self.steps,
            self.slow_steps,
            self.relaxations,
            self.jumps,
            self.crossings,
            self.cells_crossing,
            self.missing_mm,
            self.missing_felt_mm,
            self.unreported
        )?;
        if self.slowest.is_empty() {
            return Ok(());
        }
        write!(f, "; slowest command {:.0} ms ({})", self.slowest_ms, self.slowest)
    }
}
