//! The distance of a site from another stretch of the rod.
//!
//! A site is a quadrature point sᵢ of the rod. Its distance G from a stretch B is that from B's nearest point, where
//! the site itself may slide along its own centre line A against a weak spring,
//!
//! ```text
//! ½ G² = min Φ,    Φ(s, t) = ½ |A(s) − B(t)|² + ½ ε (s − sᵢ)²
//! ```
//!
//! (the Moreau envelope of the squared distance along A: J.-J. Moreau, Bull. Soc. Math. France 93 (1965)). Where the
//! two are parallel, Φ has one minimum for each site, at s = sᵢ, and sites sum to the integral of a line contact.
//! Where they cross at an angle α, the sites near the crossing slide to the crossing itself, their forces act there,
//! and G² = d² + ε sin²α (sᵢ − s)²/(ε + sin²α) barely depends on the positions of sites: this unifies what are two
//! formulations elsewhere, for lines and for points (C. Meier, W. A. Wall, A. Popp, *A unified approach for
//! beam-to-beam contact*, CMAME 315 (2017)).
//!
//! With r = A − B and q the eight vectors that both points depend on, r = Σ cₖ qₖ, the minimum depends on q by
//!
//! ```text
//! G ∂G/∂qₖ = cₖ r
//! ∂²(½G²)/∂qₖ∂qₗ = cₖ cₗ I − Σ Φ_ka (Φ_ab)⁻¹ Φ_lb,    Φ_ks = cₖ′ r + cₖ A′,  Φ_kt = cₖ′ r − cₖ B′
//! ```
//!
//! with a, b those of s and t that are free: not at an end of the rod, and s within a window about sᵢ.

use nalgebra::Matrix3;

use super::curve::{Curve, Jet, Place, slopes};
use crate::Vec3;
use crate::rod::couples::PLACES;
use crate::rod::quadrature::hermite;
use crate::tuning::PairTuning;

/// Distance of a site from a stretch up to which its gap may be below `known`, both in touching distances. A slide
/// s ≤ W, the window, brings it nearer by at most s, and counts as ε s².
pub(super) fn reach(known: f64, tuning: &PairTuning) -> f64 {
    let PairTuning { slide, window, .. } = *tuning;
    window + (known * known - slide * window * window).max(0.0).sqrt()
}

/// Second derivatives of Φ in s and t.
type Stiffness = [f64; 3];

/// The nearest points of a site and of another stretch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::contact) struct Gap {
    /// Both points.
    pub(super) at: [Place; 2],
    /// s − sᵢ.
    pub(super) slide: f64,
    /// Which of s and t are free.
    free: [bool; 2],
    /// From B to A.
    pub(super) between: Vec3,
    /// G.
    pub(super) distance: f64,
}

/// First and second derivatives of a gap.
pub(super) struct Derivatives {
    pub(super) gradient: [Vec3; PLACES],
    pub(super) hessian: [[Matrix3<f64>; PLACES]; PLACES],
}

/// Φ and its derivatives at s and t.
struct Value {
    phi: f64,
    slope: [f64; 2],
    stiffness: Stiffness,
    straight: Stiffness,
    between: Vec3,
}

#[inline]
fn value(a: &Jet, b: &Jet, slide: f64, epsilon: f64) -> Value {
    let r = a.at - b.at;
    let straight = [a.first.norm_squared() + epsilon, -a.first.dot(&b.first), b.first.norm_squared()];
    Value {
        phi: 0.5 * (r.norm_squared() + epsilon * slide * slide),
        slope: [r.dot(&a.first) + epsilon * slide, -r.dot(&b.first)],
        stiffness: [straight[0] + r.dot(&a.second), straight[1], straight[2] - r.dot(&b.second)],
        straight,
        between: r,
    }
}

/// Inverse of the free part; `None` where that is not convex.
fn inverse([ss, st, tt]: Stiffness, free: [bool; 2], tuning: &PairTuning) -> Option<Stiffness> {
    let PairTuning { slide, convex, .. } = *tuning;
    match free {
        [true, true] => {
            let det = ss * tt - st * st;
            (ss > convex && tt > convex && det > convex * slide).then(|| [tt / det, -st / det, ss / det])
        }
        [true, false] => (ss > convex).then(|| [1.0 / ss, 0.0, 0.0]),
        [false, true] => (tt > convex).then(|| [0.0, 0.0, 1.0 / tt]),
        [false, false] => Some([0.0; 3]),
    }
}

impl Gap {
    /// The gap of a site from the stretch about a point, by descent from an initial slide and that point. `touch` is
    /// the distance at which surfaces touch. If the gap is wider than `within`, the descent may end early, at places
    /// that are farther apart than that.
    pub(super) fn find(
        curve: &Curve<'_>,
        site: Place,
        slide: f64,
        to: Place,
        (touch, within): (f64, f64),
    ) -> Self {
        let enough = 0.5 * within * within;
        let tuning = curve.tuning;
        let window = tuning.window * touch;
        let at = |slide: f64| curve.walk(site, slide.clamp(-window, window));
        let (first, mut slide) = at(slide);
        let mut places = [first, to];
        let mut free = [true; 2];
        // Most steps stay on the elements on which they begin.
        let mut pieces = places.map(|place| curve.piece(place.element));
        let mut look = |places: &[Place; 2], slide: f64| {
            for (piece, place) in pieces.iter_mut().zip(places) {
                if piece.element != place.element {
                    *piece = curve.piece(place.element);
                }
            }
            value(&pieces[0].jet(places[0].xi), &pieces[1].jet(places[1].xi), slide, tuning.slide)
        };
        let mut now = look(&places, slide);
        for _ in 0..tuning.descents {
            let held = |down: f64, place: Place| down != 0.0 && curve.ends(place, down.signum());
            let down = now.slope.map(|slope| -slope);
            free = [
                !(held(down[0], places[0]) || (slide.abs() >= window && down[0] * slide > 0.0)),
                !held(down[1], places[1]),
            ];
            let convex = inverse(now.stiffness, free, tuning);
            let Some([ss, st, tt]) = convex.or_else(|| inverse(now.straight, free, tuning)) else { break };
            let mut step = [ss * down[0] + st * down[1], st * down[0] + tt * down[1]];
            let size = step[0].abs().max(step[1].abs());
            let promised = 0.5 * (step[0] * down[0] + step[1] * down[1]);
            let is_parabolic = convex.is_some() && size < tuning.parabolic * touch;
            if is_parabolic && now.phi - tuning.promised * promised > enough {
                break;
            }
            if size > 2.0 * touch {
                step = step.map(|s| s * 2.0 * touch / size);
            }
            let mut part = 1.0;
            loop {
                let (first, there) = at(slide + part * step[0]);
                let next = [first, curve.walk(places[1], part * step[1]).0];
                let then = look(&next, there);
                if then.phi <= now.phi || part < 1e-3 || size <= tuning.short * touch {
                    (slide, places, now) = (there, next, then);
                    break;
                }
                part *= 0.5;
            }
            if size <= tuning.short * touch {
                break;
            }
        }
        Self { at: places, slide, free, between: now.between, distance: (2.0 * now.phi).sqrt() }
    }

    /// The weights of the eight vectors in r.
    pub(super) fn weights(&self) -> [f64; PLACES] {
        let [a, b] = self.at.map(|place| hermite(place.xi));
        [a[0], a[1], a[2], a[3], -b[0], -b[1], -b[2], -b[3]]
    }

    /// r/G: the direction in which the first point is pushed from the second.
    pub(super) fn direction(&self) -> Vec3 {
        self.between / self.distance
    }

    /// Derivatives of G.
    pub(super) fn derivatives(&self, curve: &Curve<'_>) -> Derivatives {
        let [a, b] = self.at.map(|place| curve.jet(place));
        let tuning = curve.tuning;
        let now = value(&a, &b, self.slide, tuning.slide);
        let r = self.between;
        let c = self.weights();
        let [ca, cb] = self.at.map(|place| slopes(place.xi, curve.length_mm(place.element)));
        let mut by_s = [Vec3::zeros(); PLACES];
        let mut by_t = [Vec3::zeros(); PLACES];
        for k in 0..PLACES {
            by_s[k] = a.first * c[k];
            by_t[k] = -b.first * c[k];
            if k < 4 {
                by_s[k] += r * ca[k];
            } else {
                by_t[k] -= r * cb[k - 4];
            }
        }
        let [ss, st, tt] = inverse(now.stiffness, self.free, tuning)
            .or_else(|| inverse(now.straight, self.free, tuning))
            .unwrap_or_default();
        let m = self.direction();
        let gradient = c.map(|c| m * c);
        let mut hessian = [[Matrix3::zeros(); PLACES]; PLACES];
        for k in 0..PLACES {
            let (s, t) = (by_s[k] * ss + by_t[k] * st, by_s[k] * st + by_t[k] * tt);
            for l in k..PLACES {
                let held = Matrix3::from_diagonal_element(c[k] * c[l])
                    - s * by_s[l].transpose()
                    - t * by_t[l].transpose()
                    - gradient[k] * gradient[l].transpose();
                hessian[k][l] = held / self.distance;
            }
        }
        Derivatives { gradient, hessian }
    }
}
