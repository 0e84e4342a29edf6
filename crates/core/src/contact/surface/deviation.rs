//! Deviation of the contact surface from the surface it is made from.
//!
//! The wall that acts on a device is the smooth one, not the triangles it is made from: where these cut across a
//! crest the smooth wall lies slightly outside them, and in tubes by the sag edge²/8R. So the deviation is measured
//! from the smooth wall, both ways, at sample points: of points of the given surface, and of feet on the smooth wall
//! from the given surface. A point x near the smooth wall is at the distance |f|/|∇f|, to first order, and its foot
//! is x − f ∇f/|∇f|².

use std::ops::Range;

use super::ContactMesh;
use crate::vessel::{SurfaceMesh, Wall, WallQuery};
use crate::{Result, Vec3, parallel};

/// Approximate number of sample points on each side, in addition to two per triangle.
const SAMPLES: f64 = 120_000.0;
/// Triangles with a distance of at least this fraction of the largest are sampled more finely.
const NEARLY: f64 = 0.85;
/// Factor of the number of points in these triangles.
const CLOSER: usize = 30;
/// Largest number of triangles sampled more finely, those with the largest distances.
const LOOKED_AT: usize = 500;

/// Lower bound of the gradient, which is nearly 1, for computing feet: below it the foot is nowhere near.
const FLAT: f64 = 0.1;
/// Radius about an opening's axis, in radii of the opening, within which everything beyond its plane belongs to its
/// extension.
const BESIDE_RADII: f64 = 2.0;

/// Distances of two surfaces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deviation {
    /// Mean over the sample points, mm.
    pub mean_mm: f64,
    /// 99th percentile, mm.
    pub usual_mm: f64,
    /// The maximum, mm.
    pub most_mm: f64,
    /// Position of the maximum on the given surface or on the felt one.
    pub worst_at_mm: Vec3,
}

impl ContactMesh {
    /// The deviation of this wall from `given`, except its extensions beyond openings.
    ///
    /// # Errors
    /// If the given wall has no triangles.
    pub fn deviation(&self, given: &Wall) -> Result<Deviation> {
        let query = WallQuery::new(given)?;
        let from_given = |x: &Vec3| {
            let Some(near) = self.query.nearest(x, f64::MAX) else { return Some(f64::MAX) };
            let surface = self.smooth.distance(x, near.triangle);
            Some(
                surface
                    .map_or(near.distance_mm, |surface| surface.value_mm / surface.gradient.norm().max(FLAT))
                    .abs(),
            )
        };
        let extended = |x: &Vec3| {
            given.openings().iter().any(|opening| {
                let (beyond_mm, lateral_mm) = opening.beyond_and_off_axis_mm(x);
                beyond_mm > 0.0 && lateral_mm < BESIDE_RADII * opening.radius_mm
            })
        };
        let from_felt = |x: &Vec3| {
            if extended(x) {
                return None;
            }
            let triangle = self.query.nearest(x, f64::MAX)?.triangle;
            let surface = self.smooth.distance(x, triangle)?;
            let foot =
                x - surface.gradient * (surface.value_mm / surface.gradient.norm_squared().max(FLAT * FLAT));
            let near = query.nearest(&foot, f64::MAX)?;
            // Beyond a rim of the given surface lies the cap of a hole.
            (!near.rim).then_some(near.distance_mm.abs())
        };
        let sides = [measured(given.mesh(), from_given), measured(self.query.mesh(), from_felt)];
        let (most_mm, worst_at_mm) =
            sides.iter().map(|side| side.most).max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or_default();
        let mut all: Vec<f64> = sides.into_iter().flat_map(|side| side.distances_mm).collect();
        all.sort_by(f64::total_cmp);
        Ok(Deviation {
            mean_mm: all.iter().sum::<f64>() / all.len().max(1) as f64,
            usual_mm: all.get(all.len() * 99 / 100).copied().unwrap_or(0.0),
            most_mm,
            worst_at_mm,
        })
    }
}

/// The measurements on one side.
struct Measured {
    distances_mm: Vec<f64>,
    most: (f64, Vec3),
}

/// `distance` at points spread evenly over the triangles of a mesh, with finer sampling near the largest.
fn measured(mesh: &SurfaceMesh, distance: impl Fn(&Vec3) -> Option<f64> + Sync) -> Measured {
    let area = |index: usize| {
        let [a, b, c] = mesh.corners(index);
        0.5 * (b - a).cross(&(c - a)).norm()
    };
    let count = mesh.triangles.len();
    let each_mm2 = ((0..count).map(area).sum::<f64>() / SAMPLES).max(f64::MIN_POSITIVE);
    let on = |index: usize, times: usize| {
        let points = 1 + times * (area(index) / each_mm2).ceil() as usize;
        let (corners, distance) = (mesh.corners(index), &distance);
        (0..points).filter_map(move |k| {
            let x = point(corners, k);
            Some((distance(&x)?, x))
        })
    };
    let each = |part: Range<usize>| {
        let all = part.flat_map(|index| on(index, 1).map(move |(mm, x)| (mm, x, index)));
        all.collect::<Vec<_>>()
    };
    let all = parallel::parts(count, each).concat();
    let largest = |a: (f64, Vec3), b: (f64, Vec3)| if b.0 > a.0 { b } else { a };
    let most = all.iter().map(|&(mm, x, _)| (mm, x)).fold((0.0, Vec3::zeros()), largest);
    let mut far: Vec<(f64, usize)> =
        all.iter().filter(|(mm, ..)| *mm > NEARLY * most.0).map(|(mm, _, index)| (*mm, *index)).collect();
    far.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    far.truncate(LOOKED_AT);
    let most = far.into_iter().flat_map(|(_, index)| on(index, CLOSER)).fold(most, largest);
    Measured { distances_mm: all.into_iter().map(|(mm, ..)| mm).collect(), most }
}

/// Sample points of a triangle: its corners, its middle, then the sequence of Roberts, *The unreasonable
/// effectiveness of quasirandom sequences*, 2018.
fn point([a, b, c]: [Vec3; 3], number: usize) -> Vec3 {
    match number {
        0 => a,
        1 => (a + b + c) / 3.0,
        _ => {
            let [u, v] = [0.754_877_666_246_693, 0.569_840_290_998_053].map(|w| (w * number as f64).fract());
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            a + (b - a) * u + (c - a) * v
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::WallProperties;
    use crate::vessel::{CentrelineNode, CentrelineTree, GeneratedWall, NoStore, Resolution};

    fn tube(radius_mm: f64) -> Wall {
        let node = |z: f64, parent| CentrelineNode { position_mm: Vec3::z() * z, radius_mm, parent };
        let nodes = (0..=20).map(|k: usize| node(3.0 * k as f64, k.checked_sub(1))).collect();
        let tree = CentrelineTree::new(nodes).unwrap();
        GeneratedWall::new(&tree, Resolution::EdgeMm(1.0)).unwrap().wall
    }

    #[test]
    fn deviation_is_the_sag_of_triangles_and_the_distance_of_another_tube() {
        let properties = WallProperties { deviation_mm: 0.0, ..WallProperties::default() };
        let given = tube(4.0);
        let surface = ContactMesh::new(&given, 0.2, &properties, &NoStore).unwrap();
        let own = surface.deviation(&given).unwrap();
        // The middle of a chord of 1 mm, and slightly more in the middle of a triangle.
        let sag_mm = 1.0 / 32.0;
        assert!((0.8..1.6).contains(&(own.most_mm / sag_mm)), "{own:?}");
        assert!(own.mean_mm < own.usual_mm && own.usual_mm <= own.most_mm, "{own:?}");
        // Caps and extensions are excluded: nothing is 4 mm away.
        for by_mm in [-0.3, 0.3] {
            let other = surface.deviation(&tube(4.0 + by_mm)).unwrap();
            assert!((other.mean_mm - 0.3_f64).abs() < sag_mm, "{other:?}");
            assert!((other.most_mm - 0.3_f64).abs() < 2.0 * sag_mm, "{other:?}");
        }
    }
}
