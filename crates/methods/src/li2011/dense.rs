//! The paper's own solve: A B⁻¹ x = b as a dense system (eqs. 10–12), by faer's LU.
//!
//! With c = x₀ + ½h₁t₀ the part of every xᵢ due to the sheath alone, eq. 11 reads B t = x − c. B is block lower
//! triangular with Bᵢⱼ = ½(hⱼ + hⱼ₊₁) for j < i and Bᵢᵢ = ½hᵢ, and its inverse follows from tᵢ = 2(xᵢ − xᵢ₋₁)/hᵢ −
//! tᵢ₋₁ without factorisation, as section 2.2.4 remarks. Setting ∂U/∂t = 0,
//!
//! ```text
//! A = K + Σⱼ kⱼ Bⱼᵀ nⱼ nⱼᵀ Bⱼ               K: bending, block tridiagonal
//! b = K₁₀ t₀ + Σⱼ kⱼ (dⱼ − nⱼ·c) Bⱼᵀ nⱼ + Bᵀ f
//! ```
//!
//! Unit tangents add the rows t̂ᵢ·tᵢ = 1 with their multipliers λ. With T the matrix with t̂ᵢ in the rows of node i
//! and column i,
//!
//! ```text
//! ⎡ A B⁻¹    T ⎤ ⎡ x − c ⎤   ⎡ b ⎤
//! ⎣ Tᵀ B⁻¹   0 ⎦ ⎣   λ   ⎦ = ⎣ 1 ⎦
//! ```
//!
//! A B⁻¹ mixes levers of the whole length with those of one element: its condition number reaches 10¹⁰ at 300 nodes,
//! and one solve has an error of a micrometre. Iterative refinement with the residual of the equations themselves
//! ([`Chain::residual`]) removes it at the cost of a few triangular solves.

use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::solvers::Solve;
use faer::{Accum, Mat, Par};

use super::chain::Chain;
use endowire_core::Vec3;

/// Solves for positions x₁…xₙ and tangents t₁…tₙ at the minimum of the energy of `chain`.
///
/// O(n³) time, O(n²) memory: four dense matrices of (3n)² numbers, (4n)² with unit tangents.
pub fn solve(chain: &Chain, positions_mm: &mut Vec<Vec3>, tangents: &mut Vec<Vec3>) {
    positions_mm.clear();
    tangents.clear();
    let n = chain.elements();
    if n == 0 {
        return;
    }
    let (a, b) = stationarity(chain);
    let inverse_of_b = inverse_of_b(chain);
    let held = chain.directions.len();
    let size = 3 * n + held;
    let mut system = Mat::<f64>::zeros(size, size);
    triangular::matmul(
        system.as_mut().submatrix_mut(0, 0, 3 * n, 3 * n),
        BlockStructure::Rectangular,
        Accum::Replace,
        a.as_ref(),
        BlockStructure::Rectangular,
        inverse_of_b.as_ref(),
        BlockStructure::TriangularLower,
        1.0,
        Par::Seq,
    );
    for (i, direction) in chain.directions.iter().enumerate() {
        let row = 3 * n + i;
        for (k, component) in direction.iter().enumerate() {
            system[(3 * i + k, row)] = *component;
            for j in 0..=i {
                system[(row, 3 * j + k)] = component * inverse_of_b[(3 * i + k, 3 * j + k)];
            }
        }
    }
    let factors = system.partial_piv_lu();
    let right = Mat::from_fn(size, 1, |row, _| if row < 3 * n { b[(row, 0)] } else { 1.0 });
    let solution = factors.solve(&right);
    tangents.resize(n, Vec3::zeros());
    add_tangents(chain, &solution, tangents);
    let mut multipliers: Vec<f64> = (0..held).map(|i| solution[(3 * n + i, 0)]).collect();
    let mut residual = Vec::with_capacity(n);
    for _ in 0..REFINEMENTS {
        chain.integrate(tangents, positions_mm);
        chain.residual(tangents, positions_mm, &mut residual);
        for ((left, direction), multiplier) in residual.iter_mut().zip(&chain.directions).zip(&multipliers) {
            *left -= direction * *multiplier;
        }
        let right = Mat::from_fn(size, 1, |row, _| match row.checked_sub(3 * n) {
            None => residual[row / 3][row % 3],
            Some(i) => 1.0 - chain.directions[i].dot(&tangents[i]),
        });
        let correction = factors.solve(&right);
        add_tangents(chain, &correction, tangents);
        multipliers.iter_mut().enumerate().for_each(|(i, m)| *m += correction[(3 * n + i, 0)]);
    }
    chain.integrate(tangents, positions_mm);
}

/// Number of refinements: each gains about six digits at 300 nodes; the second reaches rounding.
const REFINEMENTS: usize = 2;

/// t += B⁻¹ x for a column x.
fn add_tangents(chain: &Chain, x: &Mat<f64>, tangents: &mut [Vec3]) {
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
fn inverse_of_b(chain: &Chain) -> Mat<f64> {
    let n = chain.elements();
    let h = &chain.lengths_mm;
    let mut inverse = Mat::<f64>::zeros(3 * n, 3 * n);
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
fn stationarity(chain: &Chain) -> (Mat<f64>, Mat<f64>) {
    let n = chain.elements();
    let mut a = Mat::<f64>::zeros(3 * n, 3 * n);
    let mut b = Mat::<f64>::zeros(3 * n, 1);
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

    // Rows √k nⱼᵀBⱼ of the springs: their Gram matrix is the wall's share of A.
    let mut rows = Mat::<f64>::zeros(chain.springs.len(), 3 * n);
    let sheath_part = sheath_part(chain);
    for (row, spring) in chain.springs.iter().enumerate() {
        let (i, stiffness) = (spring.node - 1, spring.stiffness_n_per_mm);
        let gap = spring.offset_mm - spring.direction.dot(&sheath_part);
        for j in 0..=i {
            let weight = b_entry(chain, i, j);
            for k in 0..3 {
                let entry = weight * spring.direction[k];
                rows[(row, 3 * j + k)] = stiffness.sqrt() * entry;
                b[(3 * j + k, 0)] += stiffness * gap * entry;
            }
        }
    }
    matmul(a.as_mut(), Accum::Add, rows.transpose(), rows.as_ref(), 1.0, Par::Seq);
    (a, b)
}
