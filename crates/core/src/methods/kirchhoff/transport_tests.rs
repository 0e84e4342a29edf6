//! Predictions, compared with the curves that they follow.

use super::mesh::{Fineness, Mesh};
use super::transport::{transport, transport_together};
use crate::Vec3;
use crate::device::Device;
use crate::rod::{Frame, RodState};

const ELEMENT_MM: f64 = 2.0;

fn mesh(inserted_mm: f64) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.build(
        &Device::uniform(100.0, 0.5, 1.0).unwrap(),
        inserted_mm,
        Fineness::of_elements(ELEMENT_MM),
        1.0,
    );
    mesh
}

/// A device in a plane whose tangent has turned by `angle` at this distance from the sheath.
fn bent(mesh: &Mesh, angle: impl Fn(f64) -> f64) -> RodState {
    let tangent = |from_tip_mm: f64| {
        let turned = angle(mesh.from_tip_mm[0] - from_tip_mm);
        Vec3::new(turned.sin(), 0.0, turned.cos())
    };
    let mut frames = vec![Frame::new(Vec3::z(), Some(Vec3::y()))];
    for from_tip_mm in &mesh.from_tip_mm[1..] {
        frames.push(frames[frames.len() - 1].transported_to(&tangent(*from_tip_mm)));
    }
    RodState::from_frames(&mesh.elements, Vec3::zeros(), frames)
}

fn slid(from: &Mesh, state: &RodState, to: &Mesh) -> RodState {
    let mut out = RodState::default();
    transport((from, state), (to, (&state.frames[0], &state.positions[0])), |_| state.angles[0], &mut out);
    out
}

#[test]
fn a_device_that_slides_stays_on_its_arc_and_goes_on_straight() {
    const RADIUS_MM: f64 = 50.0;
    let from = mesh(40.0);
    let state = bent(&from, |s| s / RADIUS_MM);
    let on_arc = |s: f64| Vec3::new(1.0 - (s / RADIUS_MM).cos(), 0.0, (s / RADIUS_MM).sin()) * RADIUS_MM;
    for inserted_mm in [43.0, 37.3] {
        let to = mesh(inserted_mm);
        let out = slid(&from, &state, &to);
        for (x, from_tip_mm) in out.positions.iter().zip(&to.from_tip_mm) {
            let s = inserted_mm - from_tip_mm;
            let there = if s <= 40.0 {
                on_arc(s)
            } else {
                on_arc(40.0) + state.frames[state.elements()].t * (s - 40.0)
            };
            // The element in which the arc ends bends over all of its length: κh²/24.
            let bound = if s <= 40.0 { 1e-3 } else { 1.01 * ELEMENT_MM * ELEMENT_MM / (24.0 * RADIUS_MM) };
            assert!((x - there).norm() < bound, "{inserted_mm} mm, {s} mm: {x} and not {there}");
        }
        // The tip, whose marks are fixed to it, has moved on by 3 mm: the arc does not move with it.
        let off = out.frames[out.elements()].t.angle(&state.frames[state.elements()].t);
        assert!((off - (40.0 - inserted_mm).max(0.0) / RADIUS_MM).abs() < 1e-4, "{off}");
    }
}

#[test]
fn angles_and_axial_forces_go_with_the_device_and_the_tail_gives_what_enters() {
    let (from, to) = (mesh(40.0), mesh(44.0));
    let mut state = bent(&from, |s| s / 50.0);
    for (i, angle) in state.angles.iter_mut().enumerate() {
        *angle = 0.7 + 0.01 * i as f64;
    }
    for (e, tension) in state.tensions.iter_mut().enumerate() {
        *tension = 1.0 + e as f64;
    }
    let out = slid(&from, &state, &to);
    let (n, old) = (out.elements(), state.elements());
    assert_eq!(n, old + 2);
    assert_eq!(out.angles[..3], [state.angles[0]; 3]);
    for i in 3..=n {
        assert!((out.angles[i] - state.angles[i - 2]).abs() < 1e-12);
    }
    assert_eq!(out.tensions[2..], state.tensions[..]);
    assert_eq!(out.tensions[..2], [0.0; 2]);
}

#[test]
fn several_instruments_slide_as_one_where_there_is_one() {
    let (mut from, mut to) = (mesh(40.0), mesh(42.0));
    from.inserted_mm.push(40.0);
    to.inserted_mm.push(42.0);
    let mut state = bent(&from, |s| 0.1 * (0.2 * s).sin());
    for (i, angle) in state.angles.iter_mut().enumerate().skip(1) {
        *angle = 0.02 * i as f64;
    }
    let alone = slid(&from, &state, &to);
    let mut together = RodState::default();
    transport_together(
        (&from, &state),
        (&to, (&state.frames[0], &state.positions[0])),
        (&[Some(0)], |_, _| state.angles[0]),
        &mut together,
    );
    assert_eq!((&together.positions, &together.chords), (&alone.positions, &alone.chords));
    for (a, b) in together.angles.iter().zip(&alone.angles).skip(2) {
        assert!((a - b).abs() < 1e-12, "{a} {b}");
    }
}
