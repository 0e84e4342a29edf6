//! Parts that were put together without a union are united, bodies in the wall are taken off, and what only lies beside a
//! vessel is not joined to it.

use std::f64::consts::PI;

use super::shapes::{add, ball, disc, tube, turned_over};
use crate::Vec3;
use crate::vessel::{
    ExtractedCentreline, RepairKind, RepairMode, RepairOptions, Sac, SurfaceMesh, Wall, check,
};

/// A trunk of radius 5 mm from z = 0 to 80 mm, with these parts.
fn trunk_with(parts: &[SurfaceMesh]) -> SurfaceMesh {
    let mut mesh = tube(Vec3::zeros(), Vec3::z() * 80.0, 5.0, (32, 36));
    parts.iter().for_each(|part| add(&mut mesh, part));
    mesh
}

fn branch(from: [f64; 3], to: [f64; 3], radius_mm: f64) -> SurfaceMesh {
    tube(Vec3::from(from), Vec3::from(to), radius_mm, (24, 25))
}

#[test]
fn branches_are_united_with_their_trunk() {
    for (parts, openings) in [
        (vec![branch([0.0, 0.0, 40.0], [40.0, 0.0, 40.0], 2.5)], 3),
        (vec![branch([0.0, 0.0, 35.0], [30.0, 0.0, 65.0], 2.5)], 3),
        (vec![branch([0.0, 0.0, 40.0], [40.0, 0.0, 40.0], 1.0)], 3),
        (
            vec![
                branch([0.0, 0.0, 30.0], [40.0, 0.0, 30.0], 2.0),
                branch([0.0, 0.0, 50.0], [-40.0, 0.0, 50.0], 2.0),
            ],
            4,
        ),
        // Right through, and one that begins within the first.
        (vec![branch([-40.0, 1.0, 40.0], [40.0, 1.0, 40.0], 2.0)], 4),
        (
            vec![
                branch([0.0, 0.0, 40.0], [40.0, 0.0, 40.0], 2.5),
                branch([20.0, 0.0, 40.0], [30.0, 25.0, 40.0], 1.5),
            ],
            4,
        ),
    ] {
        let mesh = trunk_with(&parts);
        let wall = Wall::from_surface(&mesh).unwrap();
        let report = wall.report();
        assert_eq!((report.parts_united, report.components), (parts.len(), 1), "{:?}", report.notes());
        assert_eq!(wall.openings().len(), openings, "{:?}", wall.openings());
        let checked = check(wall.mesh()).unwrap();
        assert!(checked.is_sound(), "{:?}", checked.faults());
        assert!(!check(&mesh).unwrap().is_sound());
        let named = report.repairs.iter().filter(|repair| repair.kind == RepairKind::PartUnited).count();
        assert_eq!(named, parts.len());
        let line = ExtractedCentreline::of(&wall, None, &[]).unwrap();
        assert!(line.unreached.is_empty(), "{:?}", line.unreached);
        // All radii of the rims are as drawn.
        let widest = wall.openings()[0].radius_mm;
        assert!((widest - 5.0).abs() < 1e-9, "{widest}");
        let apart = Wall::repaired(&mesh, &RepairOptions { mode: RepairMode::None, ..Default::default() });
        assert_eq!(apart.unwrap().report().components, parts.len() + 1);
    }
}

#[test]
fn a_vessel_pushed_into_another_is_one() {
    let mut mesh = tube(Vec3::zeros(), Vec3::z() * 45.0, 4.0, (32, 20));
    add(&mut mesh, &tube(Vec3::z() * 35.0, Vec3::z() * 80.0, 3.9, (32, 20)));
    let wall = Wall::from_surface(&mesh).unwrap();
    assert_eq!((wall.report().parts_united, wall.openings().len()), (1, 2), "{:?}", wall.report().notes());
    let (wide, narrow) = (PI * 16.0 * 45.0, PI * 3.9 * 3.9 * 35.0);
    assert!((wall.volume_mm3() / (wide + narrow) - 1.0).abs() < 0.01, "{}", wall.volume_mm3());
    assert!(check(wall.mesh()).unwrap().is_sound());
}

#[test]
fn a_sac_that_overlaps_its_artery_is_joined_and_one_apart_is_none() {
    let artery = || tube(Vec3::z() * -20.0, Vec3::z() * 20.0, 2.0, (24, 40));
    for (off_mm, is_joined) in [(4.5, true), (4.0, true), (7.0, false)] {
        let mut mesh = artery();
        add(&mut mesh, &ball(Vec3::y() * off_mm, 3.0, 16));
        let wall = Wall::from_surface(&mesh).unwrap();
        assert_eq!(wall.report().parts_united, usize::from(is_joined));
        let checked = check(&mesh).unwrap();
        assert_eq!(checked.separate_pieces, usize::from(!is_joined), "{:?}", checked.faults());
        let sac = Sac::measure(&wall, Vec3::y() * off_mm, Vec3::zeros());
        if is_joined {
            let sac = sac.unwrap();
            assert!((0.8..4.6).contains(&sac.neck_diameter_mm), "{sac:?}");
            assert!(sac.volume_mm3 < 4.0 / 3.0 * PI * 27.0);
        } else {
            let refused = sac.unwrap_err().to_string();
            assert!(refused.contains("is not joined to the artery"), "{refused}");
            let told = wall.report().repair_notes();
            assert!(
                told.len() == 1 && told[0].starts_with("1 closed pieces that are not joined"),
                "{told:?}"
            );
        }
    }
}

#[test]
fn a_body_in_the_wall_is_taken_off() {
    for (off_mm, radius_mm) in [(4.0, 2.0), (3.5, 1.0), (4.6, 1.0)] {
        let body = ball(Vec3::new(off_mm, 0.0, 40.0), radius_mm, 12);
        let empty = Wall::from_surface(&trunk_with(&[])).unwrap().volume_mm3();
        let wall = Wall::from_surface(&trunk_with(std::slice::from_ref(&body))).unwrap();
        let told = wall.report().notes();
        let is_within = off_mm + radius_mm < 4.9;
        assert_eq!(wall.report().bodies_in_wall, usize::from(!is_within), "{told:?}");
        assert_eq!(wall.report().pieces_dropped, 0, "{told:?}");
        assert!(
            wall.volume_mm3() < empty && wall.volume_mm3() > empty - body.signed_volume_mm3() - 1e-9,
            "{told:?}"
        );
        assert_eq!(wall.openings().len(), 2, "{told:?}");
    }
}

/// Rings that pierce the wall all round are no parts of the lumen, however much of them is outside.
#[test]
fn rings_in_the_wall_are_taken_off() {
    let ring = |around_mm: f64, radius_mm: f64| {
        let (around, across) = (32, 12);
        let at = |i: usize, j: usize| {
            let [a, b] =
                [(i, around), (j, across)].map(|(k, of)| std::f64::consts::TAU * k as f64 / of as f64);
            let out = around_mm + radius_mm * b.cos();
            Vec3::new(out * a.cos(), out * a.sin(), 40.0 + radius_mm * b.sin())
        };
        let vertices_mm = (0..around).flat_map(|i| (0..across).map(move |j| at(i, j))).collect();
        let number = |i: usize, j: usize| (across * (i % around) + j % across) as u32;
        let square = |i: usize, j: usize| {
            let [a, b, c, d] = [number(i, j), number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)];
            [[a, b, c], [a, c, d]]
        };
        let triangles = (0..around).flat_map(|i| (0..across).flat_map(move |j| square(i, j))).collect();
        SurfaceMesh { vertices_mm, triangles }
    };
    let empty = Wall::from_surface(&trunk_with(&[])).unwrap().volume_mm3();
    for (around_mm, radius_mm) in [(4.6, 0.6), (4.9, 0.6), (5.1, 0.8), (5.0, 2.0), (5.5, 1.5)] {
        let wall = Wall::from_surface(&trunk_with(&[ring(around_mm, radius_mm)])).unwrap();
        let report = wall.report();
        assert_eq!((report.bodies_in_wall, report.parts_united), (1, 0), "{around_mm}: {:?}", report.notes());
        assert_eq!(report.pieces_dropped, 0, "{around_mm}: {:?}", report.notes());
        assert!(wall.volume_mm3() < 0.998 * empty, "{around_mm}");
        assert!(!wall.contains(&Vec3::new(around_mm.min(4.9), 0.0, 40.0)).unwrap(), "{around_mm}");
        assert!(wall.contains(&(Vec3::z() * 40.0)).unwrap(), "{around_mm}");
    }
}

#[test]
fn vessels_that_graze_each_other_stay_two() {
    let mesh = trunk_with(&[branch([-40.0, 6.8, 40.0], [40.0, 6.8, 40.0], 2.0)]);
    let wall = Wall::from_surface(&mesh).unwrap();
    assert_eq!((wall.report().parts_united, wall.report().components), (0, 2), "{:?}", wall.report().notes());
    assert!(!check(&mesh).unwrap().is_sound());
}

/// Side by side, crossing by less than a facet, or touching along a line.
#[test]
fn walls_that_graze_are_moved_apart_or_named() {
    let trunk_mm3 = Wall::from_surface(&trunk_with(&[])).unwrap().volume_mm3();
    for deep_mm in [0.0, 0.005, 0.05, 0.1, 0.3] {
        for beside in [
            branch([-40.0, 7.0 - deep_mm, 40.0], [40.0, 7.0 - deep_mm, 40.0], 2.0),
            tube(Vec3::x() * (8.0 - deep_mm), Vec3::new(8.0 - deep_mm, 0.0, 80.0), 3.0, (24, 36)),
        ] {
            let beside_mm3 = Wall::from_surface(&beside).unwrap().volume_mm3();
            let mesh = trunk_with(std::slice::from_ref(&beside));
            let wall = Wall::from_surface(&mesh).unwrap();
            let report = wall.report();
            assert_eq!((report.components, wall.openings().len()), (2, 4), "{deep_mm}: {:?}", report.notes());
            let share = wall.volume_mm3() / (trunk_mm3 + beside_mm3);
            assert!((0.97..1.0 + 1e-9).contains(&share), "{deep_mm}: {share}");
            let checked = check(&mesh).unwrap();
            assert_eq!(
                report.intersections_left > 0,
                !checked.needs_you().is_empty(),
                "{:?}",
                checked.needs_you()
            );
            // What only touches is cut apart there.
            let kinds = [RepairKind::MovedApart, RepairKind::StillCrossing, RepairKind::EdgeCut];
            let named = report.repairs.iter().any(|repair| kinds.contains(&repair.kind));
            assert_eq!(
                named,
                checked.self_intersections + checked.non_manifold_edges > 0,
                "{deep_mm}: {:?}",
                report.notes()
            );
        }
    }
}

/// A mouth of which a part lies in the trunk is drawn out until it ends in it.
#[test]
fn branches_that_are_a_little_short_are_joined() {
    for (from, to) in [
        ([4.9, 0.0, 40.0], [40.0, 0.0, 40.0]),
        ([4.6, 0.0, 40.0], [40.0, 0.0, 40.0]),
        ([4.0, 0.0, 40.0], [30.0, 0.0, 66.0]),
        ([4.7, 0.0, 40.0], [20.0, 3.0, 66.0]),
    ] {
        let mesh = trunk_with(&[branch(from, to, 2.0)]);
        let wall = Wall::from_surface(&mesh).unwrap();
        let report = wall.report();
        let counts = (report.parts_united, report.components, wall.openings().len());
        assert_eq!(counts, (1, 1, 3), "{from:?}: {:?}", report.notes());
        let checked = check(wall.mesh()).unwrap();
        assert!(checked.is_sound(), "{from:?}: {:?}", checked.faults());
        let line = ExtractedCentreline::of(&wall, None, &[]).unwrap();
        assert!(line.unreached.is_empty(), "{from:?}: {:?}", line.unreached);
    }
}

#[test]
fn a_vessel_through_another_one_is_named() {
    let graft = branch([0.5, 0.0, -30.0], [0.5, 0.0, 110.0], 2.0);
    let mesh = trunk_with(&[graft]);
    let checked = check(&mesh).unwrap();
    assert_eq!((checked.nested_pieces, checked.is_sound()), (1, false), "{:?}", checked.faults());
    let told = checked.repair.repair_notes();
    assert!(told.iter().any(|line| line.contains("inside another one")), "{told:?}");
    assert_eq!(told, checked.needs_you());
}

/// A plug or a membrane is drawn somewhat wider than its vessel.
#[test]
fn what_fills_a_vessel_and_sticks_out_through_its_wall_closes_it() {
    let middle = Vec3::z() * 40.0;
    let plug = |radius_mm: f64, axis: Vec3| {
        let mut plug = tube(middle - axis * 8.0, middle + axis * 8.0, radius_mm, (24, 8));
        for end in Wall::welded(&plug).unwrap().openings() {
            end.close(&mut plug);
        }
        plug
    };
    let tilted = Vec3::new(0.3, 0.1, 1.0).normalize();
    for (content, counts) in [
        (plug(5.3, Vec3::z()), (0, 1)),
        (plug(6.0, Vec3::z()), (0, 1)),
        (turned_over(plug(5.6, tilted)), (0, 1)),
        (disc(middle, Vec3::z(), 5.3, (0.0, 24)), (1, 1)),
        (disc(middle, tilted, 6.0, (0.0, 24)), (1, 1)),
    ] {
        let wall = Wall::from_surface(&trunk_with(&[content])).unwrap();
        let report = wall.report();
        assert_eq!((report.sheets_in_lumen, report.bodies_in_wall), counts, "{:?}", report.notes());
        assert_eq!((report.parts_united, report.pieces_dropped), (0, 0), "{:?}", report.notes());
        assert!(!wall.contains(&middle).unwrap());
        for side in [-1.0, 1.0] {
            assert!(wall.contains(&(middle + Vec3::z() * side * 20.0)).unwrap());
        }
        assert_eq!((wall.openings().len(), report.components), (2, 2), "{:?}", report.notes());
    }
    // A patch on the wall is none of these.
    let patch = disc(Vec3::new(4.9, 0.0, 40.0), Vec3::x(), 0.8, (0.0, 12));
    let report = Wall::from_surface(&trunk_with(&[patch])).unwrap().report().clone();
    assert_eq!((report.bodies_in_wall, report.sheets_in_lumen), (0, 0), "{:?}", report.notes());
}
