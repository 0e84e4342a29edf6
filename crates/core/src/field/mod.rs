//! Energies of a device in a field: a magnet at its tip, its weight, or a user-defined energy.
//!
//! A field is an energy u per length of the material points of a device, which may depend on the position of a point and on the direction of the
//! centre line there. With s the distance of a point from the tip of its instrument, r(s) its position and r′(s) the tangent,
//!
//! ```text
//! U = ∫ [u(s, r, r′) − u(s, r₀, t₀)] ds
//! ```
//!
//! over the length inside the vessel. r₀ and t₀ are those of the sheath's mouth: material that enters brings no energy with it, so a constant in u
//! changes nothing, not even the hand force. In Li et al. 2011 (eq. 1) it is the external energy.
//!
//! The integral uses three Gauss points on each element, or on the part of it on which the field acts. With q = (x₀, h t₀, x₁, h t₁), the
//! unknowns of an element of length h, a point is r = Σ cᵢ qᵢ and its tangent r′ = Σ dᵢ qᵢ (`rod::quadrature`), so
//!
//! ```text
//! ∂u/∂qᵢ = cᵢ uᵣ + dᵢ uₜ,    ∂²u/∂qᵢ∂qⱼ = cᵢcⱼ uᵣᵣ + cᵢdⱼ uᵣₜ + dᵢcⱼ uᵣₜᵀ + dᵢdⱼ uₜₜ
//! ```
//!
//! where derivatives by the tangent do not assume unit length: |r′| = 1 holds only to the order of the element.
//!
//! `FieldLoad` is the energy that a solver takes: `Simulation` and `StaticProblem` construct it themselves.

mod load;
mod magnet;
mod spec;
#[cfg(test)]
mod tests;
mod weight;

use std::fmt::Debug;
use std::ops::Range;

use nalgebra::Matrix3;

use crate::{Error, Result, Vec3};

pub(crate) use load::FieldLoad;
pub use magnet::Magnet;
pub use spec::FieldSpec;
pub use weight::Weight;

/// A material point of a device in a field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MaterialPoint {
    /// Number of the instrument that it is of, the innermost first; 0 for a device alone.
    pub instrument: usize,
    /// Distance along the instrument from its tip, mm.
    pub from_tip_mm: f64,
    /// Where it is, mm.
    pub position_mm: Vec3,
    /// Derivative of the position by the arc length, from the sheath to the tip: of unit length to the order of the element.
    pub tangent: Vec3,
}

/// Energy per length of a material point, with its derivatives; all zero by default.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct EnergyDensity {
    /// u, mJ/mm.
    pub value: f64,
    /// ∂u/∂r, mJ/mm²: the force per length that acts on the point, turned round.
    pub by_position: Vec3,
    /// ∂u/∂r′, mJ/mm.
    pub by_tangent: Vec3,
    /// ∂²u/∂r², symmetric, mJ/mm³.
    pub by_positions: Matrix3<f64>,
    /// ∂²u/∂rᵢ∂r′ⱼ in row i and column j, mJ/mm².
    pub by_position_and_tangent: Matrix3<f64>,
    /// ∂²u/∂r′², symmetric, mJ/mm.
    pub by_tangents: Matrix3<f64>,
}

/// An energy per length of a device's material points.
///
/// It is called from many threads and must be a pure function, so that simulations are deterministic. The derivatives must be those of the value:
/// otherwise a step finds no equilibrium. A step into a region where the field is not finite ends with an error.
pub trait Field: Debug + Send + Sync {
    /// Distances from the tip of an instrument between which it acts, mm: `0.0..f64::INFINITY` for all of it, an empty range for none.
    fn acts_on(&self, instrument: usize) -> Range<f64>;

    /// Energy per length of a point.
    fn density(&self, point: &MaterialPoint) -> EnergyDensity;

    /// Its numbers, from which it can be made again, if it is one of those that scenes name.
    fn spec(&self) -> Option<FieldSpec> {
        None
    }
}

/// Checks that a size is a number from 0 to a limit.
fn at_most(name: &str, size: f64, limit: f64) -> Result<()> {
    if (0.0..=limit).contains(&size) {
        return Ok(());
    }
    Err(Error::parameter(name, size, format!("must be a number of at most {limit}")))
}
