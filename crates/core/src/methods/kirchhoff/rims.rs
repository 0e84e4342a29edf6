//! Where an instrument ends in or around others with play, and what goes on tilts in it ([`crate::rod::Tilt`]).
//!
//! What ends is next to what goes on: either all of that lies in it, or all of it around it. Of several ends that share a node the one
//! next to what goes on counts; where something goes on both inside and outside of what ends, those hold each other and nothing tilts. The
//! clearance is that of the radii, averaged behind the end as stiffness and rest curvature are, so that nothing jumps where a section is
//! pushed through.
//!
//! # What presses there
//!
//! Where the two are turned against each other they press on each other at places, and rub there, as much as for centimetres along the
//! line. At an end the rim and the place where they leave each other press with f = M φ/(6δ) ([`Tilt::rim_force`]); on the rim what the line
//! itself has there comes in addition, as vectors. Inside, at a step of rest curvature, a moment M = EIᵣ |step of Δκ⁰| turns one against the other, and both halves
//! take a part of it: u crosses the lumen in two cubics that meet in its middle, each δ = a L³/6, φ = a L²/2, ½M = EIᵣ a L, so that
//!
//! ```text
//! L = 3δ/φ,   M = 4 EIᵣ φ²/(3δ),   φ = ½ √(3δM/EIᵣ),   f = ½M/L = M φ/(6δ)
//! ```
//!
//! at both places. Without play these lengths, and with them the forces, would have no bound: so nothing of this is counted then.

use super::material::between;
use super::mesh::{Fineness, Mesh};
use crate::Vec3;
use crate::device::{Device, Section, Stack, line_mm};
use crate::rod::quadrature::GAUSS;
use crate::rod::{ElementData, RodState, Side, Tilt, beyond, window};

/// An end at which something tilts.
#[derive(Debug, Clone, Copy, PartialEq)]
struct End {
    /// What ends.
    ends: usize,
    /// It and what is next to it of those that go on, the inner one first.
    inside: usize,
    around: usize,
}

/// The instrument that ends within `near_mm` of the first node of an element, in or around those in it.
fn end(stack: &Stack, inserted_mm: &[f64], (near, far): (f64, f64), near_mm: f64) -> Option<End> {
    let line = line_mm(inserted_mm.iter().copied());
    let behind = |k: usize| line - inserted_mm[k];
    let is_in = |k: &usize| inserted_mm[*k] > 0.0;
    let goes_on = |k: &usize| is_in(k) && behind(*k) < 0.5 * (near + far);
    let each = 0..inserted_mm.len();
    let (first, last) = (each.clone().find(goes_on)?, each.clone().rfind(goes_on)?);
    let mut ending = each.filter(|k| is_in(k) && !goes_on(k) && (behind(*k) - near).abs() <= near_mm);
    // Around what goes on, or inside it.
    let outer = ending.clone().find(|k| *k > last).map(|k| End { ends: k, inside: last, around: k });
    let end =
        outer.or_else(|| ending.rfind(|k| *k < first).map(|k| End { ends: k, inside: k, around: first }))?;
    (end.inside..end.around).all(|k| inserted_mm[k] == 0.0 || stack.has_clearance(k)).then_some(end)
}

/// The play of what is in an element between two distances from the tip of the line, in an instrument that ends within `near_mm` of its
/// first node.
pub(super) fn tilt(
    (stack, inserted_mm): (&Stack, &[f64]),
    (near, far): (f64, f64),
    near_mm: f64,
    data: &ElementData,
) -> Option<Tilt> {
    let End { ends, inside, around } = end(stack, inserted_mm, (near, far), near_mm)?;
    let line = line_mm(inserted_mm.iter().copied());
    let behind = |k: usize| line - inserted_mm[k];
    let goes_on = |k: &usize| inserted_mm[*k] > 0.0 && behind(*k) < 0.5 * (near + far);
    let devices: Vec<&Device> = stack.devices().collect();
    let held = inserted_mm[ends];
    // Radii over the longest length that the clearance at the rim leads to.
    let at_rim =
        clearance_mm((devices[inside], near - behind(inside)), (devices[around], near - behind(around)))?;
    let curved =
        (0..inserted_mm.len()).filter(|k| *k == ends || goes_on(k)).flat_map(|k| devices[k].sections());
    let curvature = curved.map(|section| {
        let [u, v] = section.rest_curvature_per_mm;
        libm::hypot(u, v)
    });
    let length = window(at_rim, held, curvature.fold(0.0, f64::max));
    let clearance =
        mean((devices[inside], near - behind(inside)), (devices[around], near - behind(around)), length)?;
    let side = |of: &mut dyn Iterator<Item = usize>| {
        let mut side = Side::default();
        of.for_each(|k| {
            let here = near - behind(k);
            side.add(&between(devices[k], (here + length, here), 0.0), stack.sets()[k]);
        });
        side
    };
    let own = side(&mut std::iter::once(ends));
    let others = side(&mut (0..inserted_mm.len()).filter(goes_on));
    Tilt::new((clearance, held), &own, &others, &data.materials)
}

/// Clearance between two instruments at these distances from their tips, mm; `None` without a lumen.
fn clearance_mm((inner, inner_at): (&Device, f64), (outer, outer_at): (&Device, f64)) -> Option<f64> {
    let room = outer.section_at(outer_at.max(0.0)).inner_radius_mm?;
    Some(room - inner.section_at(inner_at.max(0.0)).radius_mm)
}

/// Its mean over a length behind these places, weighted as rest curvature is ([`Side`]).
fn mean((inner, inner_at): (&Device, f64), (outer, outer_at): (&Device, f64), length: f64) -> Option<f64> {
    // Radii are constant in sections, which are long against a tenth of what is averaged over.
    const PIECES: u32 = 10;
    let mut sum = 0.0;
    for piece in 0..PIECES {
        for point in &GAUSS {
            let part = (f64::from(piece) + point.xi) / f64::from(PIECES);
            let back = (1.0 - part) * length;
            let weight = 2.0 * part * point.weight / f64::from(PIECES);
            sum += weight * clearance_mm((inner, inner_at + back), (outer, outer_at + back))?;
        }
    }
    Some(sum)
}

/// How two instruments press on each other at places near a node, beside what the line tells.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Pressed {
    /// Force of the rim on the inner one, N.
    rim_n: Vec3,
    /// Sum of the forces away from the rim, N.
    others_n: f64,
}

impl Pressed {
    /// Between an instrument and the one around it at a node.
    pub(super) fn at<const C: usize>(
        stack: &Stack,
        (mesh, rod): (&Mesh, &RodState),
        node: usize,
        (inner, outer): (usize, usize),
    ) -> Self {
        let mut pressed = Self::default();
        if !stack.has_play() {
            return pressed;
        }
        pressed.others_n = steps_n(stack, mesh, node, (inner, outer));
        let Some(data) = mesh.elements.get(node).filter(|data| data.tilt.is_some()) else { return pressed };
        let ends = (mesh.from_tip_mm[node], mesh.from_tip_mm[node + 1]);
        let near_mm = Fineness::near_of(mesh.flush_mm);
        let Some(end) = end(stack, &mesh.inserted_mm, ends, near_mm) else { return pressed };
        let Some((state, tilt)) = beyond(data, &rod.element::<C>(node)) else { return pressed };
        if (end.inside, end.around) != (inner, outer) {
            return pressed;
        }
        let force_n = data.tilt.map_or(0.0, |play| play.rim_force(tilt));
        let frame = &rod.frames[node];
        let way = state.first.t - frame.t * frame.t.dot(&state.first.t);
        let size = way.norm();
        if size > 0.0 {
            // What goes on leans on the rim of what ends, on the side to which it tilts.
            let sign = if end.ends == outer { -1.0 } else { 1.0 };
            pressed.rim_n = way * (sign * force_n / size);
        }
        pressed.others_n += force_n;
        pressed
    }

    /// Sum of the forces across the line, N, with that which the line tells.
    pub(super) fn sum_n(&self, line_n: &Vec3) -> f64 {
        (line_n + self.rim_n).norm() + self.others_n
    }
}

/// Forces at steps of the rest curvature of two instruments inside one another, on the half elements beside a node, N.
fn steps_n(stack: &Stack, mesh: &Mesh, node: usize, (inner, outer): (usize, usize)) -> f64 {
    if !stack.has_clearance(inner) || node == 0 {
        return 0.0;
    }
    let inserted_mm = &mesh.inserted_mm;
    let line = mesh.from_tip_mm[0];
    let at = |i: usize| mesh.from_tip_mm.get(i).copied().unwrap_or(0.0);
    let behind = |k: usize| line - inserted_mm[k];
    let rim = behind(inner).max(behind(outer));
    let (from, to) = (0.5 * (at(node) + at(node + 1)), 0.5 * (at(node - 1) + at(node)));
    let devices: Vec<&Device> = stack.devices().collect();
    let stiff = |range: std::ops::Range<usize>, place: f64| -> f64 {
        let each = range.filter(|k| inserted_mm[*k] > 0.0 && place > behind(*k));
        each.map(|k| devices[k].section_at(place - behind(k)).softest_nmm2()).sum()
    };
    let mut sum_n = 0.0;
    for k in [inner, outer] {
        let mut place = behind(k);
        for pair in devices[k].sections().windows(2) {
            place += pair[0].length_mm;
            if !(place > rim && from < place && place <= to) {
                continue;
            }
            let moment = |side: &Section, a: usize| side.softest_nmm2() * side.rest_curvature_per_mm[a];
            let step_nmm = libm::hypot(
                moment(&pair[1], 0) - moment(&pair[0], 0),
                moment(&pair[1], 1) - moment(&pair[0], 1),
            );
            let (inside, around) = (stiff(0..inner + 1, place), stiff(outer..devices.len(), place));
            let own = if k == inner { inside } else { around };
            let relative = inside * around / (inside + around);
            let moment_nmm = relative * step_nmm / own;
            let room = clearance_mm(
                (devices[inner], place - behind(inner)),
                (devices[outer], place - behind(outer)),
            );
            if let Some(room) = room.filter(|room| *room > 0.0 && moment_nmm > 0.0) {
                let tilt = 0.5 * (3.0 * room * moment_nmm / relative).sqrt();
                sum_n += 2.0 * moment_nmm * tilt / (6.0 * room);
            }
        }
    }
    sum_n
}
