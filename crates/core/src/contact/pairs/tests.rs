//! Gaps, pairs and their derivatives.

use super::*;
use crate::Vec3;
use crate::contact::set::{Stencil, System};
use crate::rod::{Assembly, Frame, Layout, PLAIN, TWISTED};

/// A rod along a curve, with nodes at equal steps of its parameter.
pub(super) fn along(curve: impl Fn(f64) -> Vec3, to: f64, elements: usize) -> (Vec<ElementData>, RodState) {
    let at = |i: f64| curve(to * i / elements as f64);
    let tangent = |i: f64| (at(i + 1e-4) - at(i - 1e-4)).normalize();
    let length = |e: usize| {
        let parts = 64;
        let place = |k: usize| at(e as f64 + k as f64 / parts as f64);
        (0..parts).map(|k| (place(k + 1) - place(k)).norm()).sum()
    };
    let data: Vec<_> = (0..elements).map(|e| ElementData::plain(length(e), 1.0)).collect();
    let frames = (0..=elements).map(|i| Frame::new(tangent(i as f64), None)).collect();
    let mut state = RodState::from_frames(&data, curve(0.0), frames);
    for (i, x) in state.positions.iter_mut().enumerate() {
        *x = at(i as f64);
    }
    (data, state)
}

/// A coil of radius `wide` and this pitch.
fn coil(wide: f64, pitch: f64) -> impl Fn(f64) -> Vec3 {
    move |a: f64| Vec3::new(wide * a.cos(), wide * a.sin(), pitch * a / std::f64::consts::TAU)
}

/// A rod that crosses over itself at an angle, `high` above.
fn loop_over(high: f64) -> impl Fn(f64) -> Vec3 {
    move |a: f64| {
        let b = a - 2.5;
        Vec3::new(1.6 * (1.3 * b).sin(), 0.9 * (2.6 * b).sin(), high * b / 2.4)
    }
}

fn contact(elements: &[ElementData], radius_mm: f64) -> SelfContact {
    SelfContact::new(elements, vec![Capsule { radius_mm, modulus_n_per_mm2: 40.0 }; elements.len()])
}

fn derivatives_are_those_of_the_energy<const C: usize>(
    elements: &[ElementData],
    state: &RodState,
    radius: f64,
    friction: f64,
) {
    let mut touching = contact(elements, radius);
    // Slips are of the magnitude of ε, so that some points stick and some do not.
    let mut begun = state.clone();
    for (i, x) in begun.positions.iter_mut().enumerate() {
        *x += Vec3::new((0.7 * i as f64).sin(), (1.1 * i as f64).cos(), 0.3) * 0.01;
    }
    let law = FrictionLaw { coefficient: friction, stick_mm: [0.02, 0.001], least_n: 0.0 };
    touching.begin_friction(&begun, std::iter::empty(), elements.iter().map(|_| 0.005), law);
    let mut assembly = Assembly::<C>::new(elements.len());
    touching.look_at_base(elements, state);
    // With the forces of the energy itself.
    for pair in &mut touching.pairs {
        pair.force_n = pair.spring_n_per_mm * pair.depth_mm().max(0.0);
    }
    touching.follow_pairs(elements, state);
    touching.press(elements, state, &mut assembly);
    assert!(touching.pairs.iter().filter(|pair| pair.depth_mm() > 0.0).count() > 3);
    assert!(!assembly.couplings.is_empty());
    let l = Layout::<C>;
    let rows: Vec<usize> = (0..=elements.len())
        .flat_map(|i| (0..5).map(move |a| if a < 3 { l.position(i) + a } else { l.tangent(i) + a - 3 }))
        .collect();
    let mut moved = |way: &[f64], h: f64| {
        let mut to = state.clone();
        for (i, w) in way.chunks_exact(5).enumerate() {
            to.positions[i] += Vec3::new(w[0], w[1], w[2]) * h;
            to.frames[i] = state.frames[i].transported(h * w[3], h * w[4]);
        }
        touching.stored_or_merit_mj(elements, &to)
    };
    for seed in 0..6 {
        let way: Vec<f64> = (0..rows.len()).map(|k| (1.7 * f64::from(seed) + 2.3 * k as f64).sin()).collect();
        let (h, here) = (1e-5, moved(&way, 0.0));
        assert!((here - assembly.external_energy).abs() < 1e-12 * here);
        let (plus, minus) = (moved(&way, h), moved(&way, -h));
        let slope: f64 = rows.iter().zip(&way).map(|(row, w)| assembly.residual[*row] * w).sum();
        let found = (plus - minus) / (2.0 * h);
        assert!((found - slope).abs() < 1e-5 * (1.0 + slope.abs()), "direction {seed}: {found} and {slope}");
        let mut curve = 0.0;
        for (i, w) in rows.iter().zip(&way) {
            for (j, v) in rows.iter().zip(&way) {
                let block = Layout::<C>::BLOCK;
                let near = (i / block).abs_diff(j / block) <= 1;
                curve +=
                    w * v * if near { assembly.matrix.get(*i, *j) } else { assembly.couplings.get(*i, *j) };
            }
        }
        let found = (plus + minus - 2.0 * here) / (h * h);
        assert!((found - curve).abs() < 1e-3 * (1.0 + curve.abs()), "direction {seed}: {found} and {curve}");
    }
}

#[test]
fn derivatives_are_those_of_the_energy_along_lines_and_at_crossings() {
    let (elements, state) = along(coil(0.5, 0.19), 13.0, 40);
    for friction in [0.0, 0.4] {
        derivatives_are_those_of_the_energy::<PLAIN>(&elements, &state, 0.1, friction);
        derivatives_are_those_of_the_energy::<TWISTED>(&elements, &state, 0.1, friction);
    }
    let (elements, state) = along(loop_over(0.09), 5.0, 30);
    for friction in [0.0, 0.4] {
        derivatives_are_those_of_the_energy::<PLAIN>(&elements, &state, 0.1, friction);
    }
}

#[test]
fn a_linear_spring_is_a_couple_without_curvature() {
    let (elements, state) = along(coil(0.5, 0.19), 13.0, 40);
    let mut touching = contact(&elements, 0.1);
    touching.look_at_base(&elements, &state);
    let (mut one, mut other) =
        (Assembly::<TWISTED>::new(elements.len()), Assembly::<TWISTED>::new(elements.len()));
    for (k, pair) in touching.pairs.iter().enumerate() {
        let (first, second) = (0.3 + k as f64, 2.0 + (k as f64).sin());
        let m = pair.gap.direction();
        one.add_couple(
            &elements,
            &state,
            &pair.couple(&touching.curve(&elements, &state), first, 0.0, second),
        );
        let mut system = System { elements: &elements, base: &state, into: &mut other };
        let stiffness = (second * m * m.transpose(), Vec3::zeros(), 0.0);
        pair.difference.add(&mut system, &(m * first, 0.0), &stiffness);
    }
    let n = one.residual.len();
    let largest = one.residual.iter().fold(0.0, |most, r| f64::max(most, r.abs()));
    assert!(touching.pairs.len() > 100 && largest > 1.0);
    for i in 0..n {
        assert!((one.residual[i] - other.residual[i]).abs() < 1e-12 * largest, "row {i}");
        for j in i..n {
            let block = Layout::<TWISTED>::BLOCK;
            let entry = |of: &Assembly<TWISTED>| {
                if j / block - i / block <= 1 { of.matrix.get(i, j) } else { of.couplings.get(i, j) }
            };
            // A couple turns tangents with its carried forces, which are none here.
            assert!((entry(&one) - entry(&other)).abs() < 1e-12 * largest, "({i}, {j})");
        }
    }
}

#[test]
fn no_pair_is_missed_by_a_search_in_two_parts() {
    // A coil, a crossing, and a coil that is wound to a coil; none bends as sharply as pairs are apart.
    let wound = |a: f64| {
        let b = 24.0 * a;
        let out = 1.5 + 0.45 * b.cos();
        Vec3::new(out * a.cos(), out * a.sin(), 0.45 * b.sin() + 0.02 * a)
    };
    let rods = [along(coil(0.5, 0.17), 26.0, 90), along(loop_over(0.1), 5.0, 30), along(wound, 6.0, 520)];
    for (elements, state) in &rods {
        let mut touching = contact(elements, 0.1);
        touching.look_at_base(elements, state);
        let near = touching.pairs.len();
        let PairTuning { near: sought, known, .. } = touching.tuning;
        // From twice as far as any site of a pair may be, without a limit at which a descent ends early.
        let farthest_mm = 2.0 * gap::reach(known, &touching.tuning) * 0.2;
        let (mut every, curve) = (Vec::new(), touching.curve(elements, state));
        assert_eq!(touching.known, sought);
        let (from_nothing, mut far) = (SelfContact { known: 0.0, ..touching.clone() }, Vec::new());
        touching.tree.near(farthest_mm, touching.apart_mm(), |_, _| farthest_mm, &mut far);
        for (a, b) in far {
            from_nothing.find_between(&curve, (a, b), 1e3, &mut every);
            from_nothing.find_between(&curve, (b, a), 1e3, &mut every);
        }
        every.retain(|pair| pair.gap.distance < known * pair.touch_mm);
        touching.know_pairs_within(elements, 1e3);
        let missed = |list: &[Pair], from: &[Pair]| {
            let same = |p: &Pair, q: &Pair| {
                p.site == q.site
                    && (p.arc_mm - q.arc_mm).abs() < 1e-6
                    && (p.gap.distance - q.gap.distance).abs() < 1e-9
            };
            list.iter().find(|p| !from.iter().any(|q| same(p, q))).map(|p| (p.site, p.arc_mm, p.gap))
        };
        assert!(0 < near && near < touching.pairs.len(), "{near} of {}", touching.pairs.len());
        assert_eq!(missed(&every, &touching.pairs), None);
        assert_eq!(missed(&touching.pairs, &every), None);
        // In order of sites, as forces are handed on.
        assert!(touching.pairs.is_sorted_by_key(|pair| pair.site));
    }
}

#[test]
fn a_trial_that_moves_far_meets_pairs_that_were_not_near() {
    // Two rods, 1.7 touching distances apart, and one of them moved until they press.
    let (mut elements, mut state) = along(|x| Vec3::new(x, 0.0, 0.0), 4.0, 8);
    let (others, other) = along(|x| Vec3::new(x, 0.0, 0.34), 4.0, 8);
    elements.push(ElementData::BREAK);
    elements.extend(others);
    state.join(&other);
    let mut touching = contact(&elements, 0.1);
    touching.look_at_base(&elements, &state);
    assert!(touching.pairs.is_empty());
    let lowered = |by_mm: f64| {
        let mut to = state.clone();
        to.positions[9..].iter_mut().for_each(|x| x.z -= by_mm);
        to
    };
    assert_eq!(touching.stored_or_merit_mj(&elements, &lowered(0.139)), 0.0);
    // Energy of the depth over the length, half of it for each of both.
    let pressed_mj = touching.stored_or_merit_mj(&elements, &lowered(0.15));
    assert!((pressed_mj / (0.5 * 40.0 * 4.0 * 0.01 * 0.01) - 1.0).abs() < 0.01, "{pressed_mj}");
}

#[test]
fn a_crossing_is_felt_the_same_wherever_sites_lie() {
    // The same crossing with different meshes: the energy of a depth of a hundredth of the radius.
    let energy = |elements: usize| {
        let (elements, state) = along(loop_over(0.0826), 5.0, elements);
        let mut touching = contact(&elements, 0.1);
        touching.look_at_base(&elements, &state);
        let force: f64 = touching.touching(&elements, &state).iter().map(|t| t.force_n).sum();
        force
    };
    let all: Vec<f64> = (30..50).map(energy).collect();
    let mean = all.iter().sum::<f64>() / all.len() as f64;
    assert!(mean > 0.0 && all.iter().all(|f| (f / mean - 1.0).abs() < 0.005), "{all:?}");
}

#[test]
fn forces_are_those_of_the_same_points_after_the_rod_was_pushed() {
    let (elements, state) = along(coil(0.5, 0.19), 13.0, 40);
    let mut touching = contact(&elements, 0.1);
    touching.look_at_base(&elements, &state);
    for (k, pair) in touching.pairs.iter_mut().enumerate() {
        pair.force_n = 1.0 + (0.01 * k as f64).sin();
    }
    let (was, mut kept) = (touching.pairs.clone(), Vec::new());
    touching.keep(&mut kept);
    assert_eq!(kept.len(), was.len());
    // Away from the base, whose end is another one.
    let sum_n = |pairs: &[Pair], first: usize| {
        let inside = pairs.iter().filter(|pair| pair.gap.at.iter().all(|place| place.element >= first));
        inside.map(|pair| pair.force_n).sum::<f64>()
    };
    // The same rod, and one with two elements less at its base.
    for less in [0, 2] {
        let elements = &elements[less..];
        let state = state.part(less..41);
        let mut next = contact(elements, 0.1);
        next.recall(elements, &kept);
        next.look_at_base(elements, &state);
        let (was_n, is_n) = (sum_n(&was, 6 + less), sum_n(&next.pairs, 6));
        assert!(was_n > 10.0 && (is_n / was_n - 1.0).abs() < 1e-3, "{is_n} and {was_n}");
    }
    // Counter-check: without them there are none.
    let mut next = contact(&elements, 0.1);
    next.look_at_base(&elements, &state);
    assert_eq!(sum_n(&next.pairs, 0), 0.0);
}

#[test]
fn a_thick_part_is_not_felt_beyond_its_shoulder() {
    // A rod, thick up to x = 5, and another across it on its thin part, this far beyond the shoulder and above the axis.
    let forces = |beyond: f64, high: f64| {
        let (mut elements, mut state) = along(|x| Vec3::new(x, 0.0, 0.0), 10.0, 20);
        let (others, other) = along(move |y| Vec3::new(5.0 + beyond, y - 3.03, high), 6.0, 12);
        elements.push(ElementData::BREAK);
        elements.extend(others);
        state.join(&other);
        let radius = |e: usize| if e < 10 { 0.3 } else { 0.1 };
        let capsule = |e: usize| Capsule { radius_mm: radius(e), modulus_n_per_mm2: 40.0 };
        let capsules = (0..elements.len()).map(capsule).collect();
        let touching = SelfContact::new(&elements, capsules).touching_at(&elements, &state);
        (touching.iter().map(|t| t.force_n).sum::<f64>(), touching)
    };
    // A little above the thin part: free. Pressed in by a hundredth: that and no more, as far from the shoulder.
    for beyond in [0.35, 0.5, 1.0, 3.0] {
        assert_eq!(forces(beyond, 0.201).0, 0.0, "{beyond}");
        let (force_n, touching) = forces(beyond, 0.199);
        assert!((force_n / forces(3.0, 0.199).0 - 1.0).abs() < 0.05, "{beyond}: {force_n}");
        assert!(touching.iter().all(|t| t.penetration_mm < 1.0001e-3), "{beyond}: {touching:?}");
    }
    // On the thick part, and over the rounded shoulder.
    assert!(forces(-1.0, 0.399).0 > 0.0 && forces(-1.0, 0.401).0 == 0.0);
    assert!(forces(0.2, 0.34).0 > 0.0 && forces(0.2, 0.35).0 == 0.0);
}

#[test]
fn ends_that_meet_head_on_are_felt_as_near_as_they_are() {
    // Open rings with this gap whose ends face each other, or are offset.
    for (apart, lateral) in [(0.19, 0.0), (0.15, 0.5), (0.0, 0.9), (0.12, 0.7)] {
        let radius = 1.5;
        let turn = std::f64::consts::TAU - apart / radius;
        let ring = move |a: f64| Vec3::new(radius * a.cos(), radius * a.sin(), 0.19 * lateral * a / turn);
        let (elements, state) = along(ring, turn, 20);
        let mut touching = contact(&elements, 0.1);
        let ends = (state.positions[20] - state.positions[0]).norm();
        touching.look_at_base(&elements, &state);
        // The depths of the sites next to the ends.
        let deepest = touching.pairs.iter().map(Pair::depth_mm).fold(0.0, f64::max);
        assert!((deepest - (0.2 - ends)).abs() < 5e-4, "{apart} {lateral}: {deepest} of {}", 0.2 - ends);
    }
}
