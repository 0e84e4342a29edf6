//! Gradients and Hessians of the element against fourth-order differences of its energy.

use super::element::{ElementData, ElementState, ElementSystem, Material, elongation, mid_slope};
use super::frame::{Frame, reference_twist};
use super::lagrangian::{element_energy, element_system};
use super::layout::{Layout, MAX_ANGLES, PLAIN, TWISTED};
use crate::Vec3;

pub(super) fn noise(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    ((*seed >> 11) as f64) / (1u64 << 53) as f64 * 2.0 - 1.0
}

fn vector(seed: &mut u64) -> Vec3 {
    Vec3::new(noise(seed), noise(seed), noise(seed))
}

/// A state whose end tangent is turned by about `angle` against the first and whose chord is off by about `spread`.
pub(super) fn state(seed: &mut u64, angle: f64, spread: f64) -> ElementState {
    let first = Frame::new(vector(seed), Some(vector(seed)));
    let way = noise(seed) * 3.0;
    let second = first
        .transported(angle * way.cos(), angle * way.sin())
        .turned(noise(seed))
        .transported(spread * noise(seed), spread * noise(seed));
    // The chord of an arc through both tangents, so that no state is absurdly stretched.
    let chord =
        (first.t + second.t) / (1.0 + 0.7 * first.t.dot(&second.t)).max(0.3) * 0.85 + vector(seed) * spread;
    let mut angles = || [2.0 * noise(seed), 2.0 * noise(seed), 0.3 * noise(seed)];
    let angles = [angles(), angles(), angles()];
    ElementState { first, second, chord, tension: 3.0 * noise(seed), angles }
}

fn positive(seed: &mut u64) -> f64 {
    1.5 + noise(seed)
}

pub(super) fn material(s: &mut u64) -> Material {
    Material {
        bending: [positive(s), positive(s), positive(s)],
        torsion: [positive(s), positive(s), positive(s)],
        rest_curvature: [[noise(s), noise(s)], [noise(s), noise(s)], [noise(s), noise(s)]],
        rest_twist: [noise(s), noise(s), noise(s)],
        ..Material::NONE
    }
}

/// The same with two of its three instruments stiffer in some planes than in others.
fn skewed(mut data: ElementData, s: &mut u64) -> ElementData {
    for material in &mut data.materials[..2] {
        for k in 0..3 {
            material.skew[k] = [positive(s), positive(s), noise(s)];
        }
    }
    data
}

/// An element with three instruments that have rest shapes, and one without.
pub(super) fn data(seed: &mut u64) -> ElementData {
    let materials = [material(seed), material(seed), material(seed)];
    let bending =
        [0, 1, 2].map(|k| materials.iter().map(|m| m.bending[k]).sum::<f64>() + 0.5 * positive(seed));
    ElementData {
        length: 0.4 * positive(seed),
        bending,
        flexibility: 0.3 * positive(seed),
        materials,
        tilt: None,
    }
}

/// The Lagrangian after the unknowns have moved by `d`; entries of b and N of the first node are empty, the last one is N.
pub(super) fn lagrangian<const C: usize>(data: &ElementData, s: &ElementState, d: &[f64; C]) -> f64 {
    let l = Layout::<C>;
    let three = |at: usize| Vec3::new(d[at], d[at + 1], d[at + 2]);
    let (t0, t1) = (l.tangent(0), l.tangent(1));
    let mut moved = *s;
    moved.chord += (three(l.position(1)) - three(l.position(0))) / data.length;
    moved.first = s.first.transported(d[t0], d[t0 + 1]);
    moved.second = s.second.transported(d[t1], d[t1 + 1]);
    let before = reference_twist(&s.first, &s.second);
    let after = reference_twist(&moved.first, &moved.second);
    for (set, angles) in moved.angles.iter_mut().enumerate().take(Layout::<C>::ANGLES) {
        angles[0] += d[l.angle(0, set)];
        angles[1] += d[l.angle(1, set)] + after - before;
        angles[2] += d[l.bubble(0, set)];
    }
    moved.tension += d[l.tension(0)];
    let rigid = ElementData { flexibility: 0.0, ..*data };
    let e = element_energy::<C>(&rigid, &moved);
    let c = elongation(data.length, mid_slope(moved.first.t, moved.chord, moved.second.t).norm());
    e.total() + moved.tension * c - 0.5 * data.flexibility * moved.tension * moved.tension
}

/// Largest errors of gradient and Hessian, relative to their largest entries.
pub(super) fn errors<const C: usize>(data: &ElementData, s: &ElementState, spoil: f64) -> (f64, f64) {
    let l = Layout::<C>;
    let mut out = ElementSystem::<C>::zeros();
    element_system::<_, true>(data, s, 0.0, &mut out);
    out.gradient[l.tangent(0)] += spoil;
    out.rows[l.tangent(0)][l.tangent(1) + 1] += spoil;
    let at = |i: usize, a: f64, j: usize, b: f64| {
        let mut d = [0.0; C];
        d[i] += a;
        d[j] += b;
        lagrangian(data, s, &d)
    };
    let step = 5e-4;
    let (mut eg, mut eh) = (0.0f64, 0.0f64);
    let size_h = out.rows.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
    let size_g = out.gradient.iter().fold(0.1 * size_h, |m, v| m.max(v.abs()));
    for i in 0..C {
        let first = |h: f64| (at(i, h, i, 0.0) - at(i, -h, i, 0.0)) / (2.0 * h);
        let g = (4.0 * first(step) - first(2.0 * step)) / 3.0;
        eg = eg.max((g - out.gradient[i]).abs() / size_g);
        for j in i..C {
            let second = |h: f64| {
                if i == j {
                    (at(i, h, i, 0.0) - 2.0 * at(i, 0.0, i, 0.0) + at(i, -h, i, 0.0)) / (h * h)
                } else {
                    (at(i, h, j, h) - at(i, h, j, -h) - at(i, -h, j, h) + at(i, -h, j, -h)) / (4.0 * h * h)
                }
            };
            let v = (4.0 * second(step) - second(2.0 * step)) / 3.0;
            eh = eh.max((v - out.rows[i][j]).abs() / size_h);
        }
    }
    (eg, eh)
}

#[test]
fn element_derivatives_are_those_of_its_energy() {
    // (turn of the tangent, deviation, stretch): nearly straight, random, strongly bent, nearly reversed, strongly stretched,
    // strongly pressed.
    for (angle, spread, stretch) in [
        (1e-6, 1e-6, 1.0),
        (0.3, 0.2, 1.0),
        (1.5, 0.1, 1.0),
        (2.3, 0.05, 1.0),
        (0.5, 0.1, 2.0),
        (0.5, 0.1, 0.8),
    ] {
        for seed in 1..30u64 {
            let mut s = seed * 77 + 5;
            let (d, mut q) = (data(&mut s), state(&mut s, angle, spread));
            q.chord *= stretch;
            for d in [d, skewed(d, &mut s)] {
                let of_widths = [
                    errors::<PLAIN>(&d, &q, 0.0),
                    errors::<TWISTED>(&d, &q, 0.0),
                    errors::<20>(&d, &q, 0.0),
                    errors::<24>(&d, &q, 0.0),
                ];
                for (sets, (g, h)) in of_widths.into_iter().enumerate() {
                    assert!(
                        g < 1e-8 && h < 5e-7,
                        "{sets} sets, angle {angle}, seed {seed}: gradient {g:e}, Hessian {h:e}"
                    );
                }
            }
        }
    }
}

#[test]
fn a_wrong_derivative_is_seen() {
    let mut s = 9;
    let (d, q) = (data(&mut s), state(&mut s, 0.3, 0.2));
    for (g, h) in [errors::<TWISTED>(&d, &q, 1e-2), errors::<24>(&d, &q, 1e-2)] {
        assert!(g > 1e-8 && h > 5e-7);
    }
}

/// A skew stiffness is what a rest curvature meets: with B = diag(3, 1) along d₁ and d₂ an element that is bent in either plane stores
/// its part alone, whichever way it is turned.
#[test]
fn a_skew_element_stores_what_its_planes_store() {
    let length = 0.02;
    let first = Frame::new(Vec3::z(), Some(Vec3::x()));
    for turned in [0.0, 0.4, 1.3, 2.9] {
        for (plane, stiffness) in
            [(0.0, 3.0), (0.5 * std::f64::consts::PI, 1.0), (0.25 * std::f64::consts::PI, 2.0)]
        {
            let way: f64 = plane + turned;
            let bend = 0.01;
            let second = first.transported(bend * way.cos(), bend * way.sin());
            let material = Material {
                bending: [1.0; 3],
                skew: [[2.0, 0.0, 0.0]; 3],
                torsion: [1.0; 3],
                ..Material::NONE
            };
            let of_arc = (0.5 * bend).sin() / (0.5 * bend);
            let chord = first.transported(0.5 * bend * way.cos(), 0.5 * bend * way.sin()).t * of_arc;
            let angles = [[turned, turned, 0.0]; MAX_ANGLES];
            let q = ElementState { first, second, chord, tension: 0.0, angles };
            let energy = element_energy::<TWISTED>(&ElementData::of(length, material), &q);
            let expected = 0.5 * stiffness * bend * bend / length;
            assert!((energy.bend / expected - 1.0).abs() < 1e-8, "{turned} {plane}: {energy:?} {expected}");
            assert!(energy.twist < 1e-12 * expected);
        }
    }
}

#[test]
fn elements_with_and_without_twist_agree_where_nothing_twists() {
    let mut s = 4;
    let (mut d, mut q) = (data(&mut s), state(&mut s, 0.5, 0.1));
    d.materials = [Material { torsion: [f64::MIN_POSITIVE; 3], ..Material::NONE }; MAX_ANGLES];
    q.angles = [[0.0; 3]; MAX_ANGLES];
    let (mut full, mut plain) = (ElementSystem::<TWISTED>::zeros(), ElementSystem::<PLAIN>::zeros());
    element_system::<_, true>(&d, &q, 7.0, &mut full);
    element_system::<_, true>(&d, &q, 7.0, &mut plain);
    let map = [1, 2, 3, 4, 5, 7, 9, 10, 11, 12, 13, 15];
    for i in 0..PLAIN {
        assert_eq!(plain.gradient[i], full.gradient[map[i]]);
        for j in i..PLAIN {
            assert!((plain.rows[i][j] - full.rows[map[i]][map[j]]).abs() < 1e-13);
        }
    }
}

#[test]
fn the_augmentation_is_the_square_of_the_stretch() {
    let mut s = 31;
    for (angle, spread) in [(1e-6, 1e-6), (0.3, 0.2), (1.5, 0.1)] {
        let (d, q) = (data(&mut s), state(&mut s, angle, spread));
        let gamma = d.augmentation();
        let (mut with, mut without) = (ElementSystem::<PLAIN>::zeros(), ElementSystem::<PLAIN>::zeros());
        element_system::<_, true>(&d, &q, gamma, &mut with);
        element_system::<_, true>(&d, &q, 0.0, &mut without);
        let last = PLAIN - 1;
        assert_eq!(without.rows[last][last], -d.flexibility);
        assert_eq!(with.rows[last][last], -d.flexibility / (1.0 - gamma * d.flexibility));
        for i in 0..last {
            assert_eq!(with.gradient[i], without.gradient[i]);
            for j in i..last {
                let added = with.rows[i][j] - without.rows[i][j];
                let error = added - gamma * with.stretch[i] * with.stretch[j];
                assert!(error.abs() < 1e-13 * gamma, "angle {angle}, ({i}, {j}): {error:e}");
            }
        }
    }
}

#[test]
fn the_hessian_of_a_nearly_straight_element_is_that_of_the_beam() {
    // EI/h³ (12, 6h, 4h², 2h²) across, nothing along.
    let first = Frame::new(Vec3::new(0.6, -0.3, 0.7), None);
    for turn in [0.0, 1e-9] {
        let second = first.transported(turn, 0.0);
        let d = ElementData::plain(0.5, 2.0);
        let q = ElementState {
            first,
            second,
            chord: (first.t + second.t) * 0.5,
            tension: 0.0,
            angles: [[0.0; 3]; MAX_ANGLES],
        };
        let mut out = ElementSystem::<PLAIN>::zeros();
        element_system::<_, true>(&d, &q, 0.0, &mut out);
        let (x0, t0, x1, t1) = (0, 3, 6, 9);
        // The rotation changes entries by its own size; rounding is 192 along each pair of axes.
        let room = 1e3 * turn + 1e-12;
        let along = |i: usize, j: usize| first.u[i] * first.u[j] + first.v[i] * first.v[j];
        for i in 0..3 {
            for j in 0..3 {
                let wanted = 12.0 * 2.0 / 0.125 * along(i, j);
                assert!((out.rows[x0 + i][x1 + j] + wanted).abs() < room);
                if j >= i {
                    assert!((out.rows[x0 + i][x0 + j] - wanted).abs() < room);
                    assert!((out.rows[x1 + i][x1 + j] - wanted).abs() < room);
                }
            }
            let wanted = 6.0 * 2.0 / 0.25 * first.u[i];
            for (entry, sign) in
                [((x0 + i, t0), 1.0), ((t0, x1 + i), -1.0), ((x0 + i, t1), 1.0), ((x1 + i, t1), -1.0)]
            {
                assert!((out.rows[entry.0][entry.1] - sign * wanted).abs() < room);
            }
        }
        for a in 0..2 {
            assert!((out.rows[t0 + a][t0 + a] - 16.0).abs() < room);
            assert!((out.rows[t1 + a][t1 + a] - 16.0).abs() < room);
            assert!((out.rows[t0 + a][t1 + a] - 8.0).abs() < room);
        }
    }
}
