//! A close-fitting channel along an arc, as a catheter is for what lies in it.

use nalgebra::Matrix3;

use super::StaticProblem;
use crate::rod::quadrature::{GAUSS, hermite};
use crate::rod::{Clamp, ElementData, Frame, PLAIN, PointSum, RodState, Stencils};
use crate::solve::{External, Newton};
use crate::{Error, Result, Vec3};

/// A close-fitting channel along a circle of this radius about (0, radius, 0), with ½ k d² per length.
#[derive(Debug, Clone, Copy)]
pub struct Channel {
    /// Radius of the circle.
    pub radius: f64,
    /// k.
    pub stiffness: f64,
}

impl Channel {
    /// Energy per length at a point with its derivatives.
    fn at(&self, x: &Vec3) -> (f64, Vec3, Matrix3<f64>) {
        let from_centre = Vec3::new(x.x, x.y - self.radius, 0.0);
        let distance = from_centre.norm();
        let normal = from_centre / distance;
        let off = distance - self.radius;
        let along = Matrix3::from_diagonal(&Vec3::new(1.0, 1.0, 0.0)) - normal * normal.transpose();
        let across = normal * normal.transpose() + Matrix3::from_diagonal(&Vec3::z());
        let hessian = (across + along * (off / distance)) * self.stiffness;
        let gradient = (normal * off + Vec3::z() * x.z) * self.stiffness;
        (0.5 * self.stiffness * (off * off + x.z * x.z), gradient, hessian)
    }

    /// Iterates over its quadrature points: element, ξ, weight, and energy there.
    fn points(
        &self,
        elements: &[ElementData],
        state: &RodState,
        mut to: impl FnMut(usize, f64, f64, (f64, Vec3, Matrix3<f64>)),
    ) {
        for (e, data) in elements.iter().enumerate() {
            for point in &GAUSS {
                let [w0, s0, w1, s1] = hermite(point.xi);
                let bend = state.frames[e].t * s0 + state.frames[e + 1].t * s1;
                let x = state.positions[e] * w0 + state.positions[e + 1] * w1 + bend * data.length;
                to(e, point.xi, point.weight * data.length, self.at(&x));
            }
        }
    }
}

impl External for Channel {
    fn linearise(&mut self, elements: &[ElementData], state: &RodState, into: &mut dyn Stencils) {
        let mut sums = vec![PointSum::default(); elements.len()];
        self.points(elements, state, |e, xi, weight, (value, gradient, hessian)| {
            into.add_value(weight * value);
            sums[e].add(xi, &(gradient * weight), Some(&(hessian * weight)));
        });
        for (e, sum) in sums.iter().enumerate() {
            into.add_points(state, &elements[e], e, sum);
        }
    }

    fn value(&mut self, elements: &[ElementData], state: &RodState) -> f64 {
        let mut sum = 0.0;
        self.points(elements, state, |_, _, weight, (value, ..)| sum += weight * value);
        sum
    }
}

impl StaticProblem {
    /// Push force of each of several straight instruments that come out of the origin along x and lie in a channel; `None`
    /// where it jumps.
    ///
    /// # Errors
    /// No equilibrium, and instruments that twist.
    pub fn push_forces_in(&self, channel: &Channel) -> Result<Vec<Option<f64>>> {
        if self.angles > 0 {
            let remedy = "leave out rest shapes: a channel holds straight instruments";
            return Err(Error::parameter("instrument", "shaped", remedy));
        }
        let (elements, mut channel) = (&self.elements, *channel);
        let mut frames = vec![Frame::new(Vec3::x(), Some(Vec3::y()))];
        for (e, data) in elements.iter().enumerate() {
            frames.push(frames[e].transported(data.length / channel.radius, 0.0));
        }
        let mut state = RodState::from_frames(elements, Vec3::zeros(), frames);
        let mut supports = self.supports.clone();
        let mut newton = Newton::<PLAIN>::new(elements.len());
        let report = newton.solve(elements, &mut supports, &mut channel, &mut state, &self.options);
        if !report.converged {
            return Err(Error::Computation(report.reason.to_string()));
        }
        let clamp = Clamp::new::<PLAIN>(&newton.start_residual, &state);
        let hands = self.hands::<PLAIN>(&state, &supports, &mut channel, &clamp);
        Ok(hands.into_iter().map(|(force, _)| force).collect())
    }
}
