//! Orients triangles consistently with their neighbours.

use super::topology::{Edges, NONE};

/// The result of [`make_consistent`].
#[derive(Debug)]
pub(crate) struct Consistency {
    /// The patch of each triangle: what is connected through edges of exactly two triangles.
    pub(crate) patch: Vec<u32>,
    /// Number of patches.
    pub(crate) patches: usize,
    /// Triangles turned over.
    #[cfg(test)]
    flipped: Vec<bool>,
    /// Edges with contradictory orientations: the surface is one-sided there (a Möbius strip).
    pub(crate) contradictions: usize,
}

/// Turns triangles over until neighbours traverse their common edge in opposite directions. In each patch the
/// majority keeps its direction (on a tie that of the first triangle), so that a few flipped faces are the ones
/// reported. `edges` are those of the triangles.
pub(crate) fn make_consistent(triangles: &mut [[u32; 3]], edges: &mut Edges) -> Consistency {
    let table = edges.of(triangles);
    let across = table.neighbours(triangles.len());
    let mut agrees = vec![[true; 3]; triangles.len()];
    for uses in table.edges() {
        if let [a, b] = uses {
            agrees[a.triangle as usize][a.side as usize] = a.forward != b.forward;
            agrees[b.triangle as usize][b.side as usize] = a.forward != b.forward;
        }
    }
    let mut patch = vec![NONE; triangles.len()];
    let mut flipped = vec![false; triangles.len()];
    let mut patches = 0;
    let mut contradictions = 0;
    let mut members = Vec::new();
    for seed in 0..triangles.len() {
        if patch[seed] != NONE {
            continue;
        }
        members.clear();
        members.push(seed);
        patch[seed] = patches;
        let mut next = 0;
        while next < members.len() {
            let t = members[next];
            next += 1;
            for side in 0..3 {
                let other = across[t][side] as usize;
                if across[t][side] == NONE {
                    continue;
                }
                if patch[other] == NONE {
                    patch[other] = patches;
                    flipped[other] = flipped[t] ^ !agrees[t][side];
                    members.push(other);
                } else if (flipped[t] ^ flipped[other]) == agrees[t][side] {
                    contradictions += 1;
                }
            }
        }
        let turned = members.iter().filter(|&&t| flipped[t]).count();
        if 2 * turned > members.len() {
            for &t in &members {
                flipped[t] = !flipped[t];
            }
        }
        patches += 1;
    }
    for (triangle, _) in triangles.iter_mut().zip(&flipped).filter(|(_, flip)| **flip) {
        triangle.swap(1, 2);
        edges.changed();
    }
    // Each contradiction was counted from both sides.
    Consistency {
        patch,
        patches: patches as usize,
        #[cfg(test)]
        flipped,
        contradictions: contradictions / 2,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of `n` triangles, closed into a ring with or without a half twist.
    fn ring(n: u32, twist: bool) -> Vec<[u32; 3]> {
        let vertex = |i: u32| {
            let around = i % (2 * n);
            if twist && i >= 2 * n { around ^ 1 } else { around }
        };
        (0..n)
            .flat_map(|i| {
                let [a, b, c, d] = [2 * i, 2 * i + 1, 2 * i + 2, 2 * i + 3].map(vertex);
                [[a, b, c], [c, b, d]]
            })
            .collect()
    }

    #[test]
    fn flipped_faces_are_found_and_turned_back() {
        let clean = ring(20, false);
        let mut dirty = clean.clone();
        for t in [3, 4, 17] {
            dirty[t].swap(1, 2);
        }
        let outcome = make_consistent(&mut dirty, &mut Edges::default());
        assert_eq!(dirty, clean);
        assert_eq!((outcome.patches, outcome.contradictions), (1, 0));
        let turned: Vec<usize> = (0..clean.len()).filter(|&t| outcome.flipped[t]).collect();
        assert_eq!(turned, [3, 4, 17]);
    }

    #[test]
    fn a_moebius_strip_is_reported_as_contradiction_and_a_plain_ring_is_not() {
        assert!(make_consistent(&mut ring(20, true), &mut Edges::default()).contradictions > 0);
        assert_eq!(make_consistent(&mut ring(20, false), &mut Edges::default()).contradictions, 0);
    }
}
