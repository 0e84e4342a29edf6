//! Gradients and Hessians of an element with play against differences of its energy.

use super::derivative_tests::{data, errors, material, noise, state};
use super::element::{ElementData, ElementState, ElementSystem, Material};
use super::lagrangian::{element_energy, element_system};
use super::layout::{PLAIN, TWISTED};
use super::play::{Side, Tilt};
use super::rim::beyond;

/// An element with three instruments that comes out of a fourth one, or of one that has the third set.
fn played(seed: &mut u64, clearance: f64) -> ElementData {
    let mut data = ElementData { flexibility: 0.0, ..data(seed) };
    let (mut ends, mut goes_on) = (Side::default(), Side::default());
    ends.add(&data.materials[2], Some(2));
    data.materials[2] = Material::NONE;
    for set in 0..2 {
        goes_on.add(&material(seed), Some(set));
    }
    data.tilt = Tilt::new((clearance, 5.0), &ends, &goes_on, &data.materials);
    data
}

#[test]
fn an_element_with_play_has_these_derivatives() {
    let mut seed = 11;
    for turn in 0..60 {
        let clearance = 0.05 + 0.04 * noise(&mut seed);
        let data = played(&mut seed, clearance);
        assert!(data.tilt.is_some());
        let s: ElementState = state(&mut seed, 0.6, 0.05);
        for (gradient, hessian) in
            [errors::<24>(&data, &s, 0.0), errors::<TWISTED>(&data, &s, 0.0), errors::<PLAIN>(&data, &s, 0.0)]
        {
            assert!(gradient < 1e-7 && hessian < 1e-5, "{turn}: {gradient:e} {hessian:e}");
        }
        // The twin: a spoilt entry is found.
        let (gradient, hessian) = errors::<24>(&data, &s, 0.1);
        assert!(gradient > 1e-5 && hessian > 2e-5, "{gradient:e} {hessian:e}");
    }
}

#[test]
fn play_lowers_the_energy_and_less_of_it_less() {
    let mut seed = 5;
    for _ in 0..20 {
        let (mut tight, s) = (played(&mut seed, 1e-9), state(&mut seed, 0.4, 0.0));
        let with = element_energy::<24>(&tight, &s).total();
        let (_, tilt) = beyond(&tight, &s).unwrap();
        tight.tilt = None;
        let without = element_energy::<24>(&tight, &s).total();
        assert!(with <= without + 1e-9 * without.abs() && without - with < 1e-3 * without.abs().max(1.0));
        assert!(tilt < 2e-3, "{tilt}");
    }
}

#[test]
fn the_axial_force_does_not_see_the_kink() {
    let mut seed = 3;
    let (data, s) = (played(&mut seed, 0.1), state(&mut seed, 0.3, 0.02));
    let stretch = |data: &ElementData| {
        let mut out = ElementSystem::<24>::zeros();
        element_system::<24, false>(data, &s, 0.0, &mut out);
        out.stretch
    };
    assert_eq!(stretch(&data), stretch(&ElementData { tilt: None, ..data }));
}
