//! Skipped elements touch nothing, and are evaluated where they may.

use super::super::tests::{RADIUS_MM, Rod, ellipse, rod, swept};
use super::*;
use crate::contact::ContactSurface;
use crate::random::{splitmix64, unit};
use crate::rod::{Assembly, Frame, PLAIN};
use crate::solve::External;

const ELEMENTS: usize = 12;

/// A straight device with a radius of 0.45 mm fits in this tube with a radius of 3 mm.
fn tube() -> ContactSurface {
    swept(&ellipse(3.0, 3.0, 36), 61, |k| (Vec3::z() * (0.5 * f64::from(k)), Vec3::x(), 1.0))
}

/// A rod along the tube whose nodes are up to `off_mm` off its axis, and rotated by about as much.
fn off_axis(rod: &Rod<'_>, seed: u64, off_mm: f64) -> RodState {
    let number = |k: u64| 2.0 * unit(splitmix64(seed, k)) - 1.0;
    let middle = Vec3::new(1.7 * number(90), 1.7 * number(91), 8.0);
    let mut state = rod.at(middle);
    for node in 0..=ELEMENTS {
        let way = [0, 1, 2].map(|k| number(6 * node as u64 + k));
        let turn = [3, 4].map(|k| 0.3 * off_mm * number(6 * node as u64 + k));
        state.positions[node] += Vec3::from(way) * off_mm;
        state.frames[node] = Frame::new(Vec3::new(turn[0], turn[1], 1.0).normalize(), Some(Vec3::x()));
    }
    state
}

/// Safe fractions and energies at trials about a base, of a device whose clear elements are skipped, and of one that
/// evaluates all; and the number of skipped elements. `more_mm` is added to the assumed distance of elements from
/// touching.
fn asked(surface: &ContactSurface, seed: u64, more_mm: f64) -> (Vec<[f64; 2]>, Vec<[f64; 2]>, usize) {
    let proximity = [1.0, 0.75, 0.5, 0.25];
    let mut knowing = rod(surface, ELEMENTS, &proximity, 10.0);
    let elements = knowing.elements.clone();
    let base = off_axis(&knowing, seed, 0.1);
    let mut trials: Vec<RodState> = Vec::new();
    for trial in 0..12 {
        let other = off_axis(&knowing, 1000 * seed + trial, 0.1);
        let part = 0.25 * trial as f64;
        let mut state = base.clone();
        for node in 0..=ELEMENTS {
            state.positions[node] += (other.positions[node] - base.positions[node]) * part;
            state.frames[node] = other.frames[node];
        }
        trials.push(state);
    }
    let mut assembly = Assembly::<PLAIN>::new(ELEMENTS);
    let mut at_base = |rod: &mut Rod<'_>, trials: &[RodState], more_mm: f64| {
        let mut contact = rod.contact();
        assembly.assemble(&elements, &base);
        contact.linearise(&elements, &base, &mut assembly);
        for span in &mut contact.cache.spans {
            span.room.free_mm += more_mm;
            span.room.clearance_mm += more_mm;
        }
        // Once more, as a base that has been evaluated.
        contact.linearise(&elements, &base, &mut assembly);
        let left_out = contact.cache.spans.iter().filter(|span| !span.at_base).count();
        let reported: Vec<[f64; 2]> = trials
            .iter()
            .map(|trial| [contact.safe_fraction(&elements, trial), contact.value(&elements, trial)])
            .collect();
        (reported, left_out)
    };
    let (reported, left_out) = at_base(&mut knowing, &trials, more_mm);
    let mut other = rod(surface, ELEMENTS, &proximity, 10.0);
    let (whole, all) = at_base(&mut other, &trials, f64::NEG_INFINITY);
    assert_eq!(all, 0);
    (reported, whole, left_out)
}

fn differ(reported: &[[f64; 2]], whole: &[[f64; 2]]) -> usize {
    let off = |a: f64, b: f64| (a - b).abs() > 1e-9 * (1.0 + b.abs());
    reported.iter().zip(whole).filter(|(a, b)| off(a[0], b[0]) || off(a[1], b[1])).count()
}

#[test]
fn what_is_left_out_touches_nothing() {
    let surface = tube();
    let (mut left_out, mut pressing, mut stopped, mut wrong) = (0, 0, 0, 0);
    for seed in 1..40 {
        let (reported, whole, out) = asked(&surface, seed, 0.0);
        assert_eq!(differ(&reported, &whole), 0, "{seed}: {reported:?} {whole:?}");
        left_out += out;
        stopped += whole.iter().filter(|[safe, _]| *safe < 1.0).count();
        pressing += whole.iter().filter(|[_, value]| *value > 0.0).count();
        // Counter-check: with too large an assumed distance, elements go through the wall.
        let (reported, whole, _) = asked(&surface, seed, 2.0);
        wrong += differ(&reported, &whole);
    }
    assert!(left_out > 200 && pressing > 100 && stopped > 10, "{left_out} {pressing} {stopped}");
    assert!(wrong > 20, "{wrong}");
}

#[test]
fn no_point_of_an_element_moves_farther_than_is_said() {
    let surface = tube();
    let mut rod = rod(&surface, ELEMENTS, &[1.0, 0.7, 0.5, 0.3, 0.0], 10.0);
    let (elements, points) = (rod.elements.clone(), rod.points.clone());
    let states = [1, 2].map(|seed| off_axis(&rod, seed, 0.8));
    let contact = rod.contact();
    let mut nearest = f64::INFINITY;
    for point in points {
        let [from, to] = states.each_ref().map(|state| point.position(&elements, state));
        let [was, is] = states.each_ref().map(|state| nodes(point.element, state));
        let most_mm = contact.motion_mm(&was, &is, elements[point.element].length);
        assert!((to - from).norm() <= most_mm);
        nearest = nearest.min(most_mm - (to - from).norm());
    }
    // The bound is tight: a node that moves farther than the other attains it, except for rotations.
    assert!(nearest < 0.1 * RADIUS_MM, "{nearest}");
}

#[test]
fn where_there_are_no_numbers_there_is_no_room() {
    let surface = tube();
    let mut rod = rod(&surface, ELEMENTS, &[1.0, 0.5], 10.0);
    let elements = rod.elements.clone();
    let (good, mut bad) = (rod.at(Vec3::new(0.0, 0.0, 8.0)), rod.at(Vec3::new(0.0, 0.0, 8.0)));
    bad.positions[ELEMENTS / 2] = Vec3::repeat(f64::NAN);
    let mut assembly = Assembly::<PLAIN>::new(ELEMENTS);
    // Elements evaluated at a good state after a base of finite numbers and after one with NaN at a node.
    for (base, elements_near) in [(&good, 0), (&bad, 2)] {
        let mut contact = rod.contact();
        assembly.assemble(&elements, base);
        contact.linearise(&elements, base, &mut assembly);
        let near = (0..ELEMENTS).filter(|span| contact.near(*span, &elements, &good).is_some()).count();
        assert_eq!(near, elements_near);
    }
}
