//! Friction between instruments in a sub-step: where it acts, and its normal forces.
//!
//! The force across the line follows from the equilibrium ([`super::lateral`]), and the couples of friction move the
//! line; so both are lagged ([`Search::run`]). A solution uses the forces of the previous one: first those of the last
//! equilibrium at the same distance from the sheath, then its own.
//! Without rotation nothing has to be renewed: friction along the line is evaluated afterwards.

use super::configuration::Start;
use super::hands::ROUNDED_MM;
use super::lateral::{Line, comes_out, lateral_forces};
use super::mesh::Mesh;
use super::search::Search;
use crate::contact::{Between, HandMotion, InnerFriction, Place};
use crate::device::{Stack, line_mm};
use crate::methods::LateralForce;
use crate::rod::RodState;

/// The instrument with friction just behind a node, which is `instrument` or one inside it, and the one around it.
pub(super) fn pair(mesh: &Mesh, (i, instrument): (usize, usize)) -> Option<(usize, usize)> {
    let place = mesh.from_tip_mm[0] - 0.5 * (mesh.from_tip_mm[i - 1] + mesh.from_tip_mm[i]);
    let there = |k: &usize| mesh.inserted_mm[*k] > place;
    Some(((0..=instrument).rev().find(there)?, (instrument + 1..mesh.inserted_mm.len()).find(there)?))
}

/// Radius of an instrument just behind a node, mm.
pub(super) fn radius_mm(stack: &Stack, mesh: &Mesh, (i, instrument): (usize, usize)) -> f64 {
    let place = 0.5 * (mesh.from_tip_mm[i - 1] + mesh.from_tip_mm[i]);
    let from_tip_mm = place - (mesh.from_tip_mm[0] - mesh.inserted_mm[instrument]);
    stack.instruments()[instrument].device.section_at(from_tip_mm).radius_mm
}

/// Sets the places with friction between instruments in a step from `start` to the mesh `mesh`, on which `slid` is
/// the line slid along its curve. What moves in it, the hands by `motions` and the device with its vessel by `carried_mm`, is
/// what the slip that sticks is a part of.
pub(super) fn begin(
    stack: &Stack,
    start: Start<'_>,
    (mesh, slid): (&Mesh, &RodState),
    (motions, carried_mm): (&[HandMotion], f64),
    between: &mut Between,
) {
    between.clear();
    let line = mesh.from_tip_mm[0];
    let motion = |k: usize| motions.get(k).map_or([0.0; 2], HandMotion::parts);
    let rub = 0..motions.len().saturating_sub(1);
    for instrument in rub.filter(|inner| stack.friction(*inner) > 0.0) {
        let outside_mm = line_mm(mesh.inserted_mm[instrument + 1..].iter().copied());
        let reach_mm = mesh.inserted_mm[instrument].min(outside_mm);
        let last = if reach_mm > 0.0 { mesh.nearest_node(line - reach_mm) } else { 0 };
        let mut known = 0;
        for i in 1..=last {
            let Some((inner, outer)) = pair(mesh, (i, instrument)).filter(|(inner, _)| *inner == instrument)
            else {
                continue;
            };
            let radius_mm = radius_mm(stack, mesh, (i, inner));
            let ([advance, turn], [outer_advance, outer_turn]) = (motion(inner), motion(outer));
            let advance_mm = advance - outer_advance;
            let mut place = Place {
                sets: stack.sets()[inner].zip(stack.sets()[outer]),
                advance_mm: if advance_mm.abs() > ROUNDED_MM { advance_mm } else { 0.0 },
                turn_rad: turn - outer_turn,
                ..Place::new((i, inner, outer), stack.friction(inner), radius_mm)
            };
            place.from_rad = place.turned_rad(slid);
            let after = if i < last { mesh.from_tip_mm[i + 1] } else { mesh.from_tip_mm[i] };
            place.length_mm = 0.5 * (mesh.from_tip_mm[i - 1] - after);
            place.force_n = place.length_mm * pressure(start, line - mesh.from_tip_mm[i], inner, &mut known);
            let way_mm = |k: &HandMotion| k.advance_mm().abs() + radius_mm * k.turn_rad.abs();
            between.push(place, motions.iter().map(way_mm).fold(carried_mm, f64::max));
        }
    }
}

/// Normal force on an instrument in the last equilibrium, N/mm, at this distance from the sheath. `known` is where
/// the search starts: calls go from the sheath to the tip.
fn pressure(start: Start<'_>, from_sheath_mm: f64, inner: usize, known: &mut usize) -> f64 {
    let (mesh, inner_friction) = (start.mesh, &start.state.inner_friction);
    let most = mesh.inserted_mm.len().saturating_sub(1);
    if inner_friction.is_empty() || mesh.elements.is_empty() {
        return 0.0;
    }
    let place = |i: usize| mesh.from_tip_mm[0] - mesh.from_tip_mm[i];
    while *known + 1 < mesh.elements.len() && place(*known + 1) < from_sheath_mm {
        *known += 1;
    }
    let share = (from_sheath_mm - place(*known)) / (place(*known + 1) - place(*known));
    let at = |i: usize| inner_friction[most * i + inner].pressure_n_per_mm;
    // At the sheath's mouth nothing is reported.
    let near = if *known == 0 { at(1) } else { at(*known) };
    near + (at(*known + 1) - near) * share.clamp(0.0, 1.0)
}

impl<const C: usize> Search<'_, '_, C> {
    /// Renews the normal forces between instruments; returns the relative change of the couples.
    pub(super) fn press(&mut self, stack: &Stack, mesh: &Mesh) -> f64 {
        if self.contact.between().places().is_empty() {
            return 0.0;
        }
        let state = &*self.state;
        let mut inner_friction = Vec::new();
        keep(self.contact.between(), state, mesh, &mut inner_friction);
        // The wall matters only where an instrument comes out of another.
        let ends: Vec<usize> = (0..mesh.inserted_mm.len()).filter_map(|k| comes_out(mesh, k)).collect();
        let beside = |e: usize| ends.iter().any(|node| e == *node || e + 1 == *node);
        let near = (0..mesh.points.len()).filter(|index| beside(mesh.points[*index].element));
        let pressing: Vec<_> = near
            .filter_map(|index| {
                Some((index, self.contact.touch(&mesh.elements, state, index)?.contact.total_n()))
            })
            .collect();
        let rounds = self.tuning.friction.lateral_rounds;
        let line =
            Line { stack, mesh, rod: state, pressing: &pressing, inner_friction: &inner_friction, rounds };
        let reported: Vec<Vec<LateralForce>> = (0..mesh.inserted_mm.len())
            .map(|inner| match stack.friction(inner) {
                0.0 => Vec::new(),
                _ => lateral_forces::<C>(&line, inner),
            })
            .collect();
        let force = |place: &Place| {
            let at = &reported[place.inner][place.node];
            (at.pressing_n, at.length_mm)
        };
        self.contact.between().renew(state, force)
    }
}

/// Stores friction between instruments at the nodes of the line, for the next step and for reports.
pub(super) fn keep(between: &Between, rod: &RodState, mesh: &Mesh, inner_friction: &mut Vec<InnerFriction>) {
    inner_friction.clear();
    if between.places().is_empty() {
        return;
    }
    let most = mesh.inserted_mm.len() - 1;
    inner_friction.resize(most * mesh.from_tip_mm.len(), InnerFriction::default());
    for place in between.places() {
        let [along, around] = place.parts(rod);
        let pressure_n_per_mm = place.force_n / place.length_mm;
        inner_friction[most * place.node + place.inner] = InnerFriction { along, around, pressure_n_per_mm };
    }
}
