//! A mesh that can be cut and joined edge by edge.

use std::collections::BTreeSet;

use endowire_core::Vec3;
use endowire_core::vessel::SurfaceMesh;

/// Triangles with, for every vertex, those around it.
pub(super) struct Editable {
    pub(super) vertices: Vec<Vec3>,
    pub(super) triangles: Vec<Option<[u32; 3]>>,
    around: Vec<Vec<u32>>,
}

impl Editable {
    pub(super) fn new(mesh: &SurfaceMesh) -> Self {
        let mut edit = Self {
            vertices: mesh.vertices_mm.clone(),
            triangles: Vec::new(),
            around: vec![Vec::new(); mesh.vertices_mm.len()],
        };
        mesh.triangles.iter().for_each(|t| edit.add(*t));
        edit
    }

    /// The mesh, without vertices that no triangle uses.
    pub(super) fn finish(&self) -> SurfaceMesh {
        let mut mesh = SurfaceMesh::default();
        let mut number = vec![None; self.vertices.len()];
        for triangle in self.triangles.iter().flatten() {
            let corners = triangle.map(|v| {
                *number[v as usize].get_or_insert_with(|| {
                    mesh.vertices_mm.push(self.vertices[v as usize]);
                    (mesh.vertices_mm.len() - 1) as u32
                })
            });
            mesh.triangles.push(corners);
        }
        mesh
    }

    pub(super) fn count(&self) -> usize {
        self.triangles.iter().flatten().count()
    }

    pub(super) fn vertex(&mut self, place: Vec3) -> u32 {
        self.vertices.push(place);
        self.around.push(Vec::new());
        (self.vertices.len() - 1) as u32
    }

    pub(super) fn add(&mut self, triangle: [u32; 3]) {
        let index = self.triangles.len() as u32;
        self.triangles.push(Some(triangle));
        triangle.iter().for_each(|&v| self.around[v as usize].push(index));
    }

    pub(super) fn remove(&mut self, index: u32) {
        if let Some(triangle) = self.triangles[index as usize].take() {
            triangle.iter().for_each(|&v| self.around[v as usize].retain(|&t| t != index));
        }
    }

    pub(super) fn replace(&mut self, index: u32, from: u32, to: u32) {
        if let Some(triangle) = &mut self.triangles[index as usize] {
            *triangle = triangle.map(|v| if v == from { to } else { v });
            self.around[from as usize].retain(|&t| t != index);
            self.around[to as usize].push(index);
        }
    }

    pub(super) fn at(&self, v: u32) -> Vec3 {
        self.vertices[v as usize]
    }

    pub(super) fn length(&self, a: u32, b: u32) -> f64 {
        (self.at(a) - self.at(b)).norm()
    }

    pub(super) fn triangle(&self, index: u32) -> Option<[u32; 3]> {
        self.triangles[index as usize]
    }

    /// The triangles at a vertex.
    pub(super) fn fan(&self, v: u32) -> &[u32] {
        &self.around[v as usize]
    }

    /// The triangles at an edge.
    pub(super) fn sharing(&self, a: u32, b: u32) -> Vec<u32> {
        let has = |t: &&u32| self.triangles[**t as usize].is_some_and(|t| t.contains(&b));
        self.around[a as usize].iter().filter(has).copied().collect()
    }

    /// The vertices joined to a vertex.
    pub(super) fn neighbours(&self, v: u32) -> BTreeSet<u32> {
        let corners = self.fan(v).iter().filter_map(|&t| self.triangle(t)).flatten();
        corners.filter(|&w| w != v).collect()
    }

    /// Whether a vertex is on an open edge.
    pub(super) fn is_open(&self, v: u32) -> bool {
        self.neighbours(v).iter().any(|&w| self.sharing(v, w).len() != 2)
    }

    /// Twice the area of a triangle, as a vector.
    pub(super) fn normal(&self, triangle: [u32; 3]) -> Vec3 {
        let [a, b, c] = triangle.map(|v| self.at(v));
        (b - a).cross(&(c - a))
    }

    /// Cuts an edge, and every triangle at it, at a point.
    pub(super) fn split(&mut self, a: u32, b: u32, place: Vec3) -> u32 {
        let middle = self.vertex(place);
        for index in self.sharing(a, b) {
            let Some(triangle) = self.triangle(index) else { continue };
            self.remove(index);
            self.add(triangle.map(|v| if v == b { middle } else { v }));
            self.add(triangle.map(|v| if v == a { middle } else { v }));
        }
        middle
    }

    /// Moves vertex `a` into its neighbour `b`, if the surface stays a surface, no edge gets longer than `longest_mm`, and no triangle
    /// turns by more than the angle of this cosine, and each is one that `fits`. Returns whether it was done.
    pub(super) fn collapse(
        &mut self,
        (a, b): (u32, u32),
        longest_mm: f64,
        least_cosine: f64,
        fits: impl Fn([Vec3; 3]) -> bool,
    ) -> bool {
        let shared = self.sharing(a, b);
        if shared.is_empty() || shared.len() > 2 {
            return false;
        }
        let (near_a, near_b) = (self.neighbours(a), self.neighbours(b));
        if near_a.intersection(&near_b).count() != shared.len() || (shared.len() == 2 && self.is_open(a)) {
            return false;
        }
        if shared.len() == 1 && near_a.iter().filter(|&&w| self.sharing(a, w).len() == 1).count() != 2 {
            return false;
        }
        if near_a.iter().any(|&w| w != b && self.length(w, b) > longest_mm) {
            return false;
        }
        for &index in self.fan(a).iter().filter(|t| !shared.contains(t)) {
            let Some(triangle) = self.triangle(index) else { continue };
            let moved = triangle.map(|v| if v == a { b } else { v });
            let (before, after) = (self.normal(triangle), self.normal(moved));
            if after.norm() < 1e-9 || before.dot(&after) < least_cosine * before.norm() * after.norm() {
                return false;
            }
            if !fits(moved.map(|v| self.at(v))) {
                return false;
            }
        }
        shared.into_iter().for_each(|index| self.remove(index));
        for index in self.fan(a).to_vec() {
            self.replace(index, a, b);
        }
        true
    }
}
