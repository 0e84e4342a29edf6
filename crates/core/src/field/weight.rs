//! Weight, less what blood bears of it.

use std::ops::Range;

use super::{EnergyDensity, Field, FieldSpec, MaterialPoint, at_most};
use crate::{Result, Vec3};

/// A dead force per length of all of an instrument: its weight in blood.
///
/// u = −w·r.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weight {
    instrument: usize,
    force_n_per_mm: Vec3,
}

/// Largest force per length, N/mm: a bar of tungsten 5 mm thick weighs 4·10⁻³.
const WEIGHT_LIMIT_N_PER_MM: f64 = 1.0;

impl Weight {
    /// That of an instrument. A solid round wire of radius r and density ρ in blood of density ρ₀ has π r² (ρ − ρ₀) g.
    ///
    /// # Errors
    /// A force above 1 N/mm, or one that is not finite ([`Error::Parameter`](crate::Error::Parameter)).
    pub fn new(instrument: usize, force_n_per_mm: Vec3) -> Result<Self> {
        at_most("weight.force_n_per_mm", force_n_per_mm.norm(), WEIGHT_LIMIT_N_PER_MM)?;
        Ok(Self { instrument, force_n_per_mm })
    }
}

impl Field for Weight {
    fn acts_on(&self, instrument: usize) -> Range<f64> {
        if instrument == self.instrument { 0.0..f64::INFINITY } else { 0.0..0.0 }
    }

    fn density(&self, point: &MaterialPoint) -> EnergyDensity {
        let value = -self.force_n_per_mm.dot(&point.position_mm);
        EnergyDensity { value, by_position: -self.force_n_per_mm, ..EnergyDensity::default() }
    }

    fn spec(&self) -> Option<FieldSpec> {
        let force_n_per_mm = self.force_n_per_mm.into();
        Some(FieldSpec::Weight { instrument: self.instrument, force_n_per_mm })
    }
}
