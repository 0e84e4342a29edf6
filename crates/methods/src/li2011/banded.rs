//! The same minimum in O(n): the block-banded system in interleaved (x, t), eliminated from the tip.
//!
//! In terms of the change of tangent uᵢ = tᵢ − tᵢ₋₁ over an element, eqs. 5–9 are a chain
//!
//! ```text
//! xᵢ = xᵢ₋₁ + h tᵢ₋₁ + ½h uᵢ,   tᵢ = tᵢ₋₁ + uᵢ,   cost ½(α/h)|uᵢ|² + node terms at xᵢ,
//! ```
//!
//! so the energy of everything beyond node i, minimised over its unknowns, is a quadratic of (xᵢ, tᵢ) alone: Vᵢ =
//! ½xᵀXx + xᵀYt + ½tᵀTt − qₓ·x − q_t·t. Block elimination from the tip propagates X, Y, T, qₓ, q_t to the sheath;
//! back-substitution from the sheath, where x₀ and t₀ are known, gives all uᵢ. Per element it factors one 3×3 matrix,
//! H_uu = α/h + (contributions of what lies beyond), positive definite for α > 0: pivoting is never needed.
//!
//! With unit tangents there is also the row t̂·(t + u) = 1 with its multiplier λ, eliminated together with u:
//!
//! ```text
//! H u + λ t̂ = r,  t̂·u = 1 − t̂·t   ⇒   u = P H⁻¹r + w (1 − t̂·t),   w = H⁻¹t̂ / (t̂·H⁻¹t̂),   P = I − w t̂ᵀ
//! ```

use nalgebra::{Cholesky, Matrix3};

use super::chain::Chain;
use endowire_core::Vec3;

/// Elimination of one element: u = free − by_x·x − by_t·t.
#[derive(Debug, Clone, Copy)]
struct Elimination {
    free: Vec3,
    by_x: Matrix3<f64>,
    by_t: Matrix3<f64>,
}

/// Reusable memory of the solve.
#[derive(Debug, Clone, Default)]
pub struct Workspace {
    eliminations: Vec<Elimination>,
}

/// The quadratic Vᵢ.
struct Beyond {
    xx: Matrix3<f64>,
    xt: Matrix3<f64>,
    tt: Matrix3<f64>,
    qx: Vec3,
    qt: Vec3,
}

/// Solves for positions x₁…xₙ and tangents t₁…tₙ at the minimum of the energy of `chain`, in O(n).
///
/// Positions are relative to the sheath, which avoids the rounding of far-away vessels.
pub fn solve(
    chain: &Chain,
    workspace: &mut Workspace,
    positions_mm: &mut Vec<Vec3>,
    tangents: &mut Vec<Vec3>,
) {
    let n = chain.elements();
    workspace.eliminations.clear();
    let mut beyond = Beyond {
        xx: Matrix3::zeros(),
        xt: Matrix3::zeros(),
        tt: Matrix3::zeros(),
        qx: Vec3::zeros(),
        qt: Vec3::zeros(),
    };
    let mut springs = chain.springs.iter().rev().peekable();
    for i in (1..=n).rev() {
        beyond.qx += chain.forces_n[i - 1];
        while let Some(spring) = springs.next_if(|spring| spring.node == i) {
            let stiff = spring.direction * spring.stiffness_n_per_mm;
            beyond.xx += stiff * spring.direction.transpose();
            beyond.qx += stiff * (spring.offset_mm - spring.direction.dot(&chain.start_mm));
        }
        let (h, alpha) = (chain.lengths_mm[i - 1], chain.bending_stiffness_nmm2[i - 1]);
        let elimination = beyond.eliminate(h, alpha, chain.direction(i));
        workspace.eliminations.push(elimination);
    }

    positions_mm.clear();
    tangents.clear();
    let (mut x, mut t) = (Vec3::zeros(), chain.start_tangent);
    for (elimination, h) in workspace.eliminations.iter().rev().zip(&chain.lengths_mm) {
        let u = elimination.free - elimination.by_x * x - elimination.by_t * t;
        x += t * *h + u * (0.5 * h);
        t += u;
        positions_mm.push(chain.start_mm + x);
        tangents.push(t);
    }
}

impl Beyond {
    /// Moves the quadratic one element of length `h` towards the sheath; its end's tangent has unit length about
    /// `direction`.
    fn eliminate(&mut self, h: f64, alpha: f64, direction: Option<&Vec3>) -> Elimination {
        let (x, y, t) = (self.xx, self.xt, self.tt);
        let yt = y.transpose();
        // Second derivatives of α/(2h)|u|² + V(x + h t + ½h u, t + u).
        let uu = Matrix3::from_diagonal_element(alpha / h) + x * (0.25 * h * h) + (y + yt) * (0.5 * h) + t;
        let ux = x * (0.5 * h) + yt;
        let ut = x * (0.5 * h * h) + y * (0.5 * h) + yt * h + t;
        let qu = self.qx * (0.5 * h) + self.qt;
        // Positive definite by construction; only NaN in the input leads here, and is propagated.
        let inverse = Cholesky::new(uu).map_or(Matrix3::repeat(f64::NAN), |c| c.inverse());
        let (mut free, mut by_x, mut by_t) = (inverse * qu, inverse * ux, inverse * ut);
        if let Some(direction) = direction {
            let w = inverse * direction;
            let w = w / direction.dot(&w);
            free += w * (1.0 - direction.dot(&free));
            by_x -= w * (direction.transpose() * by_x);
            by_t += w * (direction.transpose() - direction.transpose() * by_t);
        }
        self.substitute(h, alpha, &free, &by_x, &by_t);
        Elimination { free, by_x, by_t }
    }

    /// V(x + h t + ½h u, t + u) + α/(2h)|u|² at u = free − by_x·x − by_t·t, as a sum of squares.
    ///
    /// The shorter Schur complement (xx − uxᵀ by_x, …) is a difference of large terms where the wall is much stiffer
    /// than the chain, and loses six digits on coarse chains; this form loses none.
    fn substitute(&mut self, h: f64, alpha: f64, free: &Vec3, by_x: &Matrix3<f64>, by_t: &Matrix3<f64>) {
        let one = Matrix3::identity();
        let half = 0.5 * h;
        // New (x, t) as functions of the old: x' = xx x + xt t + ½h free, t' = −by_x x + tt t + free.
        let (xx, xt) = (one - by_x * half, one * h - by_t * half);
        let (tx, tt) = (-by_x, one - by_t);
        let stiffness = alpha / h;
        // P' A, the columns of A being those of x and of t.
        let (px, py) = (self.xx * xx + self.xt * tx, self.xx * xt + self.xt * tt);
        let yt = self.xt.transpose();
        let (ptx, pty) = (yt * xx + self.tt * tx, yt * xt + self.tt * tt);
        let qx = self.qx - (self.xx * half + self.xt) * free;
        let qt = self.qt - (yt * half + self.tt) * free;
        let (by_xt, by_tt) = (by_x.transpose() * stiffness, by_t.transpose() * stiffness);
        self.xx = symmetric(xx.transpose() * px + tx.transpose() * ptx + by_xt * by_x);
        self.xt = xx.transpose() * py + tx.transpose() * pty + by_xt * by_t;
        self.tt = symmetric(xt.transpose() * py + tt.transpose() * pty + by_tt * by_t);
        self.qx = xx.transpose() * qx + tx.transpose() * qt + by_xt * free;
        self.qt = xt.transpose() * qx + tt.transpose() * qt + by_tt * free;
    }
}

/// Symmetrises: otherwise rounding would accumulate over hundreds of elements.
fn symmetric(m: Matrix3<f64>) -> Matrix3<f64> {
    (m + m.transpose()) * 0.5
}
