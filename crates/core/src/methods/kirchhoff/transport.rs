//! The simple predictor: the rod slides along its own curve, and straight ahead beyond its tip.

use crate::Vec3;
use crate::rod::quadrature::{Point, hermite};
use crate::rod::{Frame, RodState};

use super::mesh::Mesh;

/// Triad and position of a device in the sheath's mouth.
pub(super) type Mouth<'a> = (&'a Frame, &'a Vec3);

/// Unit tangent at an arc length from the sheath on the curve of `state`.
///
/// `element` is where the search starts, updated to where it was found: calls go from the sheath to the tip.
fn on_curve(mesh: &Mesh, state: &RodState, from_sheath_mm: f64, element: &mut usize) -> Vec3 {
    let inserted = mesh.from_tip_mm[0];
    let last = state.elements();
    let beyond = from_sheath_mm - inserted;
    if last == 0 || beyond >= 0.0 {
        return state.frames[last].t;
    }
    let s = inserted - from_sheath_mm;
    while *element + 1 < last && mesh.from_tip_mm[*element + 1] > s {
        *element += 1;
    }
    let e = *element;
    let h = mesh.elements[e].length;
    let xi = ((mesh.from_tip_mm[e] - s) / h).clamp(0.0, 1.0);
    state.tangent_in(e, xi)
}

/// Position and unit tangent at an arc length from the sheath on the curve of `state`, and straight ahead beyond its
/// tip.
pub(super) fn place_on_curve(mesh: &Mesh, state: &RodState, from_sheath_mm: f64) -> (Vec3, Vec3) {
    let (last, inserted_mm) = (state.elements(), mesh.from_tip_mm[0]);
    let s = inserted_mm - from_sheath_mm;
    if last == 0 || s <= 0.0 {
        let along = state.frames[last].t;
        return (state.positions[last] - along * s, along);
    }
    let e = (mesh.from_tip_mm[1..=last].partition_point(|end| *end > s)).min(last - 1);
    let length_mm = mesh.elements[e].length;
    let xi = ((mesh.from_tip_mm[e] - s) / length_mm).clamp(0.0, 1.0);
    let [t0, t1] = [e, e + 1].map(|i| state.frames[i].t);
    let [w0, s0, w1, s1] = hermite(xi);
    let place = state.positions[e] * w0 + state.positions[e + 1] * w1 + (t0 * s0 + t1 * s1) * length_mm;
    (place, state.tangent_in(e, xi))
}

/// Triads and chords on the mesh `to` of the rod that was in `state` on the mesh `from`, slid along its curve from the sheath's
/// mouth.
fn slide_curve((from, state): (&Mesh, &RodState), mouth: Mouth<'_>, to: &Mesh, out: &mut RodState) {
    let inserted = to.from_tip_mm[0];
    let mut element = 0;
    let direction = |from_tip_mm: f64| on_curve(from, state, inserted - from_tip_mm, &mut element);
    lay(mouth, to, direction, out);
}

/// Triads, chords and positions of a rod with this triad and position at its start, and these tangents as a function
/// of the distance from its tip. Calls go from the sheath to the tip; the triads are carried without twist.
pub(super) fn lay(
    (first, start): Mouth<'_>,
    to: &Mesh,
    mut direction: impl FnMut(f64) -> Vec3,
    out: &mut RodState,
) {
    let n = to.elements.len();
    out.frames.clear();
    out.chords.clear();
    out.frames.push(*first);
    for e in 0..n {
        let m = direction(0.5 * (to.from_tip_mm[e] + to.from_tip_mm[e + 1]));
        let t = direction(to.from_tip_mm[e + 1]);
        let frame: Frame = out.frames[e].transported_to(&t);
        out.chords.push((m + (out.frames[e].t + frame.t) * 0.25) / 1.5);
        out.frames.push(frame);
    }
    out.reference_twists.clear();
    out.reference_twists.resize(n, 0.0);
    out.positions.clear();
    out.positions.resize(n + 1, *start);
    out.place(&to.elements);
}

/// The state on the mesh `to` of the device that was in `state` on the mesh `from`, slid along its curve.
///
/// Material angles move with the device; material that enters from the sheath has the angle that it had in the `tail`, by
/// its distance from the tip.
pub(super) fn transport(
    (from, state): (&Mesh, &RodState),
    (to, mouth): (&Mesh, Mouth<'_>),
    tail: impl Fn(f64) -> f64,
    out: &mut RodState,
) {
    slide_curve((from, state), mouth, to, out);
    let n = to.elements.len();
    // Axial forces, angles and bubbles of the same piece of device, by its distance from the tip.
    let old = state.elements();
    out.tensions.clear();
    out.bubbles.clear();
    out.angles.clear();
    for e in 0..n {
        let from_end = n - e;
        let known = old.checked_sub(from_end);
        out.tensions.push(known.map_or(0.0, |k| state.tensions[k]));
        out.bubbles.push(known.filter(|k| *k > 0).map_or(0.0, |k| state.bubbles[k]));
    }
    // Relative to triads carried along the rod without twist, like the new ones.
    let angle = |i: usize| tail(to.from_tip_mm[i]);
    out.angles.extend((0..n.saturating_sub(old)).map(angle));
    let known = state.angles.iter().zip(state.carried_twists()).map(|(angle, carried)| angle + carried);
    out.angles.extend(known.skip(old.saturating_sub(n)));
    out.angles[0] = angle(0);
}

/// As [`transport`], for several instruments, each with its set of angles, if any, and its tail: the nodes are different
/// marks, so angles are interpolated.
pub(super) fn transport_together(
    (from, state): (&Mesh, &RodState),
    (to, mouth): (&Mesh, Mouth<'_>),
    (sets, tail): (&[Option<usize>], impl Fn(usize, f64) -> f64),
    out: &mut RodState,
) {
    slide_curve((from, state), mouth, to, out);
    let (n, old) = (to.elements.len(), state.elements());
    // The first element whose far end is not before a position; elements are in order, sheath first.
    let holding = |from_tip: f64| from.from_tip_mm[1..].partition_point(|end| *end > from_tip);
    out.tensions.clear();
    for ends in to.from_tip_mm.windows(2) {
        let middle = 0.5 * (ends[0] + ends[1]);
        let known = holding(middle);
        let is_in = known < old && middle <= from.from_tip_mm[known];
        out.tensions.push(if is_in { state.tensions[known] } else { 0.0 });
    }
    // Angles are measured from triads carried without twist.
    let carried: Vec<f64> = state.carried_twists().collect();
    let count = state.sets();
    out.angles.clear();
    out.angles.resize(count * (n + 1), 0.0);
    out.bubbles.clear();
    out.bubbles.resize(count * n, 0.0);
    for (index, set) in sets.iter().enumerate() {
        let Some(set) = *set else { continue };
        // An instrument that is not inserted leaves the angles to a coil in its place.
        let is_in = |index: usize| to.inserted_mm[index] > 0.0;
        if !is_in(index) && (0..sets.len()).any(|other| sets[other] == Some(set) && is_in(other)) {
            continue;
        }
        let inserted = from.inserted_mm.get(index).copied().unwrap_or(0.0);
        // The angle that the same piece of the instrument had.
        let angle = |from_line_tip: f64| {
            let from_tip = (from_line_tip - (to.from_tip_mm[0] - to.inserted_mm[index])).max(0.0);
            let place = from.from_tip_mm[0] - (inserted - from_tip);
            if inserted <= from_tip {
                return tail(index, from_tip);
            }
            let e = holding(place).min(old - 1);
            let xi = ((from.from_tip_mm[e] - place) / from.elements[e].length).clamp(0.0, 1.0);
            let [w0, w1, wb] = Point::at(xi, 0.0).phi;
            w0 * (state.angle(e, set) + carried[e])
                + w1 * (state.angle(e + 1, set) + carried[e + 1])
                + wb * state.bubbles[count * e + set]
        };
        for i in 0..=n {
            out.angles[count * i + set] = angle(to.from_tip_mm[i]);
        }
        for e in 0..n {
            let middle = angle(0.5 * (to.from_tip_mm[e] + to.from_tip_mm[e + 1]));
            let ends = out.angles[count * e + set] + out.angles[count * (e + 1) + set];
            out.bubbles[count * e + set] = middle - 0.5 * ends;
        }
    }
}
