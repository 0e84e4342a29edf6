//! Files of VTK, for ParaView and 3D Slicer.

use std::path::Path;

use endowire_core::Vec3;

use super::{Line, Run, written};
use crate::failure::Failure;
use crate::output::progress;
use crate::output::vtk::{PointArray, PolyData, write_series};

/// Value that contact points have instead of an instrument's index.
const CONTACT: f64 = -1.0;

/// Writes the vessel, a file for each step, and the list of these files; a vessel that moves or yields once for each step.
pub(super) fn write(run: &Run, folder: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(folder).map_err(|e| Failure::write(folder, &e))?;
    let write = |name: &str, data: &PolyData| {
        let path = folder.join(name);
        data.write(&path).map_err(|e| Failure::write(&path, &e))
    };
    let vessel = |row: Option<usize>| {
        let triangles = run.wall.mesh().triangles.clone();
        PolyData { points_mm: run.vertices_mm(row), triangles, ..PolyData::default() }
    };
    let moves = run.places.changes();
    if !moves {
        write("vessel.vtp", &vessel(None))?;
    }
    let bar = progress::bar(run.times.len(), "step");
    let mut files = Vec::new();
    for (row, step, time_s) in run.rows() {
        let name = format!("step_{step:06}.vtp");
        write(&name, &step_data(run, row)?)?;
        let mut names = vec![name];
        if moves {
            let name = format!("vessel_{step:06}.vtp");
            write(&name, &vessel(Some(row)))?;
            names.push(name);
        }
        files.push((time_s, names));
        bar.inc(1);
    }
    bar.finish_and_clear();
    let series = folder.join("run.pvd");
    write_series(&series, &files).map_err(|e| Failure::write(&series, &e))?;
    written(files.len(), None, &series);
    Ok(())
}

/// The line of each inserted instrument and of each detached coil, and the contacts.
fn step_data(run: &Run, row: usize) -> Result<PolyData, Failure> {
    let mut data = PolyData::default();
    let (mut of, mut from_tip_mm, mut radius_mm) = (Vec::new(), Vec::new(), Vec::new());
    let (mut tangents, mut forces_n) = (Vec::new(), Vec::new());
    for Line { instrument, shape, .. } in run.lines(row)? {
        let first = data.points_mm.len();
        data.lines.push((first..first + shape.len()).collect());
        data.points_mm.extend_from_slice(&shape.positions_mm);
        tangents.extend_from_slice(&shape.tangents);
        for own_mm in &shape.from_tip_mm {
            of.push(instrument as f64);
            from_tip_mm.push(*own_mm);
            radius_mm.push(run.radius_mm(instrument, *own_mm));
            forces_n.push(Vec3::zeros());
        }
    }
    for contact in run.contacts(row) {
        data.vertices.push(data.points_mm.len());
        data.points_mm.push(contact.position_mm);
        of.push(CONTACT);
        from_tip_mm.push(0.0);
        radius_mm.push(0.0);
        tangents.push(Vec3::zeros());
        forces_n.push(contact.force_n);
    }
    let number = |name, numbers| PointArray { name, components: 1, numbers };
    let vector = |name, vectors: Vec<Vec3>| PointArray {
        name,
        components: 3,
        numbers: vectors.iter().flat_map(|v| [v.x, v.y, v.z]).collect(),
    };
    data.arrays = vec![
        number("instrument", of),
        number("from_tip_mm", from_tip_mm),
        number("radius_mm", radius_mm),
        vector("tangent", tangents),
        vector("contact_force_n", forces_n),
    ];
    Ok(data)
}
