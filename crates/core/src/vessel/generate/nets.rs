//! Surface nets: one vertex in every grid cell the surface passes, one quadrilateral around every grid edge it crosses.
//!
//! Gibson, "Constrained elastic surface nets", MICCAI 1998. By hand, because the crate for it (fast-surface-nets 0.2) wants the
//! whole box as a dense 32-bit array, of which a vessel tree fills a thousandth, and brings a second glam. Here only blocks of
//! cells near the surface are sampled, in 64 bits.

use std::collections::{BTreeMap, BTreeSet};

use super::field::{Field, Local};
use crate::{Error, Result, Vec3};

/// Cells along a block. Larger blocks waste samples away from the surface, smaller ones repeat more at their faces.
const BLOCK: usize = 8;
const CORNERS: usize = BLOCK + 1;

/// Shifts the grid off round coordinates, where symmetric vessels would meet grid points exactly.
const OFFSET: [f64; 3] = [0.3819, 0.2361, 0.1459];

/// Room around a block, in cells: points are looked up by where they start from, and may move a little.
const MARGIN: f64 = 3.0;

type Key = [i32; 3];

/// Quadrilaterals around a field's zero set, counter-clockwise from outside.
pub(super) struct Nets {
    pub(super) vertices: Vec<Vec3>,
    pub(super) quads: Vec<[u32; 4]>,
    /// Spacing of the grid, mm.
    pub(super) edge: f64,
    locals: BTreeMap<Key, Local>,
}

impl Nets {
    /// Calls `evaluate` with what of the field matters near `point`: from the block it is in, or looked for anew if that has no surface.
    pub(super) fn with_local<T>(&self, field: &Field, point: &Vec3, evaluate: impl FnOnce(&Local) -> T) -> T {
        let key =
            [0, 1, 2].map(|axis| ((point[axis] / self.edge - OFFSET[axis]) / BLOCK as f64).floor() as i32);
        match self.locals.get(&key) {
            Some(local) => evaluate(local),
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

/// Meshes the zero set of `field` on a grid of spacing `edge`.
pub(super) fn mesh(field: &Field, edge: f64) -> Result<Nets> {
    let width = BLOCK as f64 * edge;
    let position = |cell: [f64; 3]| Vec3::from_fn(|axis, _| (cell[axis] + OFFSET[axis]) * edge);
    let half_diagonal = width * 0.75_f64.sqrt();
    let steepness = field.steepness();
    let mut nets = Nets { vertices: Vec::new(), quads: Vec::new(), edge, locals: BTreeMap::new() };
    let mut blocks: BTreeMap<Key, Block> = BTreeMap::new();
    for key in candidates(field, edge) {
        let first = key.map(|k| f64::from(k) * BLOCK as f64);
        let centre = position(first.map(|c| c + BLOCK as f64 / 2.0));
        let local = field.local(&centre, half_diagonal + MARGIN * edge);
        if field.value(&local, &centre).f.abs() > steepness * half_diagonal {
            continue;
        }
        let mut corners = vec![0.0; CORNERS * CORNERS * CORNERS];
        for z in 0..CORNERS {
            for y in 0..CORNERS {
                for x in 0..CORNERS {
                    let at = position([first[0] + x as f64, first[1] + y as f64, first[2] + z as f64]);
                    corners[corner_index([x, y, z])] = field.value(&local, &at).f;
                }
            }
        }
        let mut cells = vec![u32::MAX; BLOCK * BLOCK * BLOCK];
        let before = nets.vertices.len();
        for_each_cell(|at| {
            if let Some(inside) = crossing_mean(&corners, at) {
                cells[cell_index(at)] = nets.vertices.len() as u32;
                nets.vertices
                    .push(position([0, 1, 2].map(|axis| first[axis] + at[axis] as f64 + inside[axis])));
            }
        });
        if nets.vertices.len() > before {
            nets.locals.insert(key, local);
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
