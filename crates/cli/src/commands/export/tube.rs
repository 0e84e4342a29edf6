//! A body that is drawn as a tube: an instrument or a detached coil as a chain of joints along its line, which keep their
//! places in the material while the line moves.

use std::f64::consts::TAU;

use endowire_core::Vec3;
use endowire_core::nalgebra::{UnitQuaternion, Vector3};

use super::{Line, Run};
use crate::failure::Failure;

/// Shortest distance of joints, mm, and largest number of them.
const SHORTEST_MM: f64 = 1.0;
const MOST_JOINTS: f64 = 400.0;
/// Vertices around a tube.
pub(super) const SIDES: usize = 10;
/// Millimetres in a metre, the unit of glTF.
const MM: f64 = 1e-3;

/// A point or direction in the axes of glTF, in which y is up.
pub(super) fn upright(v: &Vec3) -> Vec3 {
    Vec3::new(v.x, v.z, -v.y)
}

/// A place in glTF: metres, y up.
pub(super) fn place(mm: &Vec3) -> Vec3 {
    upright(mm) * MM
}

/// A joint at a time: its place, m, and the rotation that turns z to the tangent.
#[derive(Clone, Copy)]
pub(super) struct Joint {
    pub(super) place: Vec3,
    pub(super) turn: UnitQuaternion<f64>,
}

/// A body over time.
pub(super) struct Tube {
    pub(super) instrument: usize,
    pub(super) coil: Option<usize>,
    /// Arc lengths of its joints from its tip, mm: from 0.
    pub(super) from_tip_mm: Vec<f64>,
    /// Its joints at each key; `None` before it is detached.
    pub(super) keys: Vec<Option<Vec<Joint>>>,
}

/// All bodies of a run at these rows.
pub(super) fn tubes(run: &Run, rows: &[usize]) -> Result<Vec<Tube>, Failure> {
    let lines = rows.iter().map(|row| run.lines(*row)).collect::<Result<Vec<_>, _>>()?;
    let mut bodies: Vec<(usize, Option<usize>)> =
        (0..run.stack.instruments().len()).map(|index| (index, None)).collect();
    for line in lines.iter().flatten().filter(|line| line.coil.is_some()) {
        if !bodies.contains(&(line.instrument, line.coil)) {
            bodies.push((line.instrument, line.coil));
        }
    }
    let tube = |(instrument, coil): (usize, Option<usize>)| {
        let own: Vec<Option<&Line>> = lines
            .iter()
            .map(|lines| lines.iter().find(|line| (line.instrument, line.coil) == (instrument, coil)))
            .collect();
        let inserted = |line: &Line| line.shape.from_tip_mm.first().copied().unwrap_or(0.0);
        let longest_mm = own.iter().flatten().map(|line| inserted(line)).fold(0.0, f64::max);
        let apart_mm = (longest_mm / MOST_JOINTS).max(SHORTEST_MM);
        let count = (longest_mm / apart_mm).ceil() as usize;
        let from_tip_mm: Vec<f64> = (0..=count).map(|k| (k as f64 * apart_mm).min(longest_mm)).collect();
        let key = |line: &Option<&Line>| match (line, coil) {
            (None, Some(_)) => None,
            _ => Some(joints(run, *line, &from_tip_mm)),
        };
        let keys = own.iter().map(key).collect();
        Tube { instrument, coil, from_tip_mm, keys }
    };
    // What was never inserted is not drawn.
    Ok(bodies.into_iter().map(tube).filter(|tube| tube.from_tip_mm.len() > 1).collect())
}

/// The joints of a line at a time. What is not inserted is straight, behind the sheath's mouth.
fn joints(run: &Run, line: Option<&Line>, from_tip_mm: &[f64]) -> Vec<Joint> {
    let inserted_mm = line.and_then(|line| line.shape.from_tip_mm.first().copied()).unwrap_or(0.0);
    let (mouth, towards) = (run.sheath.position_mm, run.sheath.direction);
    let at = |own_mm: f64| match line.filter(|_| own_mm <= inserted_mm) {
        Some(line) => line.shape.position_at(own_mm).unwrap_or(mouth),
        None => mouth - towards * (own_mm - inserted_mm),
    };
    let places: Vec<Vec3> = from_tip_mm.iter().map(|own_mm| place(&at(*own_mm))).collect();
    let last = places.len() - 1;
    let tangent = |k: usize| {
        let along = places[k.saturating_sub(1)] - places[(k + 1).min(last)];
        along.try_normalize(0.0).unwrap_or_else(|| upright(&towards))
    };
    // Carried along from the sheath without twist.
    let mut turn = UnitQuaternion::rotation_between(&Vector3::z(), &tangent(last))
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), TAU / 2.0));
    let mut joints: Vec<Joint> = (0..=last)
        .rev()
        .map(|k| {
            let before = turn * Vector3::z();
            let step = UnitQuaternion::rotation_between(&before, &tangent(k));
            turn = step.unwrap_or_else(UnitQuaternion::identity) * turn;
            Joint { place: places[k], turn }
        })
        .collect();
    joints.reverse();
    joints
}

/// A tube in the places of its joints: vertices with normals, the joint of each, and triangles.
pub(super) struct Skin {
    pub(super) positions: Vec<f32>,
    pub(super) normals: Vec<f32>,
    pub(super) joint: Vec<u16>,
    pub(super) triangles: Vec<u32>,
}

/// The skin of a tube at its last key.
pub(super) fn skin(run: &Run, tube: &Tube) -> Skin {
    let mut skin = Skin { positions: vec![], normals: vec![], joint: vec![], triangles: vec![] };
    let Some(Some(joints)) = tube.keys.last() else { return skin };
    let mut add = |place: Vec3, normal: Vec3, joint: usize| {
        skin.positions.extend(place.iter().map(|x| *x as f32));
        skin.normals.extend(normal.iter().map(|x| *x as f32));
        skin.joint.push(joint as u16);
    };
    for (k, (joint, own_mm)) in joints.iter().zip(&tube.from_tip_mm).enumerate() {
        let radius = run.radius_mm(tube.instrument, *own_mm) * MM;
        for side in 0..SIDES {
            let (sin, cos) = (TAU * side as f64 / SIDES as f64).sin_cos();
            let out = joint.turn * Vec3::new(cos, sin, 0.0);
            add(joint.place + out * radius, out, k);
        }
    }
    // The tip is rounded off by a point half a radius beyond.
    let radius = run.radius_mm(tube.instrument, 0.0) * MM;
    let ahead = joints[0].turn * Vector3::z();
    add(joints[0].place + ahead * (0.5 * radius), ahead, 0);
    let (sides, tip) = (SIDES as u32, (joints.len() * SIDES) as u32);
    for side in 0..sides {
        let next = (side + 1) % sides;
        skin.triangles.extend([tip, side, next]);
        for ring in 0..joints.len() as u32 - 1 {
            let (a, b) = (ring * sides, (ring + 1) * sides);
            skin.triangles.extend([a + side, b + side, b + next, a + side, b + next, a + next]);
        }
    }
    skin
}
