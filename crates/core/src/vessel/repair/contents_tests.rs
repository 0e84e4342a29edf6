//! What lies in a lumen is a wall, of whatever size and shape; what lies outside is dropped by name.

use super::shapes::{add, ball, disc, tube, turned_over};
use crate::Vec3;
use crate::device::Device;
use crate::insertion::{Command, Sheath, Simulation};
use crate::vessel::{Repair, RepairKind, RepairMode, RepairOptions, SurfaceMesh, Wall, WallQuery};

/// A tube of radius 10 mm from z = 0 to 100 mm.
fn vessel() -> SurfaceMesh {
    tube(Vec3::zeros(), Vec3::z() * 100.0, 10.0, (32, 40))
}

fn with(content: &SurfaceMesh) -> SurfaceMesh {
    let mut mesh = vessel();
    add(&mut mesh, content);
    mesh
}

/// The only repair of this kind.
fn only(wall: &Wall, kind: RepairKind) -> Repair {
    let those: Vec<&Repair> = wall.report().repairs.iter().filter(|repair| repair.kind == kind).collect();
    assert_eq!(those.len(), 1, "{:?}", wall.report().repairs);
    *those[0]
}

#[test]
fn closed_bodies_are_walls_whatever_their_size() {
    let empty = Wall::from_surface(&vessel()).unwrap().volume_mm3();
    let at = Vec3::new(2.0, -1.0, 40.0);
    let mut plug = tube(Vec3::z() * 20.0, Vec3::z() * 85.0, 8.0, (24, 30));
    for end in Wall::welded(&plug).unwrap().openings() {
        end.close(&mut plug);
    }
    let mut cube = SurfaceMesh::cuboid(Vec3::new(-9.0, -1.0, 30.0), Vec3::new(-6.0, 2.0, 33.0), 10.0);
    cube = Wall::welded(&cube).unwrap().mesh().clone();
    for (body, inside, size_mm) in [
        (ball(at, 3.0, 12), at, 6.0),
        (ball(at, 0.2, 8), at, 0.4),
        (turned_over(ball(at, 5.0, 16)), at, 10.0),
        (plug, Vec3::z() * 50.0, 65.0),
        (cube, Vec3::new(-7.5, 0.5, 31.5), 3.0),
    ] {
        let wall = Wall::from_surface(&with(&body)).unwrap();
        let report = wall.report();
        assert_eq!((report.bodies_in_lumen, report.pieces_dropped, report.skins_dropped), (1, 0, 0));
        let taken = body.signed_volume_mm3().abs();
        assert!(
            (wall.volume_mm3() - (empty - taken)).abs() < 1e-9 * empty,
            "{} {empty} {taken}",
            wall.volume_mm3()
        );
        assert!(!wall.contains(&inside).unwrap());
        assert!(WallQuery::new(&wall).unwrap().nearest(&inside, f64::MAX).unwrap().distance_mm < 0.0);
        let repair = only(&wall, RepairKind::BodyInLumen);
        let longest = repair.size_mm.into_iter().fold(0.0, f64::max);
        assert!((longest / size_mm - 1.0).abs() < 0.05, "{longest} {size_mm}");
        let told = report.repair_notes();
        assert!(
            told.len() == 1 && told[0].starts_with("1 closed bodies in the lumen taken as walls: "),
            "{told:?}"
        );
        // Meshed evenly, it is still there.
        assert!(!Wall::welded(wall.mesh()).unwrap().contains(&inside).unwrap());
        let kept =
            Wall::repaired(&with(&body), &RepairOptions { mode: RepairMode::None, ..Default::default() });
        assert!(!kept.unwrap().contains(&inside).unwrap());
    }
}

#[test]
fn sheets_are_walls_with_two_sides() {
    let middle = Vec3::z() * 50.0;
    let mut flap = disc(middle, Vec3::z(), 9.0, (0.0, 24));
    flap.triangles.truncate(flap.triangles.len() / 2);
    let corner = |x: f64, y: f64| middle + Vec3::new(x, y, 0.0);
    let square = SurfaceMesh {
        vertices_mm: vec![corner(-5.0, -5.0), corner(5.0, -5.0), corner(5.0, 5.0), corner(-5.0, 5.0)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    for (name, sheet, on_it) in [
        ("membrane", disc(middle, Vec3::z(), 9.5, (0.0, 24)), Vec3::x() * 4.0),
        ("ring", disc(middle, Vec3::z(), 9.0, (4.0, 32)), Vec3::x() * 6.5),
        ("flap", flap, Vec3::y() * 4.0),
        ("square", square, Vec3::y() * 2.0),
        ("stent", tube(middle - Vec3::z() * 6.0, middle + Vec3::z() * 6.0, 7.0, (24, 6)), Vec3::x() * 7.0),
    ] {
        let wall = Wall::from_surface(&with(&sheet)).unwrap();
        let report = wall.report();
        assert_eq!((report.sheets_in_lumen, report.pieces_dropped), (1, 0), "{name}: {report:?}");
        only(&wall, RepairKind::SheetInLumen);
        assert_eq!(wall.openings().len(), 2, "{name}");
        let across = if name == "stent" { Vec3::x() } else { Vec3::z() };
        let query = WallQuery::new(&wall).unwrap();
        for side in [-1.0, 1.0] {
            let near = query.nearest(&(middle + on_it + across * side), f64::MAX).unwrap();
            assert!(near.distance_mm > 0.0 && near.distance_mm < 1.0, "{name}: {near:?}");
            assert!(near.normal.dot(&across) * side > 0.9, "{name}: {near:?}");
        }
        let refused =
            Wall::repaired(&with(&sheet), &RepairOptions { mode: RepairMode::None, ..Default::default() });
        let refused = refused.unwrap_err().to_string();
        assert!(refused.contains("1 sheets in the lumen, which have no inside: "), "{name}: {refused}");
    }
}

#[test]
fn a_wire_stops_at_a_membrane_and_passes_a_ring() {
    // How far the tip comes along z when 44 mm are pushed in.
    let reached = |content: &SurfaceMesh| {
        let mut mesh = tube(Vec3::zeros(), Vec3::z() * 80.0, 4.0, (16, 36));
        add(&mut mesh, content);
        let wall = Wall::from_surface(&mesh).unwrap();
        let inlet = wall.openings().iter().find(|opening| opening.direction.z < 0.0).unwrap().index;
        let sheath = Sheath::at_opening(&wall, inlet, 1.0).unwrap();
        let wire = Device::uniform(200.0, 0.45, 10.0).unwrap();
        let mut simulation = Simulation::builder(wall, wire, sheath).build().unwrap();
        for _ in 0..11 {
            // Nothing passes: the step says so, and the device stays where it was.
            if let Err(error) = simulation.step(Command::advance(4.0)) {
                assert!(error.to_string().contains("blocked"), "{error}");
                break;
            }
        }
        simulation.tip_of_mm(0).unwrap().z
    };
    let at = Vec3::z() * 40.0;
    let stopped = reached(&disc(at, Vec3::z(), 3.8, (0.0, 24)));
    assert!((36.0..40.3).contains(&stopped), "{stopped}");
    let passed = reached(&disc(at, Vec3::z(), 3.7, (2.0, 24)));
    assert!(passed > 43.0, "{passed}");
}

#[test]
fn what_lies_outside_is_dropped_by_name() {
    let outside = Vec3::new(30.0, 0.0, 50.0);
    let wall = Wall::from_surface(&with(&ball(outside, 1.0, 10))).unwrap();
    let report = wall.report();
    assert_eq!((report.bodies_in_lumen, report.pieces_dropped), (0, 1));
    let dropped = only(&wall, RepairKind::PieceDropped);
    assert!((Vec3::from(dropped.at_mm) - outside).norm() < 1e-9);
    assert_eq!(
        report.repair_notes(),
        ["1 pieces that are small, flat or on the wall dropped: 2 × 2 × 2 mm at [30.00, 0.00, 50.00]"]
    );
    // A hole is named by the size of its rim and by its place, and stays open where it is meant.
    let mut holed = vessel();
    let hole = Vec3::new(10.0, 0.0, 50.0);
    let gone: Vec<bool> = (0..holed.triangles.len()).map(|t| (holed.middle(t) - hole).norm() < 3.0).collect();
    let mut kept = gone.iter();
    holed.triangles.retain(|_| !kept.next().unwrap());
    let closed = Wall::from_surface(&holed).unwrap();
    assert_eq!((closed.report().holes_filled, closed.openings().len()), (1, 2));
    assert!((Vec3::from(only(&closed, RepairKind::HoleClosed).at_mm) - hole).norm() < 2.0);
    let meant = RepairOptions { keep_open_mm: vec![hole], ..Default::default() };
    let open = Wall::repaired(&holed, &meant).unwrap();
    assert_eq!((open.report().holes_filled, open.openings().len()), (0, 3));
    only(&open, RepairKind::HoleKept);
    let elsewhere = RepairOptions { keep_open_mm: vec![Vec3::new(-10.0, 0.0, 50.0)], ..Default::default() };
    let refused = Wall::repaired(&holed, &elsewhere).unwrap_err().to_string();
    assert!(refused.starts_with("keep_open_mm = [-10, 0, 50]: no hole is there: the nearest"), "{refused}");
}
