//! Centre lines in files of other programs: VMTK's and ParaView's `.vtp`, and 3D Slicer's markups (`.mrk.json`).

use std::path::Path;

use serde::Deserialize;

use super::CentrelineNode;
use super::files::{PatientAxes, vtp_lines};
use crate::Vec3;

/// Names of radii, in lower case.
const RADIUS: [&str; 2] = ["maximuminscribedsphereradius", "radius"];
/// What to do about a line without radii.
const NO_RADII: &str = "it has no radii, and the vessel would have no width: write it with them, as VMTK's vmtkcenterlines and 3D \
                        Slicer's Extract Centerline do (MaximumInscribedSphereRadius, Radius)";

/// Whether this is the name of an array of radii.
pub(super) fn is_radius(name: &str) -> bool {
    RADIUS.contains(&name.to_lowercase().as_str())
}

/// The lines of a file of these kinds, by its extension, in the axes of scenes; `None` for a table.
pub(super) fn read(bytes: &[u8], path: &Path) -> Option<Result<Vec<Vec<CentrelineNode>>, String>> {
    let extension = path.extension()?.to_string_lossy().to_ascii_lowercase();
    match extension.as_str() {
        "vtp" => Some(vtp(bytes)),
        "json" => Some(markups(bytes)),
        "vtk" => Some(Err("lines are read from .vtp files: write it as one (VMTK: -ofile line.vtp)".into())),
        _ => None,
    }
}

fn vtp(bytes: &[u8]) -> Result<Vec<Vec<CentrelineNode>>, String> {
    let lines = vtp_lines(bytes, is_radius)?;
    let node =
        |(position_mm, radius_mm): (Vec3, f64)| CentrelineNode { position_mm, radius_mm, parent: None };
    lines
        .into_iter()
        .map(|line| {
            let points = line.into_iter().map(|(place, radius)| Some((place, radius?)));
            let points: Option<Vec<(Vec3, f64)>> = points.collect();
            Ok(points.ok_or(NO_RADII)?.into_iter().map(node).collect())
        })
        .collect()
}

/// A markups file, as far as it is read.
#[derive(Deserialize)]
struct Markups {
    markups: Vec<Markup>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Markup {
    coordinate_system: Option<String>,
    coordinate_units: Option<serde_json::Value>,
    #[serde(default)]
    control_points: Vec<ControlPoint>,
    #[serde(default)]
    measurements: Vec<Measurement>,
}

#[derive(Deserialize)]
struct ControlPoint {
    position: Option<[f64; 3]>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Measurement {
    #[serde(default)]
    name: String,
    #[serde(default)]
    control_point_values: Vec<f64>,
}

/// The curves of 3D Slicer's markups, with their measurement `Radius`.
fn markups(bytes: &[u8]) -> Result<Vec<Vec<CentrelineNode>>, String> {
    let file: Markups = serde_json::from_slice(bytes)
        .map_err(|error| format!("is no markups file of 3D Slicer that can be read: {error}"))?;
    let mut lines = Vec::new();
    for (number, markup) in file.markups.iter().enumerate() {
        if let Some(unit) = markup.coordinate_units.as_ref().and_then(serde_json::Value::as_str)
            && unit != "mm"
        {
            return Err(format!("markup {number}: coordinateUnits = {unit:?}: write it in mm"));
        }
        let axes: PatientAxes = match markup.coordinate_system.as_deref() {
            None => PatientAxes::Lps,
            Some(name) => name
                .parse()
                .map_err(|_| format!("markup {number}: coordinateSystem = {name:?}: must be LPS or RAS"))?,
        };
        // Points that are not placed have no position.
        let places: Vec<Vec3> =
            markup.control_points.iter().filter_map(|p| p.position).map(Vec3::from).collect();
        if places.len() < 2 {
            continue;
        }
        let radii = markup.measurements.iter().find(|one| is_radius(&one.name)).ok_or(NO_RADII)?;
        let radii = &radii.control_point_values;
        if radii.len() != places.len() {
            return Err(format!(
                "markup {number}: {} control points have {} radii: write both again",
                places.len(),
                radii.len()
            ));
        }
        let node = |(place, radius): (&Vec3, &f64)| CentrelineNode {
            position_mm: axes.to_lps(*place),
            radius_mm: *radius,
            parent: None,
        };
        lines.push(places.iter().zip(radii).map(node).collect());
    }
    match lines.is_empty() {
        true => Err("holds no curve of two points or more".into()),
        false => Ok(lines),
    }
}

#[cfg(test)]
mod tests {
    use crate::vessel::CentrelineTree;
    use crate::{Result, Vec3};
    use std::path::Path;

    fn read(text: &str, name: &str) -> Result<CentrelineTree> {
        CentrelineTree::from_bytes(text.as_bytes(), Path::new(name))
    }

    /// A trunk along z and a branch that leaves it at z = 4, as VMTK writes both from the root.
    fn vtp(radii: &str, space: &str) -> String {
        format!(
            r#"<?xml version="1.0"?><VTKFile type="PolyData" byte_order="LittleEndian"><PolyData>{space}
            <Piece NumberOfPoints="9" NumberOfLines="2"><PointData>{radii}</PointData>
            <Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">
            0 0 0 0 0 2 0 0 4 0 0 6 0 0 8  0 0 0 0 0 2 0 0 4 6 0 8</DataArray></Points>
            <Lines><DataArray type="Int64" Name="connectivity" format="ascii">0 1 2 3 4 5 6 7 8</DataArray>
            <DataArray type="Int64" Name="offsets" format="ascii">5 9</DataArray></Lines></Piece></PolyData></VTKFile>"#
        )
    }

    const RADII: &str = r#"<DataArray type="Float64" Name="MaximumInscribedSphereRadius" format="ascii">
        3 3 3 3 3 3 3 3 2</DataArray>"#;

    #[test]
    fn lines_of_vmtk_are_a_tree() {
        let tree = read(&vtp(RADII, ""), "line.vtp").unwrap();
        let ends: Vec<Vec3> = (tree.nodes().iter().zip(tree.children()))
            .filter(|(_, children)| children.is_empty())
            .map(|(node, _)| node.position_mm)
            .collect();
        assert_eq!(ends, [Vec3::new(0.0, 0.0, 8.0), Vec3::new(6.0, 0.0, 8.0)]);
        assert_eq!(tree.nodes()[0].radius_mm, 3.0);
        // "RAS" in its field SPACE.
        let ras =
            r#"<FieldData><Array type="String" Name="SPACE" format="ascii">82 65 83 0</Array></FieldData>"#;
        let turned = read(&vtp(RADII, ras), "line.vtp").unwrap();
        assert!(turned.nodes().iter().any(|node| node.position_mm == Vec3::new(-6.0, 0.0, 8.0)));
        let reported = read(&vtp("", ""), "line.vtp").unwrap_err().to_string();
        assert!(reported.contains("line.vtp") && reported.contains("no radii"), "{reported}");
    }

    #[test]
    fn curves_of_slicer_are_a_tree() {
        let curve = |system: &str, radii: &str| {
            format!(
                r#"{{"markups": [{{"type": "Curve", {system} "controlPoints": [
                {{"id": "0", "position": [1.0, 0.0, 0.0]}}, {{"id": "1", "position": [1.0, 2.0, 3.0]}}],
                "measurements": [{{"name": "length"}}{radii}]}}]}}"#
            )
        };
        let radii = r#", {"name": "Radius", "controlPointValues": [4.0, 3.5]}"#;
        let lps = read(&curve(r#""coordinateSystem": "LPS","#, radii), "c.mrk.json").unwrap();
        assert_eq!(lps.nodes()[1].position_mm, Vec3::new(1.0, 2.0, 3.0));
        assert_eq!(lps.nodes()[1].radius_mm, 3.5);
        let ras = read(&curve(r#""coordinateSystem": "RAS","#, radii), "c.mrk.json").unwrap();
        assert_eq!(ras.nodes()[1].position_mm, Vec3::new(-1.0, -2.0, 3.0));
        for (system, radii, part) in [
            ("", "", "no radii"),
            (r#""coordinateSystem": "IJK","#, radii, "must be LPS or RAS"),
            ("", r#", {"name": "Radius", "controlPointValues": [4.0]}"#, "2 control points have 1 radii"),
            (r#""coordinateUnits": "m","#, radii, "in mm"),
        ] {
            let reported = read(&curve(system, radii), "c.mrk.json").unwrap_err().to_string();
            assert!(reported.contains(part), "{reported}");
        }
        assert!(read("{}", "c.mrk.json").unwrap_err().to_string().contains("markups"));
        assert!(read("x", "line.vtk").unwrap_err().to_string().contains(".vtp"));
    }
}
