//! One element's energy, gradient and Hessian in the unknowns of Newton's method.
//!
//! The unknowns of an element are, in this order: the displacement of the first node (3); the turn of its tangent (2:
//! along u and v of its triad, moved by the smallest rotation); with twist, its angles θ₀ and the element's angle
//! bubbles b, one of each per instrument that has angles; the same of the second node; and the axial force N.
//! Derivatives are those of the energy pulled back by that retraction, exact at the current state, so second
//! derivatives include the curvature of the sphere (−(g·t)I) and of the reference twist. Energy and gradient come
//! from the vectors y and z of each Gauss point, the Hessian from the element's invariants (`invariants`).

use super::batch::{Batch, Lane, MOST};
use super::bending::{bending, bending_value};
use super::element::{
    ElementData, ElementState, ElementSystem, Energy, angles, arc_factor, elongation, mean_speed, mid_slope,
};
use super::element_torsion::add_torsion;
use super::invariants::{Derivatives, Factors};
use super::lanes::{Lanes, Vector};
use super::layout::Layout;
use super::quadrature::GAUSS;
use super::rim::{rim_energy, rim_system};
use super::state::RodState;
use super::torsion::TwistValue;
use pulp::{Arch, Scalar, Simd, WithSimd, bytemuck};
use std::ops::Range;

/// The element's energy alone, where two neighbouring nodes have `C` unknowns.
pub(crate) fn element_energy<const C: usize>(data: &ElementData, s: &ElementState) -> Energy {
    if let Some(energy) = rim_energy::<C>(data, s) {
        return energy;
    }
    energy::<_, C>(&Batch::new::<C>(Scalar, &[Lane::of(data, s)]))
}

/// The element's Lagrangian with derivatives. The Hessian is computed only if `HESSIAN` is set, with the augmentation
/// `gamma` (γ in `super::assembly`; 0 gives the Hessian of the Lagrangian itself).
pub(crate) fn element_system<const C: usize, const HESSIAN: bool>(
    data: &ElementData,
    s: &ElementState,
    gamma: f64,
    out: &mut ElementSystem<C>,
) {
    if data.tilt.is_some() {
        return rim_system::<C, HESSIAN>(data, s, gamma, out);
    }
    let batch = Batch::new::<C>(Scalar, &[Lane::of(data, s)]);
    system::<_, C, HESSIAN>(&batch, Lanes::splat(Scalar, gamma), out);
}

/// Elastic energy of all elements of a rod.
pub(crate) fn stored_energy<const C: usize>(elements: &[ElementData], state: &RodState) -> f64 {
    Arch::new().dispatch(Stored::<C> { elements, state })
}

/// Sums the elastic energy of a rod.
pub(super) struct Stored<'a, const C: usize> {
    pub(super) elements: &'a [ElementData],
    pub(super) state: &'a RodState,
}

impl<const C: usize> WithSimd for Stored<'_, C> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let mut sum = 0.0;
        for first in (0..self.elements.len()).step_by(S::F64_LANES) {
            let (batch, count) = beside::<S, C>(simd, self.elements, self.state, first);
            let Energy { bend, twist, axial } = energy::<S, C>(&batch);
            let energies = [bend, twist, axial];
            let [bend, twist, axial] = [0, 1, 2].map(|k| bytemuck::cast_slice(&energies[k..k + 1]));
            for lane in (0..count).filter(|lane| !self.elements[first + lane].is_break()) {
                let data = &self.elements[first + lane];
                if let Some(energy) = rim_energy::<C>(data, &self.state.element::<C>(first + lane)) {
                    sum += energy.total();
                    continue;
                }
                sum += Energy::<f64> { bend: bend[lane], twist: twist[lane], axial: axial[lane] }.total();
            }
        }
        sum
    }
}

/// Calls `tell` with the gradient and the derivative of the elongation of each of these elements, made by `data`,
/// at `state`, without axial force.
pub(crate) fn element_gradients<const C: usize>(
    range: Range<usize>,
    data: impl Fn(usize) -> ElementData,
    state: &RodState,
    tell: impl FnMut(usize, &[f64; C], &[f64; C]),
) {
    Arch::new().dispatch(Gradients { range, data, state, tell });
}

/// Computes gradients of elements that are made one after the other.
pub(super) struct Gradients<'a, const C: usize, D, T> {
    pub(super) range: Range<usize>,
    pub(super) data: D,
    pub(super) state: &'a RodState,
    pub(super) tell: T,
}

impl<const C: usize, D, T> WithSimd for Gradients<'_, C, D, T>
where
    D: Fn(usize) -> ElementData,
    T: FnMut(usize, &[f64; C], &[f64; C]),
{
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let zero = Lanes::splat(simd, 0.0);
        let mut all = ElementSystem::<C, S::f64s>::filled(zero.stored());
        let mut made = [ElementData::EMPTY; MOST];
        let end = self.range.end;
        for first in self.range.step_by(S::F64_LANES) {
            for (lane, data) in made.iter_mut().enumerate().take(S::F64_LANES) {
                *data = (self.data)((first + lane).min(end - 1));
            }
            let mut lanes = [self.state.lane::<C>(&made[0], first); MOST];
            for lane in 0..S::F64_LANES {
                lanes[lane] = self.state.lane::<C>(&made[lane], (first + lane).min(end - 1));
                lanes[lane].tension = 0.0;
            }
            system::<S, C, false>(&Batch::new::<C>(simd, &lanes), zero, &mut all);
            for lane in 0..S::F64_LANES.min(end - first) {
                let of = |list: &[S::f64s; C], i: usize| {
                    bytemuck::cast_slice::<_, f64>(list)[i * S::F64_LANES + lane]
                };
                let gradient = std::array::from_fn(|i| of(&all.gradient, i));
                let stretch = std::array::from_fn(|i| of(&all.stretch, i));
                (self.tell)(first + lane, &gradient, &stretch);
            }
        }
    }
}

/// The elements from `first` on, as many as there are lanes, and their number; the last one fills unused lanes.
#[inline(always)]
pub(super) fn beside<S: Simd, const C: usize>(
    simd: S,
    elements: &[ElementData],
    state: &RodState,
    first: usize,
) -> (Batch<S>, usize) {
    let last = elements.len() - 1;
    let mut lanes = [state.lane::<C>(&elements[first], first); MOST];
    for lane in 1..S::F64_LANES {
        let e = (first + lane).min(last);
        lanes[lane] = state.lane::<C>(&elements[e], e);
    }
    (Batch::new::<C>(simd, &lanes), S::F64_LANES.min(elements.len() - first))
}

#[inline(always)]
fn energy<S: Simd, const C: usize>(s: &Batch<S>) -> Energy<S::f64s> {
    let (t0, t1) = (s.first.t, s.second.t);
    let zero = Lanes::splat(s.simd, 0.0);
    let (mut bend, mut twist, mut axial) = (zero, zero, zero);
    for k in 0..GAUSS.len() {
        let point = &GAUSS[k];
        let (y, z) = point.derivatives(s.chord, t0, t1);
        bend += s.bending[k] * point.weight * bending_value(y, z);
    }
    let speed = mid_slope(t0, s.chord, t1).norm();
    bend = bend * (arc_factor(t0, t1).0 * mean_speed(speed) / s.length);
    if Layout::<C>::ANGLES > 0 {
        let (chord, end) = (s.first.local(s.chord), s.first.local(t1));
        let along = Vector::splat(s.simd, [1.0, 0.0, 0.0]);
        for k in 0..GAUSS.len() {
            let point = &GAUSS[k];
            let (y, z) = point.derivatives(chord, along, end);
            let shared = TwistValue::new(y, z);
            for set in 0..Layout::<C>::ANGLES {
                let instrument = &s.instruments[set];
                if instrument.present {
                    let (phi, dphi) = angles(&instrument.angles, point);
                    let input = instrument.torsion_input(k, s.length);
                    twist += shared.twist_energy(dphi, &input);
                    if instrument.curved {
                        bend += shared.rest_curvature_energy(phi, &input);
                    }
                    if instrument.skewed {
                        bend += shared.skew_energy(phi, instrument.skew_input(k, s.length));
                    }
                }
            }
        }
        for set in 0..Layout::<C>::ANGLES {
            if s.instruments[set].curved {
                bend += s.instruments[set].rest_energy(s.length);
            }
        }
    }
    if s.stretches {
        axial = stretch_energy(s, elongation(s.length, speed));
    }
    Energy { bend: bend.stored(), twist: twist.stored(), axial: axial.stored() }
}

/// ½ c²/D of elements that stretch.
#[inline(always)]
fn stretch_energy<S: Simd>(s: &Batch<S>, c: Lanes<S>) -> Lanes<S> {
    (c * 0.5 * c / s.flexibility).where_positive(s.flexibility)
}

/// First rows of x₀, t₀, x₁ and t₁.
#[inline(always)]
const fn places<const C: usize>() -> [usize; 4] {
    let l = Layout::<C>;
    [l.position(0), l.tangent(0), l.position(1), l.tangent(1)]
}

/// The Lagrangian of each element with derivatives.
#[inline(always)]
pub(super) fn system<S: Simd, const C: usize, const HESSIAN: bool>(
    s: &Batch<S>,
    gamma: Lanes<S>,
    out: &mut ElementSystem<C, S::f64s>,
) {
    let h = s.length;
    let ih = h.inverse();
    let (t0, t1) = (s.first.t, s.second.t);
    let zero = Lanes::splat(s.simd, 0.0);

    // Bending at unit speed, in (e, t₀, t₁).
    let mut stored = zero;
    let mut ge = Vector::splat(s.simd, [0.0; 3]);
    let (mut g0, mut g1) = (ge, ge);
    let mut second = Derivatives::zeros(s.simd);
    for k in 0..GAUSS.len() {
        let point = &GAUSS[k];
        let (y, z) = point.derivatives(s.chord, t0, t1);
        let f = bending(y, z);
        let scale = s.bending[k] * point.weight * ih;
        stored += scale * f.value;
        let (gy, gz) = (f.gy * scale, f.gz * scale);
        ge += gy * point.y[0] + gz * point.z[0];
        g0 += gy * point.y[1] + gz * point.z[1];
        g1 += gy * point.y[2] + gz * point.z[2];
        if HESSIAN {
            second.add_point(k, scale, &f.partials);
        }
    }

    // The middle: m = r′/|r′| with r′ = 1.5 e − ¼(t₀ + t₁).
    let mid = mid_slope(t0, s.chord, t1);
    let speed = mid.norm();
    let slow = speed.inverse();
    let m = mid * slow;

    // Times the factor f = g(t₀·t₁) (1 + 2|r′|)/3: f ∇U + U ∇f. ∇|r′| = m (1.5, −¼, −¼).
    let arc = arc_factor(t0, t1);
    let mean = mean_speed(speed);
    let f = arc.0 * mean;
    // Axial force at the middle: N c, c = ⅔h(|r′| − 1). Its derivative in |r′| has the same form as that of f U.
    let c = elongation(h, speed);
    let mut energy = Energy { bend: stored * f, twist: zero, axial: zero };
    if s.stretches {
        energy.axial = stretch_energy(s, c);
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
    let (gx, m) = ((ge * ih).components(), m.components());
    out.gradient = [zero.stored(); C];
    out.stretch = [zero.stored(); C];
    for i in 0..3 {
        out.gradient[x0_at + i] = (-gx[i]).stored();
        out.gradient[x1_at + i] = gx[i].stored();
        out.stretch[x0_at + i] = (-m[i]).stored();
        out.stretch[x1_at + i] = m[i].stored();
    }
    for a in 0..2 {
        out.gradient[t0_at + a] = g0.dot(d0[a]).stored();
        out.gradient[t1_at + a] = g1.dot(d1[a]).stored();
        out.stretch[t0_at + a] = ct.dot(d0[a]).stored();
        out.stretch[t1_at + a] = ct.dot(d1[a]).stored();
    }
    out.gradient[C - 1] = (c - s.flexibility * s.tension).stored();
    if HESSIAN {
        let factors = Factors { stored, arc, mean, slow, length: h, tension: s.tension, gamma };
        add_hessian(s, ih, &second.complete(&factors), out);
        // The flexibility of the transformed multiplier, which belongs to the augmentation.
        out.rows[C - 1][C - 1] = (-s.flexibility / (-(gamma * s.flexibility) + 1.0)).stored();
        for i in 0..C - 1 {
            out.rows[i][C - 1] = out.stretch[i];
        }
    }
    if Layout::<C>::ANGLES > 0 {
        add_torsion::<S, C, HESSIAN>(s, out, &mut energy);
    }
    out.energy =
        Energy { bend: energy.bend.stored(), twist: energy.twist.stored(), axial: energy.axial.stored() };
}

/// Sets the rows of the Hessian from derivatives in the invariants.
#[inline(always)]
fn add_hessian<S: Simd, const C: usize>(
    s: &Batch<S>,
    ih: Lanes<S>,
    v: &Derivatives<S>,
    out: &mut ElementSystem<C, S::f64s>,
) {
    let [x0_at, t0_at, x1_at, t1_at] = places::<C>();
    let (e, t0, t1) = (s.chord, s.first.t, s.second.t);
    let (d0, d1) = ([s.first.u, s.first.v], [s.second.u, s.second.v]);
    let ([vs, vp, vq, vr], vv) = (v.first, &v.second);
    // ∇g in x₁, and V_ij ∇gⱼ of them.
    let by_x = [e * (ih * 2.0), t0 * ih, t1 * ih];
    let ws = combined(&by_x, [vv[0][0], vv[0][1], vv[0][2]]);
    let wp = combined(&by_x, [vv[0][1], vv[1][1], vv[1][2]]);
    let wq = combined(&by_x, [vv[0][2], vv[1][2], vv[2][2]]);
    let wr = combined(&by_x, [vv[0][3], vv[1][3], vv[2][3]]);
    if Layout::<C>::ANGLES > 0 {
        // Set here on every call, so that only torsion has to add to it.
        let zero = Lanes::splat(s.simd, 0.0).stored();
        for i in 0..C {
            for j in i..C {
                out.rows[i][j] = zero;
            }
        }
    }
    let stiffness = (by_x[0].outer(ws) + by_x[1].outer(wp) + by_x[2].outer(wq))
        .with_diagonal(vs * 2.0 * ih * ih)
        .entries();
    for i in 0..3 {
        for j in i..3 {
            let value = stiffness[i][j];
            out.rows[x0_at + i][x0_at + j] = value.stored();
            out.rows[x1_at + i][x1_at + j] = value.stored();
            out.rows[x0_at + i][x1_at + j] = (-value).stored();
            out.rows[x0_at + j][x1_at + i] = (-value).stored();
        }
    }
    // ∇g in the turns of the tangents: of e·t₀ and t₀·t₁ in those of t₀, of e·t₁ and t₀·t₁ in those of t₁.
    let (p, r0) = ([e.dot(d0[0]), e.dot(d0[1])], [t1.dot(d0[0]), t1.dot(d0[1])]);
    let (q, r1) = ([e.dot(d1[0]), e.dot(d1[1])], [t0.dot(d1[0]), t0.dot(d1[1])]);
    let (along, across) = (e.dot(t0), e.dot(t1));
    let cosine = t0.dot(t1);
    for a in 0..2 {
        let column0 = (wp * p[a] + wr * r0[a] + d0[a] * (vp * ih)).components();
        let column1 = (wq * q[a] + wr * r1[a] + d1[a] * (vq * ih)).components();
        for i in 0..3 {
            out.rows[x0_at + i][t0_at + a] = (-column0[i]).stored();
            out.rows[t0_at + a][x1_at + i] = column0[i].stored();
            out.rows[x0_at + i][t1_at + a] = (-column1[i]).stored();
            out.rows[x1_at + i][t1_at + a] = column1[i].stored();
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
            out.rows[t0_at + a][t0_at + b] = first.stored();
            out.rows[t1_at + a][t1_at + b] = last.stored();
        }
        for b in 0..2 {
            let mixed = (vv[1][2] * q[b] + vv[1][3] * r1[b]) * p[a]
                + (vv[2][3] * q[b] + vv[3][3] * r1[b]) * r0[a]
                + vr * d0[a].dot(d1[b]);
            out.rows[t0_at + a][t1_at + b] = mixed.stored();
        }
    }
}

/// Three vectors with their weights.
#[inline(always)]
fn combined<S: Simd>(of: &[Vector<S>; 3], w: [Lanes<S>; 3]) -> Vector<S> {
    of[0] * w[0] + of[1] * w[1] + of[2] * w[2]
}
