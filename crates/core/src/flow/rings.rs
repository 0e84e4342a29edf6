//! How a stream divides among the arms of rings: as the pressure does not depend on the way.
//!
//! Flows through the stretches of a vessel that let nothing vanish may differ by a stream around each ring. Those around
//! the rings that satisfy Poiseuille's law are found from as many linear equations as there are rings: along each, the
//! sum of resistance times flow is zero (Kirchhoff's second law, with a stream for each ring as in Maxwell's method).
//! In a tree there is none, and nothing is changed.

use nalgebra::{DMatrix, DVector};

/// Resistance of a stretch of this length between two radii, without the factor 8 μ/π, 1/mm³.
pub(super) fn resistance_per_mm3(length_mm: f64, [a, b]: [f64; 2]) -> f64 {
    // ∫ ds/r⁴ with a linear radius.
    length_mm * (a * a + a * b + b * b) / (3.0 * (a * b).powi(3))
}

/// The rings of a vessel, as loops of stretches.
#[derive(Debug, Clone)]
pub struct Rings {
    /// The stretches of each ring with their sign, 1 where they lead around it in its direction.
    loops: Vec<Vec<(usize, f64)>>,
    resistances: Vec<f64>,
    /// Inverse of the resistances around each ring and common to two.
    inverse: DMatrix<f64>,
}

impl Rings {
    /// The rings that these links close: each from a point to another one. `upstream` has the point before each, towards
    /// the inlet; points are before those that they lead to. A stretch is numbered as the point at its downstream end,
    /// links follow; `resistances` are those of all of these, in any unit.
    pub fn new(upstream: &[Option<usize>], links: &[[usize; 2]], resistances: Vec<f64>) -> Self {
        let count = upstream.len();
        let ring = |(k, [from, to]): (usize, &[usize; 2])| {
            let mut steps = vec![(count + k, 1.0)];
            let (mut a, mut b) = (*from, *to);
            // The higher numbers are farther from the inlet.
            while a != b {
                let (at, sign) = if a > b { (&mut a, 1.0) } else { (&mut b, -1.0) };
                steps.push((*at, sign));
                match upstream[*at] {
                    Some(before) => *at = before,
                    None => break,
                }
            }
            steps
        };
        let loops: Vec<Vec<(usize, f64)>> = links.iter().enumerate().map(ring).collect();
        let shared = |a: usize, b: usize| {
            let own: rustc_hash::FxHashMap<usize, f64> = loops[a].iter().copied().collect();
            let both = loops[b].iter().filter_map(|(at, sign)| Some(own.get(at)? * sign * resistances[*at]));
            both.sum::<f64>()
        };
        let matrix = DMatrix::from_fn(loops.len(), loops.len(), shared);
        // Without resistance a ring keeps the flow that it is given.
        let inverse =
            matrix.cholesky().map_or_else(|| DMatrix::zeros(loops.len(), loops.len()), |ldl| ldl.inverse());
        Self { loops, resistances, inverse }
    }

    /// Adds the streams around rings with which the pressure does not depend on the way: to the flow through each
    /// stretch, downstream, and through each link.
    pub fn settle(&self, flows: &mut [f64]) {
        if self.loops.is_empty() {
            return;
        }
        let drop = |steps: &Vec<(usize, f64)>| {
            steps.iter().map(|(at, sign)| sign * self.resistances[*at] * flows[*at]).sum::<f64>()
        };
        let drops = DVector::from_iterator(self.loops.len(), self.loops.iter().map(drop));
        let streams = &self.inverse * drops;
        for (steps, stream) in self.loops.iter().zip(streams.iter()) {
            steps.iter().for_each(|(at, sign)| flows[*at] -= sign * stream);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stream_divides_as_the_conductances_of_two_arms() {
        // 0 inlet, 1 fork, 2 short arm, 3 meeting, 4 outlet, 5 long arm.
        let upstream = [None, Some(0), Some(1), Some(2), Some(3), Some(1)];
        let rings = Rings::new(&upstream, &[[5, 3]], vec![0.0, 9.0, 1.0, 1.0, 9.0, 5.0, 1.0]);
        let mut flows = [1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0];
        rings.settle(&mut flows);
        let expected = [1.0, 1.0, 0.75, 0.75, 1.0, 0.25, 0.25];
        assert!(flows.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{flows:?}");
        // Once settled, it stays.
        let before = flows;
        rings.settle(&mut flows);
        assert!(flows.iter().zip(before).all(|(a, b)| (a - b).abs() < 1e-12));
        // A tree is left as it is, to the bit.
        let none = Rings::new(&upstream, &[], vec![1.0; 6]);
        let mut same = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6];
        none.settle(&mut same);
        assert_eq!(same, [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]);
    }

    #[test]
    fn a_bridge_between_equal_arms_carries_nothing() {
        // Wheatstone: 1 fork, 2 and 3 the arms, 4 the meeting behind 2; 3 joins 4, and a bridge 2 to 3.
        let upstream = [None, Some(0), Some(1), Some(1), Some(2)];
        let resistances = |last: f64| vec![0.0, 1.0, 2.0, 2.0, last, 3.0, 7.0];
        let settled = |last: f64| {
            let mut flows = [1.0, 1.0, 1.0, 0.0, 1.0, 0.0, 0.0];
            Rings::new(&upstream, &[[3, 4], [2, 3]], resistances(last)).settle(&mut flows);
            flows
        };
        let even = settled(3.0);
        assert!(even[6].abs() < 1e-12 && (even[2] - 0.5).abs() < 1e-12, "{even:?}");
        // The twin: unequal arms drive a stream through it.
        assert!(settled(6.0)[6] > 0.01);
    }
}
