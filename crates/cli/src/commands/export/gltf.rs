//! A run as an animation in glTF 2.0, for Blender, browsers and game engines.

use std::path::Path;

use endowire_core::Vec3;
use endowire_core::nalgebra::{Isometry3, Matrix4, Translation3, UnitQuaternion, Vector3};
use serde_json::{Value, json};

use super::glb::Glb;
use super::tube::{Joint, Tube, place, skin, tubes, upright};
use super::vessel_keys::VesselKeys;
use super::{Run, written};
use crate::failure::Failure;
use crate::output::{tell, whole};

/// Largest number of keys: of a run with more steps some are left out, evenly.
const MOST_KEYS: usize = 500;
/// Largest number of contacts that are shown at once, those with the largest forces.
const MOST_ARROWS: usize = 64;
/// Length of the arrow of the largest force, m.
const LONGEST_ARROW: f64 = 0.02;
/// Sides of an arrow.
const SIDES: usize = 8;

/// Numbers of materials.
const VESSEL: usize = 0;
const DEVICE: usize = 1;
const FORCE: usize = 2;

/// Writes the file.
pub(super) fn write(run: &Run, file: &Path) -> Result<(), Failure> {
    let keys = run.keys(MOST_KEYS);
    let vessel = VesselKeys::of(run);
    let bytes = document(run, &keys, &vessel)?;
    whole::write_bytes(file, &bytes).map_err(|e| Failure::write(file, &e))?;
    if keys.len() < run.times.len() {
        tell(format_args!("endowire: {} of {} steps are keys of the animation", keys.len(), run.times.len()));
    }
    written(keys.len(), Some(&vessel), file);
    Ok(())
}

fn document(run: &Run, keys: &[(usize, f64)], vessel_keys: &VesselKeys) -> Result<Vec<u8>, Failure> {
    let mut glb = Glb::default();
    glb.materials = vec![
        json!({"name": "vessel", "alphaMode": "BLEND", "doubleSided": true,
            "pbrMetallicRoughness": {"baseColorFactor": [0.75, 0.2, 0.2, 0.25], "metallicFactor": 0.0, "roughnessFactor": 0.6}}),
        json!({"name": "device",
            "pbrMetallicRoughness": {"baseColorFactor": [0.2, 0.25, 0.35, 1.0], "metallicFactor": 0.5, "roughnessFactor": 0.4}}),
        json!({"name": "contact force",
            "pbrMetallicRoughness": {"baseColorFactor": [0.95, 0.6, 0.1, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.8}}),
    ];
    let times_s: Vec<f32> = keys.iter().map(|(_, time_s)| *time_s as f32).collect();
    let times = glb.times(&times_s);
    let rows: Vec<usize> = keys.iter().map(|(row, _)| *row).collect();
    let mut scene = vec![vessel(run, &mut glb, &vessel_keys.keys)];
    for tube in tubes(run, &rows)? {
        scene.extend(body(run, &mut glb, &tube, times));
    }
    let (arrows, n_per_m) = forces(run, &mut glb, &rows, times);
    scene.extend(arrows);
    Ok(glb.file(&scene, &json!({"arrows_n_per_m": n_per_m})))
}

fn flat(points: impl Iterator<Item = Vec3>) -> Vec<f32> {
    points.flat_map(|p| [p.x as f32, p.y as f32, p.z as f32]).collect()
}

/// The vessel; one that moves or yields is animated by differences from where it is before it is displaced.
fn vessel(run: &Run, glb: &mut Glb, moved: &[(usize, f64)]) -> usize {
    let rest = run.vertices_mm(None);
    let positions = glb.places(&flat(rest.iter().map(place)));
    let mesh = run.wall.mesh();
    let mut normals = vec![Vec3::zeros(); rest.len()];
    for corners in &mesh.triangles {
        let [a, b, c] = corners.map(|k| rest[k as usize]);
        let out = (b - a).cross(&(c - a));
        corners.iter().for_each(|k| normals[*k as usize] += out);
    }
    let unit = |n: &Vec3| upright(n).try_normalize(0.0).unwrap_or_else(Vec3::x);
    let normals = glb.vertices(&flat(normals.iter().map(unit)), "VEC3");
    let triangles = glb.triangles(&mesh.triangles.concat());
    let mut primitive = json!({
        "attributes": {"POSITION": positions, "NORMAL": normals}, "indices": triangles, "material": VESSEL
    });
    let mut made = json!({"name": "vessel"});
    let targets: Vec<Value> = moved
        .iter()
        .map(|(row, _)| {
            let now = run.vertices_mm(Some(*row));
            let by = now.iter().zip(&rest).map(|(now, rest)| place(&(now - rest)));
            json!({"POSITION": glb.places(&flat(by))})
        })
        .collect();
    let count = targets.len();
    if count > 0 {
        primitive["targets"] = targets.into();
        made["weights"] = json!(vec![0.0; count]);
    }
    made["primitives"] = json!([primitive]);
    let mesh = glb.mesh(made);
    let node = glb.node(json!({"name": "vessel", "mesh": mesh}));
    if count > 0 {
        let times: Vec<f32> = moved.iter().map(|(_, time_s)| *time_s as f32).collect();
        let times = glb.times(&times);
        let weights: Vec<f32> = (0..count * count).map(|k| f32::from(k / count == k % count)).collect();
        let weights = glb.numbers(&weights, "SCALAR");
        glb.animate(node, "weights", times, weights, "LINEAR");
    }
    node
}

/// The numbers of a rotation.
fn quaternion(turn: &UnitQuaternion<f64>) -> [f32; 4] {
    let q = turn.coords;
    [q.x as f32, q.y as f32, q.z as f32, q.w as f32]
}

/// An instrument or a coil: a tube that is carried by its joints. Returns its nodes.
fn body(run: &Run, glb: &mut Glb, tube: &Tube, times: usize) -> Vec<usize> {
    let Some(Some(last)) = tube.keys.last() else { return vec![] };
    let name = run.name(tube.instrument, tube.coil);
    let made = skin(run, tube);
    let positions = glb.places(&made.positions);
    let normals = glb.vertices(&made.normals, "VEC3");
    let [joints, weights] = glb.joints(&made.joint);
    let lengths: Vec<f32> = made.joint.iter().map(|k| tube.from_tip_mm[usize::from(*k)] as f32).collect();
    let from_tip = glb.vertices(&lengths, "SCALAR");
    let triangles = glb.triangles(&made.triangles);
    let attributes = json!({
        "POSITION": positions, "NORMAL": normals, "JOINTS_0": joints, "WEIGHTS_0": weights, "_FROM_TIP_MM": from_tip
    });
    let mesh = glb.mesh(json!({
        "name": name, "primitives": [{"attributes": attributes, "indices": triangles, "material": DEVICE}]
    }));
    let first = glb.nodes.len();
    let bind: Vec<f32> = last
        .iter()
        .flat_map(|joint| {
            let at = Isometry3::from_parts(Translation3::from(joint.place), joint.turn);
            let inverse: Matrix4<f64> = at.inverse().to_homogeneous();
            inverse.iter().map(|x| *x as f32).collect::<Vec<_>>()
        })
        .collect();
    for (k, joint) in last.iter().enumerate() {
        let place = joint.place.map(|x| x as f32);
        let node = json!({"name": format!("{name} {k}"), "translation": place.as_slice(), "rotation": quaternion(&joint.turn)});
        glb.node(node);
    }
    let numbers: Vec<usize> = (first..first + last.len()).collect();
    let chain = glb.node(json!({"name": format!("{name} line"), "children": numbers}));
    let bind = glb.numbers(&bind, "MAT4");
    glb.skins.push(json!({"name": name, "joints": numbers, "skeleton": chain, "inverseBindMatrices": bind}));
    let skin = glb.skins.len() - 1;
    let node = glb.node(json!({"name": name, "mesh": mesh, "skin": skin}));
    // Before a coil is detached it is where it will be, and has no size.
    let known = |key: usize| tube.keys[key..].iter().flatten().next().unwrap_or(last);
    for (k, node) in numbers.iter().enumerate() {
        let of = |key: usize| -> &Joint { &known(key)[k] };
        let places = flat((0..tube.keys.len()).map(|key| of(key).place));
        let mut turns: Vec<f32> = Vec::new();
        let mut before = last[k].turn;
        for key in 0..tube.keys.len() {
            let turn = of(key).turn;
            // Of the two quaternions of a rotation the nearer one, so that no joint goes the long way round.
            let sign = if turn.coords.dot(&before.coords) < 0.0 { -1.0 } else { 1.0 };
            before = UnitQuaternion::new_unchecked(turn.into_inner() * sign);
            turns.extend(quaternion(&before));
        }
        let (places, turns) = (glb.numbers(&places, "VEC3"), glb.numbers(&turns, "VEC4"));
        glb.animate(*node, "translation", times, places, "LINEAR");
        glb.animate(*node, "rotation", times, turns, "LINEAR");
    }
    if tube.coil.is_some() {
        let sizes: Vec<f32> =
            tube.keys.iter().flat_map(|key| [f32::from(u8::from(key.is_some())); 3]).collect();
        let sizes = glb.numbers(&sizes, "VEC3");
        glb.animate(chain, "scale", times, sizes, "STEP");
    }
    vec![chain, node]
}

/// Arrows for the forces of the wall on the device, as many as the step with most contacts has. Returns their nodes, and
/// the newtons in a metre of arrow.
fn forces(run: &Run, glb: &mut Glb, rows: &[usize], times: usize) -> (Vec<usize>, f64) {
    let mut all: Vec<Vec<(Vec3, Vec3)>> = Vec::new();
    for row in rows {
        let contacts = run.contacts(*row).into_iter().filter(|one| one.force_n.norm() > 0.0);
        let mut contacts: Vec<(Vec3, Vec3)> = contacts.map(|one| (one.position_mm, one.force_n)).collect();
        contacts.sort_by(|a, b| b.1.norm().total_cmp(&a.1.norm()));
        contacts.truncate(MOST_ARROWS);
        all.push(contacts);
    }
    let count = all.iter().map(Vec::len).max().unwrap_or(0);
    let largest_n = all.iter().flatten().map(|(_, force_n)| force_n.norm()).fold(0.0, f64::max);
    if count == 0 {
        return (vec![], 0.0);
    }
    let n_per_m = largest_n / LONGEST_ARROW;
    let mesh = arrow(glb);
    let node = |k: usize| {
        let node =
            glb.node(json!({"name": format!("contact force {k}"), "mesh": mesh, "scale": [0.0, 0.0, 0.0]}));
        let (mut places, mut turns, mut sizes) = (vec![], vec![], vec![]);
        for contacts in &all {
            let (at, force_n) = contacts.get(k).copied().unwrap_or_default();
            let size = (force_n.norm() / n_per_m) as f32;
            let along = UnitQuaternion::rotation_between(&Vector3::z(), &upright(&force_n));
            let turn = along
                .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
            places.extend(flat([place(&at)].into_iter()));
            turns.extend(quaternion(&turn));
            sizes.extend([size; 3]);
        }
        for (path, numbers, kind) in
            [("translation", places, "VEC3"), ("rotation", turns, "VEC4"), ("scale", sizes, "VEC3")]
        {
            let keys = glb.numbers(&numbers, kind);
            glb.animate(node, path, times, keys, "STEP");
        }
        node
    };
    ((0..count).map(node).collect(), n_per_m)
}

/// An arrow of length 1 along z: a shaft and a head, each a cone or a part of one.
fn arrow(glb: &mut Glb) -> usize {
    const RINGS: [(f64, f64); 4] = [(0.0, 0.02), (0.7, 0.02), (0.7, 0.06), (1.0, 0.0)];
    let (mut places, mut normals, mut triangles) = (vec![], vec![], vec![]);
    for pair in RINGS.windows(2) {
        let first = places.len() as u32;
        let [(z0, r0), (z1, r1)] = [pair[0], pair[1]];
        for side in 0..SIDES {
            let (sin, cos) = (std::f64::consts::TAU * side as f64 / SIDES as f64).sin_cos();
            let out = Vec3::new(cos * (z1 - z0), sin * (z1 - z0), r0 - r1);
            for (z, r) in [(z0, r0), (z1, r1)] {
                places.push(Vec3::new(cos * r, sin * r, z));
                normals.push(out.normalize());
            }
        }
        for side in 0..SIDES as u32 {
            let [a, b] = [side, (side + 1) % SIDES as u32].map(|side| first + 2 * side);
            triangles.extend([a, b, b + 1, a, b + 1, a + 1]);
        }
    }
    let positions = glb.places(&flat(places.into_iter()));
    let normals = glb.vertices(&flat(normals.into_iter()), "VEC3");
    let triangles = glb.triangles(&triangles);
    let primitive = json!({
        "attributes": {"POSITION": positions, "NORMAL": normals}, "indices": triangles, "material": FORCE
    });
    glb.mesh(json!({"name": "force", "primitives": [primitive]}))
}
