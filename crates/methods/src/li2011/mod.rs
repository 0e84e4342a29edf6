//! The method of Li, Qin, Guo, Chui and Heng, *A Novel FEM-Based Numeric Solver for Interactive Catheter
//! Simulation in Virtual Catheterization*, International Journal of Biomedical Imaging 2011 — as printed.
//!
//! A catheter is a chain of nodes with positions x and tangents t = x′. Tangents are linear between nodes
//! (eq. 5), positions their integral (eq. 8), and the total potential energy U = Ue + W + Up (eq. 1) is
//! quadratic in the tangents, so one linear system per input gives the new equilibrium (eqs. 10–12,
//! Algorithm 1).
//!
//! - [`chain`]: the discrete energy and its data;
//! - [`dense`]: the system A B⁻¹ x = b solved as the paper does, O(n³);
//! - [`banded`]: the same minimum by block elimination along the chain, O(n);
//! - [`stepper`]: Algorithm 1 as an insertion method.
//!
//! # What it cannot do
//! Kept on purpose, since this is the faithful method:
//! - **No unit length.** Nothing holds |t| at 1. A cantilever under a tip load P L²/EI = 1, 2, 5, 10 deflects
//!   10 %, 35 %, 133 %, 311 % too far, and no mesh cures it: it is a small-bending model.
//! - **Wall stiffness per node** (eq. 7): refining the chain stiffens the wall.
//! - **One linear solve per input**: a contact found at the translated position acts for the whole step; what the
//!   solve pushes into the wall elsewhere is found at the next input. A step is reported as converged if the nodes and
//!   triangles in contact after the solve are those that it was solved with; where they are not, the wire may be
//!   millimetres beyond the wall for that step (`endowire run` reports how far).
//! - No twist, no rest curvature, no friction.
//!
//! # Misprints read as meant
//! Eq. 4 and 6 drop the ½ of eq. 2: it is kept here. Eq. 5's first weight must read (sᵢ − s)/(sᵢ − sᵢ₋₁) for the
//! interpolation to meet its nodes. Eq. 9 is the work of the forces, which enters a potential energy with a minus
//! sign.

pub mod banded;
pub mod chain;
pub mod dense;
mod input;
mod options;
mod slide;
pub mod stepper;
mod wall;

#[cfg(test)]
mod chain_tests;

pub use chain::{Chain, Spring};
pub use options::{Li2011Options, LinearSolver};
pub use slide::TangentReading;
pub use stepper::Li2011;
pub use wall::ContactReading;
