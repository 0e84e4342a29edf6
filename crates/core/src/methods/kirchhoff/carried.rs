//! A device displaced by a moving vessel: the start of a sub-step in which the wall moves.
//!
//! Every point of the device's curve moves with the material point of the vessel at its position, c(s) = χ(r(s)) with
//! χ from the vessel before to the vessel after. That curve is longer or shorter than the device: with G = ∂χ/∂x,
//! |c′| = |G t|, and the device lies on it from the sheath on, with the tangents
//!
//! ```text
//! t(σ) = G t/|G t|  at the s with  σ = ∫ |G t| ds
//! ```
//!
//! and continues straight at its tip where the curve is too short. The sheath does not move. From there the sub-step
//! proceeds as in a vessel that does not move; slip is measured from the material points themselves
//! ([`Friction::carry`](crate::contact::Friction::carry)).

use super::balance::OuterWork;
use super::configuration::Start;
use super::mesh::Mesh;
use super::state::KirchhoffState;
use super::transport::lay;
use crate::Vec3;
use crate::contact::Touch;
use crate::rod::RodState;
use crate::rod::quadrature::hermite;
use crate::vessel::Displacement;

/// A vessel before and after a sub-step.
pub(super) type Passage<'a> = (&'a Displacement, &'a Displacement);

/// The displaced curve of a device: arc lengths and unit tangents at nodes and element midpoints.
struct Curve {
    ends_mm: Vec<f64>,
    tangents: Vec<Vec3>,
}

impl Curve {
    fn new(mesh: &Mesh, state: &RodState, (before, after): Passage<'_>) -> Self {
        let carried = |x: &Vec3, t: &Vec3| {
            let material = before.material(x);
            let slope = after.gradient(&material) * before.local(&material).inverse * t;
            (slope.norm(), slope / slope.norm())
        };
        let (mut at, first) = carried(&state.positions[0], &state.frames[0].t);
        let mut curve = Self { ends_mm: vec![0.0], tangents: vec![first] };
        let mut end_mm = 0.0;
        for (e, data) in mesh.elements.iter().enumerate() {
            let (t0, t1, h) = (state.frames[e].t, state.frames[e + 1].t, data.length);
            let [w0, s0, w1, s1] = hermite(0.5);
            let x = state.positions[e] * w0 + state.positions[e + 1] * w1 + (t0 * s0 + t1 * s1) * h;
            let (middle, along) = carried(&x, &state.tangent_in(e, 0.5));
            let (end, ahead) = carried(&state.positions[e + 1], &t1);
            // Simpson's rule.
            end_mm += h / 6.0 * (at + 4.0 * middle + end);
            curve.ends_mm.push(end_mm);
            curve.tangents.extend([along, ahead]);
            at = end;
        }
        curve
    }

    /// Unit tangent at an arc length. `element` is where the search starts: calls go from the sheath to the tip.
    fn tangent(&self, from_sheath_mm: f64, element: &mut usize) -> Vec3 {
        let last = self.ends_mm.len() - 1;
        while *element < last && self.ends_mm[*element + 1] <= from_sheath_mm {
            *element += 1;
        }
        if *element == last {
            return self.tangents[2 * last];
        }
        let (a, b) = (self.ends_mm[*element], self.ends_mm[*element + 1]);
        let x = (from_sheath_mm - a) / (b - a);
        let [first, middle, second] = [0, 1, 2].map(|k| self.tangents[2 * *element + k]);
        let t = first * ((1.0 - x) * (1.0 - 2.0 * x))
            + middle * (4.0 * x * (1.0 - x))
            + second * (x * (2.0 * x - 1.0));
        t / t.norm()
    }
}

/// The start of a part in which the wall moves; none where it does not, or without a device.
pub(super) fn taken_along(was: Start<'_>, passage: Option<Passage<'_>>) -> Option<KirchhoffState> {
    passage.filter(|_| was.state.rod.elements() > 0).map(|passage| {
        let mut taken = was.state.clone();
        carried(was.mesh, &was.state.rod, passage, &mut taken.rod);
        taken
    })
}

/// Sets `out` to the displaced device that was in `state`.
fn carried(mesh: &Mesh, state: &RodState, passage: Passage<'_>, out: &mut RodState) {
    let curve = Curve::new(mesh, state, passage);
    let mut element = 0;
    let inserted_mm = mesh.from_tip_mm[0];
    let direction = |from_tip_mm: f64| curve.tangent(inserted_mm - from_tip_mm, &mut element);
    lay((&state.frames[0], &state.positions[0]), mesh, direction, out);
    out.tensions.clone_from(&state.tensions);
    out.bubbles.clone_from(&state.bubbles);
    // Angles are now measured from triads carried along the rod without twist.
    out.angles.clone_from(&state.angles);
    let sets = state.sets();
    for (i, twist) in state.carried_twists().enumerate() {
        out.angles[sets * i..sets * (i + 1)].iter_mut().for_each(|angle| *angle += twist);
    }
}

/// Work of the wall along a passage, given the contacts before and after it: zero if the wall rests.
pub(super) fn work_of_wall(passage: Option<Passage<'_>>, [was, is]: [&[(usize, Touch)]; 2]) -> OuterWork {
    let Some((before, after)) = passage else { return OuterWork::default() };
    let there = |x: &Vec3| after.place(&before.material(x)) - x;
    let back = |x: &Vec3| x - before.place(&after.material(x));
    let (was, is) = (done(was, there), done(is, back));
    OuterWork { least_mj: was.0.min(is.0), most_mj: was.1.max(is.1) }
}

/// Work of contact forces over the motion of the wall there, mJ: signed, and by magnitude.
fn done(touches: &[(usize, Touch)], way_mm: impl Fn(&Vec3) -> Vec3) -> (f64, f64) {
    let contacts = touches.iter().map(|(_, touch)| &touch.contact);
    let each = contacts.map(|contact| contact.total_n().dot(&way_mm(&contact.position_mm)));
    each.fold((0.0, 0.0), |(sum, most), work| (sum + work, most + work.abs()))
}
