//! Merging vertices that are meant to be one.
//!
//! STL stores every corner of every triangle anew, and exporters round them differently. Vertices closer than a
//! tolerance are merged, transitively: chains of close vertices become one, so the result depends on no order.

use std::collections::HashMap;

use super::topology::DisjointSets;
use crate::Vec3;

/// Grid cells per tolerance. Large cells make most vertices look into their own cell only; the border test keeps
/// pairs across cells.
const CELL_PER_TOLERANCE: f64 = 16.0;

/// For each vertex the index of the vertex it is merged into (its own index if it stays): the smallest index of
/// all vertices linked to it by steps of at most `tolerance_mm`. Vertices that are not finite are joined to none that is.
pub(crate) fn merge_targets(vertices_mm: &[Vec3], tolerance_mm: f64) -> Vec<u32> {
    let mut sets = DisjointSets::new(vertices_mm.len());
    join_equal(vertices_mm, &mut sets);
    // What is not finite lies nowhere, and near nothing.
    let usable = |v: u32| vertices_mm[v as usize].iter().all(|c| c.is_finite());
    let distinct: Vec<u32> =
        (0..vertices_mm.len() as u32).filter(|&v| sets.find(v) == v && usable(v)).collect();
    if tolerance_mm > 0.0 {
        join_near(vertices_mm, &distinct, tolerance_mm, &mut sets);
    }
    (0..vertices_mm.len() as u32).map(|v| sets.find(v)).collect()
}

/// Joins vertices with equal coordinates, which is most of what an STL file needs.
fn join_equal(vertices_mm: &[Vec3], sets: &mut DisjointSets) {
    // Adding zero turns −0 into +0, which compare equal and must hash so.
    let key = |v: &Vec3| [v.x, v.y, v.z].map(|c| (c + 0.0).to_bits());
    let mut order: Vec<([u64; 3], u32)> =
        vertices_mm.iter().enumerate().map(|(i, v)| (key(v), i as u32)).collect();
    order.sort_unstable();
    for pair in order.windows(2) {
        if pair[0].0 == pair[1].0 {
            sets.join(pair[0].1, pair[1].1);
        }
    }
}

/// Joins vertices at most `tolerance` apart, by a grid in which each vertex visits the cells its tolerance ball meets.
fn join_near(vertices_mm: &[Vec3], distinct: &[u32], tolerance: f64, sets: &mut DisjointSets) {
    let cell = CELL_PER_TOLERANCE * tolerance;
    let cell_of = |p: Vec3| [p.x, p.y, p.z].map(|c| (c / cell).floor() as i64);
    // Only looked up, never iterated: its order cannot reach the result.
    let mut grid: HashMap<[i64; 3], Vec<u32>> = HashMap::with_capacity(distinct.len());
    for &v in distinct {
        let p = vertices_mm[v as usize];
        let (low, high) = (cell_of(p.add_scalar(-tolerance)), cell_of(p.add_scalar(tolerance)));
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    for &other in grid.get(&[x, y, z]).into_iter().flatten() {
                        if (vertices_mm[other as usize] - p).norm() <= tolerance {
                            sets.join(v, other);
                        }
                    }
                }
            }
        }
        grid.entry(cell_of(p)).or_default().push(v);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_within_tolerance_merge_across_cell_borders_and_others_do_not() {
        let near_border = 16.0 * 0.01;
        let points = [
            Vec3::new(near_border - 0.004, 0.0, 0.0),
            Vec3::new(near_border + 0.004, 0.0, 0.0),
            Vec3::new(near_border + 0.02, 0.0, 0.0),
        ];
        assert_eq!(merge_targets(&points, 0.01), [0, 0, 2]);
        assert_eq!(merge_targets(&points, 0.001), [0, 1, 2]);
    }

    #[test]
    fn a_chain_of_close_vertices_becomes_one_whatever_the_order() {
        let chain = [0.0, 0.016, 0.008, 0.024].map(|x| Vec3::new(x, 1.0, -1.0));
        assert_eq!(merge_targets(&chain, 0.01), [0; 4]);
    }

    #[test]
    fn negative_zero_is_zero() {
        assert_eq!(merge_targets(&[Vec3::new(0.0, 0.0, 0.0), Vec3::new(-0.0, 0.0, -0.0)], 0.0), [0, 0]);
    }
}
