//! What has become of a vessel's course: lengths, tortuosity and angles between named places, before and after.

use serde::Serialize;

use super::super::{CentrelineTree, Displacement};
use crate::Vec3;

/// Name of the centre line's beginning.
const INLET: &str = "inlet";

/// A measure of the undisplaced vessel, and of the displaced one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BeforeAfter {
    /// At rest.
    pub before: f64,
    /// Displaced.
    pub after: f64,
}

/// The centre line between two named places that follow each other.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Stretch {
    /// The name of the place where it begins.
    pub from: String,
    /// The name of the place where it ends.
    pub to: String,
    /// Its length, mm.
    pub length_mm: BeforeAfter,
    /// The distance of its ends, mm.
    pub straight_mm: BeforeAfter,
    /// Length over distance.
    pub tortuosity: BeforeAfter,
}

/// A named place of the centre line.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Landmark {
    /// Its name.
    pub name: String,
    /// Where it is before it is displaced, mm.
    pub before_mm: Vec3,
    /// Where it is now, mm.
    pub after_mm: Vec3,
    /// How far it has moved, mm.
    pub displacement_mm: f64,
    /// The angle there between the straight lines to the places before and behind it; none at ends, and where several are
    /// behind it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angle_deg: Option<BeforeAfter>,
}

/// A vessel's course, undisplaced and displaced.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Straightening {
    /// How far the point of the centre line is displaced that is displaced most, mm.
    pub largest_displacement_mm: f64,
    /// The named places, the beginning of the centre line first.
    pub places: Vec<Landmark>,
    /// What lies between them.
    pub stretches: Vec<Stretch>,
}

impl Straightening {
    /// Measures a centre line by its targets.
    pub fn of(tree: &CentrelineTree, displacement: Option<&Displacement>) -> Self {
        let targets = tree.targets().iter().filter(|target| target.row > 0);
        let named = std::iter::once((0, INLET.to_owned()))
            .chain(targets.map(|target| (target.row, target.name.clone())))
            .collect();
        let measured = Measured { tree, displacement, named };
        let moved = |row: usize| {
            let [before, after] = measured.place(row);
            (after - before).norm()
        };
        let largest_displacement_mm = (0..tree.nodes().len()).map(moved).fold(0.0, f64::max);
        Self { largest_displacement_mm, places: measured.places(), stretches: measured.stretches() }
    }
}

/// A centre line before and after.
struct Measured<'a> {
    tree: &'a CentrelineTree,
    displacement: Option<&'a Displacement>,
    /// Named places by row.
    named: Vec<(usize, String)>,
}

impl Measured<'_> {
    fn place(&self, row: usize) -> [Vec3; 2] {
        let before = self.tree.nodes()[row].position_mm;
        [before, self.displacement.map_or(before, |displacement| displacement.place(&before))]
    }

    /// The rows from a named place back to the one before it, and that; none for the beginning.
    fn back(&self, row: usize) -> Option<(Vec<usize>, usize)> {
        let mut rows = vec![row];
        let mut at = row;
        while let Some(parent) = self.tree.nodes()[at].parent {
            rows.push(parent);
            if let Some(before) = self.named.iter().position(|(named, _)| *named == parent) {
                return Some((rows, before));
            }
            at = parent;
        }
        None
    }

    fn stretches(&self) -> Vec<Stretch> {
        let each = self.named.iter().filter_map(|(row, name)| {
            let (rows, before) = self.back(*row)?;
            let change = |of: &dyn Fn(usize) -> f64| BeforeAfter { before: of(0), after: of(1) };
            let length = |when: usize| {
                rows.windows(2)
                    .map(|pair| (self.place(pair[0])[when] - self.place(pair[1])[when]).norm())
                    .sum::<f64>()
            };
            let (first, last) = (rows[rows.len() - 1], rows[0]);
            let straight = |when: usize| (self.place(first)[when] - self.place(last)[when]).norm();
            Some(Stretch {
                from: self.named[before].1.clone(),
                to: name.clone(),
                length_mm: change(&length),
                straight_mm: change(&straight),
                tortuosity: change(&|when| length(when) / straight(when)),
            })
        });
        each.collect()
    }

    fn places(&self) -> Vec<Landmark> {
        let behind = |of: usize| -> Vec<usize> {
            let each =
                self.named.iter().filter(|(row, _)| self.back(*row).is_some_and(|(_, before)| before == of));
            each.map(|(row, _)| *row).collect()
        };
        let each = self.named.iter().enumerate().map(|(index, (row, name))| {
            let [before_mm, after_mm] = self.place(*row);
            let ends = self.back(*row).map(|(rows, _)| rows[rows.len() - 1]);
            let angle_deg = match (ends, &behind(index)[..]) {
                (Some(first), [next]) => {
                    let angle = |when: usize| {
                        let here = self.place(*row)[when];
                        let [a, b] = [first, *next].map(|end| self.place(end)[when] - here);
                        a.angle(&b).to_degrees()
                    };
                    Some(BeforeAfter { before: angle(0), after: angle(1) })
                }
                _ => None,
            };
            let displacement_mm = (after_mm - before_mm).norm();
            Landmark { name: name.clone(), before_mm, after_mm, displacement_mm, angle_deg }
        });
        each.collect()
    }
}
