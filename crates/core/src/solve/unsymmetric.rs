//! Unsymmetric stiffness of follower loads, as rank-one terms beside the band.

use super::newton::Newton;

/// Largest number of unsymmetric rank-one terms.
const MAX_RANK: usize = 24;

impl<const C: usize> Newton<C> {
    /// Woodbury's formula for the unsymmetric rank-one terms, which keeps Newton's step exact. Returns the sign of
    /// det(I + QᵀS⁻¹P), the ratio of the determinants with and without them.
    pub(super) fn unsymmetric(&mut self) -> f64 {
        let rank = self.assembly.rank_ones.len().min(MAX_RANK);
        let mut sign = 1.0;
        if rank == 0 {
            return sign;
        }
        while self.columns.len() < rank {
            self.columns.push(vec![0.0; self.step.len()]);
        }
        let terms = &self.assembly.rank_ones[..rank];
        let mut small = [[0.0; MAX_RANK + 1]; MAX_RANK];
        for (k, term) in terms.iter().enumerate() {
            let column = &mut self.columns[k];
            column.fill(0.0);
            column[term.row..term.row + 3].copy_from_slice(&term.p);
            self.factor.solve(column);
        }
        let along = |x: &[f64], k: usize| -> f64 {
            let t = &terms[k];
            (0..3).map(|a| t.q[a] * x[t.column + a]).sum()
        };
        for i in 0..rank {
            for j in 0..rank {
                small[i][j] = along(&self.columns[j], i) + f64::from(u8::from(i == j));
            }
            small[i][MAX_RANK] = along(&self.step, i);
        }
        // Gaussian elimination with partial pivoting.
        for k in 0..rank {
            let mut p = k;
            for i in k + 1..rank {
                if small[i][k].abs() > small[p][k].abs() {
                    p = i;
                }
            }
            if p != k {
                small.swap(k, p);
                sign = -sign;
            }
            if small[k][k].abs() < 1e-12 {
                return 0.0;
            }
            sign *= small[k][k].signum();
            for i in k + 1..rank {
                let f = small[i][k] / small[k][k];
                for j in k..=MAX_RANK {
                    small[i][j] -= f * small[k][j];
                }
            }
        }
        let mut x = [0.0; MAX_RANK];
        for k in (0..rank).rev() {
            let mut sum = small[k][MAX_RANK];
            for j in k + 1..rank {
                sum -= small[k][j] * x[j];
            }
            x[k] = sum / small[k][k];
        }
        for (k, value) in x[..rank].iter().enumerate() {
            for (s, c) in self.step.iter_mut().zip(&self.columns[k]) {
                *s -= value * c;
            }
        }
        sign
    }
}
