//! Surface nets: one vertex in every grid cell the surface passes, one quadrilateral around every grid edge it crosses.
//!
//! Gibson, "Constrained elastic surface nets", MICCAI 1998. By hand, because the crate for it (fast-surface-nets 0.2) wants the
//! whole box as a dense 32-bit array, of which a vessel tree fills a thousandth, and brings a second glam. Here only blocks of
//! cells near the surface are sampled, in 64 bits.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::field::{Field, Local};
use crate::{Error, Result, Vec3, parallel};

/// Cells along a block. Larger blocks waste samples away from the surface, smaller ones repeat more at their faces.
const BLOCK: usize = 8;
const CORNERS: usize = BLOCK + 1;

/// Corners of a cell, by their distance from the first in the list of a block's.
const CELL: [usize; 8] = {
    let (y, z) = (CORNERS, CORNERS * CORNERS);
    [0, 1, y, y + 1, z, z + 1, z + y, z + y + 1]
};

/// Cells along the smallest part of a block that is left out as a whole.
const LEAF: usize = 2;
const LEAVES: usize = BLOCK / LEAF;

/// Shifts the grid off round coordinates, where symmetric vessels would meet grid points exactly.
const OFFSET: [f64; 3] = [0.3819, 0.2361, 0.1459];

/// Room around a block, in cells: points are looked up by where they start from, and may move a little.
pub(super) const MARGIN: f64 = 3.0;
/// The same around a leaf; points that go farther are asked about with what matters to the block.
const LEAF_MARGIN: f64 = 1.0;

type Key = [i32; 3];

/// Quadrilaterals around a field's zero set, counter-clockwise from outside.
pub(super) struct Nets {
    pub(super) vertices: Vec<Vec3>,
    pub(super) quads: Vec<[u32; 4]>,
    /// Spacing of the grid, mm.
    pub(super) edge: f64,
    /// For blocks with surface what matters in them, and in their leaves.
    locals: BTreeMap<Key, (Arc<Local>, Leaves)>,
}

type Leaves = Vec<Option<Local>>;

impl Nets {
    /// Calls `evaluate` with what of the field matters near `point`: from the leaf or block it is in, or looked for anew if that has no
    /// surface.
    pub(super) fn with_local<T>(&self, field: &Field, point: &Vec3, evaluate: impl FnOnce(&Local) -> T) -> T {
        let blocks = [0, 1, 2].map(|axis| (point[axis] / self.edge - OFFSET[axis]) / BLOCK as f64);
        let key = blocks.map(|at| at.floor() as i32);
        match self.locals.get(&key) {
            Some((block, leaves)) => {
                let leaf = blocks.map(|at| (((at - at.floor()) * LEAVES as f64) as usize).min(LEAVES - 1));
                evaluate(leaves[leaf_index(leaf)].as_ref().unwrap_or(block))
            }
            None => evaluate(&field.local(point, MARGIN * self.edge)),
        }
    }
}

struct Block {
    corners: Vec<f64>,
    /// Vertex in each cell, or `u32::MAX`.
    cells: Vec<u32>,
}

fn corner_index(at: [usize; 3]) -> usize {
    (at[2] * CORNERS + at[1]) * CORNERS + at[0]
}

fn cell_index(at: [usize; 3]) -> usize {
    (at[2] * BLOCK + at[1]) * BLOCK + at[0]
}

fn leaf_index(at: [usize; 3]) -> usize {
    (at[2] * LEAVES + at[1]) * LEAVES + at[0]
}

/// Samples the corners of a block near the surface; others get a value of their sign.
struct Sampler<'a> {
    field: &'a Field,
    edge: f64,
    /// First corner of the block, in cells.
    first: [f64; 3],
    corners: Vec<f64>,
    leaves: Leaves,
    /// First corner, cells along it and value of the parts without surface.
    clear: Vec<([usize; 3], usize, f64)>,
}

impl Sampler<'_> {
    fn block(field: &Field, edge: f64, first: [f64; 3], local: &Arc<Local>) -> (Vec<f64>, Leaves) {
        let corners = vec![f64::NAN; CORNERS * CORNERS * CORNERS];
        let leaves = vec![None; LEAVES * LEAVES * LEAVES];
        let mut sampler = Sampler { field, edge, first, corners, leaves, clear: Vec::new() };
        sampler.halve([0; 3], BLOCK, local);
        for (from, size, value) in sampler.clear {
            for_each_corner(from, size, |at| {
                let corner = &mut sampler.corners[corner_index(at)];
                if corner.is_nan() {
                    *corner = value;
                }
            });
        }
        (sampler.corners, sampler.leaves)
    }

    /// Looks at the eight halves of a cube of `size` cells.
    fn halve(&mut self, from: [usize; 3], size: usize, local: &Arc<Local>) {
        let half = size / 2;
        for octant in 0..8 {
            let from = [0, 1, 2].map(|axis| from[axis] + half * (octant >> axis & 1));
            self.cube(from, half, local);
        }
    }

    fn cube(&mut self, from: [usize; 3], size: usize, wide: &Arc<Local>) {
        let centre = self.position(from.map(|k| k + size / 2));
        let half_diagonal = 0.75_f64.sqrt() * size as f64 * self.edge;
        let sounding = self.field.sound(wide, &centre);
        let value = sounding.f();
        if value.abs() > self.field.steepness() * half_diagonal {
            self.clear.push((from, size, value));
            return;
        }
        let local = self.field.narrowed(wide, &sounding, half_diagonal + LEAF_MARGIN * self.edge);
        if size > LEAF {
            self.halve(from, size, &Arc::new(local));
            return;
        }
        for_each_corner(from, size, |at| {
            if self.corners[corner_index(at)].is_nan() {
                self.corners[corner_index(at)] = self.field.value(&local, &self.position(at)).f;
            }
        });
        self.leaves[leaf_index(from.map(|k| k / LEAF))] = Some(local);
    }

    fn position(&self, corner: [usize; 3]) -> Vec3 {
        grid_point([0, 1, 2].map(|axis| self.first[axis] + corner[axis] as f64), self.edge)
    }
}

fn grid_point(cell: [f64; 3], edge: f64) -> Vec3 {
    Vec3::from_fn(|axis, _| (cell[axis] + OFFSET[axis]) * edge)
}

fn for_each_corner(from: [usize; 3], size: usize, mut visit: impl FnMut([usize; 3])) {
    for z in from[2]..=from[2] + size {
        for y in from[1]..=from[1] + size {
            for x in from[0]..=from[0] + size {
                visit([x, y, z]);
            }
        }
    }
}

/// Meshes the zero set of `field` on a grid of spacing `edge`.
pub(super) fn mesh(field: &Field, edge: f64) -> Result<Nets> {
    let width = BLOCK as f64 * edge;
    let half_diagonal = width * 0.75_f64.sqrt();
    let steepness = field.steepness();
    let mut nets = Nets { vertices: Vec::new(), quads: Vec::new(), edge, locals: BTreeMap::new() };
    let mut blocks: BTreeMap<Key, Block> = BTreeMap::new();
    let keys: Vec<Key> = candidates(field, edge).into_iter().collect();
    let first_corner = |key: &Key| key.map(|k| f64::from(k) * BLOCK as f64);
    let sampled = parallel::map(keys.len(), |k| {
        let first = first_corner(&keys[k]);
        let centre = grid_point(first.map(|c| c + BLOCK as f64 / 2.0), edge);
        let local = field.local(&centre, half_diagonal + MARGIN * edge);
        if field.value(&local, &centre).f.abs() > steepness * half_diagonal {
            return None;
        }
        let local = Arc::new(local);
        let (corners, leaves) = Sampler::block(field, edge, first, &local);
        Some((local, corners, leaves))
    });
    for (key, sampled) in keys.into_iter().zip(sampled) {
        let Some((local, corners, leaves)) = sampled else { continue };
        let first = first_corner(&key);
        let mut cells = vec![u32::MAX; BLOCK * BLOCK * BLOCK];
        let before = nets.vertices.len();
        for_each_cell(|at| {
            if leaves[leaf_index(at.map(|k| k / LEAF))].is_none() {
                return;
            }
            if let Some(inside) = crossing_mean(&corners, at) {
                cells[cell_index(at)] = nets.vertices.len() as u32;
                let cell = [0, 1, 2].map(|axis| first[axis] + at[axis] as f64 + inside[axis]);
                nets.vertices.push(grid_point(cell, edge));
            }
        });
        if nets.vertices.len() > before {
            nets.locals.insert(key, (local, leaves));
            blocks.insert(key, Block { corners, cells });
        }
    }
    for (key, block) in &blocks {
        let mut missing = false;
        for_each_cell(|at| {
            for axis in 0..3 {
                missing |= !push_quad(&blocks, key, block, at, axis, &mut nets.quads);
            }
        });
        if missing {
            return Err(Error::Computation(
                "the grid misses a part of the surface; report this as a bug".into(),
            ));
        }
    }
    Ok(nets)
}

fn for_each_cell(mut visit: impl FnMut([usize; 3])) {
    for z in 0..BLOCK {
        for y in 0..BLOCK {
            for x in 0..BLOCK {
                visit([x, y, z]);
            }
        }
    }
}

/// Blocks that the lumen, widened by a block, can reach.
fn candidates(field: &Field, edge: f64) -> BTreeSet<Key> {
    let width = BLOCK as f64 * edge;
    let mut keys = BTreeSet::new();
    for branch in &field.branches {
        for sample in &branch.samples {
            // Blends bulge by less than a radius; the end may go on for the extension.
            let reach = 1.3 * sample.radius + field.extension + branch.step;
            let key = |axis: usize, sign: f64| {
                ((sample.position[axis] + sign * reach) / width - OFFSET[axis] / BLOCK as f64).floor() as i32
            };
            for z in key(2, -1.0)..=key(2, 1.0) {
                for y in key(1, -1.0)..=key(1, 1.0) {
                    for x in key(0, -1.0)..=key(0, 1.0) {
                        keys.insert([x, y, z]);
                    }
                }
            }
        }
    }
    keys
}

/// Mean of the points where the surface crosses the twelve edges of a cell, from its first corner, in cells.
fn crossing_mean(corners: &[f64], cell: [usize; 3]) -> Option<[f64; 3]> {
    let base = corner_index(cell);
    let inside = CELL.iter().filter(|&&corner| corners[base + corner] < 0.0).count();
    if inside == 0 || inside == CELL.len() {
        return None;
    }
    let value = |offset: [usize; 3]| corners[corner_index([0, 1, 2].map(|a| cell[a] + offset[a]))];
    let (mut sum, mut count) = (Vec3::zeros(), 0.0);
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for (du, dv) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let mut from = [0; 3];
            (from[u], from[v]) = (du, dv);
            let mut to = from;
            to[axis] = 1;
            let (a, b) = (value(from), value(to));
            if (a < 0.0) != (b < 0.0) {
                let mut at = Vec3::from_fn(|k, _| from[k] as f64);
                at[axis] = a / (a - b);
                sum += at;
                count += 1.0;
            }
        }
    }
    (count > 0.0).then(|| (sum / count).into())
}

/// Adds the quadrilateral around the grid edge from the first corner of `cell` along `axis`, if the surface crosses it.
/// False if a cell around it has no vertex.
fn push_quad(
    blocks: &BTreeMap<Key, Block>,
    key: &Key,
    block: &Block,
    cell: [usize; 3],
    axis: usize,
    quads: &mut Vec<[u32; 4]>,
) -> bool {
    let mut ahead = cell;
    ahead[axis] += 1;
    let (a, b) = (block.corners[corner_index(cell)], block.corners[corner_index(ahead)]);
    if (a < 0.0) == (b < 0.0) {
        return true;
    }
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut quad = [u32::MAX; 4];
    for (corner, (back_u, back_v)) in
        [(true, true), (false, true), (false, false), (true, false)].into_iter().enumerate()
    {
        let (mut at, mut key) = (cell, *key);
        for (direction, back) in [(u, back_u), (v, back_v)] {
            if back && at[direction] == 0 {
                at[direction] = BLOCK - 1;
                key[direction] -= 1;
            } else if back {
                at[direction] -= 1;
            }
        }
        quad[corner] = blocks.get(&key).map_or(u32::MAX, |b| b.cells[cell_index(at)]);
    }
    if a >= 0.0 {
        quad.reverse();
    }
    quads.push(quad);
    !quad.contains(&u32::MAX)
}
