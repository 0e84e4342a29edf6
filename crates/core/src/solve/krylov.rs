//! GMRES (Y. Saad, M. H. Schultz, *GMRES: a generalized minimal residual algorithm for solving nonsymmetric linear systems*, SIAM J.
//! Sci. Stat. Comput. 7 (1986)): for operators that are known by their products alone.

/// Solves A x = b, with the products `apply` of A, until |b − A x| ≤ `tolerance` |b| or for `most` products. Returns x, and |b − A x|/|b|.
pub(crate) fn gmres(
    b: &[f64],
    (tolerance, most): (f64, usize),
    mut apply: impl FnMut(&[f64]) -> Vec<f64>,
) -> (Vec<f64>, f64) {
    let size = norm(b);
    let mut x = vec![0.0; b.len()];
    if size == 0.0 {
        return (x, 0.0);
    }
    let mut basis = vec![scaled(b, 1.0 / size)];
    // Columns of the triangular factor of the Hessenberg matrix, the rotations that make it, and the rotated right-hand side.
    let mut columns: Vec<Vec<f64>> = Vec::new();
    let mut rotations: Vec<(f64, f64)> = Vec::new();
    let mut right = vec![size];
    while columns.len() < most && right[columns.len()].abs() > tolerance * size {
        let k = columns.len();
        let mut next = apply(&basis[k]);
        let mut column: Vec<f64> = Vec::with_capacity(k + 2);
        for vector in &basis {
            let part = dot(vector, &next);
            add(&mut next, -part, vector);
            column.push(part);
        }
        let left = norm(&next);
        column.push(left);
        for (i, (c, s)) in rotations.iter().enumerate() {
            (column[i], column[i + 1]) =
                (c * column[i] + s * column[i + 1], c * column[i + 1] - s * column[i]);
        }
        let length = libm::hypot(column[k], column[k + 1]);
        if length == 0.0 || !length.is_finite() {
            break;
        }
        let (c, s) = (column[k] / length, column[k + 1] / length);
        rotations.push((c, s));
        column[k] = length;
        column.truncate(k + 1);
        columns.push(column);
        right.push(-s * right[k]);
        right[k] *= c;
        if left == 0.0 {
            break;
        }
        basis.push(scaled(&next, 1.0 / left));
    }
    let count = columns.len();
    let mut parts = right[..count].to_vec();
    for k in (0..count).rev() {
        parts[k] /= columns[k][k];
        for i in 0..k {
            parts[i] -= columns[k][i] * parts[k];
        }
    }
    for (part, vector) in parts.iter().zip(&basis) {
        add(&mut x, *part, vector);
    }
    (x, right[count].abs() / size)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

fn scaled(a: &[f64], by: f64) -> Vec<f64> {
    a.iter().map(|a| a * by).collect()
}

fn add(to: &mut [f64], part: f64, what: &[f64]) {
    to.iter_mut().zip(what).for_each(|(to, what)| *to += part * what);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unsymmetric_system_is_solved_in_as_many_products_as_it_has_other_eigenvalues() {
        let matrix = [[4.0, 1.0, 0.0], [0.5, 3.0, -1.0], [0.0, 2.0, 5.0]];
        let times = |v: &[f64]| -> Vec<f64> { matrix.iter().map(|row| dot(row, v)).collect() };
        let exact = [1.0, -2.0, 0.5];
        let mut products = 0;
        let solve = |most: usize, products: &mut usize| {
            gmres(&times(&exact), (1e-14, most), |v| {
                *products += 1;
                times(v)
            })
        };
        let (x, off) = solve(10, &mut products);
        assert!(off < 1e-13 && products == 3, "{off} {products}");
        assert!(x.iter().zip(&exact).all(|(a, b)| (a - b).abs() < 1e-12), "{x:?}");
        // Two are too few.
        assert!(solve(2, &mut products).1 > 1e-3);
        // With one eigenvalue one is enough.
        let double = |v: &[f64]| vec![2.0 * v[0], 2.0 * v[1]];
        let (x, _) = gmres(&[2.0, 4.0], (1e-14, 1), double);
        assert!((x[0] - 1.0).abs() + (x[1] - 2.0).abs() < 1e-15, "{x:?}");
        assert_eq!(gmres(&[0.0; 2], (1e-14, 5), double).0, [0.0; 2]);
    }
}
