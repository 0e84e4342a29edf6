//! Surfaces of VTK, as ParaView, 3D Slicer, SimVascular and VMTK write them: XML (`.vtp`) and the older format (`.vtk`).
//!
//! Own implementation, because the crate for them (vtkio 0.6) aborts on damaged files, and supports neither padded
//! parts of base64 nor the cells of legacy files since version 5.

#[cfg(feature = "vtp")]
mod arrays;
mod legacy;
#[cfg(feature = "vtp")]
mod xml;

use super::Reason;
use super::faces::Faces;
use super::scalar::index;
pub(super) use legacy::parse as parse_legacy;
#[cfg(feature = "vtp")]
pub(super) use xml::parse as parse_xml;
#[cfg(feature = "vtp")]
pub(in crate::vessel) use xml::parse_lines;

/// What to do about data that are not a surface.
const EXTRACT: &str =
    "extract its surface (ParaView: Extract Surface; vtkDataSetSurfaceFilter) and write that";

/// Corners of many cells, one cell after another, and the end of each cell among them.
#[derive(Debug, Default)]
struct Cells {
    corners: Vec<i64>,
    ends: Vec<usize>,
}

impl Cells {
    /// Cells from their corners and ends, as in XML files.
    fn from_ends(corners: &[f64], ends: &[f64]) -> Result<Self, Reason> {
        let corners: Vec<i64> = corners.iter().copied().map(index).collect();
        let mut cells = Self { corners, ends: Vec::with_capacity(ends.len()) };
        let mut begin = 0;
        for (number, &end) in ends.iter().enumerate() {
            if !(end >= begin as f64 && end <= cells.corners.len() as f64 && end.fract() == 0.0) {
                return Err(format!(
                    "offset {number} is {end}, and must be {begin} to {}: the cells are damaged, or cut off",
                    cells.corners.len()
                ));
            }
            begin = end as usize;
            cells.ends.push(begin);
        }
        Ok(cells)
    }

    /// Cells from the count of each and its corners, as in older legacy files.
    fn from_counts(numbers: &[f64], count: usize) -> Result<Self, Reason> {
        let mut cells = Self::default();
        let mut rest = numbers;
        for number in 0..count {
            let reported = rest.first().copied().unwrap_or(-1.0);
            if !(reported >= 0.0 && reported.fract() == 0.0 && reported < rest.len() as f64) {
                return Err(format!(
                    "cell {number} of {count} has no corners: the cells are damaged, or cut off"
                ));
            }
            let (corners, after) = rest[1..].split_at(reported as usize);
            cells.corners.extend(corners.iter().copied().map(index));
            cells.ends.push(cells.corners.len());
            rest = after;
        }
        Ok(cells)
    }

    /// Each cell's corners.
    fn iter(&self) -> impl Iterator<Item = &[i64]> {
        let begins = std::iter::once(0).chain(self.ends.iter().copied());
        begins.zip(&self.ends).map(|(begin, end)| &self.corners[begin..*end])
    }

    /// Adds these polygons to the faces of a file.
    fn add_polygons(&self, faces: &mut Faces) {
        self.iter().enumerate().for_each(|(number, polygon)| faces.push(polygon.iter().copied(), number));
    }

    /// Adds these triangle strips likewise.
    fn add_strips(&self, faces: &mut Faces) {
        self.iter().enumerate().for_each(|(number, strip)| faces.push_strip(strip, number));
    }
}

#[cfg(test)]
#[cfg(feature = "vtp")]
mod tests;
