//! Opens a closed surface at the ends of its vessels, by planes across their centre line.
//!
//! The centre line is that of the whole closed surface, from the middle of one end to those of the others. A vessel that
//! leaves the picture is cut where the plane first has all of the border patch beyond it, so that the rim is wholly in the
//! picture however obliquely the vessel leaves; a blunt end is cut where the largest sphere fits for the first time, about
//! a radius from its tip.

use std::collections::BTreeSet;

use super::distance::Voxels;
use super::ends::{EndKind, Tip};
use crate::vessel::topology::{EdgeTable, NONE};
use crate::vessel::trimming::cut_off;
use crate::vessel::{CentrelineEnd, CentrelineTree, ExtractedCentreline, SurfaceMesh, Wall};
use crate::{Result, Vec3};

/// Height below the plane that a voxel of the border patch may have, in voxels: the line is found to within a part of one.
const BELOW: f64 = 0.25;
/// Length of the line over which its direction is taken, in radii of the vessel.
const DIRECTION: f64 = 1.5;
/// Largest way along the line from its end to the plane, in radii: a vessel that runs along the border has no section.
const FARTHEST: f64 = 6.0;
/// Distance from the plane within which a vertex is moved onto it, in voxels.
const ON_PLANE: f64 = 0.25;
/// Largest part of the surface that may be cut off, in radii of the vessel around the plane.
const LARGEST: f64 = 6.0;

/// A plane across the end of a vessel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plane {
    pub(super) centre_mm: Vec3,
    /// Out of the vessel.
    pub(super) outward: Vec3,
}

impl Plane {
    fn height_mm(&self, x: &Vec3) -> f64 {
        (x - self.centre_mm).dot(&self.outward)
    }
}

/// The middles of the ends of a part, as points of a centre line from the first to the others, each from the end inwards.
pub(super) fn lines(closed: &SurfaceMesh, middles_mm: &[Vec3]) -> Result<Vec<Option<Vec<Vec3>>>> {
    let wall = Wall::welded(closed)?;
    let place = |middle: &Vec3| CentrelineEnd::Place(*middle);
    let ends: Vec<CentrelineEnd> = middles_mm[1..].iter().map(place).collect();
    let found = ExtractedCentreline::of(&wall, Some(place(&middles_mm[0])), &ends)?;
    let mut lines = vec![None];
    for number in 1..middles_mm.len() {
        let name = format!("place {number}");
        let target = found.tree.targets().iter().find(|target| target.name == name);
        lines.push(target.map(|target| inwards(&found.tree, target.row)));
    }
    // The first end has the line to the farthest of the others, seen from its own side.
    let longest = lines.iter().flatten().max_by_key(|line| line.len()).cloned();
    lines[0] = longest.map(|mut line| {
        line.reverse();
        line
    });
    Ok(lines)
}

/// The line from a row to the root.
fn inwards(tree: &CentrelineTree, row: usize) -> Vec<Vec3> {
    let mut line = Vec::new();
    let mut next = Some(row);
    while let Some(row) = next {
        line.push(tree.nodes()[row].position_mm);
        next = tree.nodes()[row].parent;
    }
    line
}

/// The point at a distance along a line, its last one beyond that.
fn along(line: &[Vec3], way_mm: f64) -> Vec3 {
    let mut left = way_mm;
    for pair in line.windows(2) {
        let length = (pair[1] - pair[0]).norm();
        if left < length {
            return pair[0].lerp(&pair[1], left / length);
        }
        left -= length;
    }
    line.last().copied().unwrap_or_default()
}

/// The plane across the end of a vessel; an error says why there is none.
pub(super) fn plane(
    tip: &Tip,
    line: Option<&Vec<Vec3>>,
    voxels: &Voxels<'_>,
    voxel_mm: f64,
) -> std::result::Result<Plane, String> {
    let Some(line) = line else { return Err("no centre line leads there".into()) };
    let patch: Vec<Vec3> = tip.patch.iter().map(|(voxel, _)| voxels.centre_mm(*voxel)).collect();
    let lever_mm = DIRECTION * tip.radius_mm.max(voxel_mm);
    let step_mm = voxel_mm / 8.0;
    let limit_mm = FARTHEST * tip.radius_mm.max(voxel_mm);
    for k in 0..(limit_mm / step_mm) as usize {
        let way_mm = k as f64 * step_mm;
        let centre_mm = along(line, way_mm);
        let inner = along(line, way_mm + lever_mm);
        let Some(outward) = (centre_mm - inner).try_normalize(1e-9) else {
            return Err("its centre line is shorter than the vessel is wide".into());
        };
        let plane = Plane { centre_mm, outward };
        if tip.kind == EndKind::Blunt || patch.iter().all(|x| plane.height_mm(x) >= -BELOW * voxel_mm) {
            return Ok(plane);
        }
    }
    Err("it runs along the picture's border, and has no whole section near it".into())
}

/// Cuts off what is beyond a plane from `outermost_mm` on, a place at the end of the vessel; an error says why it cannot be
/// cut.
pub(super) fn cut(
    mesh: &mut SurfaceMesh,
    plane: &Plane,
    outermost_mm: &Vec3,
    radius_mm: f64,
    voxel_mm: f64,
) -> std::result::Result<(), String> {
    let nearest = (0..mesh.triangles.len() as u32).min_by(|a, b| {
        let distance = |t: u32| (mesh.middle(t as usize) - outermost_mm).norm();
        distance(*a).total_cmp(&distance(*b))
    });
    let across = EdgeTable::new(&mesh.triangles).neighbours(mesh.triangles.len());
    let highest = |t: u32| {
        let heights = mesh.corners(t as usize).map(|x| plane.height_mm(&x));
        heights.into_iter().fold(f64::MIN, f64::max)
    };
    let mut next: Vec<u32> = nearest.into_iter().filter(|t| highest(*t) > 0.0).collect();
    if next.is_empty() {
        return Err("its plane is beyond its tip".into());
    }
    let reach_mm = LARGEST * radius_mm.max(voxel_mm);
    let mut part = BTreeSet::new();
    while let Some(triangle) = next.pop() {
        if !part.insert(triangle) {
            continue;
        }
        if (mesh.corners(triangle as usize)[0] - plane.centre_mm).norm() > reach_mm {
            return Err("its plane would cut off more than the end".into());
        }
        for other in across[triangle as usize] {
            if other == NONE {
                return Err("its plane meets another opening".into());
            }
            if !part.contains(&other) && highest(other) > 0.0 {
                next.push(other);
            }
        }
    }
    let near: BTreeSet<u32> = part.iter().flat_map(|t| mesh.triangles[*t as usize]).collect();
    for v in near {
        let x = &mut mesh.vertices_mm[v as usize];
        let height = plane.height_mm(x);
        if height.abs() < ON_PLANE * voxel_mm {
            *x -= plane.outward * height;
        }
    }
    // What was moved onto the plane is on it but for rounding.
    cut_off(mesh, &part, |x| {
        let height = plane.height_mm(x);
        if height.abs() < 1e-6 * voxel_mm { 0.0 } else { height }
    });
    Ok(())
}
