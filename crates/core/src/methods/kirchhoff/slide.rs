//! The warm start: the rod slides along its own curve, and beyond its tip goes on straight.

use crate::Vec3;
use crate::rod::quadrature::{Point, hermite};
use crate::rod::{Frame, RodState};

use super::mesh::Mesh;

/// Position and unit tangent at an arc length from the sheath on the curve of `state`.
///
/// `element` is where to start looking, updated to where it was found: calls go from the sheath to the tip.
fn on_curve(mesh: &Mesh, state: &RodState, from_sheath_mm: f64, element: &mut usize) -> (Vec3, Vec3) {
    let inserted = mesh.from_tip_mm[0];
    let last = state.elements();
    let beyond = from_sheath_mm - inserted;
    if last == 0 || beyond >= 0.0 {
        let t = state.frames[last].t;
        return (state.positions[last] + t * beyond, t);
    }
    let s = inserted - from_sheath_mm;
    while *element + 1 < last && mesh.from_tip_mm[*element + 1] > s {
        *element += 1;
    }
    let e = *element;
    let h = mesh.elements[e].length;
    let xi = ((mesh.from_tip_mm[e] - s) / h).clamp(0.0, 1.0);
    let [w0, s0, w1, s1] = hermite(xi);
    let (t0, t1) = (state.frames[e].t, state.frames[e + 1].t);
    let x = state.positions[e] * w0 + state.positions[e + 1] * w1 + (t0 * s0 + t1 * s1) * h;
    let slope = Point::at(xi, 0.0).derivatives(&state.chords[e], &t0, &t1).0;
    (x, slope / slope.norm())
}

/// The state on the mesh `to` of the rod that was in `state` on the mesh `from`, slid along its curve.
///
/// Material angles stay with the device; what enters from the sheath has the sheath's angle `tail_rad`.
pub(super) fn slide(from: &Mesh, state: &RodState, to: &Mesh, tail_rad: f64, out: &mut RodState) {
    let inserted = to.from_tip_mm[0];
    let first = state.frames[0];
    let n = to.elements.len();
    let mut element = 0;
    out.frames.clear();
    out.chords.clear();
    out.frames.push(first);
    for e in 0..n {
        let middle = inserted - 0.5 * (to.from_tip_mm[e] + to.from_tip_mm[e + 1]);
        let m = on_curve(from, state, middle, &mut element).1;
        let t = on_curve(from, state, inserted - to.from_tip_mm[e + 1], &mut element).1;
        let frame: Frame = out.frames[e].transported_to(&t);
        out.chords.push((m + (out.frames[e].t + frame.t) * 0.25) / 1.5);
        out.frames.push(frame);
    }
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
    // Against triads carried along the rod without twist, which is what the new ones are.
    let mut carried = 0.0;
    let mut k = 1;
    for i in 0..=n {
        let known = old.checked_sub(n - i).filter(|k| *k > 0);
        let Some(known) = known else {
            out.angles.push(tail_rad);
            continue;
        };
        while k <= known {
            carried += state.reference_twists[k - 1];
            k += 1;
        }
        out.angles.push(state.angles[known] + carried);
    }
    out.angles[0] = tail_rad;
    out.reference_twists.clear();
    out.reference_twists.resize(n, 0.0);
    out.positions.clear();
    out.positions.resize(n + 1, state.positions[0]);
    out.place(&to.elements);
}
