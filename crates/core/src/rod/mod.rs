//! The rod: its state, one element's energy, gradient and Hessian, and the assembly of the banded Newton system.
//!
//! An inextensible or stretchable, unshearable, isotropic Kirchhoff rod. Unknowns per node are the position x, the unit
//! tangent t and, where rest curvature or torque needs it, the material angle θ; per element the axial force N as an
//! independent unknown (Hellinger–Reissner) and, with angles, an angle bubble b that makes the angle quadratic in
//! the element. The Lagrangian is
//!
//!   ½∫EI |r′×r″|²/|r′|⁵ ds · ∫|r′| ds / h                      bending (`bending`)
//!   + Σᵢ − ∫EIᵢ κᵢ⁰·t′ ds + ½∫EIᵢ |κᵢ⁰|² ds                     rest curvature (`torsion`)
//!   + Σᵢ ½∫GJᵢ (τᵢ − τᵢ⁰)² ds                                  twist (`torsion`)
//!   + Σ N c − ½ D N²                                          axial (`lagrangian`)
//!
//! where coaxial instruments i share the centre line, EI is the sum of their stiffnesses, and κᵢ⁰ = R(θᵢ)(kᵢ₁, kᵢ₂)
//! turns with the angle of each: Σ ½EIᵢ|t′ − κᵢ⁰|² (Dupont, Lock, Itkowitz and Butler, IEEE Trans. Robotics 26(2),
//! 2010). A single rod is one instrument. With play, what goes on tilts where another one ends (`play`, `rim`).
//!
//! c = ⅔h(|r′(½)| − 1) is Simpson's elongation of an element whose end slopes are unit vectors, and D = ∫ds/EA.
//! Sources: C. Meier, A. Popp, W. A. Wall, *An objective 3D large deformation finite element formulation for
//! geometrically exact curved Kirchhoff rods*, CMAME 278 (2014); *A locking-free finite element formulation and
//! reduced models for geometrically exact Kirchhoff rods*, CMAME 290 (2015); M. Bergou et al., *Discrete viscous
//! threads*, SIGGRAPH 2010.
//!
//! Assemblies and elastic energies are computed for several elements at once, one per lane (`lanes`, `batch`).
//!
//! Any consistent units may be used: nothing here assumes millimetres.

pub(crate) mod assembly;
mod batch;
mod bending;
pub(crate) mod clamp;
pub(crate) mod couples;
pub(crate) mod element;
mod element_torsion;
pub(crate) mod frame;
mod invariants;
pub(crate) mod lagrangian;
mod lanes;
pub(crate) mod layout;
mod play;
pub(crate) mod points;
pub(crate) mod quadrature;
mod rim;
pub(crate) mod scatter;
mod several;
mod share;
pub(crate) mod state;
pub(crate) mod stencils;
pub(crate) mod supports;
mod torsion;

pub(crate) use assembly::Assembly;
pub use clamp::Clamp;
pub(crate) use couples::{Couple, Link};
pub(crate) use element::{ElementData, Material};
pub use frame::Frame;
pub(crate) use lagrangian::{element_energy, element_system};
pub(crate) use lagrangian::{element_gradients, stored_energy};
pub(crate) use layout::MAX_ANGLES;
pub(crate) use layout::{Layout, PLAIN, TWISTED};
pub(crate) use play::Tilt;
pub(crate) use play::{Side, window};
pub(crate) use points::PointSum;
pub(crate) use rim::beyond;
pub(crate) use share::{shares, times};
pub use state::RodState;
pub(crate) use stencils::{Stencils, Triple};
pub(crate) use supports::EndAngle;
pub use supports::Supports;

#[cfg(test)]
mod derivative_tests;
#[cfg(test)]
mod lane_tests;
#[cfg(test)]
mod rim_tests;
