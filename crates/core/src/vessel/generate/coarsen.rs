//! Fewer triangles where the vessel is wide.
//!
//! One grid spacing for a tree of thick and thin vessels is either too coarse for the thin ones or wasteful on the thick ones. So
//! the grid resolves the thinnest, and edges shorter than a local target are then collapsed, edges flipped towards vertices of six
//! neighbours, and vertices evened out and projected back: Botsch and Kobbelt, "A remeshing approach to multiresolution modeling",
//! SGP 2004, without the splits. Rims keep to their plane. All orders are fixed, so the result is deterministic.

use std::collections::BTreeMap;

use super::nets::Nets;
use super::trim::{End, onto_rim};
use super::{Field, project};
use crate::vessel::SurfaceMesh;
use crate::vessel::mesh::retain_numbered;
use crate::vessel::topology::{EdgeTable, NONE};
use crate::{Vec3, parallel};

/// Rounds of collapsing, flipping and evening out. Later rounds find next to nothing to collapse.
const ROUNDS: usize = 6;
/// Passes of collapses within a round; each pass collapses edges that do not touch each other.
const PASSES: usize = 12;
/// Edges shorter than this fraction of the target go, and none longer than that fraction may arise (Botsch and Kobbelt: 4/5, 4/3).
const SHORT: f64 = 0.8;
/// Where the grid is as coarse as wanted, one round takes out only the stumps that cuts and grazing cells leave.
const STUMP: f64 = 0.45;
const LONG: f64 = 1.4;
/// Cosine by which a triangle may turn in a collapse or flip.
const LEAST_COSINE: f64 = 0.8;

pub(super) struct Coarsener<'a> {
    pub(super) field: &'a Field,
    pub(super) nets: &'a Nets,
    pub(super) ends: &'a [End],
    /// Largest edge, mm.
    pub(super) edge: f64,
}

/// What is kept per vertex.
#[derive(Clone, Copy)]
struct Vertex {
    /// Which end's rim it is on.
    rim: Option<usize>,
    /// Wanted edge length, mm.
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
            for _ in 0..PASSES {
                if self.collapse(mesh, &mut info, short) == 0 {
                    break;
                }
            }
            flip(mesh, &info);
            self.even_out(mesh, &mut info);
        }
    }

    /// Wanted edge length near a point of the surface.
    fn target(&self, point: &Vec3) -> f64 {
        let radius = self.nets.with_local(self.field, point, |local| self.field.value(local, point)).radius;
        super::local_edge(self.edge, radius)
    }

    fn end_near(&self, point: &Vec3) -> Option<usize> {
        let distance = |k: &usize| (self.ends[*k].centre - point).norm();
        (0..self.ends.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }

    /// The place on the surface, or on its rim, next to `point`, and the edge length wanted there.
    fn settle(&self, mut point: Vec3, rim: Option<usize>) -> (Vec3, f64) {
        let edge = self.nets.edge;
        let value = self.nets.with_local(self.field, &point.clone(), |local| match rim {
            Some(end) => {
                point = onto_rim(self.field, local, &self.ends[end], point, edge);
                None
            }
            None => project(self.field, local, &mut point, edge),
        });
        let target = match value {
            Some(value) => super::local_edge(self.edge, value.radius),
            None => self.target(&point),
        };
        (point, target)
    }

    /// One pass of collapses, shortest edges (relative to their target) first; returns how many.
    fn collapse(&self, mesh: &mut SurfaceMesh, info: &mut [Vertex], shortest: f64) -> usize {
        let around = triangles_around(mesh);
        let mut short: Vec<(f64, u32, u32, bool)> = EdgeTable::new(&mesh.triangles)
            .edges()
            .map(|uses| (uses[0].low, uses[0].high, uses.len() == 1))
            .filter_map(|(a, b, open)| {
                let wanted = info[a as usize].target.min(info[b as usize].target);
                let length = (mesh.vertices_mm[a as usize] - mesh.vertices_mm[b as usize]).norm();
                (length < shortest * wanted).then_some((length / wanted, a, b, open))
            })
            .collect();
        short.sort_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
        let mut touched = vec![false; mesh.vertices_mm.len()];
        let mut gone = vec![false; mesh.triangles.len()];
        let mut count = 0;
        for (_, a, b, open) in short {
            let (rim_a, rim_b) = (info[a as usize].rim, info[b as usize].rim);
            if rim_a.is_some() && rim_b.is_some() && !open {
                continue;
            }
            let ring: Vec<u32> = around[a as usize].iter().chain(&around[b as usize]).copied().collect();
            let used = |t: &u32| mesh.triangles[*t as usize].iter().any(|v| touched[*v as usize]);
            if ring.iter().any(used) || !link_is_simple(mesh, &around, a, b, open) {
                continue;
            }
            // A rim is not pulled inwards.
            let (pa, pb) = (mesh.vertices_mm[a as usize], mesh.vertices_mm[b as usize]);
            let start = match (rim_a, rim_b) {
                (Some(_), None) => pa,
                (None, Some(_)) => pb,
                _ => (pa + pb) / 2.0,
            };
            let (position, target) = self.settle(start, rim_a.or(rim_b));
            if !stays_sound(mesh, &ring, [a, b], &position, target) {
                continue;
            }
            for t in ring {
                for v in mesh.triangles[t as usize] {
                    touched[v as usize] = true;
                }
                gone[t as usize] |=
                    mesh.triangles[t as usize].contains(&a) && mesh.triangles[t as usize].contains(&b);
                let triangle = &mut mesh.triangles[t as usize];
                *triangle = triangle.map(|v| if v == b { a } else { v });
            }
            mesh.vertices_mm[a as usize] = position;
            info[a as usize] = Vertex { rim: rim_a.or(rim_b), target };
            count += 1;
        }
        retain_numbered(&mut mesh.triangles, |index, _| !gone[index]);
        count
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

/// Whether collapsing a–b keeps the surface a manifold: the two have only the neighbours in common that their triangles show.
fn link_is_simple(mesh: &SurfaceMesh, around: &[Vec<u32>], a: u32, b: u32, open: bool) -> bool {
    let neighbours = |v: u32| {
        let all =
            around[v as usize].iter().flat_map(|t| mesh.triangles[*t as usize]).filter(move |w| *w != v);
        all.collect::<std::collections::BTreeSet<u32>>()
    };
    neighbours(a).intersection(&neighbours(b)).count() == if open { 1 } else { 2 }
}

/// Whether the triangles around a collapsed edge keep their direction, get no long edge and no sharp corner.
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
    let mut exists: BTreeMap<(u32, u32), ()> = BTreeMap::new();
    for uses in table.edges() {
        valence[uses[0].low as usize] += 1;
        valence[uses[0].high as usize] += 1;
        exists.insert((uses[0].low, uses[0].high), ());
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
        if gain <= 0 || exists.contains_key(&(c.min(d), c.max(d))) {
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
        exists.remove(&(a.min(b), a.max(b)));
        exists.insert((c.min(d), c.max(d)), ());
        for (v, change) in [(a, -1), (b, -1), (c, 1), (d, 1)] {
            valence[v as usize] += change;
        }
    }
}
