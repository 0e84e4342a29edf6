//! Elements computed side by side have the same bits as each alone.

use super::assembly::{AddElements, Assembly};
use super::derivative_tests::{data, noise};
use super::element::{ElementData, ElementState, ElementSystem, Material};
use super::frame::Frame;
use super::lagrangian::{Stored, element_gradients, element_system};
use super::layout::{Layout, MAX_ANGLES, PLAIN, TWISTED};
use super::state::RodState;
use crate::Vec3;
use pulp::{Arch, Scalar, Simd};

/// Elements of all kinds: straight and curved, extensible and not, some after the end of an instrument.
fn rod(seed: u64, sets: usize, count: usize) -> (Vec<ElementData>, RodState) {
    let mut s = seed;
    let mut elements: Vec<ElementData> = (0..count).map(|_| data(&mut s)).collect();
    for (e, of) in elements.iter_mut().enumerate() {
        if e % 3 == 0 {
            of.flexibility = 0.0;
        }
        if e % 4 < 2 {
            of.materials.iter_mut().for_each(|material| material.rest_curvature = [[0.0; 2]; 3]);
        }
        if e % 5 > 2 {
            of.materials[MAX_ANGLES - 1] = Material::NONE;
        }
    }
    let frames: Vec<Frame> = (0..=count)
        .scan(Frame::new(Vec3::x(), None), |frame, _| {
            *frame = frame.transported(0.3 * noise(&mut s), 0.3 * noise(&mut s));
            Some(*frame)
        })
        .collect();
    let mut rod = RodState::from_frames(&elements, Vec3::zeros(), frames).with_sets(sets.max(1));
    rod.angles.iter_mut().for_each(|angle| *angle = 2.0 * noise(&mut s));
    rod.bubbles.iter_mut().for_each(|angle| *angle = 0.3 * noise(&mut s));
    rod.tensions.iter_mut().for_each(|force| *force = 3.0 * noise(&mut s));
    (elements, rod)
}

/// Assembled with the lanes of this processor, and element by element.
fn both_ways<const C: usize>(elements: &[ElementData], rod: &RodState) -> [(Assembly<C>, f64); 2] {
    let of = |one: bool| {
        let mut to = Assembly::<C>::new(elements.len());
        to.matrix.begin_blocks();
        let add = AddElements::<C, true> { to: &mut to, elements, state: rod };
        let stored = Stored::<C> { elements, state: rod };
        let energy = if one {
            Scalar.vectorize(add);
            Scalar.vectorize(stored)
        } else {
            Arch::new().dispatch(add);
            Arch::new().dispatch(stored)
        };
        (to, energy)
    };
    [of(false), of(true)]
}

fn same<const C: usize>([(a, stored_a), (b, stored_b)]: &[(Assembly<C>, f64); 2]) -> bool {
    a.matrix == b.matrix
        && a.residual == b.residual
        && a.correction == b.correction
        && (a.energy, a.scale, stored_a) == (b.energy, b.scale, stored_b)
}

fn have_the_bits_of_each_alone<const C: usize>() {
    for count in [1, 2, 3, 4, 5, 7, 8, 9, 30] {
        let (elements, rod) = rod(7 + count as u64, Layout::<C>::ANGLES, count);
        let mut ways = both_ways::<C>(&elements, &rod);
        assert!(same(&ways), "{count} elements of {C} unknowns");
        // The energy alone equals the one with derivatives; the test would notice the last digit of any entry.
        let [(ref assembly, stored), _] = ways;
        assert!((assembly.energy.total() - stored).abs() < 1e-13 * stored.abs());
        let last = &mut ways[0].0.residual[C / 2 * count];
        *last = last.next_up();
        assert!(!same(&ways));
    }
}

#[test]
fn elements_side_by_side_have_the_bits_of_each_alone() {
    have_the_bits_of_each_alone::<PLAIN>();
    have_the_bits_of_each_alone::<TWISTED>();
    have_the_bits_of_each_alone::<20>();
    have_the_bits_of_each_alone::<24>();
}

#[test]
fn gradients_side_by_side_are_those_of_each_without_axial_force() {
    let (elements, rod) = rod(5, 2, 7);
    let mut seen = 0;
    element_gradients::<20>(
        0..elements.len(),
        |e| elements[e],
        &rod,
        |e, gradient, stretch| {
            let of = |tension: f64| {
                let mut alone = ElementSystem::<20>::zeros();
                let at = ElementState { tension, ..rod.element::<20>(e) };
                element_system::<20, false>(&elements[e], &at, 0.0, &mut alone);
                (alone.gradient, alone.stretch)
            };
            assert_eq!((e, *gradient, *stretch), (seen, of(0.0).0, of(0.0).1));
            assert_ne!(*gradient, of(rod.tensions[e]).0);
            seen += 1;
        },
    );
    assert_eq!(seen, elements.len());
}

#[test]
fn an_element_beside_others_feels_nothing_of_them() {
    let (elements, rod) = rod(3, 2, 8);
    let [(whole, _), _] = both_ways::<20>(&elements, &rod);
    let mut other = elements.clone();
    other[2].bending = [100.0; 3];
    other[2].materials[1].rest_curvature = [[3.0, -2.0]; 3];
    let [(changed, _), _] = both_ways::<20>(&other, &rod);
    // Rows of the nodes of element 2, and all others.
    for row in 0..whole.residual.len() {
        let own = (2 * 10..4 * 10).contains(&row);
        if !own {
            assert_eq!(whole.residual[row], changed.residual[row], "row {row}");
        }
    }
    assert!(whole.residual != changed.residual);
}
