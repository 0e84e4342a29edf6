//! Contact between loops of the device.

use super::environment::Environment;
use super::joined::{Joined, join};
use super::mesh::Mesh;
use super::meshed;
use super::state::KirchhoffState;
use crate::contact::{Capsule, HandMotion, SelfContact, Touching};
use crate::device::{Device, Stack};
use crate::rod::ElementData;

/// The surface of each element of the line: with the radius of its outermost instrument in the middle, practically
/// rigid.
pub(super) fn capsules<'a>(mesh: &'a Mesh, stack: &'a Stack) -> impl Iterator<Item = Capsule> + 'a {
    middles(mesh).zip(&mesh.elements).map(move |(middle_mm, element)| {
        Capsule::rigid(stack.outermost_radius_mm(&mesh.inserted_mm, middle_mm), element.bending[1])
    })
}

/// The surface of an element of a single device whose middle is at this distance from the tip, mm.
pub(super) fn capsule(device: &Device, middle_mm: f64, element: &ElementData) -> Capsule {
    Capsule::rigid(device.section_at(middle_mm).radius_mm, element.bending[1])
}

/// Advance of the outermost instrument in each element along the line, mm; 0 for coils, whose elements follow.
pub(super) fn advances_mm<'a>(
    mesh: &'a Mesh,
    stack: &'a Stack,
    motions: &'a [HandMotion],
) -> impl Iterator<Item = f64> + 'a {
    let outermost = |middle_mm: f64| stack.outermost_instrument(&mesh.inserted_mm, middle_mm).unwrap_or(0);
    let on_line = middles(mesh).map(move |middle_mm| motions[outermost(middle_mm)].advance_mm());
    on_line.chain(std::iter::repeat(0.0)).take(mesh.elements.len())
}

/// Where loops, and detached coils, touch in a state.
pub(super) fn touching(environment: &Environment<'_>, state: &KirchhoffState) -> Vec<Touching> {
    let mut mesh = Mesh::default();
    meshed(environment, &state.hands, &mut mesh);
    let mut joined = Joined::default();
    let (options, surroundings) = (environment.options, &environment.surroundings);
    let modulus = surroundings.properties.modulus_n_per_mm2;
    joined.renew(&state.coils, surroundings.stack, options.fineness(), modulus);
    joined.add_to(&mut mesh);
    let mut rod = state.rod.clone();
    join(&mut rod, &state.coils);
    let mut loops = SelfContact::tuned(&options.tuning);
    loops.renew(&mesh.elements, capsules(&mesh, surroundings.stack).chain(joined.capsules()));
    loops.touching_at(&mesh.elements, &rod)
}

/// Distances of the middles of elements from the tip, mm.
fn middles(mesh: &Mesh) -> impl Iterator<Item = f64> + '_ {
    mesh.from_tip_mm.windows(2).map(|ends| 0.5 * (ends[0] + ends[1]))
}
