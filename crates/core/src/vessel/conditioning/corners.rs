//! An editable triangle mesh: a corner table.
//!
//! Half-edge `3t + k` runs from corner k of triangle t to the next; `twin` is the opposite one, or [`NONE`] where the
//! surface is open or not a manifold. Split, collapse and flip change a few entries and leave everything else
//! unchanged.

use crate::Vec3;
use crate::vessel::SurfaceMesh;
use crate::vessel::topology::{EdgeTable, NONE};

/// Permitted changes of a vertex.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// Inside the surface: any.
    Free,
    /// On the rim of an opening: it may be removed if the rim is straight there.
    Rim,
    /// On an edge of more than two triangles, or where two sheets touch: none.
    Locked,
}

/// Properties of a vertex.
#[derive(Debug, Clone, Copy)]
pub(super) struct Vertex {
    /// Its position on the given surface, mm.
    pub(super) at: Vec3,
    /// Outward unit normal of the mesh.
    pub(super) normal: Vec3,
    /// The triangle of the given surface it lies on.
    pub(super) place: u32,
    pub(super) kind: Kind,
    /// Target length of its edges, mm.
    pub(super) target_mm: f64,
    /// Local radius of the lumen, mm.
    pub(super) radius_mm: f64,
    /// Largest distance of the conditioned surface from the given one, mm.
    pub(super) limit_mm: f64,
}

/// The mesh being edited. Removed triangles have corners [`NONE`], removed vertices no half-edge.
#[derive(Debug, Clone)]
pub(super) struct Corners {
    pub(super) vertices: Vec<Vertex>,
    pub(super) triangles: Vec<[u32; 3]>,
    twin: Vec<u32>,
    out: Vec<u32>,
}

/// The half-edge after `e` in its triangle.
#[inline]
pub(super) fn next(e: u32) -> u32 {
    if e % 3 == 2 { e - 2 } else { e + 1 }
}

/// The half-edge before `e` in its triangle.
#[inline]
pub(super) fn previous(e: u32) -> u32 {
    if e.is_multiple_of(3) { e + 2 } else { e - 1 }
}

impl Corners {
    /// The table of `mesh`. Triangles with a repeated vertex are omitted.
    pub(super) fn new(mesh: &SurfaceMesh, deviation_mm: f64) -> Self {
        let sound = |t: &[u32; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
        let places: Vec<u32> =
            (0..mesh.triangles.len() as u32).filter(|&t| sound(&mesh.triangles[t as usize])).collect();
        let triangles: Vec<[u32; 3]> = places.iter().map(|&t| mesh.triangles[t as usize]).collect();
        let count = mesh.vertices_mm.len();
        let mut twin = vec![NONE; 3 * triangles.len()];
        let mut kinds = vec![Kind::Free; count];
        for uses in EdgeTable::new(&triangles).edges() {
            let half = |k: usize| 3 * uses[k].triangle + u32::from(uses[k].side);
            let ends = [uses[0].low as usize, uses[0].high as usize];
            if uses.len() == 2 && uses[0].forward != uses[1].forward {
                twin[half(0) as usize] = half(1);
                twin[half(1) as usize] = half(0);
            } else if uses.len() == 1 {
                for v in ends {
                    kinds[v] = if kinds[v] == Kind::Locked { Kind::Locked } else { Kind::Rim };
                }
            } else {
                ends.iter().for_each(|&v| kinds[v] = Kind::Locked);
            }
        }
        let mut out = vec![NONE; count];
        let mut fans = vec![0usize; count];
        let mut place = vec![0; count];
        for (t, triangle) in triangles.iter().enumerate() {
            for k in 0..3 {
                let v = triangle[k] as usize;
                out[v] = (3 * t + k) as u32;
                fans[v] += 1;
                place[v] = places[t];
            }
        }
        let vertex = |v: usize| Vertex {
            at: mesh.vertices_mm[v],
            normal: Vec3::zeros(),
            place: place[v],
            kind: kinds[v],
            target_mm: 0.0,
            radius_mm: 0.0,
            limit_mm: deviation_mm,
        };
        let vertices = (0..count).map(vertex).collect();
        let mut made = Self { vertices, triangles, twin, out };
        // If a walk around a vertex does not visit all its triangles, sheets touch.
        let mut spokes = Vec::new();
        for v in 0..count {
            made.spokes(v as u32, &mut spokes);
            if spokes.len() != fans[v] {
                made.vertices[v].kind = Kind::Locked;
            }
        }
        made
    }

    /// The mesh without removed parts; `at` gives the positions of vertices.
    pub(super) fn surface(&self, at: impl Fn(u32) -> Vec3) -> SurfaceMesh {
        let mut number = vec![NONE; self.vertices.len()];
        let mut mesh = SurfaceMesh::default();
        for t in self.triangles.iter().filter(|t| t[0] != NONE) {
            mesh.triangles.push(t.map(|v| {
                if number[v as usize] == NONE {
                    number[v as usize] = mesh.vertices_mm.len() as u32;
                    mesh.vertices_mm.push(at(v));
                }
                number[v as usize]
            }));
        }
        mesh
    }

    /// Drops removed parts, so that passes over all triangles stay short.
    pub(super) fn compact(&mut self) {
        let mut number = vec![NONE; self.vertices.len()];
        let mut vertices = Vec::new();
        let mut moved = vec![NONE; self.triangles.len()];
        let mut triangles = Vec::new();
        for (t, triangle) in self.triangles.iter().enumerate().filter(|(_, t)| t[0] != NONE) {
            moved[t] = triangles.len() as u32;
            triangles.push(triangle.map(|v| {
                if number[v as usize] == NONE {
                    number[v as usize] = vertices.len() as u32;
                    vertices.push(self.vertices[v as usize]);
                }
                number[v as usize]
            }));
        }
        let renamed = |e: u32| if e == NONE { NONE } else { 3 * moved[e as usize / 3] + e % 3 };
        let mut twin = Vec::with_capacity(3 * triangles.len());
        for t in (0..self.triangles.len()).filter(|&t| moved[t] != NONE) {
            twin.extend((0..3).map(|k| renamed(self.twin[3 * t + k])));
        }
        let mut out = vec![NONE; vertices.len()];
        for (v, &n) in number.iter().enumerate().filter(|(_, n)| **n != NONE) {
            out[n as usize] = renamed(self.out[v]);
        }
        *self = Self { vertices, triangles, twin, out };
    }

    pub(super) fn half_edges(&self) -> u32 {
        self.twin.len() as u32
    }

    /// Whether the triangle of a half-edge still exists.
    #[inline]
    pub(super) fn lives(&self, e: u32) -> bool {
        self.triangles[e as usize / 3][0] != NONE
    }

    /// Whether `e` represents its edge: the first of two twins does.
    #[inline]
    pub(super) fn leads(&self, e: u32) -> bool {
        self.lives(e) && (self.twin[e as usize] == NONE || e < self.twin[e as usize])
    }

    #[inline]
    pub(super) fn twin(&self, e: u32) -> u32 {
        self.twin[e as usize]
    }

    #[inline]
    pub(super) fn from(&self, e: u32) -> u32 {
        self.triangles[e as usize / 3][e as usize % 3]
    }

    #[inline]
    pub(super) fn to(&self, e: u32) -> u32 {
        self.from(next(e))
    }

    /// The corner opposite a half-edge.
    #[inline]
    pub(super) fn apex(&self, e: u32) -> u32 {
        self.from(previous(e))
    }

    #[inline]
    pub(super) fn at(&self, v: u32) -> Vec3 {
        self.vertices[v as usize].at
    }

    pub(super) fn length_mm(&self, e: u32) -> f64 {
        (self.at(self.to(e)) - self.at(self.from(e))).norm()
    }

    /// Mean of the target lengths at the two ends of an edge, mm.
    pub(super) fn target_mm(&self, e: u32) -> f64 {
        0.5 * (self.vertices[self.from(e) as usize].target_mm + self.vertices[self.to(e) as usize].target_mm)
    }

    pub(super) fn kind(&self, v: u32) -> Kind {
        self.vertices[v as usize].kind
    }

    /// Positions of a triangle's corners.
    pub(super) fn positions(&self, t: u32) -> [Vec3; 3] {
        self.triangles[t as usize].map(|v| self.at(v))
    }

    /// Half-edges that start at `v`, one for each triangle around it (of one sheet, where sheets touch).
    pub(super) fn spokes(&self, v: u32, list: &mut Vec<u32>) {
        list.clear();
        let start = self.out[v as usize];
        if start == NONE {
            return;
        }
        let mut e = start;
        loop {
            list.push(e);
            e = self.twin[previous(e) as usize];
            if e == start || list.len() > self.triangles.len() {
                return;
            }
            if e == NONE {
                break;
            }
        }
        e = self.twin[start as usize];
        while e != NONE && list.len() <= self.triangles.len() {
            e = next(e);
            list.push(e);
            e = self.twin[e as usize];
        }
    }

    /// Neighbours of `v`, given its spokes.
    pub(super) fn neighbours(&self, spokes: &[u32], list: &mut Vec<u32>) {
        list.clear();
        for &e in spokes {
            list.push(self.to(e));
            if self.twin[previous(e) as usize] == NONE {
                list.push(self.apex(e));
            }
        }
    }

    fn join(&mut self, e: u32, f: u32) {
        if e != NONE {
            self.twin[e as usize] = f;
        }
        if f != NONE {
            self.twin[f as usize] = e;
        }
    }

    fn add_triangle(&mut self, corners: [u32; 3]) -> u32 {
        self.triangles.push(corners);
        self.twin.extend([NONE; 3]);
        3 * (self.triangles.len() as u32 - 1)
    }

    /// Splits an edge at `vertex`.
    pub(super) fn split(&mut self, e: u32, vertex: Vertex) -> u32 {
        let m = self.vertices.len() as u32;
        self.vertices.push(vertex);
        let back = self.twin[e as usize];
        let first = self.halve(e, m);
        self.out.push(first);
        if back != NONE {
            let second = self.halve(back, m);
            self.join(e, second);
            self.join(back, first);
        }
        m
    }

    /// Splits the triangle of `e` at `m`, which lies on `e`; returns the half-edge from `m` to the old end of `e`.
    fn halve(&mut self, e: u32, m: u32) -> u32 {
        let (a, b, c) = (self.from(e), self.to(e), self.apex(e));
        let beyond = self.twin[next(e) as usize];
        let new = self.add_triangle([m, b, c]);
        self.triangles[e as usize / 3][next(e) as usize % 3] = m;
        self.join(new + 1, beyond);
        self.join(new + 2, next(e));
        self.out[a as usize] = e;
        self.out[b as usize] = new + 1;
        self.out[c as usize] = new + 2;
        new
    }

    /// Pulls vertex `from(e)` (or `to(e)`, if `onto_start`) onto the other end of `e`. The link condition must hold.
    pub(super) fn collapse(&mut self, e: u32, onto_start: bool, spokes_of_gone: &[u32]) {
        let (gone, kept) = if onto_start { (self.to(e), self.from(e)) } else { (self.from(e), self.to(e)) };
        for &s in spokes_of_gone {
            self.triangles[s as usize / 3][s as usize % 3] = kept;
        }
        self.out[gone as usize] = NONE;
        let back = self.twin[e as usize];
        for side in [e, back] {
            if side == NONE {
                continue;
            }
            let apex = self.apex(side);
            let (x, y) = (self.twin[next(side) as usize], self.twin[previous(side) as usize]);
            self.join(x, y);
            // One of x and y leaves the apex, the other the kept vertex.
            for leaving in
                [x, y, if x == NONE { NONE } else { next(x) }, if y == NONE { NONE } else { next(y) }]
            {
                if leaving != NONE {
                    let v = self.from(leaving);
                    if v == apex || v == kept {
                        self.out[v as usize] = leaving;
                    }
                }
            }
            self.triangles[side as usize / 3] = [NONE; 3];
        }
    }

    /// Whether collapsing `e` preserves the topology: its ends have only those neighbours in common that lie across
    /// it, and no triangle degenerates. `a` and `b` are the neighbours of its ends.
    pub(super) fn may_collapse(&self, e: u32, a: &[u32], b: &[u32]) -> bool {
        let back = self.twin[e as usize];
        let sides = if back == NONE { 1 } else { 2 };
        let common = a.iter().filter(|v| b.contains(v)).count();
        if common != sides || a.len() + b.len() < 4 + 2 * sides {
            return false;
        }
        [e, back].into_iter().filter(|&s| s != NONE).all(|s| {
            let (x, y) = (self.twin[next(s) as usize], self.twin[previous(s) as usize]);
            let apex = self.apex(s);
            // A corner of three triangles would have two left on the same vertices.
            let mut spokes = Vec::new();
            self.spokes(apex, &mut spokes);
            (x != NONE || y != NONE)
                && self.kind(apex) != Kind::Locked
                && spokes.len() > if self.kind(apex) == Kind::Rim { 1 } else { 3 }
        })
    }

    /// Flips the edge within its two triangles.
    pub(super) fn flip(&mut self, e: u32) {
        let back = self.twin[e as usize];
        let (a, b, c, d) = (self.from(e), self.to(e), self.apex(e), self.apex(back));
        let outer = [next(back), previous(back), next(e), previous(e)].map(|h| self.twin[h as usize]);
        let (s, t) = (e - e % 3, back - back % 3);
        self.triangles[s as usize / 3] = [a, d, c];
        self.triangles[t as usize / 3] = [b, c, d];
        self.join(s, outer[0]);
        self.join(t + 2, outer[1]);
        self.join(t, outer[2]);
        self.join(s + 2, outer[3]);
        self.join(s + 1, t + 1);
        for (v, leaving) in [(a, s), (d, s + 1), (c, s + 2), (b, t)] {
            self.out[v as usize] = leaving;
        }
    }

    /// Vertices of the remaining surface.
    pub(super) fn live_vertices(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.out.len() as u32).filter(|&v| self.out[v as usize] != NONE)
    }

    /// Sets all normals: means over the adjacent triangles, by angle and area, barely affected by slivers.
    pub(super) fn set_normals(&mut self) {
        let at: Vec<Vec3> = self.vertices.iter().map(|v| v.at).collect();
        let normals = vertex_normals(&self.triangles, &at);
        for (vertex, normal) in self.vertices.iter_mut().zip(normals) {
            vertex.normal = normal;
        }
    }
}

/// Outward unit normals at vertices of a mesh under change: those of the remaining adjacent triangles, weighted by
/// angle and, unlike [`SurfaceMesh::vertex_normals`](crate::vessel::SurfaceMesh::vertex_normals), by area; zero
/// without triangles.
pub(super) fn vertex_normals(triangles: &[[u32; 3]], at: &[Vec3]) -> Vec<Vec3> {
    let mut normals = vec![Vec3::zeros(); at.len()];
    for t in triangles.iter().filter(|t| t[0] != NONE) {
        let p = t.map(|v| at[v as usize]);
        let area = (p[1] - p[0]).cross(&(p[2] - p[0]));
        for k in 0..3 {
            let (e, f) = (p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
            normals[t[k] as usize] += area * libm::atan2(area.norm(), e.dot(&f));
        }
    }
    normals.iter().map(|n| n.try_normalize(0.0).filter(|n| n.x.is_finite()).unwrap_or_default()).collect()
}
