use nalgebra::Matrix3;

use super::closest::Closest;
use super::*;
use crate::random::{splitmix64, unit};
use crate::vessel::{CentrelineNode, GeneratedWall, Lumen, NoStore, WallQuery, anatomy};

fn vessel(tree: CentrelineTree) -> SweptVessel {
    SweptVessel::new(tree, Resolution::EdgeMm(1.0)).unwrap()
}

fn named(name: &str) -> SweptVessel {
    vessel(anatomy::tree(name).unwrap())
}

/// A tree of rows x, y, z, radius and parent.
fn tree(rows: &[([f64; 4], Option<usize>)]) -> CentrelineTree {
    let node = |([x, y, z, radius_mm], parent): &([f64; 4], Option<usize>)| CentrelineNode {
        position_mm: Vec3::new(*x, *y, *z),
        radius_mm: *radius_mm,
        parent: *parent,
    };
    CentrelineTree::new(rows.iter().map(node).collect()).unwrap()
}

/// A tube along z whose radius changes from 3 mm to this over 40 mm.
fn cone(end_mm: f64) -> CentrelineTree {
    let row = |k: usize| {
        let part = k as f64 / 10.0;
        ([0.0, 0.0, 40.0 * part, 3.0 + (end_mm - 3.0) * part], k.checked_sub(1))
    };
    tree(&(0..=10).map(row).collect::<Vec<_>>())
}

/// Positions in front of the wall by up to `depth_mm` and behind it by a fifth of that, all over a vessel.
fn places(field: &SweptField, depth_mm: f64, count: u64) -> impl Iterator<Item = Vec3> + '_ {
    (0..count).map(move |k| {
        let number = |n: u64| unit(splitmix64(11, 4 * k + n));
        let (branch, knot) = field.blocks.knot((number(0) * field.pieces() as f64) as u32);
        let place = field.axes[branch].at(field.axes[branch].step() * knot as f64);
        let u = any_perpendicular(&place.first.normalize());
        let v = place.first.normalize().cross(&u);
        let (sin, cos) = (TAU * number(1)).sin_cos();
        place.position + (u * cos + v * sin) * (place.radius[0] - depth_mm * (1.2 * number(2) - 0.2))
    })
}

fn closest<'a>(field: &'a SweptField, x: &Vec3) -> Closest<'a> {
    field.closest(x, From::Space(field.near(x).piece)).unwrap()
}

#[test]
fn derivatives_are_those_of_the_distance() {
    let h = 1e-4;
    for (vessel, depth_mm, has_joints) in [
        (vessel(cone(1.5)), 1.0, false),
        (named("curved_tube"), 1.0, false),
        (named("aortic_arch"), 1.0, true),
        (named("hepatic"), 0.5, true),
    ] {
        let field = vessel.field(2.0);
        let (mut asked, mut joints, mut bent) = (0, 0, 0);
        for x in places(&field, depth_mm, 2000) {
            let here = closest(&field, &x);
            if !(-0.2 * depth_mm..=depth_mm).contains(&here.distance_mm()) {
                continue;
            }
            asked += 1;
            joints += usize::from(here.is_in_joint());
            let (normal, hessian) = (here.normal(), here.hessian());
            for k in 0..3 {
                let [plus, minus] = [h, -h].map(|way| closest(&field, &(x + Vec3::ith(k, way))));
                let slope = (plus.distance_mm() - minus.distance_mm()) / (2.0 * h);
                let bend = (plus.normal() - minus.normal()) / (2.0 * h);
                // Where a joint begins or a radius changes its curvature the Hessian jumps, and differences cross the
                // jump.
                assert!((slope - normal[k]).abs() < 1e-4, "{x:?}: {slope} {}", normal[k]);
                bent += usize::from((bend - hessian.column(k)).norm() > 1e-3 * (1.0 + hessian.norm()));
            }
            assert!((hessian - hessian.transpose()).norm() < 1e-12);
        }
        assert!(asked > 1000 && (joints > 20) == has_joints, "{asked} {joints}");
        assert!(bent < asked / 50, "{bent} of {asked}");
    }
}

#[test]
fn the_distance_in_a_cone_is_exact() {
    let field = vessel(cone(1.5)).field(1.0);
    let (taper, mut plain) = (-1.5 / 40.0_f64, 0.0_f64);
    let cosine = 1.0 / (1.0 + taper * taper).sqrt();
    for k in 0..200 {
        let (z, depth) = (8.0 + 0.12 * f64::from(k), 0.8 * f64::from(k % 7) / 6.0 - 0.1);
        let radius = 3.0 + taper * z;
        let x = Vec3::new((radius - depth) * f64::from(k).cos(), (radius - depth) * f64::from(k).sin(), z);
        let found = closest(&field, &x);
        assert!((found.distance_mm() - depth * cosine).abs() < 1e-9, "{} {depth}", found.distance_mm());
        assert!((found.normal().z - taper * cosine).abs() < 1e-9);
        plain = plain.max((depth - depth * cosine).abs());
        // Along the generator a cone is straight, around it as curved as the circle across the wall.
        let hessian: Matrix3<f64> = found.hessian();
        let size = cosine / (radius - depth);
        assert!((hessian.trace() + size).abs() < 1e-6 * size, "{} {size}", hessian.trace());
    }
    // The error of the radial gap.
    assert!(plain > 4e-4, "{plain}");
}

#[test]
fn the_wall_is_that_which_is_meshed() {
    for name in ["curved_tube", "aortic_arch", "hepatic"] {
        let swept = named(name);
        let field = swept.field(1.0);
        let made = GeneratedWall::new(swept.tree(), anatomy::asset_resolution(name)).unwrap();
        let off = |x: &Vec3| closest(&field, x).distance_mm();
        let vertices = &made.wall.mesh().vertices_mm;
        let worst = vertices.iter().step_by(3).map(|x| off(x).abs()).fold(0.0, f64::max);
        assert!(worst < 2e-3, "{name}: {worst}");
        // A place in a triangle lies inside of the wall by its sag.
        let sag = (0..300).map(|t| off(&made.wall.mesh().middle(t)).abs());
        let sag_mm = sag.fold(0.0, f64::max);
        assert!(sag_mm > 4e-3, "{name}: {sag_mm}");
    }
}

#[test]
fn ways_leave_the_lumen_where_they_meet_the_mesh() {
    let swept = named("aortic_arch");
    let field = swept.field(1.0);
    let wall = GeneratedWall::new(swept.tree(), Resolution::EdgeMm(1.5)).unwrap().wall;
    let query = WallQuery::new(&wall).unwrap();
    let (mut left, mut stayed) = (0, 0);
    for (k, from) in places(&field, 6.0, 600).enumerate() {
        if !swept.contains(&from) || query.distance_mm(&from) < 1.0 {
            continue;
        }
        let number = |n: u64| unit(splitmix64(5, 4 * k as u64 + n)) - 0.5;
        let to = from + Vec3::new(number(0), number(1), number(2)) * 60.0;
        // Beyond an opening the field continues, and the mesh does not.
        let out = |x: &Vec3| swept.openings().iter().any(|o| o.beyond_and_off_axis_mm(x).0 > -1.0);
        match (field.crossing(&from, &to, 1.0), query.crossing(&from, &to, 1.0)) {
            (Some(one), Some(other)) => {
                left += 1;
                let apart_mm = (one - other).abs() * (to - from).norm();
                assert!(apart_mm < 1.0 || out(&(from + (to - from) * one)), "{apart_mm} at {from:?}");
            }
            (None, None) => stayed += 1,
            // A chord of the mesh is inside the wall, and some paths graze it.
            (one, other) => {
                let part = one.or(other).unwrap();
                let x = from + (to - from) * part;
                let off_mm = closest(&field, &x).distance_mm().abs();
                assert!(off_mm < 0.1 || out(&x) || out(&to), "{off_mm}: {from:?} {to:?}");
            }
        }
        let inside = from + (to - from) * 0.5;
        if query.distance_mm(&inside) > 0.1 && !out(&inside) {
            assert_eq!(swept.contains(&inside), wall.contains(&inside).unwrap(), "{inside:?}");
        }
    }
    assert!(left > 200 && stayed > 10, "{left} {stayed}");
}

#[test]
fn openings_are_where_and_what_those_of_the_mesh_are() {
    for name in ["straight_tube", "curved_tube", "aortic_arch", "hepatic", "sidewall_aneurysm"] {
        let swept = named(name);
        let lumen =
            Lumen::from(SweptVessel::new(swept.tree().clone(), anatomy::asset_resolution(name)).unwrap());
        let meshed = lumen.wall(&NoStore).unwrap().openings();
        assert_eq!(meshed.len(), swept.openings().len(), "{name}");
        for (one, other) in swept.openings().iter().zip(meshed) {
            assert_eq!(one.index, other.index);
            assert!((one.centre_mm - other.centre_mm).norm() < 0.1, "{name}: {one:?}");
            assert!(
                (one.radius_mm - other.radius_mm).abs() < 0.1 && one.direction.dot(&other.direction) > 0.999
            );
            assert!(
                (one.beyond_mm - other.beyond_mm).abs() < 1.0,
                "{name}: {} {}",
                one.beyond_mm,
                other.beyond_mm
            );
            // It continues straight, and its end is out of reach.
            let field = swept.field(1.0);
            let x = one.centre_mm + one.direction * (one.beyond_mm - 2.0);
            assert!(closest(&field, &x).distance_mm() > 0.9 * one.radius_mm.min(2.0 + one.radius_mm));
            assert!(!swept.contains(&x) && swept.contains(&(one.centre_mm - one.direction)));
        }
    }
}

#[test]
fn what_makes_no_vessel_is_refused() {
    let reported = |tree: CentrelineTree, edge_mm: f64| {
        SweptVessel::new(tree, Resolution::EdgeMm(edge_mm)).unwrap_err().to_string()
    };
    // A tube that intersects itself.
    let ring = |k: usize| {
        let (sin, cos) = (0.25 * k as f64).sin_cos();
        ([12.0 * cos, 12.0 * sin, 0.1 * k as f64, 2.0], k.checked_sub(1))
    };
    let ring = |count: usize| tree(&(0..count).map(ring).collect::<Vec<_>>());
    assert!(reported(ring(30), 1.0).contains("the wall cuts itself"));
    assert!(SweptVessel::new(ring(22), Resolution::EdgeMm(1.0)).is_ok());
    // A branch that ends in its parent.
    let stump = |x: f64| {
        let trunk = |k: usize| ([0.0, 0.0, 10.0 * k as f64, 5.0], k.checked_sub(1));
        let mut rows: Vec<_> = (0..5).map(trunk).collect();
        rows.push(([x, 0.0, 20.0, 2.0], Some(2)));
        tree(&rows)
    };
    assert!(reported(stump(4.0), 1.0).contains("lies in or touches another branch"));
    assert!(SweptVessel::new(stump(14.0), Resolution::EdgeMm(1.0)).is_ok());
    assert!(reported(cone(3.0), 4.0).contains("edge_mm = 4"));
}

#[test]
fn the_far_side_of_a_septum_is_another_wall() {
    // Two limbs of a radius of 1 mm, parallel between z = 20 and 44, with 1.5 mm between their walls.
    let limb = |sign: f64| {
        let place = |x: f64, z: f64| [x * sign, 0.0, z, 1.0];
        let along = (0..=12).map(|k| place(1.75, 20.0 + 2.0 * f64::from(k)));
        [place(0.9, 15.0)].into_iter().chain(along).chain([place(8.0, 56.0)]).collect::<Vec<_>>()
    };
    let mut rows = vec![([0.0, 0.0, 0.0, 1.0], None), ([0.0, 0.0, 10.0, 1.0], Some(0))];
    for sign in [-1.0, 1.0] {
        let first = rows.len();
        rows.extend(limb(sign).into_iter().enumerate().map(|(k, row)| {
            let parent = if k == 0 { 1 } else { first + k - 1 };
            (row, Some(parent))
        }));
    }
    let vessel = vessel(tree(&rows));
    let field = vessel.field(1.0);
    let piece = field.near(&Vec3::new(1.75, 0.0, 34.0)).piece;
    for k in 0..20 {
        let z = 34.0 + 0.1 * f64::from(k);
        // From the axis to 1 mm behind the limb's own wall, where that of the other limb is 0.5 mm away.
        for rho in [0.3, 0.7, 0.95, 1.3, 2.0] {
            let x = Vec3::new(1.75 - rho, 0.0, z);
            let own = field.closest(&x, From::Side(piece)).unwrap();
            assert!((own.distance_mm() - (1.0 - rho)).abs() < 2e-3, "{rho} {z}: {}", own.distance_mm());
            assert!((own.normal() - Vec3::x()).norm() < 5e-3, "{rho} {z}");
        }
    }
    // Through space the nearest wall is that of the other limb.
    let x = Vec3::new(1.75 - 2.0, 0.0, 34.0);
    let other = closest(&field, &x);
    assert!((other.distance_mm() + 0.5).abs() < 2e-3 && other.normal().x < -0.99, "{}", other.distance_mm());
}

#[test]
fn openings_have_the_numbers_that_they_have_in_an_exported_surface() {
    for name in ["straight_tube", "curved_tube", "basilar_aneurysm", "sidewall_aneurysm"] {
        let tree = anatomy::tree(name).unwrap();
        let vessel = Lumen::from(SweptVessel::new(tree, anatomy::asset_resolution(name)).unwrap());
        let mut exported = vessel.wall(&NoStore).unwrap().mesh().clone();
        // As an STL file has them, and moved by less than anyone would see.
        exported.vertices_mm.iter_mut().for_each(|x| *x = x.map(|c| f64::from((c + 1e-3) as f32)));
        let read = crate::vessel::Wall::from_surface(&exported).unwrap();
        assert_eq!(read.openings().len(), vessel.openings().len(), "{name}");
        for (one, other) in vessel.openings().iter().zip(read.openings()) {
            assert!((one.centre_mm - other.centre_mm).norm() < 0.1, "{name}: {one:?} {other:?}");
        }
    }
}

/// A single branch of these radii at these lengths, mm, straight or in an arc of this radius, from either end.
fn along(profile: &[(f64, f64)], bend_mm: Option<f64>, reversed: bool) -> CentrelineTree {
    let place = |z: f64| match bend_mm {
        None => [0.0, 0.0, z],
        Some(bend) => [bend * (1.0 - (z / bend).cos()), 0.0, bend * (z / bend).sin()],
    };
    let mut rows: Vec<[f64; 4]> = Vec::new();
    for &(z, radius) in profile {
        let [x, y, z] = place(z);
        rows.push([x, y, z, radius]);
    }
    if reversed {
        rows.reverse();
    }
    let linked = rows.into_iter().enumerate().map(|(k, row)| (row, k.checked_sub(1)));
    tree(&linked.collect::<Vec<_>>())
}

/// The distance of a place from the wall of a branch, mm, negative outside: the least over all circles that sweep it.
fn exact_mm(axis: &Axis, x: &Vec3) -> f64 {
    let [low, high] = axis.range();
    let from_circle = |s: f64| {
        let place = axis.at(s.clamp(low, high));
        let (offset, along) = (x - place.position, place.first.normalize());
        let ahead = offset.dot(&along);
        (ahead.hypot((offset - along * ahead).norm() - place.radius[0]), offset.norm(), place.radius[0])
    };
    let fine = axis.step() / 8.0;
    let samples = (0..=((high - low) / fine).ceil() as usize).map(|k| low + fine * k as f64);
    let (mut nearest, mut centre) = ((f64::INFINITY, 0.0), (f64::INFINITY, 0.0, 0.0));
    for s in samples {
        let (away, off, radius) = from_circle(s);
        if away < nearest.0 {
            nearest = (away, s);
        }
        if off < centre.0 {
            centre = (off, s, radius);
        }
    }
    let (mut a, mut b) = (nearest.1 - fine, nearest.1 + fine);
    for _ in 0..60 {
        let (c, d) = (a + (b - a) / 3.0, b - (b - a) / 3.0);
        if from_circle(c).0 < from_circle(d).0 { b = d } else { a = c }
    }
    let least = from_circle(0.5 * (a + b)).0;
    let (mut a, mut b) = (centre.1 - fine, centre.1 + fine);
    for _ in 0..60 {
        let (c, d) = (a + (b - a) / 3.0, b - (b - a) / 3.0);
        if from_circle(c).1 < from_circle(d).1 { b = d } else { a = c }
    }
    let (_, off, radius) = from_circle(0.5 * (a + b));
    if off < radius { least } else { -least }
}

/// Random radii, each at most this much wider or narrower than the last per length.
fn random_profile(seed: u64, steepest: f64) -> Vec<(f64, f64)> {
    let number = |k: u64| unit(splitmix64(seed, k));
    let mut profile = vec![(0.0, 3.0)];
    for k in 0..8 {
        let (z, radius) = profile[profile.len() - 1];
        let length = 3.0 + 5.0 * number(2 * k);
        let change = steepest * length * (2.0 * number(2 * k + 1) - 1.0);
        profile.push((z + length, (radius + change).clamp(1.2, 8.0)));
    }
    profile
}

#[test]
fn no_stretch_of_a_widening_or_narrowing_wall_is_missed() {
    let mut profiles = vec![
        vec![(0.0, 4.0), (10.0, 4.0), (20.0, 7.0), (30.0, 10.0), (50.0, 10.0)],
        vec![(0.0, 2.0), (10.0, 2.0), (20.0, 5.0), (30.0, 8.0), (50.0, 8.0)],
        vec![(0.0, 1.5), (6.0, 1.5), (12.0, 3.25), (18.0, 5.0), (24.0, 5.0), (42.0, 5.0)],
        vec![
            (0.0, 1.5),
            (5.0, 1.5),
            (8.0, 3.0),
            (11.0, 5.0),
            (15.0, 5.0),
            (19.0, 3.5),
            (23.0, 1.5),
            (28.0, 1.5),
        ],
        vec![(0.0, 3.0), (12.0, 3.0), (18.0, 1.2), (24.0, 3.0), (40.0, 3.0)],
        vec![(0.0, 3.0), (12.0, 3.0), (18.0, 1.2)],
        vec![(0.0, 3.0), (12.0, 3.0), (15.0, 6.0)],
    ];
    profiles.extend((0..12).map(|seed| random_profile(seed, 0.15 * (1 + seed % 4) as f64)));
    let (mut asked, mut faults) = (0, Vec::new());
    for (number, profile) in profiles.iter().enumerate() {
        for (bend_mm, reversed) in [(None, false), (None, true), (Some(30.0), false), (Some(30.0), true)] {
            let Ok(vessel) = SweptVessel::new(along(profile, bend_mm, reversed), Resolution::EdgeMm(0.8))
            else {
                assert!(number >= 7, "profile {number}");
                continue;
            };
            let field = vessel.field(1.6);
            let axis = &field.axes[0];
            for (k, x) in places(&field, 1.0, 300).enumerate() {
                let exact_mm = exact_mm(axis, &x);
                let near = field.near(&x);
                asked += 1;
                let found = closest(&field, &x).distance_mm();
                let is_in = vessel.field.contains(&x);
                if near.clearance_mm > exact_mm + 1e-6
                    || is_in != (exact_mm > 0.0) && exact_mm.abs() > 1e-6
                    || (found - exact_mm).abs() > 1e-4 && exact_mm < 0.8
                {
                    faults.push(format!(
                        "profile {number} {bend_mm:?} {reversed} {k}: {exact_mm:.5}, at least {:.5}, found {found:.5}, {is_in}, at {:.3} of {}",
                        near.clearance_mm,
                        axis.step() * axis.follow(&x, near.piece as usize) as f64,
                        axis.length()
                    ));
                }
            }
        }
    }
    assert!(faults.is_empty(), "{} of {asked}:\n{}", faults.len(), faults.join("\n"));
}
