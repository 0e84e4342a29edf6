//! Few energies instead of many: Gauss quadrature of a tabulated spectrum.
//!
//! A frame cannot afford a hundred energies per ray. For a discrete measure Σ wᵢ δ(xᵢ) the n-point Gauss rule has
//! positive weights and integrates polynomials up to degree 2n − 1 exactly; its nodes are the eigenvalues of the
//! Jacobi matrix of the orthogonal polynomials, its weights the squared first components of the eigenvectors (Golub
//! and Welsch, Mathematics of Computation 23, 1969), and the matrix is computed by Lanczos' recurrence on the
//! measure.

use endowire_core::nalgebra::DMatrix;

/// Gauss rule with at most `count` nodes: (node, weight), ascending. Fewer points than that are their own rule.
pub(super) fn gauss(points: &[(f64, f64)], count: usize) -> Vec<(f64, f64)> {
    let points: Vec<(f64, f64)> = points.iter().copied().filter(|p| p.1 > 0.0).collect();
    if points.len() <= count {
        return points;
    }
    let total: f64 = points.iter().map(|p| p.1).sum();
    // Lanczos with A = diag(x) from √w, reorthogonalised: the rows of `basis` are the orthonormal polynomials at the points.
    let mut basis: Vec<Vec<f64>> = vec![points.iter().map(|p| (p.1 / total).sqrt()).collect()];
    let mut jacobi = DMatrix::<f64>::zeros(count, count);
    for n in 0..count {
        let mut next: Vec<f64> = points.iter().zip(&basis[n]).map(|(p, v)| p.0 * v).collect();
        jacobi[(n, n)] = dot(&next, &basis[n]);
        for _ in 0..2 {
            for row in &basis {
                let part = dot(&next, row);
                next.iter_mut().zip(row).for_each(|(a, b)| *a -= part * b);
            }
        }
        let norm = dot(&next, &next).sqrt();
        if n + 1 < count {
            jacobi[(n, n + 1)] = norm;
            jacobi[(n + 1, n)] = norm;
            basis.push(next.iter().map(|v| v / norm).collect());
        }
    }
    let eigen = jacobi.symmetric_eigen();
    let mut rule: Vec<(f64, f64)> =
        (0..count).map(|k| (eigen.eigenvalues[k], total * eigen.eigenvectors[(0, k)].powi(2))).collect();
    rule.sort_by(|a, b| a.0.total_cmp(&b.0));
    rule
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_to_degree_two_n_minus_one_are_exact_and_the_next_is_not() {
        let points: Vec<(f64, f64)> =
            (0..40).map(|i| (f64::from(i) / 7.0, 1.0 + (0.3 * f64::from(i)).sin())).collect();
        let moment = |rule: &[(f64, f64)], d: i32| rule.iter().map(|p| p.1 * p.0.powi(d)).sum::<f64>();
        let rule = gauss(&points, 4);
        assert!(rule.len() == 4 && rule.iter().all(|p| p.1 > 0.0 && p.0 > 0.0 && p.0 < 40.0 / 7.0));
        for d in 0..8 {
            assert!((moment(&rule, d) / moment(&points, d) - 1.0).abs() < 1e-12, "{d}");
        }
        assert!((moment(&rule, 8) / moment(&points, 8) - 1.0).abs() > 1e-6);
    }

    #[test]
    fn few_points_are_their_own_rule() {
        let points = [(1.0, 0.5), (2.0, 0.0), (3.0, 0.25)];
        assert_eq!(gauss(&points, 2), [(1.0, 0.5), (3.0, 0.25)]);
    }
}
