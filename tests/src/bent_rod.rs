//! A bent and twisted rod of unit length: what the timings of the rod's parts begin with.

use endowire_core::Vec3;
use endowire_core::banded::Shift;
use endowire_core::rod::{Assembly, ElementData, Frame, Layout, Material, RodState, Supports};
use endowire_core::solve::Newton;
use endowire_core::statics::Loads;

/// `n` equal elements of EI = 1 in all; pre-curved if `twisted`.
pub fn elements(n: usize, twisted: bool) -> Vec<ElementData> {
    let material = Material {
        bending: [1.0; 3],
        torsion: [0.77; 3],
        rest_curvature: [[if twisted { 1.0 } else { 0.0 }, 0.0]; 3],
        ..Material::NONE
    };
    vec![ElementData::of(1.0 / n as f64, material); n]
}

/// The elements, bent and twisted evenly.
pub fn bent(n: usize, twisted: bool) -> (Vec<ElementData>, RodState) {
    let elements = elements(n, twisted);
    let mut frames = vec![Frame::new(Vec3::x(), Some(Vec3::y()))];
    for i in 0..n {
        frames.push(frames[i].transported(1.5 / n as f64, 0.4 / n as f64));
    }
    let state = RodState::from_frames(&elements, Vec3::zeros(), frames);
    (elements, state)
}

/// The start is clamped.
pub fn clamp() -> Supports {
    Supports { start_tangent: true, start_angles: [true; 3], ..Supports::default() }
}

/// PL²/EI = 10 across the end.
pub fn tip_load(n: usize) -> Loads {
    Loads { forces: vec![(n, Vec3::new(0.0, -10.0, 0.0))], ..Loads::default() }
}

/// The system of a bent rod, assembled, held, and shifted until it is regular.
pub fn system<const C: usize>(n: usize) -> (Vec<ElementData>, RodState, Newton<C>) {
    let (elements, state) = bent(n, Layout::<C>::ANGLES > 0);
    let mut newton = Newton::<C>::new(n);
    newton.assemble(&elements, &clamp(), &mut tip_load(n), &state);
    make_regular(&elements, &mut newton);
    (elements, state, newton)
}

/// Shifts what was assembled.
pub fn make_regular<const C: usize>(elements: &[ElementData], newton: &mut Newton<C>) {
    let mut shift = Shift::default();
    Assembly::<C>::unit_shift(elements, &clamp().held::<C>(), &mut shift);
    newton.assembly.matrix.add_shift(&shift, 50.0);
}
