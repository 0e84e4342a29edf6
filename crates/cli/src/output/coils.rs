//! Coils that a script has left behind: coils.csv, beside steps.csv. Each row is a point of a coil's centre line, from the end that was detached to its
//! tip.

use std::path::Path;

use endowire_core::Vec3;
use endowire_core::device::Stack;
use endowire_core::insertion::DetachedCoil;
use endowire_core::shape::Shape;
use serde::{Deserialize, Serialize};

use super::rows;
use crate::failure::Failure;

/// The table; there is none where nothing was detached.
pub(crate) const COILS: &str = "coils.csv";

/// A coil, and when it was detached.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Left {
    /// Number of the step that detached it.
    pub(crate) step: usize,
    pub(crate) coil: DetachedCoil,
}

/// One line of the table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Row {
    coil: usize,
    instrument: String,
    step: usize,
    from_tip_mm: f64,
    x_mm: f64,
    y_mm: f64,
    z_mm: f64,
    tangent_x: f64,
    tangent_y: f64,
    tangent_z: f64,
}

/// Writes the table of a recording.
pub(crate) fn write(folder: &Path, left: &[Left], stack: &Stack) -> Result<(), Failure> {
    let rows = left.iter().enumerate().flat_map(|(number, Left { step, coil })| {
        let Shape { positions_mm, tangents, from_tip_mm } = &coil.shape;
        let points = positions_mm.iter().zip(tangents).zip(from_tip_mm);
        points.map(move |((x, t), from_tip_mm)| Row {
            coil: number,
            instrument: stack.instruments()[coil.instrument].name.clone(),
            step: *step,
            from_tip_mm: *from_tip_mm,
            x_mm: x.x,
            y_mm: x.y,
            z_mm: x.z,
            tangent_x: t.x,
            tangent_y: t.y,
            tangent_z: t.z,
        })
    });
    rows::write(&folder.join(COILS), &rows.collect::<Vec<_>>())
}

/// What was left behind in a recorded run of these instruments.
pub(crate) fn read(folder: &Path, stack: &Stack) -> Result<Vec<Left>, Failure> {
    let path = folder.join(COILS);
    let rows: Vec<Row> = rows::read(&path)?;
    let each = rows.chunk_by(|a, b| a.coil == b.coil).map(|rows| {
        let instrument = stack.find(&rows[0].instrument);
        let instrument = instrument.map_err(|e| rows::refused(&path, &e.to_string()))?;
        let shape = Shape {
            positions_mm: rows.iter().map(|row| Vec3::new(row.x_mm, row.y_mm, row.z_mm)).collect(),
            tangents: rows.iter().map(|row| Vec3::new(row.tangent_x, row.tangent_y, row.tangent_z)).collect(),
            from_tip_mm: rows.iter().map(|row| row.from_tip_mm).collect(),
        };
        Ok(Left { step: rows[0].step, coil: DetachedCoil { instrument, shape } })
    });
    each.collect()
}

/// The coils that lie there after a step.
pub(crate) fn after(left: &[Left], step: usize) -> Vec<DetachedCoil> {
    left.iter().filter(|left| left.step <= step).map(|left| left.coil.clone()).collect()
}
