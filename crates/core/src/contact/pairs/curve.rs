//! The centre line as a curve: places on it, and its derivatives there.
//!
//! On an element of length h it is the cubic of [`hermite`], in the parameter s = h ξ. Neighbouring elements share place and tangent, so that it
//! is continuously differentiable in s, from one end to the other.

use crate::Vec3;
use crate::rod::quadrature::{Point, hermite};
use crate::rod::{ElementData, RodState};

/// A place on the centre line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::contact) struct Place {
    /// Element.
    pub(super) element: usize,
    /// Local coordinate in it, 0 to 1.
    pub(super) xi: f64,
}

/// Position and derivatives in s.
#[derive(Debug, Clone, Copy)]
pub(super) struct Jet {
    pub(super) at: Vec3,
    pub(super) first: Vec3,
    pub(super) second: Vec3,
}

/// A rod's centre line.
#[derive(Debug, Clone, Copy)]
pub(super) struct Curve<'a> {
    pub(super) elements: &'a [ElementData],
    pub(super) state: &'a RodState,
    /// Whether its end is its start.
    pub(super) closed: bool,
}

impl Curve<'_> {
    /// Position and derivatives at a place.
    pub(super) fn jet(&self, place: Place) -> Jet {
        let (e, h) = (place.element, self.elements[place.element].length);
        let (x0, x1) = (&self.state.positions[e], &self.state.positions[e + 1]);
        let (t0, t1) = (self.state.frames[e].t, self.state.frames[e + 1].t);
        let [w0, s0, w1, s1] = hermite(place.xi);
        let (first, second) = Point::at(place.xi, 0.0).derivatives((x1 - x0) / h, t0, t1);
        Jet { at: x0 * w0 + x1 * w1 + (t0 * s0 + t1 * s1) * h, first, second: second / h }
    }

    /// The place so far along the centre line from another, or the end on the way there.
    pub(super) fn walk(&self, from: Place, by: f64) -> Place {
        let Place { mut element, xi } = from;
        let mut s = xi * self.elements[element].length + by;
        let n = self.elements.len();
        while s < 0.0 && (element > 0 || self.closed) {
            element = (element + n - 1) % n;
            s += self.elements[element].length;
        }
        while s > self.elements[element].length && (element + 1 < n || self.closed) {
            s -= self.elements[element].length;
            element = (element + 1) % n;
        }
        Place { element, xi: (s / self.elements[element].length).clamp(0.0, 1.0) }
    }

    /// Whether a place is the end of the rod in this direction, 1 or −1.
    pub(super) fn ends(&self, place: Place, direction: f64) -> bool {
        if self.closed {
            false
        } else if direction > 0.0 {
            place.element + 1 == self.elements.len() && place.xi == 1.0
        } else {
            place.element == 0 && place.xi == 0.0
        }
    }

    /// The four control points of an element: it lies in their hull.
    pub(super) fn controls(&self, e: usize) -> [Vec3; 4] {
        let third = self.elements[e].length / 3.0;
        let (x0, x1) = (self.state.positions[e], self.state.positions[e + 1]);
        [x0, x0 + self.state.frames[e].t * third, x1 - self.state.frames[e + 1].t * third, x1]
    }
}

/// Derivatives in s of the weights of (x₀, h t₀, x₁, h t₁) in the centre line of an element of length `h`.
pub(super) fn slopes(xi: f64, h: f64) -> [f64; 4] {
    let y = Point::at(xi, 0.0).y;
    // r′ = y₀ (x₁ − x₀)/h + y₁ t₀ + y₂ t₁.
    [-y[0] / h, y[1] / h, y[0] / h, y[2] / h]
}
