//! One element's energy, gradient and Hessian in the unknowns of Newton's method.
//!
//! The unknowns of an element are, in this order, the displacement of the first node (3), the turn of its tangent
//! (2: along u and v of its triad, moved by the smallest rotation), with twist its angle θ₀ and the element's
//! angle bubble b, the same of the second node, and the axial force N. Derivatives are those of the energy pulled
//! back by that retraction, exact at the current state, so second derivatives hold the curvature of the sphere (−(g·t)I)
//! and of the reference twist. Energy and gradient come from the vectors y and z of each Gauss point, the Hessian from the
//! element's invariants (`invariants`).

use super::bending::{bending, bending_value};
use super::element_torsion::add_torsion;
use super::frame::Frame;
use super::invariants::{Derivatives, Factors};
use super::layout::Layout;
use super::quadrature::GAUSS;
use super::torsion::{TorsionInput, torsion_value};
use crate::Vec3;

/// What an element is made of, sampled at its Gauss points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElementData {
    /// Length h along the rod.
    pub length: f64,
    /// Bending stiffness EI.
    pub bending: [f64; 3],
    /// Torsion stiffness GJ; unused where nothing twists.
    pub torsion: [f64; 3],
    /// Rest curvature along d₁ and d₂.
    pub rest_curvature: [[f64; 2]; 3],
    /// Rest twist per length.
    pub rest_twist: [f64; 3],
    /// Axial flexibility ∫ds/EA; zero = inextensible.
    pub flexibility: f64,
}

impl ElementData {
    /// A straight, inextensible element, GJ as large as EI.
    #[cfg(test)]
    pub(crate) fn plain(length: f64, stiffness: f64) -> Self {
        Self {
            length,
            bending: [stiffness; 3],
            torsion: [stiffness; 3],
            rest_curvature: [[0.0; 2]; 3],
            rest_twist: [0.0; 3],
            flexibility: 0.0,
        }
    }

    /// Energy that it takes to straighten the element, mJ: the size of the terms that bending energy is a difference of.
    pub fn straightening_energy(&self) -> f64 {
        let [u, v] = self.rest_curvature[1];
        0.5 * self.length * self.bending[1] * (u * u + v * v)
    }

    /// Factor γ of the augmentation γ·CᵀC (see [`super::assembly`]): as stiff along the rod as the element is across it,
    /// and below half the element's true axial stiffness, which keeps the transformed flexibility positive.
    #[inline]
    pub fn augmentation(&self) -> f64 {
        let h = self.length;
        let across = 4.0 * (self.bending[0] + self.bending[1] + self.bending[2]) / (h * h * h);
        if self.flexibility > 0.0 { across.min(0.5 / self.flexibility) } else { across }
    }

    /// Stiffness and rest state of Gauss point `k` in the units of [`torsion`].
    #[inline]
    pub(super) fn torsion_input(&self, k: usize) -> TorsionInput {
        let moment = GAUSS[k].weight * self.bending[k];
        TorsionInput {
            moment: [moment * self.rest_curvature[k][0], moment * self.rest_curvature[k][1]],
            stiffness: GAUSS[k].weight * self.torsion[k] / self.length,
            rest_twist: self.length * self.rest_twist[k],
        }
    }

    /// ½∫EI|κ⁰|² ds, the constant that makes the bending energy zero in the rest state.
    #[inline]
    pub(super) fn rest_energy(&self) -> f64 {
        let mut sum = 0.0;
        for k in 0..3 {
            let [a, b] = self.rest_curvature[k];
            sum += GAUSS[k].weight * self.bending[k] * (a * a + b * b);
        }
        0.5 * self.length * sum
    }
}

/// State of one element.
#[derive(Debug, Clone, Copy)]
pub struct ElementState {
    /// Reference triad of the first node.
    pub first: Frame,
    /// Reference triad of the second node.
    pub second: Frame,
    /// Chord (x₁ − x₀)/h.
    pub chord: Vec3,
    /// Axial force.
    pub tension: f64,
    /// θ₀, θ₁ + reference twist, and b; unused without twist.
    pub angles: [f64; 3],
}

/// Stored energy by kind.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Energy {
    /// Bending, ½∫EI|κ − κ⁰|² ds.
    pub bend: f64,
    /// Twist, ½∫GJ(τ − τ⁰)² ds.
    pub twist: f64,
    /// Stretch, ½∫EA ε² ds.
    pub axial: f64,
}

impl Energy {
    /// The sum.
    pub fn total(&self) -> f64 {
        self.bend + self.twist + self.axial
    }

    /// Adds another.
    pub fn add(&mut self, other: &Self) {
        self.bend += other.bend;
        self.twist += other.twist;
        self.axial += other.axial;
    }
}

/// r′ at the middle of the element.
#[inline]
pub fn mid_slope(first: &Vec3, chord: &Vec3, second: &Vec3) -> Vec3 {
    chord * 1.5 - (first + second) * 0.25
}

/// The element's elongation, Simpson's rule for ∫(|r′| − 1) ds with unit slopes at the nodes: ⅔h(|r′(½)| − 1).
#[inline]
pub fn elongation(length: f64, mid: &Vec3) -> f64 {
    2.0 / 3.0 * length * (mid.norm() - 1.0)
}

/// What the bending energy is multiplied by beside its mean speed, with its first and second derivative in c = t₀·t₁.
///
/// A cubic with unit end slopes and |r′(½)| = 1 that spans a circular arc of angle φ costs more than the arc, by 7φ⁴/2880 of its
/// energy: 4/2880 because its curvature wavers (the interpolation error r⁗B, B = s²(h−s)²/24, has the normal part κ³B), 4/2880
/// because that makes it shorter (by κ·κ³B), less 1/2880 because the condition in the middle makes the chord longer. With
/// q = 2(1 − c) = φ² + O(φ⁴) the factor 1 − 7q²/2880 takes the excess out: constant curvature is met to order 6, and where
/// curvature varies the error at order 4 is a third of what it is without. It is 1 for an element whose ends
/// are parallel and never less than 0.96.
#[inline]
fn arc_factor(t0: &Vec3, t1: &Vec3) -> (f64, f64, f64) {
    let q = 2.0 * (1.0 - t0.dot(t1));
    const EXCESS: f64 = 7.0 / 2880.0;
    (1.0 - EXCESS * q * q, 4.0 * EXCESS * q, -8.0 * EXCESS)
}

/// Mean of |r′| over the element from that in its middle, Simpson's rule with unit slopes at the nodes.
#[inline]
fn mean_speed(mid: f64) -> f64 {
    (1.0 + 2.0 * mid) / 3.0
}

/// The element's energy alone.
pub fn element_energy(data: &ElementData, s: &ElementState, twisted: bool) -> Energy {
    let (t0, t1) = (s.first.t, s.second.t);
    let mut energy = Energy::default();
    for (k, point) in GAUSS.iter().enumerate() {
        let (y, z) = point.derivatives(&s.chord, &t0, &t1);
        energy.bend += point.weight * data.bending[k] * bending_value(&y, &z);
    }
    energy.bend *= arc_factor(&t0, &t1).0 * mean_speed(mid_slope(&t0, &s.chord, &t1).norm()) / data.length;
    if twisted {
        let (chord, end) = (s.first.local(&s.chord), s.first.local(&t1));
        for (k, point) in GAUSS.iter().enumerate() {
            let (y, z) = point.derivatives(&chord, &Vec3::x(), &end);
            let (phi, dphi) = angles(&s.angles, point);
            let (bend, twist) = torsion_value(&y, &z, phi, dphi, &data.torsion_input(k));
            energy.bend += bend;
            energy.twist += twist;
        }
        energy.bend += data.rest_energy();
    }
    if data.flexibility > 0.0 {
        let c = elongation(data.length, &mid_slope(&t0, &s.chord, &t1));
        energy.axial = 0.5 * c * c / data.flexibility;
    }
    energy
}

#[inline]
pub(super) fn angles(a: &[f64; 3], p: &super::quadrature::Point) -> (f64, f64) {
    (
        p.phi[0] * a[0] + p.phi[1] * a[1] + p.phi[2] * a[2],
        p.dphi[0] * a[0] + p.dphi[1] * a[1] + p.dphi[2] * a[2],
    )
}

/// Gradient and upper triangle of the Hessian in the unknowns of the element's nodes, in the order of [`super::layout`]. Those
/// that belong to the element before, its N and b at the first node, are empty.
#[derive(Debug, Clone)]
pub struct ElementSystem<const C: usize> {
    /// Gradient of the Lagrangian; the last entry is the constraint c − D N.
    pub gradient: [f64; C],
    /// Hessian, upper triangle; the last column is that of N.
    pub rows: [[f64; C]; C],
    /// Derivative of the elongation c in the unknowns.
    pub stretch: [f64; C],
    /// Energies.
    pub energy: Energy,
}

impl<const C: usize> ElementSystem<C> {
    /// All zero.
    pub const fn zeros() -> Self {
        let energy = Energy { bend: 0.0, twist: 0.0, axial: 0.0 };
        Self { gradient: [0.0; C], rows: [[0.0; C]; C], stretch: [0.0; C], energy }
    }
}

/// First places of x₀, t₀, x₁ and t₁.
#[inline]
const fn places<const C: usize>() -> [usize; 4] {
    let l = Layout::<C>;
    [l.position(0), l.tangent(0), l.position(1), l.tangent(1)]
}

/// The element's Lagrangian with derivatives; the Hessian only where `HESSIAN` is set, and with the augmentation `gamma` (γ
/// in [`super::assembly`]; with 0 it is the Lagrangian's own).
#[inline]
pub fn element_system<const C: usize, const HESSIAN: bool>(
    data: &ElementData,
    s: &ElementState,
    gamma: f64,
    out: &mut ElementSystem<C>,
) {
    let h = data.length;
    let ih = 1.0 / h;
    let (t0, t1) = (s.first.t, s.second.t);

    // Bending at unit speed, in (e, t₀, t₁).
    let mut energy = Energy::default();
    let (mut ge, mut g0, mut g1) = (Vec3::zeros(), Vec3::zeros(), Vec3::zeros());
    let mut second = Derivatives::default();
    for (k, point) in GAUSS.iter().enumerate() {
        let (y, z) = point.derivatives(&s.chord, &t0, &t1);
        let f = bending(&y, &z);
        let scale = point.weight * data.bending[k] * ih;
        energy.bend += scale * f.value;
        let (gy, gz) = (f.gy * scale, f.gz * scale);
        ge += gy * point.y[0] + gz * point.z[0];
        g0 += gy * point.y[1] + gz * point.z[1];
        g1 += gy * point.y[2] + gz * point.z[2];
        if HESSIAN {
            second.add_point(k, scale, &f.partials);
        }
    }

    // The middle: m = r′/|r′| with r′ = 1.5 e − ¼(t₀ + t₁).
    let mid = mid_slope(&t0, &s.chord, &t1);
    let speed = mid.norm();
    let slow = 1.0 / speed;
    let m = mid * slow;

    // Times the factor f = g(t₀·t₁) (1 + 2|r′|)/3: f ∇U + U ∇f. ∇|r′| = m (1.5, −¼, −¼).
    let arc = arc_factor(&t0, &t1);
    let stored = energy.bend;
    let mean = mean_speed(speed);
    let f = arc.0 * mean;
    energy.bend *= f;
    // Axial force at the middle: N c, c = ⅔h(|r′| − 1). Its derivative in |r′| and that of f U are of one kind.
    let c = 2.0 / 3.0 * h * (speed - 1.0);
    if data.flexibility > 0.0 {
        energy.axial = 0.5 * c * c / data.flexibility;
    }
    let pull = m * (arc.0 * stored + h * s.tension);
    let turn = arc.1 * mean * stored;
    ge = ge * f + pull;
    let ends = pull * (1.0 / 6.0);
    g0 = g0 * f + t1 * turn - ends;
    g1 = g1 * f + t0 * turn - ends;

    let ct = m * (-h / 6.0);
    let [x0_at, t0_at, x1_at, t1_at] = places::<C>();
    let (d0, d1) = ([s.first.u, s.first.v], [s.second.u, s.second.v]);
    let gx = ge * ih;
    out.gradient = [0.0; C];
    out.stretch = [0.0; C];
    for i in 0..3 {
        out.gradient[x0_at + i] = -gx[i];
        out.gradient[x1_at + i] = gx[i];
        out.stretch[x0_at + i] = -m[i];
        out.stretch[x1_at + i] = m[i];
    }
    for a in 0..2 {
        out.gradient[t0_at + a] = g0.dot(&d0[a]);
        out.gradient[t1_at + a] = g1.dot(&d1[a]);
        out.stretch[t0_at + a] = ct.dot(&d0[a]);
        out.stretch[t1_at + a] = ct.dot(&d1[a]);
    }
    out.gradient[C - 1] = c - data.flexibility * s.tension;
    if HESSIAN {
        let factors = Factors { stored, arc, mean, slow, length: h, tension: s.tension, gamma };
        add_hessian(s, ih, &second.complete(&factors), out);
        // With the augmentation goes the flexibility of the transformed multiplier.
        out.rows[C - 1][C - 1] = -data.flexibility / (1.0 - gamma * data.flexibility);
        for i in 0..C - 1 {
            out.rows[i][C - 1] = out.stretch[i];
        }
    }
    if Layout::<C>::TWIST {
        add_torsion::<C, HESSIAN>(data, s, out, &mut energy);
    }
    out.energy = energy;
}

/// Sets the rows of the Hessian from derivatives in the invariants.
#[inline(always)]
fn add_hessian<const C: usize>(s: &ElementState, ih: f64, v: &Derivatives, out: &mut ElementSystem<C>) {
    let [x0_at, t0_at, x1_at, t1_at] = places::<C>();
    let (e, t0, t1) = (s.chord, s.first.t, s.second.t);
    let (d0, d1) = ([s.first.u, s.first.v], [s.second.u, s.second.v]);
    let ([vs, vp, vq, vr], vv) = (v.first, &v.second);
    // ∇g in x₁, and V_ij ∇gⱼ of them.
    let by_x = [e * (2.0 * ih), t0 * ih, t1 * ih];
    let product = |w: [f64; 3]| by_x[0] * w[0] + by_x[1] * w[1] + by_x[2] * w[2];
    let ws = product([vv[0][0], vv[0][1], vv[0][2]]);
    let wp = product([vv[0][1], vv[1][1], vv[1][2]]);
    let wq = product([vv[0][2], vv[1][2], vv[2][2]]);
    let wr = product([vv[0][3], vv[1][3], vv[2][3]]);
    if Layout::<C>::TWIST {
        // What is set below is the same every time; torsion adds to more.
        out.rows = [[0.0; C]; C];
    }
    for i in 0..3 {
        for j in i..3 {
            let mut value = by_x[0][i] * ws[j] + by_x[1][i] * wp[j] + by_x[2][i] * wq[j];
            if i == j {
                value += 2.0 * vs * ih * ih;
            }
            out.rows[x0_at + i][x0_at + j] = value;
            out.rows[x1_at + i][x1_at + j] = value;
            out.rows[x0_at + i][x1_at + j] = -value;
            out.rows[x0_at + j][x1_at + i] = -value;
        }
    }
    // ∇g in the turns of the tangents: of e·t₀ and t₀·t₁ in those of t₀, of e·t₁ and t₀·t₁ in those of t₁.
    let (p, r0) = ([e.dot(&d0[0]), e.dot(&d0[1])], [t1.dot(&d0[0]), t1.dot(&d0[1])]);
    let (q, r1) = ([e.dot(&d1[0]), e.dot(&d1[1])], [t0.dot(&d1[0]), t0.dot(&d1[1])]);
    let (along, across) = (e.dot(&t0), e.dot(&t1));
    let cosine = t0.dot(&t1);
    for a in 0..2 {
        let column0 = wp * p[a] + wr * r0[a] + d0[a] * (vp * ih);
        let column1 = wq * q[a] + wr * r1[a] + d1[a] * (vq * ih);
        for i in 0..3 {
            out.rows[x0_at + i][t0_at + a] = -column0[i];
            out.rows[t0_at + a][x1_at + i] = column0[i];
            out.rows[x0_at + i][t1_at + a] = -column1[i];
            out.rows[x1_at + i][t1_at + a] = column1[i];
        }
        // Tangents turn on a sphere: ∇²(e·t₀) = −(e·t₀)I and so on.
        for b in a..2 {
            let mut first =
                (vv[1][1] * p[b] + vv[1][3] * r0[b]) * p[a] + (vv[1][3] * p[b] + vv[3][3] * r0[b]) * r0[a];
            let mut last =
                (vv[2][2] * q[b] + vv[2][3] * r1[b]) * q[a] + (vv[2][3] * q[b] + vv[3][3] * r1[b]) * r1[a];
            if a == b {
                first -= vp * along + vr * cosine;
                last -= vq * across + vr * cosine;
            }
            out.rows[t0_at + a][t0_at + b] = first;
            out.rows[t1_at + a][t1_at + b] = last;
        }
        for b in 0..2 {
            out.rows[t0_at + a][t1_at + b] = (vv[1][2] * q[b] + vv[1][3] * r1[b]) * p[a]
                + (vv[2][3] * q[b] + vv[3][3] * r1[b]) * r0[a]
                + vr * d0[a].dot(&d1[b]);
        }
    }
}
