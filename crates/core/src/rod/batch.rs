//! Elements side by side, one per lane: their data and states as [`super::lanes`] computes with them.

use super::element::{ElementData, ElementState};
use super::frame::Frame;
use super::lanes::{Lanes, Vector};
use super::layout::{Layout, MAX_ANGLES};
use super::quadrature::GAUSS;
use super::torsion::TorsionInput;
use crate::Vec3;
use pulp::Simd;

/// Largest number of lanes on any processor.
pub(super) const MOST: usize = 8;

/// An element on its way into a lane.
#[derive(Clone, Copy)]
pub(super) struct Lane<'a> {
    pub(super) data: &'a ElementData,
    pub(super) first: &'a Frame,
    pub(super) second: &'a Frame,
    pub(super) chord: &'a Vec3,
    pub(super) tension: f64,
    pub(super) angles: [[f64; 3]; MAX_ANGLES],
}

impl<'a> Lane<'a> {
    /// A single element.
    #[inline(always)]
    pub(super) fn of(data: &'a ElementData, s: &'a ElementState) -> Self {
        let ElementState { first, second, chord, tension, angles } = s;
        Self { data, first, second, chord, tension: *tension, angles: *angles }
    }
}

/// Each lane's own vector.
#[inline(always)]
fn vector<'a, S: Simd>(simd: S, of: impl Fn(usize) -> &'a Vec3) -> Vector<S> {
    let x = Lanes::gather(simd, |lane| of(lane).x);
    let y = Lanes::gather(simd, |lane| of(lane).y);
    let z = Lanes::gather(simd, |lane| of(lane).z);
    Vector::new(x, y, z)
}

/// Triads.
#[derive(Clone, Copy)]
pub(super) struct Axes<S: Simd> {
    pub(super) t: Vector<S>,
    pub(super) u: Vector<S>,
    pub(super) v: Vector<S>,
}

impl<S: Simd> Axes<S> {
    #[inline(always)]
    fn gather<'a>(simd: S, of: impl Fn(usize) -> &'a Frame) -> Self {
        let t = vector(simd, |lane| &of(lane).t);
        let u = vector(simd, |lane| &of(lane).u);
        let v = vector(simd, |lane| &of(lane).v);
        Self { t, u, v }
    }

    /// Components of `w` along (t, u, v).
    #[inline(always)]
    pub(super) fn local(&self, w: Vector<S>) -> Vector<S> {
        Vector::new(self.t.dot(w), self.u.dot(w), self.v.dot(w))
    }
}

/// An instrument in the elements.
#[derive(Clone, Copy)]
pub(super) struct Instrument<S: Simd> {
    /// Whether it is in any of the elements.
    pub(super) present: bool,
    /// Whether it has rest curvature in any of them.
    pub(super) curved: bool,
    /// Whether it is stiffer in some planes than in others in any of them.
    pub(super) skewed: bool,
    bending: [Lanes<S>; 3],
    skew: [[Lanes<S>; 3]; 3],
    torsion: [Lanes<S>; 3],
    rest_curvature: [[Lanes<S>; 2]; 3],
    rest_twist: [Lanes<S>; 3],
    /// θ₀, θ₁ + reference twist, and b.
    pub(super) angles: [Lanes<S>; 3],
}

impl<S: Simd> Instrument<S> {
    /// Stiffness and rest state of Gauss point `k` of elements of these lengths, in the units of [`super::torsion`].
    #[inline(always)]
    pub(super) fn torsion_input(&self, k: usize, length: Lanes<S>) -> TorsionInput<S> {
        let stiff = self.bending[k] * GAUSS[k].weight;
        let [u, v] = self.rest_curvature[k];
        let mut moment = [stiff * u, stiff * v];
        if self.skewed && self.curved {
            let [p, q, c] = self.skew[k];
            moment[0] += (p * u + c * v) * GAUSS[k].weight;
            moment[1] += (c * u + q * v) * GAUSS[k].weight;
        }
        TorsionInput {
            moment,
            stiffness: self.torsion[k] * GAUSS[k].weight / length,
            rest_twist: length * self.rest_twist[k],
        }
    }

    /// Weight × skew/h of Gauss point `k` of elements of these lengths.
    #[inline(always)]
    pub(super) fn skew_input(&self, k: usize, length: Lanes<S>) -> [Lanes<S>; 3] {
        let scale = length.inverse() * GAUSS[k].weight;
        let [p, q, c] = self.skew[k];
        [p * scale, q * scale, c * scale]
    }

    /// ½∫κ⁰ᵀBκ⁰ ds over elements of these lengths, the constant that makes the bending energy zero in the rest state.
    #[inline(always)]
    pub(super) fn rest_energy(&self, length: Lanes<S>) -> Lanes<S> {
        let mut sum = length.like(0.0);
        for k in 0..3 {
            let [a, b] = self.rest_curvature[k];
            sum += self.bending[k] * GAUSS[k].weight * (a * a + b * b);
            if self.skewed {
                let [p, q, c] = self.skew[k];
                sum += (p * a * a + q * b * b + c * (a * 2.0 * b)) * GAUSS[k].weight;
            }
        }
        length * 0.5 * sum
    }
}

/// Several elements, one per lane.
#[derive(Clone, Copy)]
pub(super) struct Batch<S: Simd> {
    pub(super) simd: S,
    pub(super) length: Lanes<S>,
    /// Total EI of all instruments.
    pub(super) bending: [Lanes<S>; 3],
    /// Axial flexibility, and whether it is above zero in any lane.
    pub(super) flexibility: Lanes<S>,
    pub(super) stretches: bool,
    pub(super) instruments: [Instrument<S>; MAX_ANGLES],
    pub(super) first: Axes<S>,
    pub(super) second: Axes<S>,
    pub(super) chord: Vector<S>,
    pub(super) tension: Lanes<S>,
}

impl<S: Simd> Batch<S> {
    /// From one element per lane; two neighbouring nodes have `C` unknowns.
    #[inline(always)]
    pub(super) fn new<const C: usize>(simd: S, lanes: &[Lane<'_>]) -> Self {
        const { assert!(S::F64_LANES <= MOST) }
        let lanes = &lanes[..S::F64_LANES];
        let zero = Lanes::splat(simd, 0.0);
        let none = Instrument {
            present: false,
            curved: false,
            skewed: false,
            bending: [zero; 3],
            skew: [[zero; 3]; 3],
            torsion: [zero; 3],
            rest_curvature: [[zero; 2]; 3],
            rest_twist: [zero; 3],
            angles: [zero; 3],
        };
        let mut batch = Self {
            simd,
            length: Lanes::gather(simd, |lane| lanes[lane].data.length),
            bending: [zero; 3],
            flexibility: Lanes::gather(simd, |lane| lanes[lane].data.flexibility),
            stretches: lanes.iter().any(|lane| lane.data.flexibility > 0.0),
            instruments: [none; MAX_ANGLES],
            first: Axes::gather(simd, |lane| lanes[lane].first),
            second: Axes::gather(simd, |lane| lanes[lane].second),
            chord: vector(simd, |lane| lanes[lane].chord),
            tension: Lanes::gather(simd, |lane| lanes[lane].tension),
        };
        for k in 0..3 {
            batch.bending[k] = Lanes::gather(simd, |lane| lanes[lane].data.bending[k]);
        }
        for set in 0..Layout::<C>::ANGLES {
            let of = &mut batch.instruments[set];
            of.present = lanes.iter().any(|lane| lane.data.materials[set].is_present());
            of.curved = lanes.iter().any(|lane| lane.data.materials[set].rest_curvature != [[0.0; 2]; 3]);
            of.skewed = lanes.iter().any(|lane| lane.data.materials[set].skew != [[0.0; 3]; 3]);
            for k in 0..3 {
                let of_lane = |lane: usize| &lanes[lane].data.materials[set];
                of.torsion[k] = Lanes::gather(simd, |lane| of_lane(lane).torsion[k]);
                of.rest_twist[k] = Lanes::gather(simd, |lane| of_lane(lane).rest_twist[k]);
                of.angles[k] = Lanes::gather(simd, |lane| lanes[lane].angles[set][k]);
                if of.skewed {
                    for a in 0..3 {
                        of.skew[k][a] = Lanes::gather(simd, |lane| of_lane(lane).skew[k][a]);
                    }
                }
                if of.curved {
                    of.bending[k] = Lanes::gather(simd, |lane| of_lane(lane).bending[k]);
                    for a in 0..2 {
                        of.rest_curvature[k][a] =
                            Lanes::gather(simd, |lane| of_lane(lane).rest_curvature[k][a]);
                    }
                }
            }
        }
        batch
    }
}
