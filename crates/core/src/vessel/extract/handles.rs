//! How many rings a vessel has, from its surface alone.
//!
//! A closed surface of V vertices, E edges and F triangles has (2 − V + E − F)/2 handles. A lumen between such
//! surfaces, its outer wall and the bodies in it, has as many independent rings as they have handles in all, since a
//! handle of a body is a hole that a device can pass.

use crate::vessel::topology::{DisjointSets, EdgeTable};
use crate::vessel::{NO_NEIGHBOUR, Wall};

/// Number of handles of a wall's pieces, each opening counted as closed, without those of these openings; `None`
/// where an edge has more than two triangles, or is open without being part of an opening.
pub(in crate::vessel) fn handles(wall: &Wall, unreached: &[usize]) -> Option<usize> {
    let triangles = &wall.mesh().triangles;
    let table = EdgeTable::new(triangles);
    let (piece_of, count) = table.components(triangles.len());
    // The Euler characteristic of each piece: triangles, less edges, plus vertices and openings.
    let mut characteristic = vec![0_i64; count];
    piece_of.iter().for_each(|piece| characteristic[*piece as usize] += 1);
    let mut open = 0;
    let mut piece_of_vertex = vec![0; wall.mesh().vertices_mm.len()];
    for uses in table.edges() {
        if uses.len() > 2 {
            return None;
        }
        let piece = piece_of[uses[0].triangle as usize];
        characteristic[piece as usize] -= 1;
        if uses.len() == 1 {
            open += 1;
            piece_of_vertex[uses[0].low as usize] = piece;
        }
    }
    for (piece, fans) in fans(triangles, &table, &piece_of).into_iter().enumerate() {
        characteristic[piece] += fans;
    }
    let mut is_counted = vec![true; count];
    for opening in wall.openings() {
        open -= opening.boundary.len();
        let piece = opening.boundary.iter().map(|vertex| piece_of_vertex[*vertex as usize]).max()? as usize;
        characteristic[piece] += 1;
        is_counted[piece] &= !unreached.contains(&opening.index);
    }
    if open != 0 {
        return None;
    }
    let counted = characteristic.iter().zip(is_counted).filter(|(_, is_counted)| *is_counted);
    let twice: i64 = counted.map(|(characteristic, _)| 2 - characteristic).sum();
    usize::try_from(twice / 2).ok()
}

/// Number of vertices of each piece, one that several fans of triangles share counted once for each.
fn fans(triangles: &[[u32; 3]], table: &EdgeTable, piece_of: &[u32]) -> Vec<i64> {
    let mut corners = DisjointSets::new(3 * triangles.len());
    let across = table.neighbours(triangles.len());
    for (t, corner_of) in triangles.iter().enumerate() {
        for side in 0..3 {
            let other = across[t][side];
            if other == NO_NEIGHBOUR {
                continue;
            }
            for corner in [side, (side + 1) % 3] {
                let same = triangles[other as usize].iter().position(|v| *v == corner_of[corner]);
                if let Some(same) = same {
                    corners.join((3 * t + corner) as u32, 3 * other + same as u32);
                }
            }
        }
    }
    let (number, count) = corners.number();
    let mut is_known = vec![false; count];
    let mut fans = vec![0; piece_of.iter().max().map_or(0, |last| *last as usize + 1)];
    for (corner, number) in number.into_iter().enumerate() {
        if !std::mem::replace(&mut is_known[number as usize], true) {
            fans[piece_of[corner / 3] as usize] += 1;
        }
    }
    fans
}
