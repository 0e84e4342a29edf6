//! The unknowns of a course, and the matrix of its energy.

use nalgebra::DMatrix;

use super::super::CentrelineTree;
use super::chains::Chain;
use super::spec::{OfRow, YieldingEnds, YieldingSpec};
use super::spline::FELT;
use crate::{Error, Result};

/// What holds a course: rows of held ends, and tethers by row with their stiffness, N/mm.
pub(super) struct Held {
    ends: Vec<usize>,
    pub(super) tethers: Vec<(usize, f64)>,
}

impl Held {
    /// Ends where the vessel is cut are held if the table says so; closed ones are not.
    pub(super) fn of(tree: &CentrelineTree, spec: &YieldingSpec) -> Result<Self> {
        let children = tree.children();
        let leaves = (0..children.len()).filter(|row| *row == 0 || children[*row].is_empty());
        let open = leaves.filter(|row| tree.closed_ends().binary_search(row).is_err());
        let ends = if spec.ends() == YieldingEnds::Held { open.collect() } else { Vec::new() };
        Ok(Self { ends, tethers: spec.tethers_of(tree)? })
    }
}

/// What a course is made of.
pub(super) struct Properties<'a> {
    pub(super) rows: &'a [OfRow],
    pub(super) tethers: &'a [(usize, f64)],
}

/// Each coefficient as a sum of unknowns.
type OfUnknowns = Vec<Vec<(usize, f64)>>;

/// Expresses all coefficients by unknowns, and counts these.
pub(super) fn unknowns(chains: &[Chain], firsts: &[usize], held: &Held) -> (OfUnknowns, usize) {
    let mut of: OfUnknowns = Vec::new();
    let mut count = 0;
    for chain in chains {
        let last = chain.spline.count() - 1;
        let ends_held = [chain.rows[0], chain.rows[chain.rows.len() - 1]].map(|row| held.ends.contains(&row));
        for k in 0..=last {
            // The run from which it comes was begun before, so that its coefficients are known.
            if let (0, Some((from, arc_mm))) = (k, chain.off) {
                let basis = chains[from].spline.at(arc_mm);
                let all = (0..FELT).flat_map(|i| {
                    let share = basis.derivatives[0][i];
                    of[firsts[from] + basis.first + i]
                        .iter()
                        .map(move |(unknown, part)| (*unknown, part * share))
                });
                let all = all.filter(|(_, share)| *share != 0.0).collect();
                of.push(all);
            } else if (k == 0 && ends_held[0]) || (k == last && ends_held[1]) {
                of.push(Vec::new());
            } else {
                of.push(vec![(count, 1.0)]);
                count += 1;
            }
        }
    }
    (of, count)
}

/// Gauss's rule with six points on (0, 1): places and weights.
const GAUSS: [(f64, f64); 6] = [
    (0.033_765_242_898_423_99, 0.085_662_246_189_585_17),
    (0.169_395_306_766_867_74, 0.180_380_786_524_069_3),
    (0.380_690_406_958_401_55, 0.233_956_967_286_345_52),
    (0.619_309_593_041_598_5, 0.233_956_967_286_345_52),
    (0.830_604_693_233_132_2, 0.180_380_786_524_069_3),
    (0.966_234_757_101_576, 0.085_662_246_189_585_17),
];

/// A₁.
pub(super) fn assemble(
    chains: &[Chain],
    firsts: &[usize],
    (of, unknowns): (&OfUnknowns, usize),
    properties: &Properties<'_>,
) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(unknowns, unknowns);
    let mut add = |i: usize, j: usize, value: f64| {
        for (p, share) in &of[i] {
            for (q, part) in &of[j] {
                matrix[(*p, *q)] += value * share * part;
            }
        }
    };
    for (chain, first) in chains.iter().zip(firsts) {
        let at = |arc_mm: f64, of: fn(&OfRow) -> f64| {
            chain.between(arc_mm, |k| of(&properties.rows[chain.rows[k]]))
        };
        let h = chain.spline.span_mm();
        for span in 0..chain.spline.spans() {
            for (place, weight) in GAUSS {
                let arc_mm = (span as f64 + place) * h;
                let basis = chain.spline.at(arc_mm);
                let bending = at(arc_mm, |row| row.bending_nmm2) * weight * h;
                let support = at(arc_mm, |row| row.support_n_per_mm2) * weight * h;
                let [values, _, bends, _] = &basis.derivatives;
                for i in 0..FELT {
                    for j in 0..FELT {
                        let value = bending * bends[i] * bends[j] + support * values[i] * values[j];
                        add(first + basis.first + i, first + basis.first + j, value);
                    }
                }
            }
        }
        // A row where runs meet is one of all of them, and held once: by the run that goes through it.
        let own = usize::from(chain.off.is_some());
        for (row, stiffness_n_per_mm) in properties.tethers {
            let Some(k) = chain.rows.iter().skip(own).position(|own| own == row) else { continue };
            let basis = chain.spline.at(chain.arcs_mm[k + own]);
            let values = &basis.derivatives[0];
            for i in 0..FELT {
                for j in 0..FELT {
                    let value = stiffness_n_per_mm * values[i] * values[j];
                    add(first + basis.first + i, first + basis.first + j, value);
                }
            }
        }
    }
    matrix
}

/// Its inverse.
pub(super) fn inverse(matrix: &DMatrix<f64>) -> Result<DMatrix<f64>> {
    matrix.clone().cholesky().map(|factors| factors.inverse()).ok_or_else(|| {
        let remedy = "holds the vessel too little beside its stiffness: give a stiffer support";
        Error::parameter("vessel.yielding.support_n_per_mm2", "given", remedy)
    })
}
