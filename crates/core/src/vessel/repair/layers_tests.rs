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
        // The last begins at the opening of a vessel of coarse facets, of which 0.15 are wider than the gap.
        for (from_mm, to_mm, around, vessel) in [
            (20.0, 40.0, 32, vessel()),
            (20.0, 40.0, 48, vessel()),
            (0.0, 40.0, 32, vessel()),
            (0.0, 40.0, 12, along(0.0, 80.0, RADIUS_MM, (12, 20))),
        ] {
            let mut mesh = vessel.clone();
            add(&mut mesh, &along(from_mm, to_mm, RADIUS_MM - off_mm, (around, 10)));
            let wall = Wall::from_surface(&mesh).unwrap();
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
