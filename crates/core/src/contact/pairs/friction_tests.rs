//! Coulomb's law where two rods cross.

use super::*;
use crate::rod::{Frame, PLAIN, Supports};
use crate::solve::newton_tests::Held;
use crate::solve::{Newton, NewtonOptions, Together};

const N: usize = 12;
const RADIUS: f64 = 0.02;

/// A cantilever along x is pressed down on a rod along y, held by springs, and pulled along it. Returns the
/// components of the contact force on that rod: down, and along it.
fn pressed_across(coefficient: f64, down: f64, along: f64) -> (f64, f64) {
    let elements = vec![ElementData::plain(1.0 / N as f64, 1.0); N];
    let frame = |along: Vec3| Frame::new(along, None);
    let mut rods = RodState::straight(&elements, Vec3::zeros(), frame(Vec3::x()));
    let below = RodState::straight(&elements, Vec3::new(0.77, -0.513, -2.0 * RADIUS), frame(Vec3::y()));
    rods.join(&below);
    // Stiff, so that it does not bend much where it is pressed.
    let stiff = vec![ElementData::plain(1.0 / N as f64, 100.0); N];
    let all = [&elements[..], &[ElementData::BREAK], &stiff[..]].concat();
    let springs = (0..=N).map(|i| (N + 1 + i, below.positions[i])).collect();
    let mut held = Held { force: (N, Vec3::new(0.0, along, -down)), springs, stiffness: 2000.0 };
    let capsule =
        |data: &ElementData| if data.is_break() { Capsule::NONE } else { Capsule::rigid(RADIUS, 1.0) };
    let mut loops = SelfContact::new(&all, all.iter().map(capsule).collect());
    let law = FrictionLaw { coefficient, stick_mm: [1e-5, 1e-7], least_n: 1e-9 };
    loops.begin_friction(&rods, std::iter::empty(), all.iter().map(|_| 0.0), law);
    let mut supports = Supports { start_tangent: true, start_angles: [true; 3], ..Supports::default() };
    let options = NewtonOptions { tolerance: 1e-9, ..NewtonOptions::default() };
    let mut outside = Together([Some(&mut loops), Some(&mut held)]);
    let report =
        Newton::<PLAIN>::new(all.len()).solve(&all, &mut supports, &mut outside, &mut rods, &options);
    assert!(report.converged && report.stable, "{coefficient}, {along}: {}", report.reason);
    assert!(loops.unsettled() < 1e-3, "{}", loops.unsettled());
    let pulls = held.pulls(&rods);
    (-pulls.z, pulls.y)
}

#[test]
fn held_friction_of_pairs_is_that_of_the_start_of_the_part() {
    let (elements, state) = tests::along(|a| Vec3::new(0.5 * a.cos(), 0.5 * a.sin(), 0.03 * a), 13.0, 40);
    let coil = || SelfContact::new(&elements, vec![Capsule { radius_mm: 0.1, modulus_n_per_mm2: 40.0 }; 40]);
    let mut first = coil();
    first.look_at_base(&elements, &state);
    first.pairs.iter_mut().for_each(|pair| pair.force_n = 0.5);
    let mut kept = Vec::new();
    first.keep(&mut kept);
    let sums_n = |contact: &SelfContact| {
        let sum = |of: fn(&Pair) -> f64| contact.pairs.iter().map(of).sum::<f64>();
        (sum(|pair| pair.friction.slider.force_n), sum(|pair| pair.friction.slider.begun.1))
    };
    for (coefficient, share) in [(0.3, 1.0), (0.0, 0.0)] {
        let mut next = coil();
        let law = FrictionLaw { coefficient, stick_mm: [1e-3, 1e-5], least_n: 1e-9 };
        next.begin_friction(&state, std::iter::empty(), elements.iter().map(|_| 0.0), law);
        next.recall(&elements, &kept);
        next.hold_friction();
        next.look_at_base(&elements, &state);
        next.follow_pairs(&elements, &state);
        let wanted_n = share * 0.5 * kept.len() as f64;
        let (force_n, begun_n) = sums_n(&next);
        assert!((force_n - wanted_n).abs() <= 1e-9 * wanted_n && force_n == begun_n, "{force_n}");
        let held = next.pairs.iter().filter(|pair| pair.is_held());
        assert!(
            held.clone()
                .all(|pair| (pair.friction.slider.normal - pair.gap.direction().normalize()).norm() < 1e-12)
        );
        // Another force, then back to that of the start.
        next.pairs.iter_mut().for_each(|pair| pair.friction.slider.force_n *= 3.0);
        next.rewind_friction();
        assert_eq!(sums_n(&next), (force_n, begun_n));
    }
}

#[test]
fn rods_that_cross_slip_at_coulombs_force_and_stick_below_it() {
    let (smooth_n, none_n) = pressed_across(0.0, 0.1, 0.05);
    assert!(smooth_n > 0.05 && none_n.abs() < 5e-3 * smooth_n, "{smooth_n} {none_n}");
    for coefficient in [0.1, 0.3] {
        let (down, along) = pressed_across(coefficient, 0.1, 0.1);
        // Across the cantilever only friction acts, along the touching surfaces; the tolerance covers the upper rod's
        // inclination.
        assert!((along / (coefficient * down) - 1.0).abs() < 0.02, "{coefficient}: {along} of {down}");
        let (down, along) = pressed_across(coefficient, 0.1, 0.002);
        assert!(along > 0.0 && along < 0.5 * coefficient * down, "{coefficient}: {along} of {down}");
    }
}
