//! The centre line as a curve: points on it, and its derivatives there.
//!
//! On an element of length h it is the cubic of [`hermite`], in the parameter s = h ξ. Neighbouring elements share
//! position and tangent, so it is continuously differentiable in s, from one end of a rod to the other. Where several
//! rods are solved together there are gaps between them, which are not elements of either. Where the radius changes
//! abruptly, as at the tip of a catheter, the surface has a shoulder: a stretch ends there, as at the end of a rod.

use super::Capsule;
use crate::Vec3;
use crate::rod::quadrature::Point;
use crate::rod::{ElementData, RodState};
use crate::tuning::PairTuning;

/// A point on the centre line.
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

/// The centre line on an element, a polynomial in ξ.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    pub(super) element: usize,
    length_mm: f64,
    /// Coefficients of 1, ξ, ξ² and ξ³, mm.
    powers: [Vec3; 4],
}

impl Piece {
    /// Position and derivatives at ξ.
    #[inline]
    pub(super) fn jet(&self, xi: f64) -> Jet {
        let [c0, c1, c2, c3] = &self.powers;
        let per_mm = 1.0 / self.length_mm;
        Jet {
            at: c0 + (c1 + (c2 + c3 * xi) * xi) * xi,
            first: (c1 + (c2 * 2.0 + c3 * (3.0 * xi)) * xi) * per_mm,
            second: (c2 * 2.0 + c3 * (6.0 * xi)) * (per_mm * per_mm),
        }
    }
}

/// The centre lines of all rods.
#[derive(Debug, Clone, Copy)]
pub(super) struct Curve<'a> {
    pub(super) elements: &'a [ElementData],
    pub(super) state: &'a RodState,
    pub(super) capsules: &'a [Capsule],
    /// Whether the rod is a ring: its end is its start.
    pub(super) closed: bool,
    pub(super) tuning: &'a PairTuning,
}

impl Curve<'_> {
    /// Position and derivatives at a place.
    pub(super) fn jet(&self, place: Place) -> Jet {
        self.piece(place.element).jet(place.xi)
    }

    /// The centre line on an element.
    #[inline]
    pub(super) fn piece(&self, element: usize) -> Piece {
        let length_mm = self.length_mm(element);
        let [(x0, t0), (x1, t1)] = self.nodes(element);
        let (chord, t0, t1) = (x1 - x0, t0 * length_mm, t1 * length_mm);
        Piece { element, length_mm, powers: [x0, t0, chord * 3.0 - t0 * 2.0 - t1, t0 + t1 - chord * 2.0] }
    }

    /// Whether an element is the gap between two rods.
    pub(super) fn is_break(&self, e: usize) -> bool {
        self.elements[e].is_break()
    }

    /// Length of an element, mm.
    pub(super) fn length_mm(&self, e: usize) -> f64 {
        self.elements[e].length
    }

    /// Positions and tangents of the nodes of an element.
    #[inline]
    fn nodes(&self, e: usize) -> [(Vec3, Vec3); 2] {
        // Called a million times per step: arrays of closures cost twice as much.
        let (x, frames) = (&self.state.positions, &self.state.frames);
        [(x[e], frames[e].t), (x[e + 1], frames[e + 1].t)]
    }

    /// The element before one on its stretch.
    pub(super) fn before(&self, e: usize) -> Option<usize> {
        let before = if e == 0 { self.closed.then(|| self.elements.len() - 1) } else { Some(e - 1) };
        before.filter(|before| self.goes_on(*before, e))
    }

    /// The element after one on its stretch.
    pub(super) fn after(&self, e: usize) -> Option<usize> {
        let after = if e + 1 == self.elements.len() { self.closed.then_some(0) } else { Some(e + 1) };
        after.filter(|after| self.goes_on(*after, e))
    }

    /// Whether the surface of an element continues in a neighbour, which is no gap.
    fn goes_on(&self, into: usize, from: usize) -> bool {
        let [a, b] = [into, from].map(|e| self.capsules[e].radius_mm);
        !self.is_break(into) && (a - b).abs() <= self.tuning.shoulder * a.max(b)
    }

    /// The point at a distance along the centre line from another, or the end of the stretch if that comes first; and
    /// its distance.
    pub(super) fn walk(&self, from: Place, by: f64) -> (Place, f64) {
        let Place { mut element, xi } = from;
        let mut s = xi * self.length_mm(element) + by;
        while s < 0.0
            && let Some(before) = self.before(element)
        {
            element = before;
            s += self.length_mm(element);
        }
        while s > self.length_mm(element)
            && let Some(after) = self.after(element)
        {
            s -= self.length_mm(element);
            element = after;
        }
        let inside = s.clamp(0.0, self.length_mm(element));
        (Place { element, xi: (s / self.length_mm(element)).clamp(0.0, 1.0) }, by + (inside - s))
    }

    /// Whether a point is the end of the stretch in this direction, 1 or −1.
    pub(super) fn ends(&self, place: Place, direction: f64) -> bool {
        if direction > 0.0 {
            place.xi == 1.0 && self.after(place.element).is_none()
        } else {
            place.xi == 0.0 && self.before(place.element).is_none()
        }
    }

    /// The four control points of an element, which lies in their convex hull.
    pub(super) fn controls(&self, e: usize) -> [Vec3; 4] {
        let third = self.length_mm(e) / 3.0;
        let [(x0, t0), (x1, t1)] = self.nodes(e);
        [x0, x0 + t0 * third, x1 - t1 * third, x1]
    }
}

/// Derivatives in s of the weights of (x₀, h t₀, x₁, h t₁) in the centre line of an element of length `h`.
pub(super) fn slopes(xi: f64, h: f64) -> [f64; 4] {
    let y = Point::at(xi, 0.0).y;
    // r′ = y₀ (x₁ − x₀)/h + y₁ t₀ + y₂ t₁.
    [-y[0] / h, y[1] / h, y[0] / h, y[2] / h]
}
