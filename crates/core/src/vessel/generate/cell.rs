//! The surface within one cell of a grid, given the values at its corners: its pieces, and their crossings of the
//! cell's edges.
//!
//! On a face the crossings of its sides are joined to lines; what is connected around the cell is a piece. On a face
//! with four crossings the sign of the saddle of the bilinear interpolation determines which two are joined (Nielson
//! and Hamann, "The asymptotic decider", Visualization 1991), equally for both cells at the face. Where the narrow
//! angle of a bifurcation cuts off opposite corners of a cell, a single vertex for both would create edges of four
//! quadrilaterals; one per piece does not (Nielson, "Dual marching cubes", Visualization 2004).

use crate::Vec3;

/// Edges of a cell. Edge 4 axis + du + 2 dv runs along `axis`, at `du` and `dv` of the two axes that follow it.
pub(in crate::vessel) const EDGES: usize = 12;

/// No piece: the surface does not cross the edge.
const NO_PIECE: u8 = u8::MAX;

/// Pieces of surface in a cell.
pub(in crate::vessel) struct Pieces {
    /// The piece that crosses each edge.
    pub(in crate::vessel) of_edge: [u8; EDGES],
    /// Mean of the points where each piece crosses edges, from the cell's first corner, in cells.
    pub(in crate::vessel) means: Vec<[f64; 3]>,
}

/// Both ends of every edge.
const ENDS: [[[usize; 3]; 2]; EDGES] = {
    let mut ends = [[[0; 3]; 2]; EDGES];
    let mut edge = 0;
    while edge < EDGES {
        let axis = edge / 4;
        ends[edge][0][(axis + 1) % 3] = edge & 1;
        ends[edge][0][(axis + 2) % 3] = edge >> 1 & 1;
        ends[edge][1] = ends[edge][0];
        ends[edge][1][axis] = 1;
        edge += 1;
    }
    ends
};

impl Pieces {
    /// The pieces in a cell with these values at its corners (x + 2 y + 4 z), if any.
    pub(in crate::vessel) fn of(values: &[f64; 8]) -> Option<Self> {
        let inside = values.iter().filter(|value| **value < 0.0).count();
        if inside == 0 || inside == values.len() {
            return None;
        }
        let value = |[x, y, z]: [usize; 3]| values[x + 2 * y + 4 * z];
        let crossing = |edge: usize| {
            let [from, to] = ENDS[edge];
            let (a, b) = (value(from), value(to));
            ((a < 0.0) != (b < 0.0)).then(|| {
                let mut at = Vec3::from_fn(|k, _| from[k] as f64);
                at[edge / 4] = a / (a - b);
                at
            })
        };
        let at: [Option<Vec3>; EDGES] = std::array::from_fn(crossing);
        // The first edge of each piece represents it.
        let mut first: [usize; EDGES] = std::array::from_fn(|edge| edge);
        let mut join = |a: usize, b: usize| {
            let (low, high) = (first[a].min(first[b]), first[a].max(first[b]));
            first.iter_mut().filter(|f| **f == high).for_each(|f| *f = low);
        };
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for side in 0..2 {
                let sides = [u * 4 + 2 * side, v * 4 + side + 2, u * 4 + 1 + 2 * side, v * 4 + side];
                let mut crossed = sides.iter().copied().filter(|edge| at[*edge].is_some());
                match (crossed.next(), crossed.next(), crossed.next()) {
                    (Some(a), Some(b), None) => join(a, b),
                    (Some(_), Some(_), Some(_)) => {
                        let corner = |p: usize, q: usize| {
                            let mut at = [side; 3];
                            (at[u], at[v]) = (p, q);
                            value(at)
                        };
                        let [low, right, high, left] = sides;
                        // The joined crossings are around a corner that the saddle cuts off.
                        if corner(0, 0) * corner(1, 1) > corner(1, 0) * corner(0, 1) {
                            join(low, right);
                            join(high, left);
                        } else {
                            join(low, left);
                            join(high, right);
                        }
                    }
                    _ => {}
                }
            }
        }
        let mut of_edge = [NO_PIECE; EDGES];
        let mut sums: Vec<(Vec3, f64)> = Vec::with_capacity(1);
        for edge in 0..EDGES {
            let Some(at) = at[edge] else { continue };
            if first[edge] == edge {
                of_edge[edge] = sums.len() as u8;
                sums.push((Vec3::zeros(), 0.0));
            }
            of_edge[edge] = of_edge[first[edge]];
            let sum = &mut sums[of_edge[edge] as usize];
            sum.0 += at;
            sum.1 += 1.0;
        }
        let means = sums.into_iter().map(|(sum, count)| (sum / count).into()).collect();
        Some(Self { of_edge, means })
    }

    /// Whether the surface passes through the side of the cell towards `axis`, the far one or the near one.
    pub(in crate::vessel) fn passes(&self, axis: usize, far: bool) -> bool {
        let (u, v, side) = ((axis + 1) % 3, (axis + 2) % 3, usize::from(far));
        [u * 4 + 2 * side, u * 4 + 1 + 2 * side, v * 4 + side, v * 4 + side + 2]
            .iter()
            .any(|edge| self.of_edge[*edge] != NO_PIECE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pieces of a cell with these corners inside; corners are x + 2y + 4z.
    fn pieces(inside: &[usize], depth: f64) -> Option<Pieces> {
        Pieces::of(&std::array::from_fn(|corner| if inside.contains(&corner) { -depth } else { 1.0 }))
    }

    #[test]
    fn a_cell_has_a_piece_for_each_corner_that_is_cut_off() {
        assert!(pieces(&[], 1.0).is_none());
        let one = pieces(&[0], 1.0).unwrap();
        assert_eq!(one.means.len(), 1);
        assert!((Vec3::from(one.means[0]) - Vec3::repeat(1.0 / 6.0)).norm() < 1e-15);
        assert_eq!(one.of_edge.iter().filter(|piece| **piece == 0).count(), 3);
        // Opposite corners of the cell, and of a face: two pieces, unless the values are large enough to connect
        // them.
        assert_eq!(pieces(&[0, 7], 1.0).unwrap().means.len(), 2);
        assert_eq!(pieces(&[0, 3], 0.5).unwrap().means.len(), 2);
        assert_eq!(pieces(&[0, 3], 2.0).unwrap().means.len(), 1);
        assert_eq!(pieces(&[0, 1, 2, 3], 1.0).unwrap().means, [[0.5; 3]]);
    }

    #[test]
    fn two_pieces_share_no_edge_and_pass_through_their_own_sides() {
        let two = pieces(&[0, 7], 1.0).unwrap();
        for edge in 0..EDGES {
            let [from, to] = ENDS[edge];
            let of_first = from == [0; 3];
            let of_last = to == [1; 3];
            let expected = if of_first {
                0
            } else if of_last {
                1
            } else {
                NO_PIECE
            };
            assert_eq!(two.of_edge[edge], expected, "{edge}");
        }
        let one = pieces(&[0], 1.0).unwrap();
        assert!((0..3).all(|axis| one.passes(axis, false) && !one.passes(axis, true)));
    }
}
