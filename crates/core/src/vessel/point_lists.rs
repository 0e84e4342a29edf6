//! Centre lines as written by other programs: lists of points with radii, line after line, without parents.
//!
//! VMTK's `.dat` and the tables that ParaView and 3D Slicer export of VMTK's lines have a header that names their
//! columns. All lines begin at the same end, or end there. Where two lines coincide, the second is joined to the
//! first.

use super::CentrelineNode;
use super::extract::{Growing, Sphere};
use crate::Vec3;

/// Names of the columns, in lower case: those of VMTK's `.dat` and of ParaView's and Slicer's tables.
const X: [&str; 3] = ["x", "points:0", "points_0"];
const Y: [&str; 3] = ["y", "points:1", "points_1"];
const Z: [&str; 3] = ["z", "points:2", "points_2"];
const RADIUS: [&str; 2] = ["maximuminscribedsphereradius", "radius"];

/// Indices of the columns of a list of points, for a header with this number of words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Columns {
    place: [usize; 4],
    pub(super) count: usize,
}

impl Columns {
    /// The columns of a header; `None` if it is not that of such a list.
    pub(super) fn of_header(words: &[&str]) -> Option<Self> {
        let words: Vec<String> = words.iter().map(|word| word.trim_matches('"').to_lowercase()).collect();
        let find = |names: &[&str]| words.iter().position(|word| names.contains(&word.as_str()));
        let place = [find(&X)?, find(&Y)?, find(&Z)?, find(&RADIUS)?];
        (!words.iter().any(|word| word == "parent")).then_some(Self { place, count: words.len() })
    }

    /// The point of a row with the same number of words.
    pub(super) fn point(&self, words: &[&str]) -> Result<CentrelineNode, String> {
        let mut numbers = [0.0; 4];
        for ((number, &column), name) in numbers.iter_mut().zip(&self.place).zip(["x", "y", "z", "radius"]) {
            let word = words.get(column).copied().unwrap_or_default();
            *number = word.parse().map_err(|_| format!("{name} = {word:?} is not a number"))?;
        }
        let [x, y, z, radius_mm] = numbers;
        Ok(CentrelineNode { position_mm: Vec3::new(x, y, z), radius_mm, parent: None })
    }
}

/// The tree of a list of points; a line ends where the next point is outside the sphere of the last one, or at the
/// common end again.
pub(super) fn tree(points: &[CentrelineNode]) -> Result<Vec<CentrelineNode>, String> {
    let Some(first_mm) = points.first().map(|point| point.position_mm) else { return Ok(Vec::new()) };
    let follows = |a: &CentrelineNode, b: &CentrelineNode| {
        // One line may end where the next begins.
        let is_new = [a, b].iter().all(|point| point.position_mm == first_mm);
        !is_new && (b.position_mm - a.position_mm).norm() < a.radius_mm.max(b.radius_mm)
    };
    joined(points.chunk_by(follows))
}

/// The tree of lines that begin or end where the first begins.
pub(super) fn joined<L: AsRef<[CentrelineNode]>>(
    lines: impl IntoIterator<Item = L>,
) -> Result<Vec<CentrelineNode>, String> {
    let sphere = |node: &CentrelineNode| Sphere { centre_mm: node.position_mm, radius_mm: node.radius_mm };
    let mut growing = Growing::default();
    for (number, stretch) in lines.into_iter().enumerate() {
        let stretch = stretch.as_ref();
        let mut line: Vec<Sphere> = stretch.iter().map(sphere).collect();
        if let (Some(root), [first, .., last]) = (growing.nodes.first(), line.as_slice()) {
            let away = |end: &Sphere| (end.centre_mm - root.position_mm).norm();
            if away(last) < away(first) {
                line.reverse();
            }
        }
        let (entry, own) = match number {
            0 => (None, line),
            _ => growing.own_part(&line),
        };
        if number > 0 && entry.is_none() {
            return Err(format!(
                "line {} of the list (a line ends where the next point is farther away than the radius) does not begin where the \
                 first does: give all lines from one end, and points closer to each other than the radius",
                number + 1
            ));
        }
        growing.join(entry, &own);
    }
    Ok(growing.nodes)
}

#[cfg(test)]
mod tests {
    use std::fmt::Write;
    use std::path::Path;

    use crate::vessel::{CentrelineTree, anatomy};
    use crate::{Result, Vec3};

    fn read(text: &str) -> Result<CentrelineTree> {
        CentrelineTree::from_bytes(text.as_bytes(), Path::new("lines.dat"))
    }

    /// The paths to all ends of a tree, each from the root, as VMTK writes them; the second is reversed.
    fn list(header: &str, tree: &CentrelineTree) -> String {
        let mut text = format!("{header}\n");
        let ends = tree.targets().iter().filter_map(|target| tree.path_to(target.row));
        for (number, path) in ends.enumerate() {
            let pieces = path.length_mm().ceil();
            let mut rows: Vec<String> = (0..=pieces as usize)
                .map(|k| {
                    let on = path.at(path.length_mm() * k as f64 / pieces);
                    format!("{},{},{},7,{}", path.nearest(&on).radius_mm.min(3.0), on.x, on.y, on.z)
                })
                .collect();
            if number == 1 {
                rows.reverse();
            }
            rows.iter().for_each(|row| writeln!(text, "{row}").unwrap());
        }
        text
    }

    #[test]
    fn lists_of_other_programs_are_trees() {
        let tree = anatomy::tree("aortic_arch").unwrap();
        let (vmtk, slicer) = (
            "MaximumInscribedSphereRadius X Y EdgeArray Z",
            "\"Radius\",\"Points:0\",\"Points:1\",\"CellId\",\"Points:2\"",
        );
        let read_back = read(&list(vmtk, &tree)).unwrap();
        assert_eq!(read(&list(slicer, &tree)).unwrap(), read_back);
        let ends = read_back.children().iter().filter(|children| children.is_empty()).count();
        assert_eq!(ends, tree.targets().len());
        for target in tree.targets() {
            let end_mm = tree.nodes()[target.row].position_mm;
            assert!(read_back.nodes().iter().any(|node| (node.position_mm - end_mm).norm() < 1e-9));
        }
    }

    #[test]
    fn what_is_no_tree_of_lines_is_refused_with_its_line() {
        let reported = |text: &str| read(text).unwrap_err().to_string();
        assert!(reported("x y z radius\n0 0 0 1\n0 0 0.5 one\n").contains("line 3: radius = \"one\""));
        assert!(reported("x y z radius\n0 0 0 1\n0 0 0.5\n").contains("line 3: 3 values; the header has 4"));
        assert!(reported("x y z radius\n0 0 0 1\n0 0 nan 1\n").contains("line 3: z = NaN"));
        let apart = reported("x y z radius\n0 0 0 1\n0 0 0.5 1\n9 0 0 1\n9 0 0.5 1\n");
        assert!(apart.contains("line 2 of the list"), "{apart}");
    }

    #[test]
    fn numpy_writes_parents_as_decimals() {
        let text =
            "0.0e+00 0.0 0.0 1.0 -1.000000000000000000e+00\n0.0 0.0 2.0 1.0 0.000000000000000000e+00\n";
        let tree = read(text).unwrap();
        assert_eq!((tree.nodes()[1].parent, tree.nodes()[1].position_mm), (Some(0), Vec3::z() * 2.0));
    }
}
