//! The vertices that may reach a point over a triangle.
//!
//! On a large mesh a list is made when first needed: a device comes near few triangles, and lists grow with finer
//! meshes and thicker devices.

use std::sync::OnceLock;

use rustc_hash::FxHashSet;

use super::Quadric;
use crate::contact::quadric_fit::Neighbours;
use crate::{Vec3, parallel};

/// Height above the surface up to which lists are complete, in radii of the thickest device and in supports.
const HEIGHT: (f64, f64) = (1.5, 0.5);
/// Largest number of triangles for which lists are made in advance, and of vertices in all of these: in a gap that is much narrower than the
/// device every list is long.
const AT_ONCE: (usize, usize) = (400_000, 30_000_000);

/// For every triangle, the vertices whose support may reach a point over it.
#[derive(Debug, Clone)]
pub(super) struct Lists {
    pub(super) triangles: Vec<[u32; 3]>,
    neighbours: Neighbours,
    /// Height up to which they are complete on any mesh, mm.
    height_mm: f64,
    known: Vec<OnceLock<Box<[u32]>>>,
}

impl Lists {
    pub(super) fn new(triangles: Vec<[u32; 3]>, neighbours: Neighbours, thickest_mm: f64) -> Self {
        let known = vec![OnceLock::new(); triangles.len()];
        Self { triangles, neighbours, height_mm: HEIGHT.0 * thickest_mm, known }
    }

    /// Makes all lists of a small mesh, so that steps do not allocate.
    pub(super) fn prepare(&self, quadrics: &[Quadric]) {
        if self.known.len() > AT_ONCE.0 {
            return;
        }
        parallel::parts(self.known.len(), |part| {
            let mut left = AT_ONCE.1 / self.known.len().max(1) * part.len();
            let (mut seen, mut list) = (vec![u32::MAX; quadrics.len()], Vec::new());
            for triangle in part {
                let is_new = marking(&mut seen, triangle);
                self.gather(quadrics, triangle, |q| self.reach_mm(q), is_new, &mut list);
                self.known[triangle].get_or_init(|| list.as_slice().into());
                if list.len() > left {
                    break;
                }
                left -= list.len();
            }
        });
    }

    /// The list of a triangle; its corners come first.
    #[inline]
    pub(super) fn of(&self, quadrics: &[Quadric], triangle: usize) -> &[u32] {
        self.known[triangle].get_or_init(|| {
            // Only used for lookups, never iterated: its order cannot affect the result.
            let mut seen = FxHashSet::default();
            let mut list = Vec::new();
            self.gather(quadrics, triangle, |q| self.reach_mm(q), |v| seen.insert(v), &mut list);
            list.into_boxed_slice()
        })
    }

    /// Largest distance from a triangle of a vertex that reaches points over it, mm.
    fn reach_mm(&self, q: &Quadric) -> f64 {
        q.half_axes_mm.1 + self.height_mm.max(HEIGHT.1 * q.half_axes_mm.0)
    }

    /// Adds to `list` the vertices that reach points of a triangle itself in front of the surface, for triangle after
    /// triangle: `seen` stores for every vertex the last triangle that met it, initially [`u32::MAX`].
    pub(super) fn touching(
        &self,
        quadrics: &[Quadric],
        triangle: usize,
        seen: &mut [u32],
        list: &mut Vec<u32>,
    ) {
        self.gather(quadrics, triangle, |q| q.farthest_mm, marking(seen, triangle), list);
    }

    /// The vertices within their `reach` of a triangle along the surface, not through space: the other side of a thin
    /// septum is another wall.
    fn gather(
        &self,
        quadrics: &[Quadric],
        triangle: usize,
        reach: impl Fn(&Quadric) -> f64,
        mut is_new: impl FnMut(u32) -> bool,
        list: &mut Vec<u32>,
    ) {
        list.clear();
        let corners = self.triangles[triangle];
        let places = corners.map(|v| quadrics[v as usize].position);
        let centre: Vec3 = (places[0] + places[1] + places[2]) / 3.0;
        let size = places.iter().map(|c| (c - centre).norm()).fold(0.0, f64::max);
        let reaches = |v: u32| {
            let q = &quadrics[v as usize];
            (q.position - centre).norm() <= reach(q) + size
        };
        list.extend(corners.into_iter().filter(|&v| is_new(v) && reaches(v)));
        let mut next = 0;
        while let Some(&v) = list.get(next) {
            list.extend(self.neighbours.of(v).iter().copied().filter(|&w| is_new(w) && reaches(w)));
            next += 1;
        }
    }
}

/// Whether a vertex is met for the first time from a triangle, for triangle after triangle.
fn marking(seen: &mut [u32], triangle: usize) -> impl FnMut(u32) -> bool {
    let mark = triangle as u32;
    move |v| std::mem::replace(&mut seen[v as usize], mark) != mark
}

#[cfg(test)]
mod tests {
    use crate::contact::SmoothWall;
    use crate::vessel::{GeneratedWall, Resolution, anatomy};

    #[test]
    fn lists_are_the_same_whoever_asks_first_and_begin_with_the_corners() {
        let tree = anatomy::tree("aortic_arch").unwrap();
        let wall = GeneratedWall::new(&tree, Resolution::EdgeMm(3.0)).unwrap().wall;
        let (mut one, other) = (SmoothWall::new(&wall, 0.5), SmoothWall::new(&wall, 0.5));
        one.lists.known.iter_mut().for_each(|list| *list = std::sync::OnceLock::new());
        let triangles = wall.mesh().triangles.len();
        let length = |t: usize| one.list(t).len();
        std::thread::scope(|scope| {
            let upwards = scope.spawn(|| (0..triangles).map(length).sum::<usize>());
            let downwards: usize = (0..triangles).rev().map(length).sum();
            assert_eq!(upwards.join().unwrap(), downwards);
        });
        for t in (0..triangles).map(|t| 7 * t % triangles) {
            assert_eq!(one.list(t), other.list(t));
            assert_eq!(one.list(t)[..3], wall.mesh().triangles[t]);
        }
    }

    #[test]
    fn on_a_triangle_no_other_vertex_counts_than_those_that_touch_it() {
        let tree = anatomy::tree("curved_tube").unwrap();
        let wall = GeneratedWall::new(&tree, Resolution::EdgeMm(1.5)).unwrap().wall;
        let smooth = SmoothWall::new(&wall, 0.5);
        let mut seen = vec![u32::MAX; wall.mesh().vertices_mm.len()];
        let mut near = Vec::new();
        for t in 0..wall.mesh().triangles.len() {
            smooth.lists.touching(&smooth.quadrics, t, &mut seen, &mut near);
            assert!(near.len() < smooth.list(t).len());
            for x in super::super::few(wall.mesh(), t) {
                let of = |list: &[u32]| smooth.reach_from(&x, list, None).unwrap().value_mm;
                assert!((of(&near) - of(smooth.list(t))).abs() < 1e-15);
            }
        }
    }
}
