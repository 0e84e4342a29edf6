//! Gradients and Hessians of the element against fourth-order differences of its energy.

use super::element::{
    ElementData, ElementState, ElementSystem, element_energy, element_system, elongation, mid_slope,
};
use super::frame::{Frame, reference_twist};
use crate::Vec3;

fn noise(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    ((*seed >> 11) as f64) / (1u64 << 53) as f64 * 2.0 - 1.0
}

fn vector(seed: &mut u64) -> Vec3 {
    Vec3::new(noise(seed), noise(seed), noise(seed))
}

/// A state whose end tangent is turned by about `angle` against the first and whose chord is off by about `spread`.
fn state(seed: &mut u64, angle: f64, spread: f64) -> ElementState {
    let first = Frame::new(vector(seed), Some(vector(seed)));
    let way = noise(seed) * 3.0;
    let second = first
        .transported(angle * way.cos(), angle * way.sin())
        .turned(noise(seed))
        .transported(spread * noise(seed), spread * noise(seed));
    // The chord of an arc through both tangents, so that no state is absurdly stretched.
    let chord =
        (first.t + second.t) / (1.0 + 0.7 * first.t.dot(&second.t)).max(0.3) * 0.85 + vector(seed) * spread;
    ElementState {
        first,
        second,
        chord,
        tension: 3.0 * noise(seed),
        angles: [2.0 * noise(seed), 2.0 * noise(seed), 0.3 * noise(seed)],
    }
}

fn data(seed: &mut u64) -> ElementData {
    let positive = |s: &mut u64| 1.5 + noise(s);
    ElementData {
        length: 0.4 * positive(seed),
        bending: [positive(seed), positive(seed), positive(seed)],
        torsion: [positive(seed), positive(seed), positive(seed)],
        rest_curvature: [[noise(seed), noise(seed)], [noise(seed), noise(seed)], [noise(seed), noise(seed)]],
        rest_twist: [noise(seed), noise(seed), noise(seed)],
        flexibility: 0.3 * positive(seed),
    }
}

/// The Lagrangian after the unknowns have moved by `d` (13 entries and N).
fn lagrangian(data: &ElementData, s: &ElementState, d: &[f64; 14]) -> f64 {
    let mut moved = *s;
    moved.chord += (Vec3::new(d[7], d[8], d[9]) - Vec3::new(d[0], d[1], d[2])) / data.length;
    moved.first = s.first.transported(d[3], d[4]);
    moved.second = s.second.transported(d[10], d[11]);
    let before = reference_twist(&s.first, &s.second);
    let after = reference_twist(&moved.first, &moved.second);
    moved.angles[0] += d[5];
    moved.angles[1] += d[12] + after - before;
    moved.angles[2] += d[6];
    moved.tension += d[13];
    let rigid = ElementData { flexibility: 0.0, ..*data };
    let e = element_energy(&rigid, &moved, true);
    let c = elongation(data.length, &mid_slope(&moved.first.t, &moved.chord, &moved.second.t));
    e.total() + moved.tension * c - 0.5 * data.flexibility * moved.tension * moved.tension
}

/// Largest errors of gradient and Hessian, relative to their largest entries.
fn errors(data: &ElementData, s: &ElementState, spoil: f64) -> (f64, f64) {
    let mut out = ElementSystem {
        gradient: [0.0; 14],
        hessian: [[0.0; 14]; 14],
        stretch: [0.0; 14],
        energy: Default::default(),
    };
    element_system::<_, true>(data, s, &mut out);
    out.gradient[4] += spoil;
    out.hessian[3][11] += spoil;
    let at = |i: usize, a: f64, j: usize, b: f64| {
        let mut d = [0.0; 14];
        d[i] += a;
        d[j] += b;
        lagrangian(data, s, &d)
    };
    let step = 1e-3;
    let (mut eg, mut eh) = (0.0f64, 0.0f64);
    let size_h = out.hessian.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
    let size_g = out.gradient.iter().fold(0.1 * size_h, |m, v| m.max(v.abs()));
    for i in 0..14 {
        let first = |h: f64| (at(i, h, i, 0.0) - at(i, -h, i, 0.0)) / (2.0 * h);
        let g = (4.0 * first(step) - first(2.0 * step)) / 3.0;
        eg = eg.max((g - out.gradient[i]).abs() / size_g);
        for j in i..14 {
            let second = |h: f64| {
                if i == j {
                    (at(i, h, i, 0.0) - 2.0 * at(i, 0.0, i, 0.0) + at(i, -h, i, 0.0)) / (h * h)
                } else {
                    (at(i, h, j, h) - at(i, h, j, -h) - at(i, -h, j, h) + at(i, -h, j, -h)) / (4.0 * h * h)
                }
            };
            let v = (4.0 * second(step) - second(2.0 * step)) / 3.0;
            eh = eh.max((v - out.hessian[i][j]).abs() / size_h);
        }
    }
    (eg, eh)
}

#[test]
fn element_derivatives_are_those_of_its_energy() {
    // (turn of the tangent, deviation): nearly straight, random, strongly bent, nearly reversed.
    for (angle, spread) in [(1e-6, 1e-6), (0.3, 0.2), (1.5, 0.1), (2.3, 0.05)] {
        for seed in 1..30u64 {
            let mut s = seed * 77 + 5;
            let (d, q) = (data(&mut s), state(&mut s, angle, spread));
            let (g, h) = errors(&d, &q, 0.0);
            assert!(g < 1e-8 && h < 5e-7, "angle {angle}, seed {seed}: gradient {g:e}, Hessian {h:e}");
        }
    }
}

#[test]
fn a_wrong_derivative_is_seen() {
    let mut s = 9;
    let (d, q) = (data(&mut s), state(&mut s, 0.3, 0.2));
    let (g, h) = errors(&d, &q, 1e-2);
    assert!(g > 1e-8 && h > 5e-7);
}

#[test]
fn elements_with_and_without_twist_agree_where_nothing_twists() {
    let mut s = 4;
    let (mut d, mut q) = (data(&mut s), state(&mut s, 0.5, 0.1));
    d.rest_curvature = [[0.0; 2]; 3];
    d.rest_twist = [0.0; 3];
    d.torsion = [0.0; 3];
    q.angles = [0.0; 3];
    let mut full = ElementSystem {
        gradient: [0.0; 14],
        hessian: [[0.0; 14]; 14],
        stretch: [0.0; 14],
        energy: Default::default(),
    };
    let mut plain = ElementSystem {
        gradient: [0.0; 11],
        hessian: [[0.0; 11]; 11],
        stretch: [0.0; 11],
        energy: Default::default(),
    };
    element_system::<_, true>(&d, &q, &mut full);
    element_system::<_, true>(&d, &q, &mut plain);
    let map = [0, 1, 2, 3, 4, 7, 8, 9, 10, 11, 13];
    for i in 0..11 {
        assert_eq!(plain.gradient[i], full.gradient[map[i]]);
        for j in i..11 {
            assert!((plain.hessian[i][j] - full.hessian[map[i]][map[j]]).abs() < 1e-13);
        }
    }
}
