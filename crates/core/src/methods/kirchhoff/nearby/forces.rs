//! The forces at the end of a part and beside it.

use std::convert::Infallible;

use super::super::configuration::Configuration;
use super::super::material::element;
use super::super::part::Effort;
use super::super::search::{Beginning, Bounds, Lagged, Search};
use super::super::state::KirchhoffState;
use super::super::workspace::Tools;
use super::sparse::Sparse;
use super::{Acting, End, STICKING};
use crate::Vec3;
use crate::methods::Sheath;
use crate::rod::{ElementData, Frame, Layout, RodState};

/// Largest rotation, rad, in the differences along an unknown; as [`super::STEP`].
const TURN_RAD: f64 = 3e-6;
/// A sheath so much elsewhere, mm and rad, is where it was.
const ROUNDED: f64 = 1e-12;

impl<const C: usize> Tools<C> {
    /// Begins a part on one side and calls `what` at the configuration of its end, with the triads from which spin is measured there.
    /// Returns its result with the triads of the slid device; `None` if the mesh is another one.
    pub(super) fn beside<T>(
        &mut self,
        acting: &Acting<'_>,
        end: &End<'_>,
        next: &mut Configuration,
        what: impl FnOnce(&mut Search<'_, '_, C>, &Lagged<'_>, &[Frame]) -> T,
    ) -> Option<(T, Vec<Frame>)> {
        let Acting { environment, materials, start, attempt } = acting;
        let surroundings = &environment.surroundings;
        self.friction.set_coefficient(surroundings.properties.largest_friction());
        self.transport_to(environment, *start, *attempt, next);
        let slid = self.slid_triads(next);
        let triads: Vec<Frame> =
            slid.iter().zip(&end.spins).map(|(triad, spin)| triad.turned(*spin)).collect();
        let (mesh, after) = next.parts();
        if (mesh.elements.len(), mesh.points.len()) != (end.state.rod.elements(), end.state.known.len()) {
            return None;
        }
        if let Some(stack) = materials {
            let all = (&mesh.inserted_mm[..], mesh.inserted_mm.len());
            for (ends, data) in mesh.from_tip_mm.windows(2).zip(&mut mesh.elements) {
                *data = element(stack, all, (ends[0], ends[1]), mesh.flush_mm);
            }
        }
        let KirchhoffState { rod, touches, .. } = after;
        rod.copy_from(&end.state.rod);
        enter::<C>(&mesh.elements, surroundings.sheath, rod);
        rod.measure_from(&triads);
        rod.place(&mesh.elements);
        let stack = materials.unwrap_or(surroundings.stack);
        let bounds = Bounds { effort: Effort::Near, most: 0, most_solves: 0, resumed: None, moved_mm: None };
        let begin = |beginning: Beginning<'_, '_, C>| {
            beginning.contact.follow_depths();
            Ok::<_, Infallible>(())
        };
        let Ok(found) = self.with_search(environment, (mesh, stack, rod), bounds, begin, |search, lagged| {
            let found = what(search, lagged, &triads);
            search.contact.touches(search.elements, search.state, touches);
            found
        });
        Some((found, slid))
    }

    /// The triads of the device in the part that was begun last, slid and not yet solved; none without friction.
    fn slid_triads(&self, next: &Configuration) -> Vec<Frame> {
        let moved = &self.guess.before_motion;
        let friction = self.friction.acts();
        match (friction, moved.is_empty()) {
            (false, _) => Vec::new(),
            (true, true) => next.state.rod.frames.clone(),
            (true, false) => moved.clone(),
        }
    }
}

/// The longest motion of a node, mm.
pub(super) fn longest_mm<const C: usize>(way: &[f64]) -> f64 {
    let nodes = way.len() / Layout::<C>::BLOCK - 1;
    let at = |i: usize| Vec3::from_column_slice(&way[Layout::<C>.position(i)..][..3]).norm();
    (0..nodes).map(at).fold(0.0, f64::max)
}

/// Sets the state of a search to that after a piece of a way from another one, with its spin measured from these triads.
pub(super) fn go<const C: usize>(
    search: &mut Search<'_, '_, C>,
    from: &RodState,
    way: (&[f64], f64),
    triads: &[Frame],
) {
    advance::<C>(search.elements, from, way, search.state);
    search.state.measure_from(triads);
}

/// The state after a piece of a way, with its axial forces.
fn advance<const C: usize>(
    elements: &[ElementData],
    from: &RodState,
    (way, part): (&[f64], f64),
    to: &mut RodState,
) {
    let way: Vec<f64> = way.iter().map(|value| value * part).collect();
    to.advance::<C>(elements, from, &way, 1.0);
    to.take_tensions::<C>(elements, from, &way);
}

/// The rows of the forces that a search has assembled, as Newton's matrix has them.
pub(super) fn rows<const C: usize>(search: &Search<'_, '_, C>) -> Vec<f64> {
    let assembly = &search.newton.assembly;
    assembly.residual.iter().zip(&assembly.correction).map(|(row, more)| row + more).collect()
}

/// Moves a rod to a sheath that is a little elsewhere.
fn enter<const C: usize>(elements: &[ElementData], sheath: &Sheath, rod: &mut RodState) {
    if let Some(way) = entering::<C>(sheath, rod) {
        let from = rod.clone();
        rod.advance::<C>(elements, &from, &way, 1.0);
    }
}

/// The way of a rod to a sheath that is a little elsewhere: all of it by the motion of the mouth, and its first tangent into the direction.
pub(super) fn entering<const C: usize>(sheath: &Sheath, rod: &RodState) -> Option<Vec<f64>> {
    let shift = sheath.position_mm - rod.positions[0];
    let (a, b) = rod.frames[0].log(&sheath.direction);
    if shift.norm() + a.abs() + b.abs() <= ROUNDED {
        return None;
    }
    let mut way = vec![0.0; Layout::<C>::dimension(rod.elements())];
    for node in 0..=rod.elements() {
        way[Layout::<C>.position(node)..][..3].copy_from_slice(shift.as_slice());
    }
    let tangent = Layout::<C>.tangent(0);
    (way[tangent], way[tangent + 1]) = (a, b);
    Some(way)
}

/// How the triads from which the spin of a rod is measured are turned against those of the slid device: Newton's steps from there turn a little
/// about the smallest rotation.
pub(super) fn spins(rod: &RodState, slid: &[Frame]) -> Vec<f64> {
    let each = slid.iter().zip(&rod.frames).map(|(slid, at)| {
        let back = at.transported_to(&slid.t).u;
        libm::atan2(back.dot(&slid.v), back.dot(&slid.u))
    });
    each.collect()
}

/// What forces that follow from the state have more than those that stay, by each unknown in turn: for those that depend on more than the
/// place of a contact, as drag and forces between instruments do. Their spin is measured from these triads. And all forces by the angle
/// from which each place between instruments slips.
pub(super) fn lagging_everywhere<const C: usize>(
    search: &mut Search<'_, '_, C>,
    lagged: &Lagged<'_>,
    triads: &[Frame],
) -> [Sparse; 2] {
    let base = search.state.clone();
    let mut lagging = Sparse::default();
    let unknowns = Layout::<C>.support(search.elements.len());
    for unknown in 0..unknowns {
        let mut way = vec![0.0; Layout::<C>::dimension(search.elements.len())];
        way[unknown] = 1.0;
        search.state.copy_from(&base);
        search.contact.follow_depths();
        search.assemble(lagged, false);
        search.contact.hold_friction();
        let stays = [-TURN_RAD, TURN_RAD].map(|part| {
            go(search, &base, (&way, part), &[]);
            search.assemble_once(false);
            rows(search)
        });
        search.contact.follow_depths();
        let follows = [-TURN_RAD, TURN_RAD].map(|part| {
            go(search, &base, (&way, part), triads);
            search.assemble(lagged, false);
            rows(search)
        });
        for row in 0..unknowns {
            let more = [0, 1].map(|side| follows[side][row] - stays[side][row]);
            lagging.add(row, unknown, (more[1] - more[0]) / (2.0 * TURN_RAD));
        }
    }
    search.state.copy_from(&base);
    search.assemble(lagged, false);
    let mut slipping = Sparse::default();
    for place in 0..search.contact.between().places().len() {
        let at = search.contact.between().places()[place];
        let part = TURN_RAD.min(STICKING * at.stick_mm / at.radius_mm);
        let sides = [-part, 2.0 * part].map(|by| {
            search.contact.between().slip_from(place, by);
            search.assemble(lagged, false);
            rows(search)
        });
        search.contact.between().slip_from(place, -part);
        for row in 0..unknowns {
            slipping.add(row, place, (sides[1][row] - sides[0][row]) / (2.0 * part));
        }
    }
    search.assemble(lagged, false);
    [lagging, slipping]
}
