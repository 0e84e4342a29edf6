//! The vertices of a wall, in cells, with what their quadrics tell of tubes.

use rustc_hash::FxHashMap;

use crate::Vec3;

/// A vertex of the wall.
#[derive(Debug, Clone, Copy)]
pub(in crate::contact) struct Corner {
    pub(in crate::contact) position: Vec3,
    /// Into the lumen.
    pub(in crate::contact) normal: Vec3,
    /// The direction in which the wall bends least.
    pub(in crate::contact) along: Vec3,
    /// Principal curvatures, 1/mm, the larger first; positive around the lumen. Zero where no quadric fits.
    pub(in crate::contact) curvature: [f64; 2],
}

/// Vertices for searches around a place.
pub(super) struct Vertices {
    pub(super) all: Vec<Corner>,
    cells: FxHashMap<[i64; 3], Vec<u32>>,
    cell_mm: f64,
}

impl Vertices {
    pub(super) fn new(all: Vec<Corner>, cell_mm: f64) -> Self {
        let mut cells: FxHashMap<[i64; 3], Vec<u32>> = FxHashMap::default();
        for (v, corner) in all.iter().enumerate() {
            cells.entry(cell(&corner.position, cell_mm)).or_default().push(v as u32);
        }
        Self { all, cells, cell_mm }
    }

    /// The vertices within a distance of a place, mm, in an order that depends on these alone.
    pub(super) fn within(&self, x: &Vec3, reach_mm: f64) -> impl Iterator<Item = u32> + '_ {
        let x = *x;
        let [low, high] = [-reach_mm, reach_mm].map(|by| cell(&x.add_scalar(by), self.cell_mm));
        (low[0]..=high[0])
            .flat_map(move |i| (low[1]..=high[1]).map(move |j| [i, j]))
            .flat_map(move |[i, j]| (low[2]..=high[2]).map(move |k| [i, j, k]))
            .filter_map(|at| self.cells.get(&at))
            .flatten()
            .copied()
            .filter(move |v| (self.all[*v as usize].position - x).norm_squared() < reach_mm * reach_mm)
    }
}

fn cell(x: &Vec3, cell_mm: f64) -> [i64; 3] {
    (x / cell_mm).map(|c| c.floor() as i64).into()
}
