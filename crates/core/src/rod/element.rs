//! Data, state and derivatives of an element, the types shared by the parts of its Lagrangian, and its kinematics.

use super::frame::Frame;
use super::lanes::{Lanes, Vector};
use super::layout::MAX_ANGLES;
use super::play::Tilt;
use super::quadrature::Point;
use crate::Vec3;
use pulp::Simd;
use std::ops::{Add, Mul, Sub};

/// One instrument in an element, sampled at its Gauss points, as far as its material angle needs it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Material {
    /// Bending stiffness EI of this instrument alone, in the plane in which it bends most easily.
    pub(crate) bending: [f64; 3],
    /// What it is stiffer by in others, B = EI + (p c; c q) along d₁ and d₂: (p, q, c), 0 of round cross-sections.
    pub(crate) skew: [[f64; 3]; 3],
    /// Torsional stiffness GJ; unused without twist.
    pub(crate) torsion: [f64; 3],
    /// Rest curvature along d₁ and d₂.
    pub(crate) rest_curvature: [[f64; 2]; 3],
    /// Rest twist per length.
    pub(crate) rest_twist: [f64; 3],
}

impl Material {
    /// No instrument: it has ended before this element.
    pub(crate) const NONE: Self = Self {
        bending: [0.0; 3],
        skew: [[0.0; 3]; 3],
        torsion: [0.0; 3],
        rest_curvature: [[0.0; 2]; 3],
        rest_twist: [0.0; 3],
    };

    /// Whether there is an instrument.
    #[inline]
    pub(crate) fn is_present(&self) -> bool {
        self.torsion != [0.0; 3]
    }
}

/// Data of an element, sampled at its Gauss points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ElementData {
    /// Length h along the rod.
    pub(crate) length: f64,
    /// Total bending stiffness EI of all instruments, without what they are stiffer by in some planes.
    pub(crate) bending: [f64; 3],
    /// Axial flexibility ∫ds/EA; zero = inextensible.
    pub(crate) flexibility: f64,
    /// The instruments that have material angles, one per set of angles.
    pub(crate) materials: [Material; MAX_ANGLES],
    /// Play of all of it in an instrument that ends at its first node, if there is any.
    pub(crate) tilt: Option<Tilt>,
}

impl ElementData {
    /// No instrument and no length.
    pub(crate) const EMPTY: Self = Self {
        length: 0.0,
        bending: [0.0; 3],
        flexibility: 0.0,
        materials: [Material::NONE; MAX_ANGLES],
        tilt: None,
    };

    /// The gap between two rods that are solved together, from the end of one to the start of the next. It has no
    /// stiffness, so neither side acts on the other. Its length is only the unit of its chord.
    pub(crate) const BREAK: Self = Self { length: 1.0, ..Self::EMPTY };

    /// Whether it is the gap between two rods.
    #[inline(always)]
    pub(crate) fn is_break(&self) -> bool {
        self.bending == [0.0; 3]
    }

    /// An inextensible element of one instrument.
    pub(crate) fn of(length: f64, material: Material) -> Self {
        let mut data = Self { length, bending: material.bending, ..Self::EMPTY };
        data.materials[0] = material;
        data
    }

    /// A straight, inextensible element, GJ as large as EI.
    #[cfg(test)]
    pub(crate) fn plain(length: f64, stiffness: f64) -> Self {
        Self::of(length, Material { bending: [stiffness; 3], torsion: [stiffness; 3], ..Material::NONE })
    }

    /// Energy that straightening the element takes, mJ: the magnitude of the terms whose difference is the bending
    /// energy.
    pub(crate) fn straightening_energy(&self) -> f64 {
        let each = self.materials.iter().map(|material| {
            let [u, v] = material.rest_curvature[1];
            0.5 * self.length * material.bending[1] * (u * u + v * v)
        });
        each.sum()
    }

    /// Largest moment by which the other instruments bend one to their common shape; 0 for a single instrument.
    pub(crate) fn mutual_moment(&self) -> f64 {
        let all = self.bending[1];
        if self.materials[0].bending[1] == all {
            return 0.0;
        }
        let each = self.materials.iter().map(|material| {
            let (own, [u, v]) = (material.bending[1], material.rest_curvature[1]);
            own * libm::hypot(u, v) * (1.0 - own / all)
        });
        each.fold(0.0, f64::max)
    }

    /// Factor γ of the augmentation γ·CᵀC (see [`super::assembly`]): as stiff along the rod as the element is across it,
    /// and below half the element's true axial stiffness, which keeps the transformed flexibility positive.
    #[inline]
    pub(crate) fn augmentation(&self) -> f64 {
        let h = self.length;
        let across = 4.0 * (self.bending[0] + self.bending[1] + self.bending[2]) / (h * h * h);
        if self.flexibility > 0.0 { across.min(0.5 / self.flexibility) } else { across }
    }
}

/// State of one element.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ElementState {
    /// Reference triad of the first node.
    pub(crate) first: Frame,
    /// Reference triad of the second node.
    pub(crate) second: Frame,
    /// Chord (x₁ − x₀)/h.
    pub(crate) chord: Vec3,
    /// Axial force.
    pub(crate) tension: f64,
    /// θ₀, θ₁ + reference twist, and b of each set of angles.
    pub(crate) angles: [[f64; 3]; MAX_ANGLES],
}

/// Stored energy by kind.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Energy<T = f64> {
    /// Bending, ½∫(κ − κ⁰)ᵀB(κ − κ⁰) ds.
    pub(crate) bend: T,
    /// Twist, ½∫GJ(τ − τ⁰)² ds.
    pub(crate) twist: T,
    /// Stretch, ½∫EA ε² ds.
    pub(crate) axial: T,
}

impl Energy {
    /// The sum.
    pub(crate) fn total(&self) -> f64 {
        self.bend + self.twist + self.axial
    }

    /// Adds another.
    pub(crate) fn add(&mut self, other: &Self) {
        self.bend += other.bend;
        self.twist += other.twist;
        self.axial += other.axial;
    }
}

/// r′ at the middle of the element.
#[inline(always)]
pub(crate) fn mid_slope<V>(first: V, chord: V, second: V) -> V
where
    V: Add<Output = V> + Sub<Output = V> + Mul<f64, Output = V>,
{
    chord * 1.5 - (first + second) * 0.25
}

/// The element's elongation from |r′(½)|, Simpson's rule for ∫(|r′| − 1) ds with unit slopes at the nodes: ⅔h(|r′(½)| − 1).
#[inline(always)]
pub(super) fn elongation<T>(length: T, speed: T) -> T
where
    T: Mul<Output = T> + Mul<f64, Output = T> + Sub<f64, Output = T>,
{
    length * (2.0 / 3.0) * (speed - 1.0)
}

/// Factor of the bending energy beside the mean speed, with its first and second derivative in c = t₀·t₁.
///
/// A cubic with unit end slopes and |r′(½)| = 1 that spans a circular arc of angle φ costs more than the arc, by 7φ⁴/2880 of its
/// energy: 4/2880 because its curvature wavers (the interpolation error r⁗B, B = s²(h−s)²/24, has the normal part κ³B), 4/2880
/// because that makes it shorter (by κ·κ³B), less 1/2880 because the condition in the middle makes the chord longer. With
/// q = 2(1 − c) = φ² + O(φ⁴) the factor 1 − 7q²/2880 takes the excess out: constant curvature is met to order 6, and where
/// curvature varies the error at order 4 is a third of what it is without. It is 1 for an element whose ends
/// are parallel and never less than 0.96.
#[inline(always)]
pub(super) fn arc_factor<S: Simd>(t0: Vector<S>, t1: Vector<S>) -> (Lanes<S>, Lanes<S>, f64) {
    let one = t0.x.like(1.0);
    let q = (one - t0.dot(t1)) * 2.0;
    const EXCESS: f64 = 7.0 / 2880.0;
    (one - q * EXCESS * q, q * (4.0 * EXCESS), -8.0 * EXCESS)
}

/// Mean of |r′| over the element from its value at the middle, by Simpson's rule with unit slopes at the nodes.
#[inline(always)]
pub(super) fn mean_speed<S: Simd>(mid: Lanes<S>) -> Lanes<S> {
    (mid * 2.0 + 1.0) / 3.0
}

/// φ and h φ′ at a point from (θ₀, θ₁, b).
#[inline(always)]
pub(super) fn angles<S: Simd>(a: &[Lanes<S>; 3], p: &Point) -> (Lanes<S>, Lanes<S>) {
    (
        a[0] * p.phi[0] + a[1] * p.phi[1] + a[2] * p.phi[2],
        a[0] * p.dphi[0] + a[1] * p.dphi[1] + a[2] * p.dphi[2],
    )
}

/// Gradient and upper triangle of the Hessian in the unknowns of the element's nodes, in the order of
/// `super::layout`. N and b at the first node belong to the element before and stay empty. `T` is one number, or
/// one per lane for elements side by side.
#[derive(Debug, Clone)]
pub(crate) struct ElementSystem<const C: usize, T = f64> {
    /// Gradient of the Lagrangian; the last entry is the constraint c − D N.
    pub(crate) gradient: [T; C],
    /// Hessian, upper triangle; the last column is that of N.
    pub(crate) rows: [[T; C]; C],
    /// Derivative of the elongation c in the unknowns.
    pub(crate) stretch: [T; C],
    /// Energies.
    pub(crate) energy: Energy<T>,
}

impl<const C: usize> ElementSystem<C> {
    /// All zero.
    pub(crate) const fn zeros() -> Self {
        Self::filled(0.0)
    }
}

impl<const C: usize, T: Copy> ElementSystem<C, T> {
    /// Fills all entries with `value`.
    pub(super) const fn filled(value: T) -> Self {
        let energy = Energy { bend: value, twist: value, axial: value };
        Self { gradient: [value; C], rows: [[value; C]; C], stretch: [value; C], energy }
    }
}
