//! The method of Li, Qin, Guo, Chui and Heng, *A Novel FEM-Based Numeric Solver for Interactive Catheter
//! Simulation in Virtual Catheterization*, International Journal of Biomedical Imaging 2011.
//!
//! A catheter is a chain of nodes with positions x and tangents t = x′. Tangents are linear between nodes
//! (eq. 5), positions their integral (eq. 8), and the total potential energy U = Ue + W + Up (eq. 1) is
//! quadratic in the tangents, so one linear system per input gives the new equilibrium (eqs. 10–12,
//! Algorithm 1).
//!
//! - [`chain`]: the discrete energy and its data;
//! - [`dense`]: the system A B⁻¹ x = b solved as the paper does, O(n³);
//! - [`banded`]: the same minimum by block elimination along the chain, O(n);
//! - `slide`, `wall`, `input`: one input of Algorithm 1; [`stepper`]: commands as inputs.
//!
//! # Three interpretations
//! As printed the method cannot pass the bend of its own tube: nothing keeps |t| at 1, and through a half-turn the
//! cheapest path of tangents leads through zero. Three interpretations of the paper close that gap, still with one
//! linear system per input:
//!
//! 1. "Translate each node by disp": every node moves by disp along the wire's own curve, like a sliding wire
//!    (`slide`).
//! 2. t(s) = x′(s) is a unit vector: one row t̂·t = 1 and one multiplier per node, t̂ the slid tangent; tangents are
//!    divided by their length after the solve, and x = B t ([`chain`]).
//! 3. A contact knows the curvature of the lumen across the device (`wall`).
//!
//! `tangents = "unit"` is 1 and 2, `contact = "smooth"` is 3. `tangents = "free"` with `contact = "triangle"` is the paper as printed.
//!
//! # Limitations
//! - **Wall stiffness per node** (eq. 7): refining the chain stiffens the wall, and there is no contact between
//!   nodes.
//! - **One linear solve per input**: a collision during an input is detected at the next. The remaining error of an
//!   input is measured and reported (`input`), and with unit tangents inputs that have not converged are halved ([`stepper`]).
//! - No twist, no rest curvature, no friction.
//! - With free tangents, lengths are not preserved: a cantilever under a tip load P L²/EI = 1, 2, 5, 10 deflects
//!   10 %, 35 %, 133 %, 311 % too far, on any mesh.
//!
//! # Misprints
//! Eq. 4 and 6 drop the ½ of eq. 2: it is kept here. Eq. 5's first weight must read (sᵢ − s)/(sᵢ − sᵢ₋₁) for the
//! interpolation to pass through its nodes. Eq. 9 is the work of the forces, which enters a potential energy with a
//! minus sign.

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
