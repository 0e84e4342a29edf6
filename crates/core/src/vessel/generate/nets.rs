//! Surface nets: one vertex in every grid cell for every piece of surface in it, one quadrilateral around every
//! crossed grid edge.
//!
//! Gibson, "Constrained elastic surface nets", MICCAI 1998, with the pieces of [`super::cell`]. Own implementation,
//! because the crate for it (fast-surface-nets 0.2) requires the whole box as a dense 32-bit array, of which a vessel
//! tree fills a thousandth, and depends on another version of glam. Here the surface is followed from cell to cell,
//! in 64 bits, and the field is evaluated only at the corners of cells that it crosses.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::cell::{EDGES, Pieces};
use super::field::{Field, Local};
use crate::{Error, Result, Vec3};

/// Number of cells along a block. Larger blocks waste samples away from the surface, smaller ones repeat more at
/// their faces.
const BLOCK: usize = 8;
const CORNERS: usize = BLOCK + 1;

/// Number of cells along a leaf, a part of a block with its own relevant samples.
const LEAF: usize = 2;
const LEAVES: usize = BLOCK / LEAF;

/// Offset of the grid from round coordinates, where symmetric vessels would meet grid points exactly.
const OFFSET: [f64; 3] = [0.3819, 0.2361, 0.1459];

/// Margin around a block, in cells: points are looked up by their initial position, and may move a little.
pub(super) const MARGIN: f64 = 3.0;
/// Margin around a leaf; points that move farther use the block's samples.
const LEAF_MARGIN: f64 = 1.0;

type Key = [i32; 3];

/// Quadrilaterals around a field's zero set, counter-clockwise from outside.
pub(super) struct Nets {
    pub(super) vertices: Vec<Vec3>,
    pub(super) quads: Vec<[u32; 4]>,
    /// Whether several pieces of surface are in one cell.
    pub(super) has_parted: bool,
    /// Spacing of the grid, mm.
    pub(super) edge: f64,
    /// For blocks with surface, the relevant parts of the field in them and in their leaves.
    locals: BTreeMap<Key, (Arc<Local>, Leaves)>,
}

type Leaves = Vec<Option<Local>>;

impl Nets {
    /// Calls `evaluate` with the relevant part of the field near `point`: from its leaf or block, or computed if that
    /// has no surface.
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

/// Cell data of a block.
struct Block {
    /// The relevant parts of the field in it, and in its leaves.
    local: Arc<Local>,
    leaves: Leaves,
    /// Values at corners; NaN where not evaluated.
    corners: Vec<f64>,
    /// Whether each cell was visited.
    seen: Vec<bool>,
    /// Vertex of the first piece in each cell, or `u32::MAX`.
    cells: Vec<u32>,
    /// Pieces of cells with several: the piece of each edge.
    several: BTreeMap<usize, [u8; EDGES]>,
}

impl Block {
    /// The pieces in a cell whose corners are known, if the surface crosses it.
    fn pieces(&self, cell: [usize; 3]) -> Option<Pieces> {
        let [near, far] = [0, CORNERS * CORNERS].map(|up| corner_index(cell) + up);
        let row = |at: usize| [self.corners[at], self.corners[at + 1]];
        let ([a, b], [c, d]) = (row(near), row(near + CORNERS));
        let ([e, f], [g, h]) = (row(far), row(far + CORNERS));
        Pieces::of(&[a, b, c, d, e, f, g, h])
    }

    /// The vertex in a cell of the piece that crosses one of its edges.
    fn vertex(&self, cell: usize, edge: usize) -> u32 {
        let piece = self.several.get(&cell).map_or(0, |of_edge| u32::from(of_edge[edge]));
        self.cells[cell].saturating_add(piece)
    }
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

/// Follows the surface through the cells of a grid.
struct Follower<'a> {
    field: &'a Field,
    edge: f64,
    blocks: BTreeMap<Key, Block>,
}

impl Follower<'_> {
    /// The pieces in a cell, at the first visit; `None` at later ones and if the surface does not cross it.
    fn look(&mut self, cell: Key) -> Option<Pieces> {
        let key = cell.map(|k| k.div_euclid(BLOCK as i32));
        let at = cell.map(|k| k.rem_euclid(BLOCK as i32) as usize);
        let (field, edge) = (self.field, self.edge);
        let position = |corner: [usize; 3]| {
            grid_point([0, 1, 2].map(|axis| f64::from(key[axis]) * BLOCK as f64 + corner[axis] as f64), edge)
        };
        let block = self.blocks.entry(key).or_insert_with(|| {
            let (centre, half) = (position([BLOCK / 2; 3]), half_diagonal(BLOCK, edge));
            Block {
                local: Arc::new(field.local(&centre, half + MARGIN * edge)),
                leaves: vec![None; LEAVES * LEAVES * LEAVES],
                corners: vec![f64::NAN; CORNERS * CORNERS * CORNERS],
                seen: vec![false; BLOCK * BLOCK * BLOCK],
                cells: vec![u32::MAX; BLOCK * BLOCK * BLOCK],
                several: BTreeMap::new(),
            }
        });
        if std::mem::replace(&mut block.seen[cell_index(at)], true) {
            return None;
        }
        let leaf = at.map(|k| k / LEAF);
        let local = block.leaves[leaf_index(leaf)].get_or_insert_with(|| {
            let centre = position(leaf.map(|k| k * LEAF + LEAF / 2));
            let sounding = field.sound(&block.local, &centre);
            field.narrowed(&block.local, &sounding, half_diagonal(LEAF, edge) + LEAF_MARGIN * edge)
        });
        for corner in 0..8 {
            let corner = [0, 1, 2].map(|axis| at[axis] + (corner >> axis & 1));
            let known = &mut block.corners[corner_index(corner)];
            if known.is_nan() {
                *known = field.value(local, &position(corner)).f;
            }
        }
        block.pieces(at)
    }

    /// Follows the surface from `cell` on.
    fn follow(&mut self, cell: Key) {
        let mut pending = vec![cell];
        while let Some(cell) = pending.pop() {
            let Some(pieces) = self.look(cell) else { continue };
            for axis in 0..3 {
                for (far, way) in [(false, -1), (true, 1)] {
                    if pieces.passes(axis, far) {
                        let mut next = cell;
                        next[axis] += way;
                        pending.push(next);
                    }
                }
            }
        }
    }
}

/// Half of the diagonal of this many cells.
fn half_diagonal(cells: usize, edge: f64) -> f64 {
    0.75_f64.sqrt() * cells as f64 * edge
}

fn grid_point(cell: [f64; 3], edge: f64) -> Vec3 {
    Vec3::from_fn(|axis, _| (cell[axis] + OFFSET[axis]) * edge)
}

/// Meshes the zero set of `field` on a grid of spacing `edge`.
pub(super) fn mesh(field: &Field, edge: f64) -> Result<Nets> {
    let mut follower = Follower { field, edge, blocks: BTreeMap::new() };
    for cell in starts(field, edge) {
        follower.follow(cell);
    }
    let mut blocks = follower.blocks;
    let mut nets =
        Nets { vertices: Vec::new(), quads: Vec::new(), has_parted: false, edge, locals: BTreeMap::new() };
    for (key, block) in &mut blocks {
        for_each_cell(|at| {
            if !block.seen[cell_index(at)] {
                return;
            }
            // Computed again: storing them was slower.
            let Some(pieces) = block.pieces(at) else { return };
            block.cells[cell_index(at)] = nets.vertices.len() as u32;
            for mean in &pieces.means {
                let cell = [0, 1, 2].map(|k| f64::from(key[k]) * BLOCK as f64 + at[k] as f64 + mean[k]);
                nets.vertices.push(grid_point(cell, edge));
            }
            if pieces.means.len() > 1 {
                nets.has_parted = true;
                block.several.insert(cell_index(at), pieces.of_edge);
            }
        });
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
    nets.locals = blocks.into_iter().map(|(key, block)| (key, (block.local, block.leaves))).collect();
    Ok(nets)
}

/// Cells crossed by the surface, some in each branch.
fn starts(field: &Field, edge: f64) -> Vec<Key> {
    let mut cells = Vec::new();
    for branch in &field.branches {
        let stride = ((BLOCK as f64 * edge / branch.step) as usize).max(1);
        for sample in branch.samples.iter().step_by(stride) {
            // Blends bulge by less than a radius.
            let reach = 2.0 * sample.radius + 2.0 * edge;
            let local = field.local(&sample.position, reach);
            let axis = sample.tangent.iamin();
            let mut cell = [0, 1, 2].map(|axis| (sample.position[axis] / edge - OFFSET[axis]).round() as i32);
            let inside = |cell: &Key| field.value(&local, &grid_point(cell.map(f64::from), edge)).f < 0.0;
            if !inside(&cell) {
                continue;
            }
            for _ in 0..(reach / edge) as usize {
                let mut next = cell;
                next[axis] += 1;
                if !inside(&next) {
                    cells.push(cell);
                    break;
                }
                cell = next;
            }
        }
    }
    cells
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

/// Adds the quadrilateral around the grid edge from the first corner of `cell` along `axis`, if the surface crosses
/// it. Returns false if a cell around it has no vertex.
fn push_quad(
    blocks: &BTreeMap<Key, Block>,
    own: &Key,
    block: &Block,
    cell: [usize; 3],
    axis: usize,
    quads: &mut Vec<[u32; 4]>,
) -> bool {
    let mut ahead = cell;
    ahead[axis] += 1;
    let (a, b) = (block.corners[corner_index(cell)], block.corners[corner_index(ahead)]);
    // NaN where the surface was not followed.
    if a.is_nan() || b.is_nan() || (a < 0.0) == (b < 0.0) {
        return true;
    }
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut quad = [u32::MAX; 4];
    for (corner, (back_u, back_v)) in
        [(true, true), (false, true), (false, false), (true, false)].into_iter().enumerate()
    {
        let (mut at, mut key) = (cell, *own);
        for (direction, back) in [(u, back_u), (v, back_v)] {
            if back && at[direction] == 0 {
                at[direction] = BLOCK - 1;
                key[direction] -= 1;
            } else if back {
                at[direction] -= 1;
            }
        }
        let edge = 4 * axis + usize::from(back_u) + 2 * usize::from(back_v);
        // Most of its cells are in the same block, which saves a look-up.
        let owner = if key == *own { Some(block) } else { blocks.get(&key) };
        quad[corner] = owner.map_or(u32::MAX, |b| b.vertex(cell_index(at), edge));
    }
    if a >= 0.0 {
        quad.reverse();
    }
    quads.push(quad);
    !quad.contains(&u32::MAX)
}
