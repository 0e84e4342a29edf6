//! Fewer triangles where the vessel is wide.
//!
//! One grid spacing for a tree of thick and thin vessels is either too coarse for the thin ones or wasteful on the
//! thick ones. So the grid resolves the thinnest, then edges shorter than a local target are collapsed, edges flipped
//! towards vertices of six neighbours, and vertices smoothed and projected back: Botsch and Kobbelt, "A remeshing
//! approach to multiresolution modeling", SGP 2004, without the splits. Rims stay in their plane. All orders are
//! fixed, so the result is deterministic.

use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap};

use super::nets::Nets;
use super::trim::{End, onto_rim};
use super::{Field, approach, project};
use crate::vessel::SurfaceMesh;
use crate::vessel::mesh::retain_numbered;
use crate::vessel::topology::{EdgeTable, NONE};
use crate::{Vec3, parallel};

/// Number of rounds of collapsing, flipping and smoothing. Later rounds find almost nothing to collapse.
const ROUNDS: usize = 6;
/// Edges shorter than this fraction of the target are collapsed, unless one longer than `LONG` times the target
/// results (Botsch and Kobbelt: 4/5, 4/3).
const SHORT: f64 = 0.8;
/// Fraction of the target used if the grid has the target resolution: one round then removes only the short edges of
/// cuts and grazing cells.
const STUMP: f64 = 0.45;
const LONG: f64 = 1.4;
/// Smallest cosine of the angle by which a triangle may rotate in a collapse or flip.
const LEAST_COSINE: f64 = 0.8;

pub(super) struct Coarsener<'a> {
    pub(super) field: &'a Field,
    pub(super) nets: &'a Nets,
    pub(super) ends: &'a [End],
    /// Largest edge, mm.
    pub(super) edge: f64,
}

/// Data per vertex.
#[derive(Clone, Copy)]
struct Vertex {
    /// The end whose rim it is on.
    rim: Option<usize>,
    /// Target edge length, mm.
    target: f64,
}

impl Coarsener<'_> {
    /// Coarsens `mesh`. Vertices with a height of zero over an end are its rim.
    pub(super) fn run(&self, mesh: &mut SurfaceMesh) {
        let mut open = vec![false; mesh.vertices_mm.len()];
        for (t, sides) in EdgeTable::new(&mesh.triangles).neighbours(mesh.triangles.len()).iter().enumerate()
        {
            for side in (0..3).filter(|&side| sides[side] == NONE) {
                open[mesh.triangles[t][side] as usize] = true;
                open[mesh.triangles[t][(side + 1) % 3] as usize] = true;
            }
        }
        let mut info: Vec<Vertex> = mesh
            .vertices_mm
            .iter()
            .zip(&open)
            .map(|(v, &open)| Vertex {
                rim: if open { self.end_near(v) } else { None },
                target: self.target(v),
            })
            .collect();
        let (rounds, short) = if self.nets.edge < self.edge { (ROUNDS, SHORT) } else { (1, STUMP) };
        for _ in 0..rounds {
            self.collapse(mesh, &mut info, short);
            flip(mesh, &info);
            self.even_out(mesh, &mut info);
        }
        mesh.vertices_mm = parallel::map(info.len(), |index| {
            let mut v = mesh.vertices_mm[index];
            if info[index].rim.is_none() {
                self.nets.with_local(self.field, &v.clone(), |local| {
                    project(self.field, local, &mut v, self.nets.edge);
                });
            }
            v
        });
    }

    /// Target edge length near a point of the surface.
    fn target(&self, point: &Vec3) -> f64 {
        let radius = self.nets.with_local(self.field, point, |local| self.field.value(local, point)).radius;
        super::local_edge(self.edge, radius)
    }

    fn end_near(&self, point: &Vec3) -> Option<usize> {
        let distance = |k: &usize| (self.ends[*k].centre - point).norm();
        (0..self.ends.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }

    /// The position on the surface, or on its rim, near `point`, and the target edge length there.
    fn settle(&self, mut point: Vec3, rim: Option<usize>) -> (Vec3, f64) {
        let edge = self.nets.edge;
        let radius = self.nets.with_local(self.field, &point.clone(), |local| match rim {
            Some(end) => {
                point = onto_rim(self.field, local, &self.ends[end], point, edge);
                self.ends[end].radius
            }
            None => approach(self.field, local, &mut point, edge).radius,
        });
        (point, super::local_edge(self.edge, radius))
    }

    /// Collapses edges, the shortest (relative to their target) first.
    fn collapse(&self, mesh: &mut SurfaceMesh, info: &mut [Vertex], shortest: f64) {
        let mut around = triangles_around(mesh);
        let mut gone = vec![false; mesh.triangles.len()];
        // Number of moves of each vertex: queued edges from before a move are obsolete.
        let mut moved = vec![0_u32; mesh.vertices_mm.len()];
        let short = |mesh: &SurfaceMesh, info: &[Vertex], moved: &[u32], a: u32, b: u32| {
            let wanted = info[a as usize].target.min(info[b as usize].target);
            let part = (mesh.vertices_mm[a as usize] - mesh.vertices_mm[b as usize]).norm() / wanted;
            // Positive numbers have the order of their bits.
            (part < shortest).then(|| Reverse((part.to_bits(), a, b, moved[a as usize], moved[b as usize])))
        };
        let table = EdgeTable::new(&mesh.triangles);
        let mut queue: BinaryHeap<_> =
            table.edges().filter_map(|uses| short(mesh, info, &moved, uses[0].low, uses[0].high)).collect();
        let (mut ring, mut next) = (Vec::new(), Vec::new());
        while let Some(Reverse((_, a, b, moved_a, moved_b))) = queue.pop() {
            if (moved[a as usize], moved[b as usize]) != (moved_a, moved_b) {
                continue;
            }
            let both = |t: &u32| mesh.triangles[*t as usize].contains(&b);
            let open = around[a as usize].iter().filter(|t| both(t)).count() == 1;
            let (rim_a, rim_b) = (info[a as usize].rim, info[b as usize].rim);
            if rim_a.is_some() && rim_b.is_some() && !open {
                continue;
            }
            ring.clear();
            ring.extend(
                around[a as usize]
                    .iter()
                    .chain(around[b as usize].iter().filter(|t| !mesh.triangles[**t as usize].contains(&a))),
            );
            // A rim is not pulled inwards.
            let (pa, pb) = (mesh.vertices_mm[a as usize], mesh.vertices_mm[b as usize]);
            let start = match (rim_a, rim_b) {
                (Some(_), None) => pa,
                (None, Some(_)) => pb,
                _ => (pa + pb) / 2.0,
            };
            // Projection takes longest: what is invalid near the surface is invalid on it.
            let wanted = info[a as usize].target.max(info[b as usize].target);
            if !stays_sound(mesh, &ring, [a, b], &start, wanted) || !link_is_simple(mesh, &around, a, b, open)
            {
                continue;
            }
            let (position, target) = self.settle(start, rim_a.or(rim_b));
            if !stays_sound(mesh, &ring, [a, b], &position, target) {
                continue;
            }
            for t in &ring {
                let triangle = &mut mesh.triangles[*t as usize];
                if triangle.contains(&a) && triangle.contains(&b) {
                    gone[*t as usize] = true;
                    triangle.iter().for_each(|v| around[*v as usize].retain(|other| other != t));
                }
                *triangle = triangle.map(|v| if v == b { a } else { v });
            }
            ring.retain(|t| !gone[*t as usize]);
            around[b as usize].clear();
            around[a as usize].clone_from(&ring);
            mesh.vertices_mm[a as usize] = position;
            info[a as usize] = Vertex { rim: rim_a.or(rim_b), target };
            moved[a as usize] += 1;
            moved[b as usize] += 1;
            next.clear();
            next.extend(ring.iter().flat_map(|t| mesh.triangles[*t as usize]).filter(|v| *v != a));
            next.sort_unstable();
            next.dedup();
            queue.extend(next.iter().filter_map(|&v| short(mesh, info, &moved, a.min(v), a.max(v))));
        }
        retain_numbered(&mut mesh.triangles, |index, _| !gone[index]);
    }

    /// Moves each vertex halfway to the mean of its neighbours, rim vertices to the mean of those on the rim.
    fn even_out(&self, mesh: &mut SurfaceMesh, info: &mut [Vertex]) {
        let mut sum = vec![(Vec3::zeros(), 0.0); mesh.vertices_mm.len()];
        for uses in EdgeTable::new(&mesh.triangles).edges() {
            let (a, b) = (uses[0].low as usize, uses[0].high as usize);
            for (from, to) in [(a, b), (b, a)] {
                if info[from].rim.is_none() || uses.len() == 1 {
                    sum[from].0 += mesh.vertices_mm[to];
                    sum[from].1 += 1.0;
                }
            }
        }
        let settled = parallel::map(sum.len(), |index| {
            let ((sum, count), v) = (sum[index], mesh.vertices_mm[index]);
            (count > 0.0).then(|| self.settle(v + 0.5 * (sum / count - v), info[index].rim))
        });
        for (index, settled) in settled.into_iter().enumerate() {
            if let Some(settled) = settled {
                (mesh.vertices_mm[index], info[index].target) = settled;
            }
        }
    }
}

fn triangles_around(mesh: &SurfaceMesh) -> Vec<Vec<u32>> {
    let mut around = vec![Vec::new(); mesh.vertices_mm.len()];
    for (index, triangle) in mesh.triangles.iter().enumerate() {
        for v in triangle {
            around[*v as usize].push(index as u32);
        }
    }
    around
}

/// Whether collapsing a–b keeps the surface a manifold: the two share only the neighbours in their common triangles.
fn link_is_simple(mesh: &SurfaceMesh, around: &[Vec<u32>], a: u32, b: u32, open: bool) -> bool {
    let neighbours = |v: u32| {
        let mut all: Vec<u32> = Vec::with_capacity(2 * around[v as usize].len());
        all.extend(around[v as usize].iter().flat_map(|t| mesh.triangles[*t as usize]).filter(|w| *w != v));
        all.sort_unstable();
        all.dedup();
        all
    };
    let of_b = neighbours(b);
    neighbours(a).iter().filter(|v| of_b.binary_search(v).is_ok()).count() == if open { 1 } else { 2 }
}

/// Whether the triangles around a collapsed edge keep their direction, without long edges or sharp corners.
fn stays_sound(mesh: &SurfaceMesh, ring: &[u32], ends: [u32; 2], position: &Vec3, target: f64) -> bool {
    ring.iter().all(|&t| {
        let triangle = mesh.triangles[t as usize];
        if ends.iter().all(|end| triangle.contains(end)) {
            return true;
        }
        let before = triangle.map(|v| mesh.vertices_mm[v as usize]);
        let moved = |k: usize| if ends.contains(&triangle[k]) { *position } else { before[k] };
        let after = [moved(0), moved(1), moved(2)];
        let longest = (0..3).map(|k| (after[k] - after[(k + 1) % 3]).norm()).fold(0.0, f64::max);
        longest < LONG * target && agree(&before, &after) && quality(&after) > 0.3
    })
}

fn normal(t: &[Vec3; 3]) -> Vec3 {
    (t[1] - t[0]).cross(&(t[2] - t[0])).try_normalize(0.0).unwrap_or_default()
}

fn agree(before: &[Vec3; 3], after: &[Vec3; 3]) -> bool {
    normal(before).dot(&normal(after)) > LEAST_COSINE
}

/// Twice the ratio of inscribed to circumscribed radius: 1 for equilateral, 0 for degenerate triangles.
fn quality(t: &[Vec3; 3]) -> f64 {
    let [a, b, c] = [(t[1] - t[0]).norm(), (t[2] - t[1]).norm(), (t[0] - t[2]).norm()];
    (a + b - c) * (b + c - a) * (c + a - b) / (a * b * c).max(f64::MIN_POSITIVE)
}

/// Flips edges where that brings the valences nearer to 6 (4 on a rim).
fn flip(mesh: &mut SurfaceMesh, info: &[Vertex]) {
    let table = EdgeTable::new(&mesh.triangles);
    let mut valence = vec![0_i64; mesh.vertices_mm.len()];
    // Edges no longer, or not yet, in the table.
    let (mut flipped, mut made) = (BTreeSet::new(), BTreeSet::new());
    for uses in table.edges() {
        valence[uses[0].low as usize] += 1;
        valence[uses[0].high as usize] += 1;
    }
    let mut touched = vec![false; mesh.triangles.len()];
    for uses in table.edges() {
        let [first, second] = uses else { continue };
        let (s, t) = (first.triangle as usize, second.triangle as usize);
        if touched[s] || touched[t] {
            continue;
        }
        let side = first.side as usize;
        let [a, b, c] = [0, 1, 2].map(|k| mesh.triangles[s][(side + k) % 3]);
        let d = mesh.triangles[t][(second.side as usize + 2) % 3];
        let excess = |v: u32, change: i64| {
            let ideal = if info[v as usize].rim.is_some() { 4 } else { 6 };
            (valence[v as usize] + change - ideal).pow(2)
        };
        let gain =
            [(a, -1), (b, -1), (c, 1), (d, 1)].iter().map(|&(v, k)| excess(v, 0) - excess(v, k)).sum::<i64>();
        let across = (c.min(d), c.max(d));
        let exists =
            || made.contains(&across) || (!flipped.contains(&across) && !table.uses(c, d).is_empty());
        if gain <= 0 || exists() {
            continue;
        }
        let at = |t: [u32; 3]| t.map(|v| mesh.vertices_mm[v as usize]);
        let (old, new) = ([at([a, b, c]), at([b, a, d])], [[a, d, c], [d, b, c]]);
        let sound = |n: [u32; 3]| old.iter().all(|o| agree(o, &at(n))) && quality(&at(n)) > 0.3;
        if !new.into_iter().all(sound) {
            continue;
        }
        (mesh.triangles[s], mesh.triangles[t]) = (new[0], new[1]);
        (touched[s], touched[t]) = (true, true);
        let before = (a.min(b), a.max(b));
        made.remove(&before);
        flipped.insert(before);
        made.insert(across);
        for (v, change) in [(a, -1), (b, -1), (c, 1), (d, 1)] {
            valence[v as usize] += change;
        }
    }
}
