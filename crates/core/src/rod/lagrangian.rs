//! One element's energy, gradient and Hessian in the unknowns of Newton's method.
//!
//! The unknowns of an element are, in this order, the displacement of the first node (3), the turn of its tangent
//! (2: along u and v of its triad, moved by the smallest rotation), with twist its angles θ₀ and the element's
//! angle bubbles b, one of each for every instrument that has them, the same of the second node, and the axial force N. Derivatives are those of the energy pulled
//! back by that retraction, exact at the current state, so second derivatives hold the curvature of the sphere (−(g·t)I)
//! and of the reference twist. Energy and gradient come from the vectors y and z of each Gauss point, the Hessian from the
//! element's invariants (`invariants`).

use super::bending::{bending, bending_value};
use super::element::{
    ElementData, ElementState, ElementSystem, Energy, angles, arc_factor, elongation, mean_speed, mid_slope,
};
use super::element_torsion::add_torsion;
use super::invariants::{Derivatives, Factors};
use super::layout::Layout;
use super::quadrature::GAUSS;
use super::torsion::TwistValue;
use crate::Vec3;

/// The element's energy alone, where two neighbouring nodes have `C` unknowns.
pub fn element_energy<const C: usize>(data: &ElementData, s: &ElementState) -> Energy {
    let (t0, t1) = (s.first.t, s.second.t);
    let mut energy = Energy::default();
    for (k, point) in GAUSS.iter().enumerate() {
        let (y, z) = point.derivatives(&s.chord, &t0, &t1);
        energy.bend += point.weight * data.bending[k] * bending_value(&y, &z);
    }
    energy.bend *= arc_factor(&t0, &t1).0 * mean_speed(mid_slope(&t0, &s.chord, &t1).norm()) / data.length;
    if Layout::<C>::ANGLES > 0 {
        let (chord, end) = (s.first.local(&s.chord), s.first.local(&t1));
        let shared = GAUSS.map(|point| {
            let (y, z) = point.derivatives(&chord, &Vec3::x(), &end);
            TwistValue::new(&y, &z)
        });
        let instruments = data.materials.iter().zip(&s.angles).take(Layout::<C>::ANGLES);
        for (material, of) in instruments.filter(|(material, _)| material.is_present()) {
            for (k, point) in GAUSS.iter().enumerate() {
                let (phi, dphi) = angles(of, point);
                let (bend, twist) = shared[k].energies(phi, dphi, &material.torsion_input(k, data.length));
                energy.bend += bend;
                energy.twist += twist;
            }
            energy.bend += material.rest_energy(data.length);
        }
    }
    if data.flexibility > 0.0 {
        let c = elongation(data.length, &mid_slope(&t0, &s.chord, &t1));
        energy.axial = 0.5 * c * c / data.flexibility;
    }
    energy
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
    if Layout::<C>::ANGLES > 0 {
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
    if Layout::<C>::ANGLES > 0 {
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
