//! A hierarchy of boxes about triangles that is quickly built.
//!
//! Triangles are sorted along a space-filling curve (Morton), and a binary tree of boxes is built over that order: this takes one
//! sort, and neighbours are adjacent. For many queries that of [`super::WallQuery`] is worth its longer building.

use super::SurfaceMesh;
use super::intersect::ray_meets;
use super::query::distance_to_triangle;
use crate::Vec3;

/// Triangles in a leaf of the tree.
pub(super) const LEAF: usize = 4;

pub(super) struct Tree {
    /// Triangles in the order of the curve.
    pub(super) order: Vec<u32>,
    /// Bounds of the triangles, in the order of the curve.
    pub(super) boxes: Vec<[Vec3; 2]>,
    /// Bounds of the nodes: node k has children 2k and 2k + 1, leaves begin at `leaves`.
    pub(super) nodes: Vec<[Vec3; 2]>,
    pub(super) leaves: usize,
}

const EMPTY: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

fn join(a: [Vec3; 2], b: &[Vec3; 2]) -> [Vec3; 2] {
    [a[0].inf(&b[0]), a[1].sup(&b[1])]
}

pub(super) fn meet(a: &[Vec3; 2], b: &[Vec3; 2]) -> bool {
    (0..3).all(|k| a[0][k] <= b[1][k] && b[0][k] <= a[1][k])
}

/// How far away a ray enters a box, with the inverse of its direction; infinite for one that it misses, or an empty one.
fn entry_mm([low, high]: &[Vec3; 2], from: &Vec3, per_way: &Vec3) -> f64 {
    if low.x > high.x {
        return f64::INFINITY;
    }
    let (low, high) = ((low - from).component_mul(per_way), (high - from).component_mul(per_way));
    let (mut begin, mut end) = (0.0_f64, f64::INFINITY);
    for (low, high) in low.iter().zip(&high) {
        // A ray in the plane of a side, which has no number there, is between the two.
        if !(low.is_nan() || high.is_nan()) {
            (begin, end) = (begin.max(low.min(*high)), end.min(low.max(*high)));
        }
    }
    if begin <= end { begin } else { f64::INFINITY }
}

impl Tree {
    pub(super) fn new(mesh: &SurfaceMesh, mut members: Vec<u32>) -> Self {
        let bounds = |corners: [Vec3; 3]| {
            let [a, b, c] = corners;
            [a.inf(&b).inf(&c), a.sup(&b).sup(&c)]
        };
        let boxes: Vec<[Vec3; 2]> = (0..mesh.triangles.len()).map(|i| bounds(mesh.corners(i))).collect();
        let empty = [Vec3::repeat(EMPTY[0]), Vec3::repeat(EMPTY[1])];
        let all = members.iter().fold(empty, |all, i| join(all, &boxes[*i as usize]));
        let scale =
            (all[1] - all[0]).map(|side| if side > 0.0 { f64::from((1 << 20) - 1) / side } else { 0.0 });
        let code = |i: u32| {
            let [low, high] = boxes[i as usize];
            let cell = ((low + high) / 2.0 - all[0]).component_mul(&scale);
            spread(cell.x as u64) | spread(cell.y as u64) << 1 | spread(cell.z as u64) << 2
        };
        let mut keyed: Vec<(u64, u32)> = members.drain(..).map(|i| (code(i), i)).collect();
        keyed.sort_unstable();
        let order: Vec<u32> = keyed.into_iter().map(|(_, i)| i).collect();
        let boxes: Vec<[Vec3; 2]> = order.iter().map(|i| boxes[*i as usize]).collect();
        let leaves = order.len().div_ceil(LEAF).next_power_of_two();
        let mut nodes = vec![empty; 2 * leaves];
        for (leaf, inside) in boxes.chunks(LEAF).enumerate() {
            nodes[leaves + leaf] = inside.iter().fold(empty, join);
        }
        for node in (1..leaves).rev() {
            nodes[node] = join(nodes[2 * node], &nodes[2 * node + 1]);
        }
        Self { order, boxes, nodes, leaves }
    }

    /// Adds to `close` the leaves from `first` on whose bounds overlap those of leaf `of`.
    pub(super) fn close_to(
        &self,
        of: usize,
        first: usize,
        stack: &mut Vec<(usize, usize)>,
        close: &mut Vec<usize>,
    ) {
        let bounds = &self.nodes[self.leaves + of];
        stack.clear();
        close.clear();
        // Node, and one past its last leaf.
        stack.push((1, self.leaves));
        while let Some((node, end)) = stack.pop() {
            if end <= first || !meet(bounds, &self.nodes[node]) {
                continue;
            }
            if node < self.leaves {
                // The width of a node's span is that of its level.
                let width = self.leaves >> node.ilog2();
                stack.push((2 * node + 1, end));
                stack.push((2 * node, end - width / 2));
            } else {
                close.push(end - 1);
            }
        }
    }

    /// The first hit of a ray on a triangle of `mesh`, up to `reach_mm` along the unit vector `way`: its distance, mm, and the
    /// triangle.
    pub(super) fn first_met(
        &self,
        mesh: &SurfaceMesh,
        from: &Vec3,
        way: &Vec3,
        reach_mm: f64,
    ) -> Option<(f64, u32)> {
        let per_way = way.map(|c| 1.0 / c);
        let entry_mm = |bounds: &[Vec3; 2]| entry_mm(bounds, from, &per_way);
        self.least(reach_mm, entry_mm, |t| ray_meets(from, way, mesh.corners(t as usize)))
    }

    /// Distance of a position from the nearest triangle of `mesh`, mm; `None` without any.
    pub(super) fn distance_mm(&self, mesh: &SurfaceMesh, x: &Vec3) -> Option<f64> {
        let gap_mm = |[low, high]: &[Vec3; 2]| (low - x).sup(&(x - high)).sup(&Vec3::zeros()).norm();
        let to = |t: u32| Some(distance_to_triangle(&mesh.corners(t as usize), x));
        self.least(f64::INFINITY, gap_mm, to).map(|(mm, _)| mm)
    }

    /// The triangle of the least value up to `most`, with a lower bound of the values in a box.
    fn least(
        &self,
        most: f64,
        bound: impl Fn(&[Vec3; 2]) -> f64,
        value: impl Fn(u32) -> Option<f64>,
    ) -> Option<(f64, u32)> {
        let mut best: Option<(f64, u32)> = None;
        let mut stack = vec![(bound(&self.nodes[1]), 1)];
        while let Some((least, node)) = stack.pop() {
            let limit = best.map_or(most, |(value, _)| value);
            if least > limit || least == f64::INFINITY {
                continue;
            }
            if node < self.leaves {
                let bounded = |child: usize| (bound(&self.nodes[child]), child);
                let (first, second) = (bounded(2 * node), bounded(2 * node + 1));
                // The nearer half first.
                stack.extend(if first.0 > second.0 { [first, second] } else { [second, first] });
                continue;
            }
            for (_, t) in self.leaf(node - self.leaves) {
                let limit = best.map_or(most, |(value, _)| value);
                best = value(t).filter(|value| *value <= limit).map(|value| (value, t)).or(best);
            }
        }
        best
    }

    /// The triangles of a leaf, each with its position in the order.
    pub(super) fn leaf(&self, leaf: usize) -> impl Iterator<Item = (usize, u32)> {
        let first = (leaf * LEAF).min(self.order.len());
        let end = (first + LEAF).min(self.order.len());
        (first..end).zip(self.order[first..end].iter().copied())
    }
}

/// The lower 20 bits, with two zeros between each.
fn spread(bits: u64) -> u64 {
    let mut x = bits & 0x1f_ffff;
    x = (x | x << 32) & 0x001f_0000_0000_ffff;
    x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{splitmix64, unit};
    use crate::vessel::{GeneratedWall, Resolution, WallQuery, anatomy};

    #[test]
    fn no_ray_enters_an_empty_box_or_one_beside_it() {
        let empty = [Vec3::repeat(EMPTY[0]), Vec3::repeat(EMPTY[1])];
        let per_way = Vec3::new(1.0, f64::INFINITY, f64::INFINITY);
        assert_eq!(entry_mm(&empty, &Vec3::zeros(), &per_way), f64::INFINITY);
        let at = |y: f64| [Vec3::new(2.0, y, -1.0), Vec3::new(3.0, y + 1.0, 1.0)];
        assert_eq!(entry_mm(&at(-0.5), &Vec3::zeros(), &per_way), 2.0);
        assert_eq!(entry_mm(&at(0.0), &Vec3::zeros(), &per_way), 2.0);
        assert_eq!(entry_mm(&at(0.5), &Vec3::zeros(), &per_way), f64::INFINITY);
    }

    #[test]
    fn rays_meet_the_wall_where_its_query_says() {
        let tree = anatomy::tree("aortic_arch").unwrap();
        let wall = GeneratedWall::new(&tree, Resolution::EdgeMm(4.0)).unwrap().wall;
        let (mesh, query) = (wall.mesh(), WallQuery::new(&wall).unwrap());
        let boxes = Tree::new(mesh, (0..mesh.triangles.len() as u32).collect());
        let (mut met, mut missed) = (0, 0);
        for k in 0..2000_u64 {
            let number = |n| unit(splitmix64(11, 8 * k + n)) - 0.5;
            let from = mesh.middle(k as usize % mesh.triangles.len())
                + Vec3::new(number(0), number(1), number(2)) * 20.0;
            let mut way = Vec3::new(number(3), number(4), number(5));
            if k % 5 == 0 {
                way[k as usize % 3] = 0.0;
            }
            let (way, reach_mm) = (way.normalize(), 100.0 * (number(6) + 0.5));
            let found = boxes.first_met(mesh, &from, &way, reach_mm).map(|(mm, _)| mm);
            let expected = query.first_met(&from, &way, reach_mm).map(|(mm, _)| mm);
            assert_eq!(found.is_some(), expected.is_some(), "{from} {way}");
            let off_mm = found.zip(expected).map_or(0.0, |(a, b)| (a - b).abs());
            assert!(off_mm < 1e-9, "{from} {way}: {found:?} {expected:?}");
            *(if found.is_some() { &mut met } else { &mut missed }) += 1;
            let nearest = query.nearest(&from, f64::MAX).unwrap().distance_mm.abs();
            assert!((boxes.distance_mm(mesh, &from).unwrap() - nearest).abs() < 1e-9, "{from}");
        }
        assert!(met > 300 && missed > 300, "{met} met it, {missed} did not");
    }
}
