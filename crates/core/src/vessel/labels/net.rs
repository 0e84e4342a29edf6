//! The surface of a set of voxels: their outer faces, joined so that every edge has exactly two of them.
//!
//! This is the net of Gibson ("Constrained elastic surface nets", MICCAI 1998) before it is relaxed: a quadrilateral for
//! each pair of neighbours of which one is inside, and a vertex for each piece of surface at a corner of voxels
//! ([`Pieces`]). Its volume is that of the voxels to the bit, which smoothing can then keep; a triangulated isosurface of
//! zeros and ones cuts every corner off instead (5 % of the section of a vessel of three voxels).
//!
//! No crate is used. By their documentation, of those on crates.io (November 2026) `mcubes` 0.1.7, `marching-cubes` 0.1.2 and
//! `isosurface` 0.1.0-alpha.0 are marching cubes by tables of 256 cases over dense fields of single precision, and say
//! nothing about ambiguous faces, of which label maps are full; `fast-surface-nets` 0.2.1 and `surface-nets` 0.1.0 put
//! one vertex into a cell, so that voxels that touch by an edge make edges of four faces; `splashsurf_lib` 0.14 is made for
//! particles. An isosurface would also lose the exact volume.
//!
//! Voxels that share an edge are joined. Where background surrounds such an edge at both of its ends, the two passages
//! would share it; then one of the two background voxels is filled, which is counted.

use std::collections::BTreeMap;

use super::mask::Mask;
use crate::vessel::generate::{EDGES, Pieces};

/// Values of voxels inside and outside: their ratio joins voxels that share an edge.
const INSIDE: f64 = -2.0;
const OUTSIDE: f64 = 1.0;

/// A closed surface of quadrilaterals, counter-clockwise from outside in a right-handed lattice.
#[derive(Debug, Default)]
pub(super) struct Net {
    /// Positions in voxels: the centre of the mask's first voxel is at 0.
    pub(super) vertices: Vec<[f64; 3]>,
    pub(super) quads: Vec<[u32; 4]>,
    /// Number of background voxels that were filled.
    pub(super) filled: usize,
}

impl Net {
    /// The surface of `mask`, which is changed where it has to be ([`Net::filled`]).
    pub(super) fn of(mask: &mut Mask) -> Self {
        let mut filled = 0;
        loop {
            let mut net = Self::once(mask);
            let crowded = net.crowded();
            if crowded.is_empty() {
                net.filled = filled;
                return net;
            }
            // Each round fills at least one voxel, so this ends.
            for (a, b) in crowded {
                filled += fill(mask, net.vertices[a as usize], net.vertices[b as usize]);
            }
        }
    }

    /// The surface; edges may have more than two quadrilaterals.
    fn once(mask: &Mask) -> Self {
        let mut net = Self::default();
        let [nx, ny, nz] = mask.size;
        let mut layer = Layer::new(nx * ny);
        for z in 0..nz - 1 {
            let below = std::mem::replace(&mut layer, Layer::new(nx * ny));
            for y in 0..ny - 1 {
                for x in 0..nx - 1 {
                    net.push_vertices(mask, [x, y, z], &mut layer);
                }
            }
            for y in 1..ny - 1 {
                for x in 1..nx - 1 {
                    net.push_quads(mask, [x, y, z], &below, &layer);
                }
            }
        }
        net
    }

    /// Adds the vertices at the corner beyond a voxel.
    fn push_vertices(&mut self, mask: &Mask, at: [usize; 3], layer: &mut Layer) {
        let first = mask.index(at);
        let (row, slice) = (mask.size[0], mask.size[0] * mask.size[1]);
        let corners: [bool; 8] =
            std::array::from_fn(|k| mask.inside[first + (k & 1) + (k >> 1 & 1) * row + (k >> 2) * slice]);
        if corners.iter().all(|inside| *inside == corners[0]) {
            return;
        }
        let Some(pieces) = Pieces::of(&corners.map(|inside| if inside { INSIDE } else { OUTSIDE })) else {
            return;
        };
        let cell = at[1] * mask.size[0] + at[0];
        layer.first[cell] = self.vertices.len() as u32;
        self.vertices.extend(pieces.means.iter().map(|_| at.map(|k| k as f64 + 0.5)));
        if pieces.means.len() > 1 {
            layer.several.insert(cell, pieces.of_edge);
        }
    }

    /// Adds the faces between a voxel and the next ones along each axis.
    fn push_quads(&mut self, mask: &Mask, at: [usize; 3], below: &Layer, layer: &Layer) {
        let own = mask.index(at);
        let strides = [1, mask.size[0], mask.size[0] * mask.size[1]];
        for axis in 0..3 {
            let (from, to) = (mask.inside[own], mask.inside[own + strides[axis]]);
            if from == to {
                continue;
            }
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let mut quad = [0; 4];
            for (corner, back) in
                [[true, true], [false, true], [false, false], [true, false]].into_iter().enumerate()
            {
                let mut cell = at;
                for (direction, back) in [u, v].into_iter().zip(back) {
                    cell[direction] -= usize::from(back);
                }
                let edge = 4 * axis + usize::from(back[0]) + 2 * usize::from(back[1]);
                let of = if cell[2] == at[2] { layer } else { below };
                quad[corner] = of.vertex(cell[1] * mask.size[0] + cell[0], edge);
            }
            if !from {
                quad.reverse();
            }
            self.quads.push(quad);
        }
    }

    /// The edges of more than two quadrilaterals.
    fn crowded(&self) -> Vec<(u32, u32)> {
        crate::vessel::generate::crowded_edges(&self.quads)
    }

    /// Every quadrilateral divided into four: vessels of few voxels become rounder.
    pub(super) fn divided(&self) -> Self {
        let mut vertices = self.vertices.clone();
        let mut middles: BTreeMap<(u32, u32), u32> = BTreeMap::new();
        let mut quads = Vec::with_capacity(4 * self.quads.len());
        let mean = |of: &[u32]| {
            [0, 1, 2].map(|k| of.iter().map(|v| self.vertices[*v as usize][k]).sum::<f64>() / of.len() as f64)
        };
        for quad in &self.quads {
            let middle: [u32; 4] = std::array::from_fn(|k| {
                let (a, b) = (quad[k], quad[(k + 1) % 4]);
                *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    vertices.push(mean(&[a, b]));
                    vertices.len() as u32 - 1
                })
            });
            let centre = vertices.len() as u32;
            vertices.push(mean(quad));
            quads.extend((0..4).map(|k| [quad[k], middle[k], centre, middle[(k + 3) % 4]]));
        }
        Self { vertices, quads, filled: self.filled }
    }

    /// The number of ways round in all of its closed pieces together: half of 2 − V + E − F for each.
    pub(super) fn rings(&self) -> usize {
        let mut first: Vec<u32> = (0..self.vertices.len() as u32).collect();
        let find = |first: &mut Vec<u32>, mut v: u32| {
            while first[v as usize] != v {
                first[v as usize] = first[first[v as usize] as usize];
                v = first[v as usize];
            }
            v
        };
        for quad in &self.quads {
            for k in 1..4 {
                let (a, b) = (find(&mut first, quad[0]), find(&mut first, quad[k]));
                first[a.max(b) as usize] = a.min(b);
            }
        }
        let pieces = (0..first.len() as u32).filter(|v| first[*v as usize] == *v).count();
        // Every quadrilateral has four edges, each shared by two.
        (2 * pieces + self.quads.len()).saturating_sub(self.vertices.len()) / 2
    }
}

/// The vertices of a layer of corners.
struct Layer {
    first: Vec<u32>,
    /// The pieces of corners with several: that of each edge.
    several: BTreeMap<usize, [u8; EDGES]>,
}

impl Layer {
    fn new(cells: usize) -> Self {
        Self { first: vec![u32::MAX; cells], several: BTreeMap::new() }
    }

    fn vertex(&self, cell: usize, edge: usize) -> u32 {
        let piece = self.several.get(&cell).map_or(0, |of_edge| u32::from(of_edge[edge]));
        self.first[cell].saturating_add(piece)
    }
}

/// Fills one of the background voxels around the edge from a to b, that with more of the label around it; 0 if an earlier
/// edge has filled it.
fn fill(mask: &mut Mask, a: [f64; 3], b: [f64; 3]) -> usize {
    let axis = (0..3).find(|&k| a[k] != b[k]).unwrap_or(0);
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut best: Option<(usize, usize)> = None;
    for n in 0..4_usize {
        let mut at = [0; 3];
        at[axis] = a[axis].max(b[axis]) as usize;
        at[u] = a[u] as usize + (n & 1);
        at[v] = a[v] as usize + (n >> 1);
        let index = mask.index(at);
        if mask.inside[index] {
            continue;
        }
        let around = mask.around(index, &super::mask::FACES_AND_EDGES).filter(|k| mask.inside[*k]).count();
        if best.is_none_or(|(most, _)| around > most) {
            best = Some((around, index));
        }
    }
    match best {
        Some((_, index)) => {
            mask.inside[index] = true;
            1
        }
        None => 0,
    }
}
