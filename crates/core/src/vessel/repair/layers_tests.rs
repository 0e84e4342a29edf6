//! The same wall twice is one wall; what lies at a distance from the wall is a wall of its own.

use super::shapes::{add, tube};
use crate::Vec3;
use crate::vessel::{RepairKind, SurfaceMesh, Wall, check};

const RADIUS_MM: f64 = 5.0;

fn along(from_mm: f64, to_mm: f64, radius_mm: f64, facets: (usize, usize)) -> SurfaceMesh {
    tube(Vec3::z() * from_mm, Vec3::z() * to_mm, radius_mm, facets)
}

fn vessel() -> SurfaceMesh {
    along(0.0, 80.0, RADIUS_MM, (32, 40))
}

fn with(layer: &SurfaceMesh) -> SurfaceMesh {
    let mut mesh = vessel();
    add(&mut mesh, layer);
    mesh
}

#[test]
fn a_part_of_the_wall_that_is_there_twice_is_dropped() {
    let clean = Wall::from_surface(&vessel()).unwrap();
    for off_mm in [0.0, 0.01, -0.01, 0.05, -0.05, 0.1, -0.1, 0.2] {
        for around in [32, 45] {
            let layer = along(21.0, 41.0, RADIUS_MM - off_mm, (around, 9));
            let wall = Wall::from_surface(&with(&layer)).unwrap();
            let report = wall.report();
            assert_eq!((report.components, wall.openings().len()), (1, 2), "{off_mm}: {:?}", report.notes());
            assert_eq!(wall.volume_mm3(), clean.volume_mm3(), "{off_mm}: {:?}", report.notes());
            assert!(report.repairs.iter().any(|repair| repair.kind == RepairKind::PieceDropped));
        }
    }
}

#[test]
fn of_two_copies_of_a_wall_one_is_left() {
    for off_mm in [0.0, 0.01, 0.05, 0.1, 0.2] {
        for (around, end_mm) in [(45, 80.0), (32, 79.9)] {
            let inner = along(0.0, end_mm, RADIUS_MM - off_mm, (around, 37));
            let mesh = with(&inner);
            let wall = Wall::from_surface(&mesh).unwrap();
            let report = wall.report();
            assert_eq!((report.components, wall.openings().len()), (1, 2), "{off_mm}: {:?}", report.notes());
            let inner_mm3 = Wall::from_surface(&inner).unwrap().volume_mm3();
            assert!((wall.volume_mm3() / inner_mm3 - 1.0).abs() < 0.01, "{off_mm}: {:?}", report.notes());
            assert!(!check(&mesh).unwrap().is_sound());
        }
    }
    // Two vessels side by side are no copies.
    let mut two = vessel();
    add(&mut two, &tube(Vec3::x() * 20.0, Vec3::new(20.0, 0.0, 80.0), RADIUS_MM, (32, 40)));
    assert_eq!(Wall::from_surface(&two).unwrap().report().components, 2);
}

#[test]
fn stents_and_liners_beside_the_wall_are_walls() {
    for off_mm in [0.3, 0.5, 0.7, 1.0] {
        for (from_mm, to_mm, around) in [(20.0, 40.0, 32), (20.0, 40.0, 48), (0.0, 40.0, 32)] {
            let layer = along(from_mm, to_mm, RADIUS_MM - off_mm, (around, 10));
            let wall = Wall::from_surface(&with(&layer)).unwrap();
            let (report, case) = (wall.report(), (off_mm, from_mm, around));
            assert_eq!(
                (report.sheets_in_lumen, report.pieces_dropped),
                (1, 0),
                "{case:?}: {:?}",
                report.notes()
            );
            assert_eq!((report.edges_sewn, report.cracks_closed), (0, 0), "{case:?}: {:?}", report.notes());
            let at = |radius_mm: f64| Vec3::new(radius_mm, 0.0, 30.0);
            assert!(!wall.contains(&at(RADIUS_MM - off_mm - 0.1)).unwrap(), "{case:?}");
            assert!(wall.contains(&at(RADIUS_MM - off_mm - 0.4)).unwrap(), "{case:?}");
            assert_eq!(wall.openings().len(), 2, "{case:?}: {:?}", wall.openings());
        }
    }
}

/// Its rim is nearer to that of the vessel than 0.15 of an edge, as the sides of a seam are.
#[test]
fn a_liner_that_begins_at_an_opening_is_not_sewn_to_it() {
    let mut mesh = along(0.0, 80.0, 20.0, (32, 20));
    add(&mut mesh, &along(0.0, 40.0, 19.6, (32, 10)));
    let wall = Wall::from_surface(&mesh).unwrap();
    let report = wall.report();
    assert_eq!(
        (report.sheets_in_lumen, report.edges_sewn, report.cracks_closed),
        (1, 0, 0),
        "{:?}",
        report.notes()
    );
    assert_eq!(wall.openings().len(), 2, "{:?}", wall.openings());
}
