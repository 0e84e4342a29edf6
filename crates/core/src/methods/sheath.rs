//! The introducer sheath: position and direction of the device's entry.

use crate::contact::{check_friction, check_valve};
use crate::vessel::Opening;
use crate::{Error, Result, Vec3};

/// The mouth of the introducer sheath. It prescribes position and tangent of the device there, and may exert friction
/// against its slip u, along and around the axis,
///
/// ```text
/// |f| = F₀ + μ |n⊥|
/// ```
///
/// with the force n⊥ between mouth and device across the axis. Only the hand feels it; nothing inside moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sheath {
    /// Mouth of the sheath, mm.
    pub position_mm: Vec3,
    /// Direction of insertion, unit length.
    pub direction: Vec3,
    /// F₀: friction of the valve, N.
    pub friction_n: f64,
    /// μ: Coulomb coefficient of the mouth.
    pub friction: f64,
}

impl Sheath {
    /// The same sheath with friction; 0 for none.
    ///
    /// # Errors
    /// A force that is not from 0 to 100 N, a coefficient that is not from 0 to 2.
    pub fn rubbing(self, friction_n: f64, friction: f64) -> Result<Self> {
        check_valve("sheath.friction_n", friction_n)?;
        check_friction("sheath.friction", friction)?;
        Ok(Self { friction_n, friction, ..self })
    }

    /// Whether it has friction.
    pub(crate) fn has_friction(&self) -> bool {
        self.friction_n > 0.0 || self.friction > 0.0
    }

    /// Rejects friction, for a method that does not report it.
    ///
    /// # Errors
    /// A sheath with friction.
    pub fn refuse_friction(&self, method: &str) -> Result<()> {
        if !self.has_friction() {
            return Ok(());
        }
        let (name, value) = if self.friction_n > 0.0 {
            ("sheath.friction_n", self.friction_n)
        } else {
            ("sheath.friction", self.friction)
        };
        let mend =
            format!("{method} has no friction in the sheath: leave it out or use the method kirchhoff");
        Err(Error::parameter(name, value, mend))
    }

    /// A sheath at a point, pointing in a direction of any length.
    ///
    /// # Errors
    /// Names the value that is not finite, or a direction of zero length.
    pub fn new(position_mm: Vec3, direction: Vec3) -> Result<Self> {
        use crate::error::vector as show;
        if !position_mm.iter().all(|c| c.is_finite()) {
            return Err(Error::parameter(
                "sheath.position_mm",
                show(&position_mm),
                "must be three finite numbers",
            ));
        }
        // Of any length: the largest component is factored out first, so that squares neither overflow nor underflow.
        let largest = direction.amax();
        let unit = (direction / largest).normalize();
        if !(direction.iter().all(|c| c.is_finite()) && unit.iter().all(|c| c.is_finite())) {
            return Err(Error::parameter(
                "sheath.direction",
                show(&direction),
                "must be a direction, not all zero",
            ));
        }
        Ok(Self { position_mm, direction: unit, friction_n: 0.0, friction: 0.0 })
    }

    /// A sheath in the middle of an opening of a vessel ([`Lumen`](crate::vessel::Lumen) or [`Wall`](crate::vessel::Wall)), pointing into it.
    ///
    /// `depth_mm` is how far inside the opening's plane the mouth lies.
    ///
    /// # Errors
    /// An opening that the vessel does not have, or a depth that is not 0 or more.
    pub fn at_opening(vessel: &impl AsRef<[Opening]>, opening: usize, depth_mm: f64) -> Result<Self> {
        let openings = vessel.as_ref();
        let Some(place) = openings.get(opening) else {
            let mend = if openings.is_empty() {
                "the vessel is closed: give sheath.position_mm, a point inside, and sheath.direction instead (endowire vessel \
                 check FILE offers both)"
                    .to_owned()
            } else {
                format!("the vessel has {} openings, numbered from 0", openings.len())
            };
            return Err(Error::parameter("sheath.opening", opening, mend));
        };
        if !(depth_mm.is_finite() && depth_mm >= 0.0) {
            return Err(Error::parameter(
                "sheath.depth_mm",
                depth_mm,
                "must be a number of 0 or more: it counts from the opening into the vessel",
            ));
        }
        Self::new(place.centre_mm - place.direction * depth_mm, -place.direction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_direction_of_any_length_will_do_and_none_will_not() {
        for length in [1e-300, 1.0, 1e200, f64::MAX] {
            let sheath = Sheath::new(Vec3::zeros(), Vec3::new(0.0, 0.0, length)).unwrap();
            assert!((sheath.direction - Vec3::z()).norm() < 1e-15, "{length}");
        }
        for direction in [Vec3::zeros(), Vec3::x() * f64::INFINITY, Vec3::x() * f64::NAN] {
            assert!(Sheath::new(Vec3::zeros(), direction).is_err(), "{direction}");
        }
    }
}
