//! A run as a text file of USD: instruments as curves and contacts as points, with a time sample for each step.

use std::fmt::Write as _;
use std::path::Path;

use endowire_core::Vec3;

use super::vessel_keys::VesselKeys;
use super::{Line, Run, written};
use crate::failure::Failure;
use crate::output::whole;

/// Writes the file.
pub(super) fn write(run: &Run, file: &Path) -> Result<(), Failure> {
    let keys = VesselKeys::of(run);
    let text = document(run, &keys)?;
    whole::write_bytes(file, text.as_bytes()).map_err(|e| Failure::write(file, &e))?;
    written(run.times.len(), Some(&keys), file);
    Ok(())
}

/// Points as USD keeps them, in single precision.
fn points(points: &[Vec3]) -> String {
    let each: Vec<String> =
        points.iter().map(|p| format!("({}, {}, {})", p.x as f32, p.y as f32, p.z as f32)).collect();
    format!("[{}]", each.join(", "))
}

fn list<T: ToString>(numbers: impl IntoIterator<Item = T>) -> String {
    let each: Vec<String> = numbers.into_iter().map(|number| number.to_string()).collect();
    format!("[{}]", each.join(", "))
}

/// A name as USD has them: letters, digits and underscores.
fn identifier(name: &str) -> String {
    let letter = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    format!("_{}", name.chars().map(letter).collect::<String>())
}

/// An attribute by time samples, or its only value.
fn attribute(text: &mut String, name: &str, samples: &[(f64, String)], more: &str) {
    let _ = writeln!(text, "        {name}.timeSamples = {{");
    for (time_s, value) in samples {
        let _ = writeln!(text, "            {time_s}: {value},");
    }
    let _ = writeln!(text, "        }}");
    if !more.is_empty() {
        let _ = writeln!(text, "        {name} ({more})");
    }
}

fn document(run: &Run, keys: &VesselKeys) -> Result<String, Failure> {
    let end_s = run.times.last().map_or(0.0, |(_, time_s)| *time_s);
    let mut text = format!(
        "#usda 1.0\n(\n    defaultPrim = \"run\"\n    doc = \"A run of endowire: millimetres, seconds, newtons\"\n    \
         metersPerUnit = 0.001\n    upAxis = \"Z\"\n    startTimeCode = 0\n    endTimeCode = {end_s}\n    \
         timeCodesPerSecond = 1\n)\n\ndef Xform \"run\"\n{{\n"
    );
    vessel(run, &mut text, &keys.keys);
    let lines = run
        .rows()
        .map(|(row, _, time_s)| Ok((time_s, run.lines(row)?)))
        .collect::<Result<Vec<(f64, Vec<Line>)>, Failure>>()?;
    let mut bodies: Vec<(usize, Option<usize>)> =
        lines.iter().flat_map(|(_, lines)| lines.iter().map(|one| (one.instrument, one.coil))).collect();
    bodies.sort_unstable();
    bodies.dedup();
    for body in bodies {
        curve(run, &mut text, body, &lines);
    }
    contacts(run, &mut text);
    Ok(text + "}\n")
}

fn vessel(run: &Run, text: &mut String, keys: &[(usize, f64)]) {
    let mesh = run.wall.mesh();
    let _ = write!(
        text,
        "    def Mesh \"vessel\"\n    {{\n        uniform token subdivisionScheme = \"none\"\n        uniform bool doubleSided = 1\n        \
         int[] faceVertexCounts = {}\n        int[] faceVertexIndices = {}\n        \
         color3f[] primvars:displayColor = [(0.75, 0.2, 0.2)]\n        float[] primvars:displayOpacity = [0.25]\n        \
         point3f[] points = {}\n",
        list(vec![3; mesh.triangles.len()]),
        list(mesh.triangles.iter().flatten()),
        points(&run.vertices_mm(None)),
    );
    if !keys.is_empty() {
        let place = |(row, time_s): &(usize, f64)| (*time_s, points(&run.vertices_mm(Some(*row))));
        let places: Vec<(f64, String)> = keys.iter().map(place).collect();
        attribute(text, "point3f[] points", &places, "");
    }
    *text += "    }\n";
}

fn curve(
    run: &Run,
    text: &mut String,
    (instrument, coil): (usize, Option<usize>),
    lines: &[(f64, Vec<Line>)],
) {
    let name = run.name(instrument, coil);
    let number = coil.unwrap_or(instrument);
    let _ = write!(
        text,
        "    def BasisCurves \"{}_{number}\" (displayName = {name:?})\n    {{\n        uniform token type = \"linear\"\n        \
         uniform token wrap = \"nonperiodic\"\n        color3f[] primvars:displayColor = [(0.2, 0.25, 0.35)]\n",
        identifier(&name)
    );
    let (mut counts, mut places, mut widths) = (vec![], vec![], vec![]);
    for (time_s, lines) in lines {
        let own = lines.iter().find(|line| (line.instrument, line.coil) == (instrument, coil));
        // A line of a single node has no length.
        let shape = own.map(|line| &line.shape).filter(|shape| shape.len() > 1);
        let nodes = shape.map_or(&[][..], |shape| &shape.positions_mm);
        let from_tip_mm = shape.map_or(&[][..], |shape| &shape.from_tip_mm);
        counts.push((*time_s, list(shape.map(endowire_core::Shape::len))));
        places.push((*time_s, points(nodes)));
        widths.push((*time_s, list(from_tip_mm.iter().map(|mm| 2.0 * run.radius_mm(instrument, *mm)))));
    }
    attribute(text, "int[] curveVertexCounts", &counts, "");
    attribute(text, "point3f[] points", &places, "");
    attribute(text, "float[] widths", &widths, "interpolation = \"vertex\"");
    *text += "    }\n";
}

/// The contacts, with the forces of the wall on the device.
fn contacts(run: &Run, text: &mut String) {
    let (mut places, mut forces) = (vec![], vec![]);
    for (row, _, time_s) in run.rows() {
        let contacts = run.contacts(row);
        places.push((time_s, points(&contacts.iter().map(|one| one.position_mm).collect::<Vec<_>>())));
        forces.push((time_s, points(&contacts.iter().map(|one| one.force_n).collect::<Vec<_>>())));
    }
    *text += "    def Points \"contacts\"\n    {\n        float[] widths = [0.5] (interpolation = \"constant\")\n        color3f[] primvars:displayColor = [(0.95, 0.6, 0.1)]\n";
    attribute(text, "point3f[] points", &places, "");
    attribute(text, "vector3f[] primvars:force_n", &forces, "interpolation = \"vertex\"");
    *text += "    }\n";
}
