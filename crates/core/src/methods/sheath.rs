//! The introducer sheath: position and direction of the device's entry.

use crate::contact::{check_friction, check_valve};
use crate::rod::Frame;
use crate::vessel::Opening;
use crate::{Error, Result, Vec3};

/// The mouth of the introducer sheath. It prescribes position and tangent of the device there, and may exert friction
/// against its slip u, along and around the axis,
///
/// ```text
/// |f| = F₀ + μ |n⊥|
/// ```
///
/// with the force n⊥ between mouth and device across the axis. Along the axis only the hand feels it; around it, it holds
/// the device just outside the mouth, against the twist of what lies between there and the hand.
///
/// At rotation zero the first material direction of a device, towards which a positive first rest curvature bends it,
/// lies in the plane of `direction` and `bends_towards`, on the side of the latter; the second is `direction` × the
/// first. Without `bends_towards` it lies towards the coordinate axis least aligned with `direction`, the first of them
/// if there are several: that axis may change with the least tilt of the sheath, and does not turn with a scene.
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
    /// Direction towards which the first material direction points at rotation zero, of any length; that of the
    /// coordinate axis least aligned with `direction` if absent.
    pub bends_towards: Option<Vec3>,
}

/// Smallest angle between `bends_towards` and the sheath's axis, rad: below it rounding would determine the roll.
const LEAST_ANGLE: f64 = 1e-6;

impl Sheath {
    /// The same sheath with friction; 0 for none.
    ///
    /// # Errors
    /// A force that is not from 0 to 100 N, a coefficient that is not from 0 to 2.
    pub fn with_friction(self, friction_n: f64, friction: f64) -> Result<Self> {
        check_valve("sheath.friction_n", friction_n)?;
        check_friction("sheath.friction", friction)?;
        Ok(Self { friction_n, friction, ..self })
    }

    /// The same sheath with devices rolled in it so that, at rotation zero, a positive first rest curvature bends them
    /// towards this direction, of any length.
    ///
    /// # Errors
    /// A direction that is zero, not finite, or along the sheath's.
    pub fn bending_towards(self, towards: Vec3) -> Result<Self> {
        let refused = |remedy: &str| {
            Err(Error::parameter("sheath.bends_towards", crate::error::vector(&towards), remedy))
        };
        let Some(unit) = unit(&towards) else {
            return refused("must be a direction, not all zero");
        };
        if unit.cross(&self.direction).norm() < LEAST_ANGLE {
            return refused(
                "is along sheath.direction, and says nothing about the roll: give a direction across it",
            );
        }
        Ok(Self { bends_towards: Some(unit), ..self })
    }

    /// The triad of a device in it at rotation zero: its tangent, and its two material directions.
    pub(crate) fn frame(&self) -> Frame {
        Frame::new(self.direction, self.bends_towards)
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
        let remedy =
            format!("{method} has no friction in the sheath: leave it out or use the method kirchhoff");
        Err(Error::parameter(name, value, remedy))
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
        let Some(unit) = unit(&direction) else {
            return Err(Error::parameter(
                "sheath.direction",
                show(&direction),
                "must be a direction, not all zero",
            ));
        };
        Ok(Self { position_mm, direction: unit, friction_n: 0.0, friction: 0.0, bends_towards: None })
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
            let remedy = if openings.is_empty() {
                "the vessel is closed: give sheath.position_mm, a point inside, and sheath.direction instead (endowire vessel \
                 check FILE offers both)"
                    .to_owned()
            } else {
                format!("the vessel has {} openings, numbered from 0", openings.len())
            };
            return Err(Error::parameter("sheath.opening", opening, remedy));
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

/// The unit vector along a finite vector of any length but zero.
fn unit(direction: &Vec3) -> Option<Vec3> {
    // The largest component is factored out first, so that squares neither overflow nor underflow.
    let unit = (direction / direction.amax()).normalize();
    let is_finite = direction.iter().chain(unit.iter()).all(|c| c.is_finite());
    is_finite.then_some(unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_roll_is_towards_a_direction_across_the_sheath() {
        let sheath = Sheath::new(Vec3::zeros(), Vec3::new(0.0, 0.0, 3.0)).unwrap();
        // By default towards the first of the axes across it.
        assert_eq!((sheath.frame().u, sheath.frame().v), (Vec3::x(), Vec3::y()));
        let rolled = sheath.bending_towards(Vec3::new(0.0, 1e-200, 5e-200)).unwrap();
        assert!((rolled.frame().u - Vec3::y()).norm() < 1e-15, "{rolled:?}");
        assert!((rolled.frame().v + Vec3::x()).norm() < 1e-15, "{rolled:?}");
        for towards in [
            Vec3::zeros(),
            Vec3::new(0.0, f64::NAN, 1.0),
            Vec3::new(f64::INFINITY, 0.0, 0.0),
            Vec3::z() * -2.0,
            Vec3::new(1e-8, 0.0, 1.0),
        ] {
            let reported = sheath.bending_towards(towards).unwrap_err();
            assert!(
                reported.is_input() && reported.to_string().starts_with("sheath.bends_towards = "),
                "{reported}"
            );
        }
    }

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
