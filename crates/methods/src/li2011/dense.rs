//! The paper's own solve: A B⁻¹ x = b as a dense system (eqs. 10–12), by an LU factorisation.
//!
//! With c = x₀ + ½h₁t₀ the part of every xᵢ that the sheath alone gives, eq. 11 reads B t = x − c.
//! B is block lower triangular with Bᵢⱼ = ½(hⱼ + hⱼ₊₁) for j < i and Bᵢᵢ = ½hᵢ, and its inverse follows from
//! tᵢ = 2(xᵢ − xᵢ₋₁)/hᵢ − tᵢ₋₁ without any factorisation, as section 2.2.4 remarks. Setting ∂U/∂t = 0,
//!
//! ```text
//! A = K + κ Σⱼ Bⱼᵀ nⱼ nⱼᵀ Bⱼ                K: bending, block tridiagonal
//! b = K₁₀ t₀ + Σⱼ κ (dⱼ − nⱼ·c) Bⱼᵀ nⱼ + Bᵀ f
//! ```
//!
//! A B⁻¹ mixes levers of the whole length with those of one element: its condition number reaches 10¹⁰ at 300 nodes, and
//! one solve leaves a micrometre. Iterative refinement with the residual of the equations themselves
//! ([`Chain::residual`]) removes it for the price of a few triangular solves.

use nalgebra::DMatrix;

use super::chain::Chain;
use crate::full::{Factors, times_lower};
use endowire_core::Vec3;

/// Solves for positions x₁…xₙ and tangents t₁…tₙ at the minimum of the energy of `chain`.
///
/// O(n³) time, O(n²) memory: four dense matrices of (3n)² numbers.
pub fn solve(chain: &Chain, positions_mm: &mut Vec<Vec3>, tangents: &mut Vec<Vec3>) {
    positions_mm.clear();
    tangents.clear();
    let n = chain.elements();
    if n == 0 {
        return;
    }
    let (a, b) = stationarity(chain);
    let factors = Factors::of(times_lower(&a, &inverse_of_b(chain)));
    tangents.resize(n, Vec3::zeros());
    add_tangents(chain, &factors.solve(&b), tangents);
    let mut residual = Vec::with_capacity(n);
    for _ in 0..REFINEMENTS {
        chain.integrate(tangents, positions_mm);
        chain.residual(tangents, positions_mm, &mut residual);
        let right = DMatrix::from_fn(3 * n, 1, |row, _| residual[row / 3][row % 3]);
        add_tangents(chain, &factors.solve(&right), tangents);
    }
    chain.integrate(tangents, positions_mm);
}

/// Rounds of refinement: each gains about six digits at 300 nodes; the second reaches rounding.
const REFINEMENTS: usize = 2;

/// t += B⁻¹ x for a column x.
fn add_tangents(chain: &Chain, x: &DMatrix<f64>, tangents: &mut [Vec3]) {
    let (mut x_previous, mut t_previous) = (Vec3::zeros(), Vec3::zeros());
    for (i, tangent) in tangents.iter_mut().enumerate() {
        let x = Vec3::from_fn(|k, _| x[(3 * i + k, 0)]);
        let t = (x - x_previous) * (2.0 / chain.lengths_mm[i]) - t_previous;
        *tangent += t;
        (x_previous, t_previous) = (x, t);
    }
}

/// c: the position that every node has when all unknown tangents are zero.
fn sheath_part(chain: &Chain) -> Vec3 {
    chain.start_mm + chain.start_tangent * (0.5 * chain.lengths_mm[0])
}

/// Scalar Bᵢⱼ of eq. 11 for 0-based node i and tangent j ≤ i.
fn b_entry(chain: &Chain, i: usize, j: usize) -> f64 {
    let h = &chain.lengths_mm;
    if i == j { 0.5 * h[j] } else { 0.5 * (h[j] + h[j + 1]) }
}

/// B⁻¹: row i is 2/hᵢ (row of xᵢ − xᵢ₋₁) minus row i−1, so its entries alternate in sign down each column.
fn inverse_of_b(chain: &Chain) -> DMatrix<f64> {
    let n = chain.elements();
    let h = &chain.lengths_mm;
    let mut inverse = DMatrix::<f64>::zeros(3 * n, 3 * n);
    for j in 0..n {
        let mut entry = 2.0 / h[j];
        for i in j..n {
            if i > j {
                // xⱼ also enters the difference of element j+1.
                entry = -entry - if i == j + 1 { 2.0 / h[i] } else { 0.0 };
            }
            for k in 0..3 {
                inverse[(3 * i + k, 3 * j + k)] = entry;
            }
        }
    }
    inverse
}

/// A and b of eq. 10.
fn stationarity(chain: &Chain) -> (DMatrix<f64>, DMatrix<f64>) {
    let n = chain.elements();
    let mut a = DMatrix::<f64>::zeros(3 * n, 3 * n);
    let mut b = DMatrix::<f64>::zeros(3 * n, 1);
    for i in 0..n {
        let stiffness = chain.bending_stiffness_nmm2[i] / chain.lengths_mm[i];
        for k in 0..3 {
            let here = 3 * i + k;
            a[(here, here)] += stiffness;
            if i == 0 {
                b[(here, 0)] += stiffness * chain.start_tangent[k];
            } else {
                a[(here - 3, here - 3)] += stiffness;
                a[(here - 3, here)] -= stiffness;
                a[(here, here - 3)] -= stiffness;
            }
        }
        for j in 0..=i {
            let weight = b_entry(chain, i, j);
            for k in 0..3 {
                b[(3 * j + k, 0)] += weight * chain.forces_n[i][k];
            }
        }
    }

    // Contact rows √κ nⱼᵀBⱼ: their Gram matrix is the wall's share of A.
    let kappa = chain.wall_stiffness_n_per_mm;
    let mut rows = DMatrix::<f64>::zeros(chain.contacts.len(), 3 * n);
    let sheath_part = sheath_part(chain);
    for (row, contact) in chain.contacts.iter().enumerate() {
        let i = contact.node - 1;
        let gap = contact.offset_mm - contact.normal.dot(&sheath_part);
        for j in 0..=i {
            let weight = b_entry(chain, i, j);
            for k in 0..3 {
                let entry = weight * contact.normal[k];
                rows[(row, 3 * j + k)] = kappa.sqrt() * entry;
                b[(3 * j + k, 0)] += kappa * gap * entry;
            }
        }
    }
    // As a product of two: nalgebra has no fast one of a transposed matrix.
    a.gemm(1.0, &rows.transpose(), &rows, 1.0);
    (a, b)
}
