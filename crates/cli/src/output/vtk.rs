//! Points, lines and triangles in VTK's XML formats: `.vtp` files, and a `.pvd` that lists a series of them with
//! times.
//!
//! Numbers are written as text, which ParaView and 3D Slicer read and which keeps every bit.

use std::fmt::Write as _;
use std::io;
use std::path::Path;

use endowire_core::Vec3;

use super::whole;

/// Points with their data, and the cells drawn between them.
#[derive(Debug, Default)]
pub(crate) struct PolyData {
    pub(crate) points_mm: Vec<Vec3>,
    /// Points that are drawn by themselves.
    pub(crate) vertices: Vec<usize>,
    pub(crate) lines: Vec<Vec<usize>>,
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) arrays: Vec<PointArray>,
}

/// A number or a vector for each point.
#[derive(Debug)]
pub(crate) struct PointArray {
    pub(crate) name: &'static str,
    /// Number of components, 1 or 3.
    pub(crate) components: usize,
    pub(crate) numbers: Vec<f64>,
}

impl PolyData {
    /// Writes a `.vtp` file, completely or not at all.
    pub(crate) fn write(&self, path: &Path) -> io::Result<()> {
        whole::write_bytes(path, self.document().as_bytes())
    }

    fn document(&self) -> String {
        let coordinates: Vec<f64> = self.points_mm.iter().flat_map(|p| [p.x, p.y, p.z]).collect();
        let vertices: Vec<[usize; 1]> = self.vertices.iter().map(|point| [*point]).collect();
        let mut text = head("PolyData");
        let _ = writeln!(
            text,
            "<Piece NumberOfPoints=\"{}\" NumberOfVerts=\"{}\" NumberOfLines=\"{}\" NumberOfStrips=\"0\" NumberOfPolys=\"{}\">",
            self.points_mm.len(),
            self.vertices.len(),
            self.lines.len(),
            self.triangles.len()
        );
        text += "<PointData>\n";
        for array in &self.arrays {
            numbers(&mut text, "Float64", array.name, array.components, &array.numbers);
        }
        text += "</PointData>\n<Points>\n";
        numbers(&mut text, "Float64", "points_mm", 3, &coordinates);
        text += "</Points>\n";
        cells(&mut text, "Verts", vertices.iter().map(<[usize; 1]>::as_slice));
        cells(&mut text, "Lines", self.lines.iter().map(Vec::as_slice));
        cells(&mut text, "Polys", self.triangles.iter().map(<[u32; 3]>::as_slice));
        text + "</Piece>\n</PolyData>\n</VTKFile>\n"
    }
}

/// Writes a `.pvd` file: times in seconds, with the files for them, which lie beside it.
pub(crate) fn write_series(path: &Path, times: &[(f64, Vec<String>)]) -> io::Result<()> {
    let mut text = head("Collection");
    for (time_s, names) in times {
        for (part, name) in names.iter().enumerate() {
            let _ = writeln!(text, "<DataSet timestep=\"{time_s}\" part=\"{part}\" file=\"{name}\"/>");
        }
    }
    text += "</Collection>\n</VTKFile>\n";
    whole::write_bytes(path, text.as_bytes())
}

fn head(kind: &str) -> String {
    format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"LittleEndian\">\n<{kind}>\n"
    )
}

fn numbers<T: std::fmt::Display>(text: &mut String, kind: &str, name: &str, components: usize, list: &[T]) {
    let _ = write!(
        text,
        "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"ascii\">"
    );
    for (index, number) in list.iter().enumerate() {
        // Line breaks for readability.
        let _ = write!(text, "{}{number}", if index.is_multiple_of(3 * components) { '\n' } else { ' ' });
    }
    text.push_str("\n</DataArray>\n");
}

fn cells<'a, T: std::fmt::Display + Copy + 'a>(
    text: &mut String,
    what: &str,
    cells: impl Iterator<Item = &'a [T]>,
) {
    let (mut connectivity, mut offsets) = (Vec::new(), Vec::new());
    for cell in cells {
        connectivity.extend_from_slice(cell);
        offsets.push(connectivity.len());
    }
    let _ = writeln!(text, "<{what}>");
    numbers(text, "Int64", "connectivity", 1, &connectivity);
    numbers(text, "Int64", "offsets", 1, &offsets);
    let _ = writeln!(text, "</{what}>");
}
