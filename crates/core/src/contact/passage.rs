//! Width of the passage ahead of a device's front: the radius of the largest sphere that can pass.
//!
//! The lumen about the front is sampled on a grid. A path is as wide as its smallest clearance, and the widest path
//! is found like a shortest one, with the smallest clearance in place of the sum of lengths (Pollack, "The maximum
//! capacity through a network", Operations Research 8, 1960). Paths begin beside the last piece of the device, end at
//! a given distance from it, and do not cross back over the lumen's cross-section at the start of that piece.
//!
//! Every point is within √3/2 h of a point of a grid of spacing h, and a clearance changes by at most the distance.
//! So a sphere of radius r cannot pass if the widest path on the grid is narrower than r − √3/2 h, and can if it is r
//! or wider. In between, a finer grid is used.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use rustc_hash::FxHashSet;

use super::ContactSurface;
use super::extension::is_beyond_an_opening;
use crate::Vec3;
use crate::rod::Frame;
use crate::tuning::PassageTuning;
use crate::vessel::Opening;

/// Index of a grid point.
type Cell = [i32; 3];

/// A passage narrower than the device.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Narrow {
    /// Radius of the largest sphere that can pass, mm: 0 where the lumen ends.
    pub(crate) radius_mm: f64,
    /// The narrowest position, in the reference.
    pub(crate) place_mm: Vec3,
}

/// The narrowest position of the widest path ahead of the front of a device of this radius, if narrower than the
/// device. `axis_mm` are positions of the device in the reference, from the tip on, a radius or two apart; at least
/// two of them.
pub(crate) fn narrow_ahead(
    surface: &ContactSurface,
    openings: &[Opening],
    axis_mm: &[Vec3],
    radius_mm: f64,
    tuning: &PassageTuning,
) -> Option<Narrow> {
    let front = front(axis_mm, tuning.beside * radius_mm)?;
    for spacing in tuning.spacings {
        let grid = Grid::new((surface, openings), front, radius_mm, spacing * radius_mm, tuning)?;
        let widest = grid.widest()?;
        if widest.radius_mm >= radius_mm {
            return None;
        }
        if widest.radius_mm < radius_mm - 0.75f64.sqrt() * grid.spacing_mm {
            return Some(widest);
        }
    }
    None
}

/// The last piece of a device, at least `least_mm` long, from its tip to a cross-section that all of it is ahead of,
/// and one point more.
fn front(axis_mm: &[Vec3], least_mm: f64) -> Option<&[Vec3]> {
    let mut length_mm = 0.0;
    for last in 1..axis_mm.len().checked_sub(1)? {
        length_mm += (axis_mm[last] - axis_mm[last - 1]).norm();
        let along = axis_mm[last - 1] - axis_mm[last + 1];
        if length_mm >= least_mm && axis_mm[..last].iter().all(|x| (x - axis_mm[last]).dot(&along) > 0.0) {
            return Some(&axis_mm[..last + 2]);
        }
    }
    None
}

/// The lumen near a front, on a grid about its tip.
struct Grid<'a> {
    surface: &'a ContactSurface,
    openings: &'a [Opening],
    /// Positions of the device from the tip to the cross-section at which its front begins.
    piece: &'a [Vec3],
    /// The middle of that cross-section, and its triad: the normal towards the tip, and two directions in the
    /// section.
    middle: Vec3,
    frame: Frame,
    radius_mm: f64,
    spacing_mm: f64,
    tuning: &'a PassageTuning,
}

/// A path to a grid point.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Way {
    /// Its smallest clearance, mm, and the position of that.
    least_mm: f64,
    narrowest: Cell,
    to: Cell,
}

impl Eq for Way {}

impl Ord for Way {
    fn cmp(&self, other: &Self) -> Ordering {
        self.least_mm.total_cmp(&other.least_mm).then_with(|| other.to.cmp(&self.to))
    }
}

impl PartialOrd for Way {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<'a> Grid<'a> {
    /// For a front given by positions from the tip to one behind its cross-section, the last but one.
    fn new(
        (surface, openings): (&'a ContactSurface, &'a [Opening]),
        front: &'a [Vec3],
        radius_mm: f64,
        spacing_mm: f64,
        tuning: &'a PassageTuning,
    ) -> Option<Self> {
        let [piece @ .., behind] = front else { return None };
        let [.., ahead, middle] = piece else { return None };
        let frame = Frame::new(ahead - behind, None);
        Some(Self { surface, openings, piece, middle: *middle, frame, radius_mm, spacing_mm, tuning })
    }

    /// The narrowest position of the widest path; `None` if the front is not in the lumen, or if the search takes too
    /// long.
    fn widest(&self) -> Option<Narrow> {
        let section = self.section();
        let mut ways = self.beside();
        if ways.is_empty() {
            return None;
        }
        let mut seen: FxHashSet<Cell> = ways.iter().map(|way| way.to).collect();
        while let Some(way) = ways.pop() {
            let at = self.place(way.to);
            if self.distance_mm(&at).0 >= self.tuning.ahead * self.radius_mm
                || is_beyond_an_opening(self.openings, &at)
            {
                return Some(Narrow { radius_mm: way.least_mm, place_mm: self.place(way.narrowest) });
            }
            if seen.len() > self.tuning.most_asked {
                return None;
            }
            for to in around(way.to) {
                let x = self.place(to);
                if self.passes_section(&at, &x, &section) || !seen.insert(to) {
                    continue;
                }
                let clearance_mm = self.clearance_mm(&x);
                if clearance_mm > way.least_mm {
                    ways.push(Way { to, ..way });
                } else if clearance_mm > 0.0 {
                    ways.push(Way { least_mm: clearance_mm, narrowest: to, to });
                }
            }
        }
        Some(Narrow { radius_mm: 0.0, place_mm: self.piece[0] })
    }

    fn place(&self, cell: Cell) -> Vec3 {
        self.piece[0] + Vec3::from(cell.map(f64::from)) * self.spacing_mm
    }

    fn cell(&self, x: &Vec3) -> Cell {
        ((x - self.piece[0]) / self.spacing_mm).map(|c| c.round() as i32).into()
    }

    /// Distance of a position from the contact surface, exact up to the reach of a device; not positive outside the lumen.
    fn clearance_mm(&self, x: &Vec3) -> f64 {
        self.surface.clearance_mm(x, self.radius_mm)
    }

    /// Distance of a position from the front, mm, and whether it is ahead of its tip.
    fn distance_mm(&self, x: &Vec3) -> (f64, bool) {
        let mut least = (f64::INFINITY, false);
        for (k, side) in self.piece.windows(2).enumerate() {
            let along = side[1] - side[0];
            let part = (x - side[0]).dot(&along) / along.norm_squared();
            let distance_mm = (x - (side[0] + along * part.clamp(0.0, 1.0))).norm();
            if distance_mm < least.0 {
                least = (distance_mm, k == 0 && part < 0.0);
            }
        }
        least
    }

    /// The initial paths, of zero length, beside the front in its part of the lumen.
    fn beside(&self) -> BinaryHeap<Way> {
        let mut ways = BinaryHeap::new();
        let mut seen = FxHashSet::default();
        let mut left: Vec<Cell> =
            self.piece.iter().map(|x| self.cell(x)).filter(|to| seen.insert(*to)).collect();
        while let Some(to) = left.pop() {
            let x = self.place(to);
            let (distance_mm, ahead) = self.distance_mm(&x);
            let least_mm = self.clearance_mm(&x);
            if ahead
                || distance_mm > self.tuning.beside * self.radius_mm
                || self.ahead_mm(&x) < 0.0
                || least_mm <= 0.0
            {
                continue;
            }
            ways.push(Way { least_mm, narrowest: to, to });
            left.extend(around(to).filter(|to| seen.insert(*to)));
        }
        ways
    }

    /// Distance of a position ahead of the cross-section, mm.
    fn ahead_mm(&self, x: &Vec3) -> f64 {
        (x - self.middle).dot(&self.frame.t)
    }

    /// The grid points of the cross-section at which the front begins: the part of its plane in the lumen next to the
    /// device.
    fn section(&self) -> FxHashSet<[i32; 2]> {
        let Frame { u, v, .. } = self.frame;
        let most = (self.tuning.ahead / self.spacing_mm * self.radius_mm) as i32;
        let mut seen = FxHashSet::default();
        let mut left: Vec<[i32; 2]> = vec![[0, 0]];
        while let Some([i, j]) = left.pop() {
            let x = self.middle + (u * f64::from(i) + v * f64::from(j)) * self.spacing_mm;
            if i.abs().max(j.abs()) > most || self.clearance_mm(&x) <= 0.0 || !seen.insert([i, j]) {
                continue;
            }
            left.extend(
                [[i + 1, j], [i - 1, j], [i, j + 1], [i, j - 1]].iter().filter(|c| !seen.contains(*c)),
            );
        }
        seen
    }

    /// Whether a step crosses the cross-section.
    fn passes_section(&self, from: &Vec3, to: &Vec3, section: &FxHashSet<[i32; 2]>) -> bool {
        let (before, after) = (self.ahead_mm(from), self.ahead_mm(to));
        if (before < 0.0) == (after < 0.0) {
            return false;
        }
        let at = from + (to - from) * (before / (before - after)) - self.middle;
        section.contains(
            &[self.frame.u, self.frame.v].map(|side| (at.dot(&side) / self.spacing_mm).round() as i32),
        )
    }
}

/// The neighbours of a grid point.
fn around([i, j, k]: Cell) -> impl Iterator<Item = Cell> {
    (0..27).filter(|n| *n != 13).map(move |n| [i + n % 3 - 1, j + n / 3 % 3 - 1, k + n / 9 - 1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::WallProperties;
    use crate::vessel::{CentrelineNode, CentrelineTree, GeneratedWall, NoStore, Resolution, Wall};

    /// A vessel along z with the given radius, optionally with a side branch of 1 mm at z = 20 mm.
    fn vessel(radius_mm: impl Fn(f64) -> f64, branch: bool) -> (ContactSurface, Wall) {
        let along = (0..81).map(|k| {
            let z = 0.5 * f64::from(k);
            let parent = usize::try_from(k - 1).ok();
            CentrelineNode { position_mm: Vec3::z() * z, radius_mm: radius_mm(z), parent }
        });
        let lateral = (1..30).map(|k| CentrelineNode {
            position_mm: Vec3::new(0.5 * f64::from(k), 0.0, 20.0),
            radius_mm: 1.0,
            parent: Some(if k == 1 { 40 } else { 79 + k as usize }),
        });
        let nodes = along.chain(lateral.take(if branch { 29 } else { 0 }));
        let tree = CentrelineTree::new(nodes.collect()).unwrap();
        let wall = GeneratedWall::new(&tree, Resolution::EdgeMm(0.2)).unwrap().wall;
        let surface = ContactSurface::new(&wall, (0.4, 0.4), &WallProperties::default(), &NoStore).unwrap();
        (surface, wall)
    }

    /// The result for a wire of radius 0.4 mm whose tip is at z, offset by x.
    fn ahead((surface, wall): &(ContactSurface, Wall), z: f64, x: f64) -> Option<Narrow> {
        let axis: Vec<Vec3> = (0..20).map(|k| Vec3::new(x, 0.0, z - 0.6 * f64::from(k))).collect();
        narrow_ahead(surface, wall.openings(), &axis, 0.4, &PassageTuning::DEFAULT)
    }

    #[test]
    fn a_tube_that_narrows_is_as_wide_as_its_narrowest_place_ahead() {
        // 2 mm wide up to 20 mm, and 0.25 mm from 21 mm to 24 mm.
        let throat = |z: f64| (2.0 - 1.75 * (z - 19.0).clamp(0.0, 1.0)) + 1.75 * (z - 24.0).clamp(0.0, 1.0);
        let narrowing = vessel(throat, false);
        for x in [0.0, 0.1] {
            let found = ahead(&narrowing, 20.0, x).unwrap();
            assert!((found.radius_mm - 0.25).abs() < 0.09 && found.place_mm.z > 19.5, "{found:?}");
        }
        // Far ahead it does not block the device, nor behind it.
        assert_eq!(ahead(&narrowing, 15.0, 0.0), None);
        assert_eq!(ahead(&narrowing, 27.0, 0.0), None);
        // Slightly wider than the device.
        let enough = vessel(|z| 2.0 - 1.57 * (z - 19.0).clamp(0.0, 1.0), false);
        assert_eq!(ahead(&enough, 20.0, 0.0), None);
    }

    #[test]
    fn a_way_beside_it_is_a_way_and_one_back_is_none() {
        let narrow = |z: f64| 2.0 - 1.8 * (z - 19.0).clamp(0.0, 1.0);
        let found = ahead(&vessel(narrow, false), 20.0, 0.0).unwrap();
        assert!((found.radius_mm - 0.2).abs() < 0.09, "{found:?}");
        assert_eq!(ahead(&vessel(narrow, true), 19.6, 0.0), None);
    }
}
