//! A round tube about a smooth axis that is given by points, not by a tree: where a surface is one.

use nalgebra::Matrix3;

use super::axis::{Axis, End, spline_slope, stretch};
use super::field::of_branch;
use crate::Vec3;
use crate::vessel::generate::any_perpendicular;
use crate::vessel::generate::curve::natural_moments;

/// Distance from the axis, in radii, below which the direction to the wall is not defined.
const ON_AXIS: f64 = 1e-9;

/// A tube of slowly changing radius.
#[derive(Debug, Clone)]
pub(crate) struct Tube {
    axis: Axis,
}

/// A point in a tube.
#[derive(Debug, Clone, Copy)]
pub(crate) struct InTube {
    /// Arc length of its foot on the axis, mm, and its gradient.
    pub(crate) foot_mm: f64,
    pub(crate) along: Vec3,
    /// Radius of the tube there, mm, with two derivatives along the axis.
    pub(crate) radius: [f64; 3],
    /// Distance from the wall, mm: radius less the distance from the axis.
    pub(crate) distance_mm: f64,
    /// Its gradient and Hessian, 1/mm.
    pub(crate) gradient: Vec3,
    pub(crate) hessian: Matrix3<f64>,
}

impl Tube {
    /// The tube through these centres, about equally far apart, with these radii, mm. At least two.
    pub(crate) fn new(centres_mm: &[Vec3], radii_mm: &[f64]) -> Self {
        let pieces = centres_mm.len() - 1;
        let chords: f64 = centres_mm.windows(2).map(|ends| (ends[1] - ends[0]).norm()).sum();
        let step_mm = chords / pieces as f64;
        let widths: Vec<Vec3> = radii_mm.iter().map(|radius| Vec3::new(*radius, 0.0, 0.0)).collect();
        let moments = natural_moments(&widths, &vec![step_mm; pieces]);
        let slope = |k: usize| spline_slope(&widths, &moments, step_mm, k).x;
        let widths: Vec<(f64, f64)> =
            radii_mm.iter().enumerate().map(|(k, radius)| (*radius, slope(k))).collect();
        Self { axis: Axis::through(centres_mm, &widths, step_mm, [End::Round; 2]) }
    }

    /// Distance of its centres along the axis, mm.
    pub(crate) fn step_mm(&self) -> f64 {
        self.axis.step()
    }

    /// The point of the axis at the foot of `x`, near an arc length: the foot, the place and the radius there.
    pub(crate) fn foot(&self, x: &Vec3, near_mm: f64) -> (f64, Vec3, f64) {
        let (s, place) = self.axis.foot(x, near_mm);
        (s, place.position, place.radius[0])
    }

    /// Direction of the axis at an arc length.
    pub(crate) fn tangent(&self, s: f64) -> Vec3 {
        self.axis.at(s).first.normalize()
    }

    /// Whether a foot is between the ends of the axis.
    pub(crate) fn holds(&self, s: f64) -> bool {
        let [low, high] = self.axis.range();
        s > low && s < high
    }

    /// Radius and curvature of the axis at an arc length.
    pub(crate) fn radius_and_bend(&self, s: f64) -> (f64, f64) {
        let place = self.axis.at(s);
        (place.radius[0], place.first.cross(&place.second).norm())
    }

    /// A point whose foot is near an arc length, mm.
    pub(crate) fn at(&self, x: &Vec3, near_mm: f64) -> InTube {
        let value = of_branch(&self.axis, 0, x, near_mm);
        let place = self.axis.at(value.foot);
        let offset = x - place.position;
        let [low, high] = self.axis.range();
        let is_free = value.foot > low && value.foot < high;
        let along = if is_free { place.first / stretch(&place, &offset) } else { Vec3::zeros() };
        let mut found = InTube {
            foot_mm: value.foot,
            along,
            radius: place.radius,
            distance_mm: -value.f,
            gradient: -value.gradient,
            hessian: (value.turning + value.turning.transpose()) * -0.5,
        };
        if offset.norm() < ON_AXIS * place.radius[0] {
            found.gradient = any_perpendicular(&place.first.normalize());
            found.hessian = Matrix3::zeros();
        }
        found
    }
}
