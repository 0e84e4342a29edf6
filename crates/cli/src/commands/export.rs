//! `endowire export`: converts a recorded run for other programs.

use endowire_core::Vec3;
use endowire_core::device::{Stack, line_mm};
use endowire_core::insertion::DetachedCoil;
use endowire_core::vessel::Lumen;

use crate::args::ExportArgs;
use crate::cache::Cache;
use crate::failure::Failure;
use crate::output::coils;
use crate::output::instruments::Lengths;
use crate::output::recording::Recording;
use crate::output::vessel::Recorded;
use crate::output::vtk::{PointArray, PolyData, write_series};
use crate::output::{folder, progress, tell};
use crate::scenes;

/// Value that contact points have instead of an instrument's index.
const CONTACT: f64 = -1.0;

/// Writes the vessel, a file for each step, and the list of these files; a vessel that moves or yields once for each step.
pub(crate) fn export(args: &ExportArgs) -> Result<(), Failure> {
    let recording = Recording::read(&args.dir, args.scene.as_deref())?;
    scenes::check_recorded(&args.set)?;
    let given = args.scene.as_deref();
    let (path, scene) = scenes::of_recording(&recording.summary, given, &args.set)?;
    if let Some(other) = scenes::other_than_recorded(&recording.summary, &args.dir, given, &path)? {
        tell(format_args!("endowire: {other}"));
    }
    let in_scene = |e: endowire_core::Error| Failure::from(e).at(path.display());
    let stack = scene.stack().map_err(in_scene)?;
    let cache = Cache::new(&args.cache);
    let wall = scene.wall(&cache).map_err(in_scene)?;
    let lengths = Lengths::read(&args.dir, &stack)?;
    let left = coils::read(&args.dir, &stack)?;
    let steps = folder::step_times(&args.dir)?;
    let out = &args.vtk;
    std::fs::create_dir_all(out).map_err(|e| Failure::write(out, &e))?;
    let write = |name: &str, data: &PolyData| {
        let path = out.join(name);
        data.write(&path).map_err(|e| Failure::write(&path, &e))
    };
    let places = Recorded::read(&args.dir, &scene, &Lumen::from(wall.clone()), &cache)?;
    let moves = places.changes();
    let vessel = |step: usize, time_s: f64| {
        let displacement = places.at(step, time_s);
        let place = |v: &Vec3| displacement.as_ref().map_or(*v, |displacement| displacement.place(v));
        let points_mm = wall.mesh().vertices_mm.iter().map(place).collect();
        PolyData { points_mm, triangles: wall.mesh().triangles.clone(), ..PolyData::default() }
    };
    if !moves {
        write("vessel.vtp", &vessel(0, 0.0))?;
    }
    let bar = progress::bar(recording.steps(), "step");
    let mut files = Vec::new();
    for (row, (step, time_s)) in (1..=recording.steps()).zip(steps) {
        let lengths_mm = lengths.after(step, &recording.shape(row))?;
        let name = format!("step_{step:06}.vtp");
        write(&name, &step_data(&recording, row, &stack, (&lengths_mm, &coils::after(&left, step))))?;
        let mut names = vec![name];
        if moves {
            let name = format!("vessel_{step:06}.vtp");
            write(&name, &vessel(step, time_s))?;
            names.push(name);
        }
        files.push((time_s, names));
        bar.inc(1);
    }
    bar.finish_and_clear();
    let series = out.join("run.pvd");
    write_series(&series, &files).map_err(|e| Failure::write(&series, &e))?;
    tell(format_args!("{} steps and the vessel in {}", files.len(), series.display()));
    Ok(())
}

/// The line of each inserted instrument and of each detached coil, and the contacts.
fn step_data(
    recording: &Recording,
    row: usize,
    stack: &Stack,
    (lengths_mm, coils): (&[f64], &[DetachedCoil]),
) -> PolyData {
    let line = recording.shape(row);
    let line_mm = line_mm(lengths_mm.iter().copied());
    let mut data = PolyData::default();
    let (mut of, mut from_tip_mm, mut radius_mm) = (Vec::new(), Vec::new(), Vec::new());
    let (mut tangents, mut forces_n) = (Vec::new(), Vec::new());
    let in_line = lengths_mm.iter().enumerate().filter(|(_, mm)| **mm > 0.0);
    let in_line = in_line.map(|(index, mm)| (index, line.behind(line_mm - mm)));
    let left = coils.iter().map(|coil| (coil.instrument, coil.shape.clone()));
    for (index, shape) in in_line.chain(left) {
        let device = &stack.instruments()[index].device;
        let first = data.points_mm.len();
        data.lines.push((first..first + shape.len()).collect());
        data.points_mm.extend_from_slice(&shape.positions_mm);
        tangents.extend_from_slice(&shape.tangents);
        for own_mm in &shape.from_tip_mm {
            of.push(index as f64);
            from_tip_mm.push(*own_mm);
            radius_mm.push(device.section_at(*own_mm).radius_mm);
            forces_n.push(Vec3::zeros());
        }
    }
    for contact in recording.contacts(row) {
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
    data
}
