//! The warm start: the rod slides along its own curve, and beyond its tip goes on straight, or along the wall it meets.

use crate::Vec3;
use crate::rod::quadrature::{Point, hermite};
use crate::rod::{Frame, RodState};
use crate::vessel::WallQuery;

use super::mesh::Mesh;

/// The way in front of the tip, in small straight pieces.
#[derive(Debug, Clone, Default)]
pub(super) struct Extension {
    /// Ends of the pieces, and their directions.
    pieces: Vec<(Vec3, Vec3)>,
    piece_mm: f64,
}

/// Longest piece of the way in front of the tip, as a part of the tip's radius.
const PIECE: f64 = 0.4;
/// Cosine between the tip's direction and the wall's inward normal below which it stands head-on and cannot slide.
const HEAD_ON: f64 = -0.995;

impl Extension {
    /// Traces up to `wanted_mm` in front of the tip: straight on while the wall is farther than the tip's radius, then
    /// along it. Returns how far it came.
    pub(super) fn trace(
        &mut self,
        query: &WallQuery,
        tip: Vec3,
        tangent: Vec3,
        radius_mm: f64,
        wanted_mm: f64,
    ) -> f64 {
        self.pieces.clear();
        let count = (wanted_mm / (PIECE * radius_mm)).ceil().max(1.0);
        self.piece_mm = wanted_mm / count;
        let (mut x, mut t) = (tip, tangent);
        for _ in 0..count as usize {
            let ahead = x + t * self.piece_mm;
            if let Some(near) = query.nearest(&ahead, radius_mm + self.piece_mm)
                && !near.rim
                && near.distance_mm < radius_mm
            {
                if t.dot(&near.normal) < HEAD_ON {
                    break;
                }
                // The piece ends where its surface would just touch, as far as one piece can turn.
                let along = t - near.normal * t.dot(&near.normal);
                let lift =
                    (t.dot(&near.normal) + (radius_mm - near.distance_mm) / self.piece_mm).clamp(-0.5, 0.5);
                t = (along.normalize() + near.normal * lift).normalize();
            }
            let next = x + t * self.piece_mm;
            if query
                .nearest(&next, radius_mm)
                .is_some_and(|near| !near.rim && near.distance_mm < CLEAR * radius_mm)
            {
                break;
            }
            x = next;
            self.pieces.push((x, t));
        }
        self.pieces.len() as f64 * self.piece_mm
    }

    /// Position and direction at `beyond_mm` in front of the tip; straight on beyond what was traced.
    fn at(&self, tip: Vec3, tangent: Vec3, beyond_mm: f64) -> (Vec3, Vec3) {
        if self.pieces.is_empty() {
            return (tip + tangent * beyond_mm, tangent);
        }
        let index = ((beyond_mm / self.piece_mm).ceil() as usize).clamp(1, self.pieces.len()) - 1;
        let (end, t) = self.pieces[index];
        (end + t * (beyond_mm - (index + 1) as f64 * self.piece_mm), t)
    }
}

/// Part of its radius that the axis keeps from the wall while it is traced.
const CLEAR: f64 = 0.5;

/// Position and unit tangent at an arc length from the sheath on the curve of `state`.
///
/// `element` is where to start looking, updated to where it was found: calls go from the sheath to the tip.
fn on_curve(
    mesh: &Mesh,
    state: &RodState,
    extension: &Extension,
    from_sheath_mm: f64,
    element: &mut usize,
) -> (Vec3, Vec3) {
    let inserted = mesh.from_tip_mm[0];
    let last = state.elements();
    let beyond = from_sheath_mm - inserted;
    if last == 0 || beyond >= 0.0 {
        let t = state.frames[last].t;
        return extension.at(state.positions[last], t, beyond);
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
/// Material angles stay with the device; what enters from the sheath has the angle that the tail has had.
pub(super) fn slide(from: &Mesh, state: &RodState, extension: &Extension, to: &Mesh, out: &mut RodState) {
    let inserted = to.from_tip_mm[0];
    let first = state.frames[0];
    let n = to.elements.len();
    let mut element = 0;
    out.frames.clear();
    out.chords.clear();
    out.frames.push(first);
    for e in 0..n {
        let middle = inserted - 0.5 * (to.from_tip_mm[e] + to.from_tip_mm[e + 1]);
        let m = on_curve(from, state, extension, middle, &mut element).1;
        let t = on_curve(from, state, extension, inserted - to.from_tip_mm[e + 1], &mut element).1;
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
    let tail = state.angles[0];
    let mut carried = 0.0;
    let mut k = 1;
    for i in 0..=n {
        let known = old.checked_sub(n - i).filter(|k| *k > 0);
        let Some(known) = known else {
            out.angles.push(tail);
            continue;
        };
        while k <= known {
            carried += state.reference_twists[k - 1];
            k += 1;
        }
        out.angles.push(state.angles[known] + carried);
    }
    out.angles[0] = tail;
    out.reference_twists.clear();
    out.reference_twists.resize(n, 0.0);
    out.positions.clear();
    out.positions.resize(n + 1, state.positions[0]);
    out.place(&to.elements);
}
