//! Detached coils: coils.csv, beside steps.csv. Each row is a point of a coil's centre line after a step, from the
//! detached end to the tip. A coil has rows for the step that detached it, and for every step after which it has
//! moved by a micrometre from its last rows.

use std::io;
use std::path::{Path, PathBuf};

use endowire_core::device::Stack;
use endowire_core::insertion::{DetachedCoil, Simulation};
use endowire_core::shape::Shape;
use endowire_core::{Error, Result, Vec3};

use crate::columns::columns;
use crate::table::{self, GIVE, StepTable};

/// The table; absent if nothing was detached.
pub const COILS: &str = "coils.csv";
/// A coil that has moved by less gets no new rows, mm.
const MOVED_MM: f64 = 1e-3;

/// Position of a detached coil from a step on.
#[derive(Debug, Clone, PartialEq)]
pub struct Left {
    step: usize,
    /// Index of the coil, in order of detachment.
    number: usize,
    coil: DetachedCoil,
}

columns! {
    /// A row of coils.csv: a point of the centre line of a detached coil after a step.
    pub struct CoilRow {
        /// Number of the step.
        pub step: usize,
        /// Number of the coil in order of detachment, from 0.
        pub coil: usize,
        /// Name of the instrument that it was.
        pub instrument: String,
        /// Arc length from the coil's tip.
        pub from_tip_mm: f64,
        /// Place of the point.
        pub x_mm: f64,
        /// As `x_mm`.
        pub y_mm: f64,
        /// As `x_mm`.
        pub z_mm: f64,
        /// Unit tangent there, towards the tip.
        pub tangent_x: f64,
        /// As `tangent_x`.
        pub tangent_y: f64,
        /// As `tangent_x`.
        pub tangent_z: f64,
    }
}

/// Writes the table of a run.
pub(crate) struct CoilTable {
    path: PathBuf,
    /// `None` before the first coil.
    pub(crate) table: Option<StepTable>,
    /// The coils as in their last rows.
    reported: Vec<DetachedCoil>,
    /// Those that the last step has detached or moved, which may be taken back.
    next: Vec<(usize, DetachedCoil)>,
}

impl CoilTable {
    /// The table of a new recording in `folder`.
    pub(crate) fn new(folder: &Path) -> Self {
        Self { path: folder.join(COILS), table: None, reported: Vec::new(), next: Vec::new() }
    }

    /// The table of a recording that resumes after step `steps`; rows of later steps are dropped.
    pub(crate) fn go_on(folder: &Path, stack: &Stack, steps: usize) -> Result<Self> {
        let new = Self::new(folder);
        if !new.path.exists() {
            return Ok(new);
        }
        let reported = coils_after(&read_coils(folder, stack)?, steps);
        let table = StepTable::go_on(&new.path, steps).map_err(|e| Error::file(&new.path, e))?;
        Ok(Self { table: Some(table), reported, ..new })
    }

    /// Adds the rows of a step.
    pub(crate) fn push(&mut self, step: usize, simulation: &Simulation) -> io::Result<()> {
        self.next.clear();
        for (number, coil) in simulation.coils().iter().enumerate() {
            if self.reported.get(number).is_some_and(|was| moved_mm(coil, was) <= MOVED_MM) {
                continue;
            }
            let table = match &mut self.table {
                Some(table) => table,
                none => none.insert(StepTable::new(&self.path)?),
            };
            let instrument = &simulation.stack().instruments()[coil.instrument].name;
            rows_of(step, number, instrument, &coil.shape).try_for_each(|row| table.push(row))?;
            self.next.push((number, coil.clone()));
        }
        Ok(())
    }

    /// Takes the last step's coils for those that are recorded.
    pub(crate) fn keep(&mut self) {
        for (number, coil) in self.next.drain(..) {
            match self.reported.get_mut(number) {
                Some(reported) => *reported = coil,
                None => self.reported.push(coil),
            }
        }
    }

    /// The coils as in their last rows.
    pub(crate) fn reported(&self) -> &[DetachedCoil] {
        &self.reported
    }
}

/// Largest displacement of a node of a coil, mm.
fn moved_mm(coil: &DetachedCoil, was: &DetachedCoil) -> f64 {
    let nodes = coil.shape.positions_mm.iter().zip(&was.shape.positions_mm);
    nodes.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

/// The rows of a coil.
fn rows_of<'a>(
    step: usize,
    coil: usize,
    instrument: &'a str,
    Shape { positions_mm, tangents, from_tip_mm }: &'a Shape,
) -> impl Iterator<Item = CoilRow> + 'a {
    let points = positions_mm.iter().zip(tangents).zip(from_tip_mm);
    points.map(move |((x, t), from_tip_mm)| CoilRow {
        step,
        coil,
        instrument: instrument.to_owned(),
        from_tip_mm: *from_tip_mm,
        x_mm: x.x,
        y_mm: x.y,
        z_mm: x.z,
        tangent_x: t.x,
        tangent_y: t.y,
        tangent_z: t.z,
    })
}

/// The detached coils of a recorded run with these instruments.
///
/// # Errors
/// [`Error::Content`] for a table that cannot be read, or names another instrument.
pub fn read_coils(folder: &Path, stack: &Stack) -> Result<Vec<Left>> {
    let path = folder.join(COILS);
    let rows: Vec<CoilRow> = table::read_if_any(&path)?.unwrap_or_default();
    let each = rows.chunk_by(|a, b| (a.step, a.coil) == (b.step, b.coil)).map(|rows| {
        let CoilRow { step, coil: number, ref instrument, .. } = rows[0];
        let instrument = stack.find(instrument).map_err(|e| Error::content(&path, format!("{e}; {GIVE}")))?;
        let shape = Shape {
            positions_mm: rows.iter().map(|row| Vec3::new(row.x_mm, row.y_mm, row.z_mm)).collect(),
            tangents: rows.iter().map(|row| Vec3::new(row.tangent_x, row.tangent_y, row.tangent_z)).collect(),
            from_tip_mm: rows.iter().map(|row| row.from_tip_mm).collect(),
        };
        Ok(Left { step, number, coil: DetachedCoil { instrument, shape } })
    });
    each.collect()
}

/// The coils after a step.
pub fn coils_after(left: &[Left], step: usize) -> Vec<DetachedCoil> {
    let mut coils: Vec<DetachedCoil> = Vec::new();
    for Left { number, coil, .. } in left.iter().filter(|left| left.step <= step) {
        match coils.get_mut(*number) {
            Some(known) => known.clone_from(coil),
            None => coils.push(coil.clone()),
        }
    }
    coils
}
