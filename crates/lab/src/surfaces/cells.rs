//! The parameters that are varied.

use serde::Serialize;

/// Increments of the hand, mm.
const INCREMENTS_MM: [f64; 3] = [0.5, 1.0, 2.0];
/// Element lengths, mm.
const ELEMENTS_MM: [f64; 3] = [1.0, 2.0, 4.0];
/// Coefficients of friction: none, hydrophilic, bare.
const FRICTIONS: [f64; 3] = [0.0, 0.1, 0.3];
/// Moduli of the wall, N/mm²: an artery's, a phantom's, and one that is rigid to a wire.
const MODULI_N_PER_MM2: [f64; 3] = [1.0, 100.0, 1e4];
/// Rotation of the hand in every command, degrees.
const TURNS_DEG: [f64; 2] = [0.0, 5.0];

/// One insertion of the matrix, into any surface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Cell {
    /// Index of the wire, among those of the surface.
    #[serde(skip)]
    pub wire: usize,
    /// Length pushed in by a command, mm.
    pub increment_mm: f64,
    /// Rotation per command, degrees.
    pub turn_deg: f64,
    /// Element length, mm.
    pub element_mm: f64,
    /// Coefficient of friction.
    pub friction: f64,
    /// Modulus of the wall, N/mm².
    pub modulus_n_per_mm2: f64,
}

impl Cell {
    /// The values of the cell, in the format matched by patterns: `step0.5 el2 mu0.1 k100 turn0`.
    pub fn name(&self) -> String {
        let Self { increment_mm, turn_deg, element_mm, friction, modulus_n_per_mm2, .. } = self;
        format!("step{increment_mm} el{element_mm} mu{friction} k{modulus_n_per_mm2} turn{turn_deg}")
    }

    fn at(wire: usize, turn: usize, [a, b, c, d]: [usize; 4]) -> Self {
        Self {
            wire,
            turn_deg: TURNS_DEG[turn],
            increment_mm: INCREMENTS_MM[a],
            element_mm: ELEMENTS_MM[b],
            friction: FRICTIONS[c],
            modulus_n_per_mm2: MODULI_N_PER_MM2[d],
        }
    }
}

/// The matrix for a surface that `wires` wires fit into: every combination (162 per wire), or a fixed subset (18 per
/// wire).
///
/// The subset is an orthogonal array: for every wire, with and without rotation, the nine rows (a, b, a + b, a + 2b)
/// mod 3 for all a and b, in which any two of the four columns take each of their nine pairs once (Rao, *J. R. Stat.
/// Soc. Suppl.* 9, 1947). So every pair of values occurs, and with a wire or a rotation every triple. The last two
/// columns are shifted from wire to wire and rotation to rotation, so that no combination of the four occurs twice
/// among two wires.
pub fn cells(wires: usize, full: bool) -> Vec<Cell> {
    let mut list = Vec::new();
    for wire in 0..wires {
        for turn in 0..TURNS_DEG.len() {
            for a in 0..3 {
                for b in 0..3 {
                    let (shift, twist) = (wire % 2, turn);
                    if full {
                        for rest in 0..9 {
                            list.push(Cell::at(wire, turn, [a, b, rest / 3, rest % 3]));
                        }
                    } else {
                        list.push(Cell::at(
                            wire,
                            turn,
                            [a, b, (a + b + shift) % 3, (a + 2 * b + 2 * twist) % 3],
                        ));
                    }
                }
            }
        }
    }
    list
}

/// Whether `name` contains all words of `pattern`; a `*` in a word matches anything. Without words, everything
/// matches.
pub fn matches(name: &str, pattern: &str) -> bool {
    let ends = |c: Option<char>| c.is_none_or(char::is_whitespace);
    pattern.split_whitespace().all(|word| {
        if !word.contains('*') {
            // A whole word of the name, so that `k1` does not match `k100`, or the beginning of the surface's.
            return name.match_indices(word).any(|(at, _)| {
                let (before, after) =
                    (name[..at].chars().next_back(), name[at + word.len()..].chars().next());
                ends(before) && (ends(after) || at == 0)
            });
        }
        let mut rest = name;
        word.split('*').all(|piece| match rest.find(piece) {
            Some(at) => {
                rest = &rest[at + piece.len()..];
                true
            }
            None => false,
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    /// The values of a cell as a list of numbers.
    fn places(cell: &Cell) -> [usize; 6] {
        let place = |list: &[f64], value: f64| list.iter().position(|v| *v == value).unwrap();
        [
            cell.wire,
            place(&TURNS_DEG, cell.turn_deg),
            place(&INCREMENTS_MM, cell.increment_mm),
            place(&ELEMENTS_MM, cell.element_mm),
            place(&FRICTIONS, cell.friction),
            place(&MODULI_N_PER_MM2, cell.modulus_n_per_mm2),
        ]
    }

    #[test]
    fn the_subset_meets_every_pair_of_values_and_the_full_matrix_everything() {
        let subset = cells(2, false);
        assert_eq!(subset.len(), 36);
        let sizes = [2, 2, 3, 3, 3, 3];
        for one in 0..6 {
            for other in 0..one {
                let met: BTreeSet<[usize; 2]> =
                    subset.iter().map(places).map(|p| [p[one], p[other]]).collect();
                assert_eq!(met.len(), sizes[one] * sizes[other], "{one} {other}");
            }
        }
        let different: BTreeSet<Vec<usize>> = subset.iter().map(|c| places(c)[2..].to_vec()).collect();
        assert_eq!(different.len(), 36);
        let full = cells(2, true);
        let all: BTreeSet<[usize; 6]> = full.iter().map(places).collect();
        assert_eq!((full.len(), all.len()), (324, 324));
        assert!(subset.iter().all(|cell| full.contains(cell)));
    }

    #[test]
    fn a_pattern_names_a_surface_a_value_or_one_cell() {
        let name = "phantom.obj@3 0.035 step0.5 el2 mu0.1 k100 turn0";
        for pattern in ["", name, "phantom", "phantom.obj", "k100 mu0.1", "*@3*0.035*turn0", "el2 phan*"] {
            assert!(matches(name, pattern), "{pattern}");
        }
        for pattern in ["k1", "step0", "carotid", "*@1*", "mu0.1 k1", "5"] {
            assert!(!matches(name, pattern), "{pattern}");
        }
    }
}
