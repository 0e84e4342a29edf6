//! One element's energy, gradient and Hessian in the unknowns of Newton's method.
//!
//! The unknowns of an element are, in this order, the displacement of the first node (3), the turn of its tangent
//! (2: along u and v of its triad, moved by the smallest rotation), with twist its angle θ₀ and the element's
//! angle bubble b, the same of the second node, and the axial force N. Derivatives are those of the energy pulled
//! back by that retraction, exact at the current state, so second derivatives hold the curvature of the sphere (−(g·t)I)
//! and of the reference twist.

use super::bending::{bending, bending_value};
use super::element_torsion::add_torsion;
use super::frame::Frame;
use super::quadrature::GAUSS;
use super::torsion::{TorsionInput, torsion_value};
use crate::Vec3;
use nalgebra::Matrix3;

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
        let across = 12.0 * (self.bending[0] + self.bending[1] + self.bending[2]) / (3.0 * h * h * h);
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

/// Gradient and upper triangle of the Hessian in the element's `M` unknowns: 11 without twist, 14 with it.
#[derive(Debug, Clone)]
pub struct ElementSystem<const M: usize> {
    /// Gradient of the Lagrangian; the last entry is the constraint c − D N.
    pub gradient: [f64; M],
    /// Hessian, upper triangle; the last row is that of N.
    pub hessian: [[f64; M]; M],
    /// Derivative of the elongation c in the unknowns.
    pub stretch: [f64; M],
    /// Energies.
    pub energy: Energy,
}

/// Places of the unknowns of an element with `m` unknowns: (t₀, θ₀, b, x₁, t₁, θ₁, N); x₀ is first.
pub(super) const fn places(m: usize) -> [usize; 7] {
    if m == 14 { [3, 5, 6, 7, 10, 12, 13] } else { [3, 0, 0, 5, 8, 0, 10] }
}

/// The element's Lagrangian with derivatives, without augmentation; the Hessian only where `HESSIAN` is set.
#[inline]
pub fn element_system<const M: usize, const HESSIAN: bool>(
    data: &ElementData,
    s: &ElementState,
    out: &mut ElementSystem<M>,
) {
    let [t0_at, _, _, x1_at, t1_at, _, n_at] = places(M);
    let h = data.length;
    let ih = 1.0 / h;
    let (t0, t1) = (s.first.t, s.second.t);

    // Bending in (e, t₀, t₁).
    let mut energy = Energy::default();
    let (mut ge, mut g0, mut g1) = (Vec3::zeros(), Vec3::zeros(), Vec3::zeros());
    let zero = Matrix3::zeros();
    let (mut hee, mut he0, mut he1, mut h00, mut h01, mut h11) = (zero, zero, zero, zero, zero, zero);
    for (k, point) in GAUSS.iter().enumerate() {
        let (y, z) = point.derivatives(&s.chord, &t0, &t1);
        let f = bending(&y, &z);
        let scale = point.weight * data.bending[k] * ih;
        energy.bend += scale * f.value;
        let (gy, gz) = (f.gy * scale, f.gz * scale);
        let ([ye, y0, y1], [ze, z0, z1]) = (point.y, point.z);
        ge += gy * ye + gz * ze;
        g0 += gy * y0 + gz * z0;
        g1 += gy * y1 + gz * z1;
        let (hyy, hyz, hzz) = (f.hyy * scale, f.hyz * scale, f.hzz * scale);
        let hzy = hyz.transpose();
        // Half products: derivative along y and z of the gradient in each vector.
        let (ey, ez) = (hyy * ye + hzy * ze, hyz * ye + hzz * ze);
        hee += ey * ye + ez * ze;
        he0 += ey * y0 + ez * z0;
        he1 += ey * y1 + ez * z1;
        let (oy, oz) = (hyy * y0 + hzy * z0, hyz * y0 + hzz * z0);
        h00 += oy * y0 + oz * z0;
        h01 += oy * y1 + oz * z1;
        h11 += hyy * (y1 * y1) + (hyz + hzy) * (y1 * z1) + hzz * (z1 * z1);
    }

    // The middle: m = y/|y| with y = 1.5 e − ¼(t₀ + t₁).
    let mid = mid_slope(&t0, &s.chord, &t1);
    let speed = mid.norm();
    let m = mid / speed;

    // Times the factor f = g(t₀·t₁) (1 + 2|y|)/3: f ∇U + U ∇f, and so on. ∇|y| = m (1.5, −¼, −¼).
    let (arc, slope, curve) = arc_factor(&t0, &t1);
    let stored = energy.bend;
    let mean = mean_speed(speed);
    let f = arc * mean;
    energy.bend *= f;
    let ends = m * (arc / 6.0);
    let (fe, f0, f1) = (m * arc, t1 * (slope * mean) - ends, t0 * (slope * mean) - ends);
    // ∇∇f without the part of |y|'s own curvature, which joins that of the axial force below.
    let (mt, cross) = (m * (2.0 / 3.0 * slope * stored), curve * mean * stored);
    let bare = (ge, g0, g1);
    ge = ge * f + fe * stored;
    g0 = g0 * f + f0 * stored;
    g1 = g1 * f + f1 * stored;
    let both = |a: &Vec3, b: &Vec3| a * b.transpose();
    let pee = both(&fe, &bare.0);
    hee = hee * f + pee + pee.transpose();
    he0 = he0 * f + both(&fe, &bare.1) + both(&bare.0, &f0) + both(&mt, &t1) * 1.5;
    he1 = he1 * f + both(&fe, &bare.2) + both(&bare.0, &f1) + both(&mt, &t0) * 1.5;
    let (p00, p11) = (both(&f0, &bare.1) - both(&mt, &t1) * 0.25, both(&f1, &bare.2) - both(&mt, &t0) * 0.25);
    h00 = h00 * f + p00 + p00.transpose() + both(&t1, &t1) * cross;
    h11 = h11 * f + p11 + p11.transpose() + both(&t0, &t0) * cross;
    h01 = h01 * f + both(&f0, &bare.2) + both(&bare.1, &f1) + both(&t1, &t0) * cross
        - (both(&mt, &t0) + both(&t1, &mt)) * 0.25
        + Matrix3::identity() * (slope * mean * stored);

    // Axial force at the middle: N c, c = ⅔h(|y| − 1).
    let c = 2.0 / 3.0 * h * (speed - 1.0);
    if data.flexibility > 0.0 {
        energy.axial = 0.5 * c * c / data.flexibility;
    }
    let ct = m * (-h / 6.0);
    ge += m * (h * s.tension);
    g0 += ct * s.tension;
    g1 += ct * s.tension;
    let across =
        (Matrix3::identity() - m * m.transpose()) * ((2.0 / 3.0 * (h * s.tension + arc * stored)) / speed);
    hee += across * 2.25;
    he0 -= across * 0.375;
    he1 -= across * 0.375;
    h00 += across * 0.0625;
    h01 += across * 0.0625;
    h11 += across * 0.0625;

    let (d0, d1) = ([s.first.u, s.first.v], [s.second.u, s.second.v]);
    let gx = ge * ih;
    for i in 0..3 {
        out.gradient[i] = -gx[i];
        out.gradient[x1_at + i] = gx[i];
        out.stretch[i] = -m[i];
        out.stretch[x1_at + i] = m[i];
    }
    for a in 0..2 {
        out.gradient[t0_at + a] = g0.dot(&d0[a]);
        out.gradient[t1_at + a] = g1.dot(&d1[a]);
        out.stretch[t0_at + a] = ct.dot(&d0[a]);
        out.stretch[t1_at + a] = ct.dot(&d1[a]);
    }
    out.gradient[n_at] = c - data.flexibility * s.tension;
    out.stretch[n_at] = 0.0;
    if M == 14 {
        let [_, th0, b, _, _, th1, _] = places(M);
        for i in [th0, b, th1] {
            out.gradient[i] = 0.0;
            out.stretch[i] = 0.0;
        }
    }
    if HESSIAN {
        out.hessian = [[0.0; M]; M];
        let hxx = hee * (ih * ih);
        for i in 0..3 {
            for j in i..3 {
                out.hessian[i][j] = hxx[(i, j)];
                out.hessian[x1_at + i][x1_at + j] = hxx[(i, j)];
            }
            for j in 0..3 {
                out.hessian[i][x1_at + j] = -hxx[(i, j)];
            }
        }
        let (curve0, curve1) = (g0.dot(&t0), g1.dot(&t1));
        for a in 0..2 {
            let (column0, column1) = (he0 * d0[a] * ih, he1 * d1[a] * ih);
            for i in 0..3 {
                out.hessian[i][t0_at + a] = -column0[i];
                out.hessian[t0_at + a][x1_at + i] = column0[i];
                out.hessian[i][t1_at + a] = -column1[i];
                out.hessian[x1_at + i][t1_at + a] = column1[i];
            }
            let (h00a, h10a, h11a) = (h00 * d0[a], h01.tr_mul(&d0[a]), h11 * d1[a]);
            for b in 0..2 {
                out.hessian[t0_at + a][t1_at + b] = h10a.dot(&d1[b]);
                if b >= a {
                    out.hessian[t0_at + a][t0_at + b] = h00a.dot(&d0[b]);
                    out.hessian[t1_at + a][t1_at + b] = h11a.dot(&d1[b]);
                }
            }
            out.hessian[t0_at + a][t0_at + a] -= curve0;
            out.hessian[t1_at + a][t1_at + a] -= curve1;
        }
        out.hessian[n_at][n_at] = -data.flexibility;
        for i in 0..n_at {
            out.hessian[i][n_at] = out.stretch[i];
        }
    }
    if M == 14 {
        add_torsion::<M, HESSIAN>(data, s, out, &mut energy);
    }
    out.energy = energy;
}
