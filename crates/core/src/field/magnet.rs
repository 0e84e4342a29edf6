//! A magnet in a uniform magnetic field.

use std::ops::Range;

use super::{EnergyDensity, Field, FieldSpec, MaterialPoint, at_most};
use crate::device::LENGTH_LIMIT_MM;
use crate::error::in_range;
use crate::{Error, Result, Vec3};

/// A length of an instrument that is magnetised along its axis, in a uniform magnetic field: what steers a magnetic guidewire or catheter.
///
/// Its energy is −m·B, so with m along the tangent u = −(m/l) B·r′ over the length l of the magnet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Magnet {
    instrument: usize,
    from_tip_mm: (f64, f64),
    moment_am2: f64,
    field_t: Vec3,
    /// −(m/l) B, mJ/mm.
    by_tangent: Vec3,
}

/// Largest dipole moment, A·m²: that of a cylinder of neodymium, 1.4 T, of a radius of 1.5 mm and a metre long is 8.
const MOMENT_LIMIT_AM2: f64 = 10.0;
/// Largest field, T: strong magnets of imaging have 7.
const FIELD_LIMIT_T: f64 = 20.0;
/// A·m²·T = J.
const MJ: f64 = 1e3;

impl Magnet {
    /// A magnet of an instrument between two distances from its tip, mm, of this dipole moment towards the tip, A·m², in a field, T.
    ///
    /// # Errors
    /// Distances that are not finite and in their order, a moment above 10 A·m², a field above 20 T ([`Error::Parameter`](crate::Error::Parameter)).
    pub fn new(instrument: usize, from_tip_mm: Range<f64>, moment_am2: f64, field_t: Vec3) -> Result<Self> {
        let Range { start, end } = from_tip_mm;
        in_range("magnet.end_mm", end, LENGTH_LIMIT_MM)?;
        if !(0.0..end).contains(&start) {
            let remedy = format!("must be a distance from the tip of 0 or more, less than end_mm = {end}");
            return Err(Error::parameter("magnet.start_mm", start, remedy));
        }
        at_most("magnet.moment_am2", moment_am2.abs(), MOMENT_LIMIT_AM2)?;
        at_most("magnet.field_t", field_t.norm(), FIELD_LIMIT_T)?;
        let by_tangent = field_t * (-MJ * moment_am2 / (end - start));
        Ok(Self { instrument, from_tip_mm: (start, end), moment_am2, field_t, by_tangent })
    }
}

impl Field for Magnet {
    fn acts_on(&self, instrument: usize) -> Range<f64> {
        if instrument == self.instrument { self.from_tip_mm.0..self.from_tip_mm.1 } else { 0.0..0.0 }
    }

    fn density(&self, point: &MaterialPoint) -> EnergyDensity {
        let value = self.by_tangent.dot(&point.tangent);
        EnergyDensity { value, by_tangent: self.by_tangent, ..EnergyDensity::default() }
    }

    fn spec(&self) -> Option<FieldSpec> {
        let Self { instrument, from_tip_mm: (start_mm, end_mm), moment_am2, field_t, .. } = *self;
        Some(FieldSpec::Magnet { instrument, start_mm, end_mm, moment_am2, field_t: field_t.into() })
    }
}
