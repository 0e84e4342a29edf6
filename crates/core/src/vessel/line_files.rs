//! Centre lines in files of other programs: VMTK's and ParaView's `.vtp`, and 3D Slicer's markups (`.mrk.json`).

use std::path::Path;

use super::CentrelineNode;
use crate::{Error, Result};

/// The points of each line, or what is wrong with them.
pub(super) type Lines = std::result::Result<Vec<Vec<CentrelineNode>>, String>;

/// Names of radii, in lower case.
#[cfg(any(feature = "markups", feature = "vtp"))]
const RADIUS: [&str; 2] = ["maximuminscribedsphereradius", "radius"];
/// What to do about a line without radii.
#[cfg(any(feature = "markups", feature = "vtp"))]
pub(super) const NO_RADII: &str = "it has no radii, and the vessel would have no width: write it with them, as VMTK's vmtkcenterlines and 3D \
                        Slicer's Extract Centerline do (MaximumInscribedSphereRadius, Radius)";

/// Whether this is the name of an array of radii.
#[cfg(any(feature = "markups", feature = "vtp"))]
pub(super) fn is_radius(name: &str) -> bool {
    RADIUS.contains(&name.to_lowercase().as_str())
}

/// Whether this build reads files of this kind.
///
/// # Errors
/// [`Error::Feature`] if not.
pub(super) fn check_built(path: &Path) -> Result<()> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let (feature, is_on) = match extension.as_str() {
        "vtp" => ("vtp", cfg!(feature = "vtp")),
        "json" => ("markups", cfg!(feature = "markups")),
        _ => return Ok(()),
    };
    if is_on { Ok(()) } else { Err(Error::feature(feature, path.display())) }
}

/// The lines of a file of these kinds, by its extension, in the axes of scenes; `None` for a table.
#[cfg_attr(
    not(any(feature = "markups", feature = "vtp")),
    allow(unused_variables, reason = "no kind is left that is read")
)]
pub(super) fn read(bytes: &[u8], path: &Path) -> Option<Lines> {
    let extension = path.extension()?.to_string_lossy().to_ascii_lowercase();
    match extension.as_str() {
        #[cfg(feature = "vtp")]
        "vtp" => Some(vtp(bytes)),
        #[cfg(feature = "markups")]
        "json" => Some(super::markups::curves(bytes)),
        "vtk" => Some(Err("lines are read from .vtp files: write it as one (VMTK: -ofile line.vtp)".into())),
        _ => None,
    }
}

#[cfg(feature = "vtp")]
fn vtp(bytes: &[u8]) -> Lines {
    let lines = super::files::vtp_lines(bytes, is_radius)?;
    let node = |(position_mm, radius_mm): (crate::Vec3, f64)| CentrelineNode {
        position_mm,
        radius_mm,
        parent: None,
    };
    lines
        .into_iter()
        .map(|line| {
            let points = line.into_iter().map(|(place, radius)| Some((place, radius?)));
            let points: Option<Vec<(crate::Vec3, f64)>> = points.collect();
            Ok(points.ok_or(NO_RADII)?.into_iter().map(node).collect())
        })
        .collect()
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
