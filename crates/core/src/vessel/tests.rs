//! Walls, queries and checks on surfaces with known faults, and on a real one.

use std::path::PathBuf;

use proptest::prelude::*;

use super::*;
use crate::{Error, Vec3};

/// A tube of radius 4 along +y from 0 to 100, open at both ends.
fn tube() -> Wall {
    tube_of(100.0)
}

fn tube_of(length_mm: f64) -> Wall {
    let node =
        |y: f64, parent| CentrelineNode { position_mm: Vec3::new(0.0, y, 0.0), radius_mm: 4.0, parent };
    let nodes = vec![node(0.0, None), node(0.5 * length_mm, Some(0)), node(length_mm, Some(1))];
    let tree = CentrelineTree::new(nodes).unwrap();
    GeneratedWall::new(&tree, Resolution::EdgeMm(2.0)).unwrap().wall
}

/// Every triangle with its own vertices, as in an STL file.
fn soup(mesh: &SurfaceMesh) -> SurfaceMesh {
    let vertices_mm: Vec<Vec3> = (0..mesh.triangles.len()).flat_map(|i| mesh.corners(i)).collect();
    SurfaceMesh {
        triangles: (0..vertices_mm.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        vertices_mm,
    }
}

fn flip_some(mesh: &mut SurfaceMesh, which: impl Fn(usize) -> bool) -> usize {
    let chosen: Vec<usize> = (0..mesh.triangles.len()).filter(|&i| which(i)).collect();
    chosen.iter().for_each(|&i| mesh.triangles[i].swap(1, 2));
    chosen.len()
}

#[test]
fn a_clean_wall_is_left_as_it_is() {
    let wall = tube();
    let again = Wall::from_surface(wall.mesh()).unwrap();
    assert_eq!(again.mesh(), wall.mesh());
    assert!(again.report().notes().is_empty(), "{:?}", again.report().notes());
    let [first, second] = again.openings() else { panic!("two openings") };
    assert!((first.radius_mm - 4.0).abs() < 1e-12 && (second.radius_mm - 4.0).abs() < 1e-12);
    assert!((first.direction + second.direction).norm() < 1e-12);
    assert!((first.centre_mm - Vec3::zeros()).norm() < 1e-9 && (first.direction + Vec3::y()).norm() < 1e-12);
}

#[test]
fn a_straight_way_is_stopped_by_the_wall_it_crosses_alone() {
    let query = WallQuery::new(&tube()).unwrap();
    let at = |x: f64, y: f64| Vec3::new(x, y, 0.0);
    let met = query.crossing(&at(0.0, 50.0), &at(8.0, 51.0), 1.0).unwrap();
    assert!((met - 0.5).abs() < 0.02, "{met}");
    assert_eq!(query.crossing(&at(0.0, 50.0), &at(3.0, 90.0), 1.0), None);
    // Beyond the end of the path, if requested.
    assert_eq!(query.crossing(&at(0.0, 50.0), &at(3.0, 50.0), 1.0), None);
    assert!((query.crossing(&at(0.0, 50.0), &at(3.0, 50.0), 2.0).unwrap() - 4.0 / 3.0).abs() < 0.05);
    assert_eq!(query.crossing(&at(0.0, 50.0), &Vec3::repeat(f64::NAN), 1.0), None);
}

#[test]
fn one_question_is_answered_as_many_are() {
    let query = WallQuery::new(&tube()).unwrap();
    for k in 0..200 {
        let turn = 2.4 * f64::from(k);
        let x = Vec3::new(6.0 * turn.cos() * (0.7 * turn).sin(), 0.6 * f64::from(k) - 10.0, turn.sin());
        let near = query.nearest(&x, f64::INFINITY).unwrap();
        assert!((query.distance_mm(&x) - near.distance_mm.abs()).abs() < 1e-12, "{x}");
        // Next to a vertex or a side too, inside is where the axis is.
        let inside = x.x.hypot(x.z) < 4.0 - 0.2;
        assert!(near.rim || !inside || near.distance_mm > 0.0, "{x} {near:?}");
    }
    let vertex = tube().mesh().vertices_mm[200];
    for (part, sign) in [(0.999, 1.0), (1.001, -1.0)] {
        let x = Vec3::new(part * vertex.x, vertex.y, part * vertex.z);
        assert_eq!(query.nearest(&x, 1.0).unwrap().distance_mm.signum(), sign);
    }
}

#[test]
fn the_same_triangle_is_found_again_whatever_its_winding() {
    let triangles = [[0, 1, 2], [2, 1, 3], [2, 0, 1], [1, 4, 1], [1, 3, 2], [4, 1, 1], [3, 1, 5]];
    let pairs = wall::duplicate_pairs(&triangles, &topology::EdgeTable::new(&triangles));
    assert_eq!(pairs, [(0, 2), (1, 4), (3, 5)]);
}

#[test]
fn dirt_is_removed_and_reported() {
    let clean = tube();
    let mut dirty = soup(clean.mesh());
    let flipped = flip_some(&mut dirty, |i| i % 7 == 3);
    dirty.triangles.push(dirty.triangles[5]);
    dirty.triangles.push([0, 0, 1]);
    dirty.vertices_mm.push(Vec3::new(1.0, 50.0, 0.0));
    let wall = Wall::from_surface(&dirty).unwrap();
    let report = wall.report();
    assert_eq!(report.triangles_flipped, flipped);
    assert_eq!(
        (report.duplicates_removed, report.degenerate_removed, report.vertices_unreferenced),
        (1, 1, 1)
    );
    assert_eq!(
        (report.components, report.openings, report.non_manifold_edges, report.stray_edges),
        (1, 2, 0, 0)
    );
    assert_eq!(wall.mesh().triangles.len(), clean.mesh().triangles.len());
    assert_eq!(wall.mesh().vertices_mm.len(), clean.mesh().vertices_mm.len());
    assert!((wall.volume_mm3() - clean.volume_mm3()).abs() < 1e-9);
    assert_eq!(report.notes().len(), 5);
}

#[test]
fn a_surface_that_is_inside_out_is_turned() {
    let clean = tube();
    let mut inverted = clean.mesh().clone();
    flip_some(&mut inverted, |_| true);
    let wall = Wall::from_surface(&inverted).unwrap();
    assert!(wall.report().inside_out && wall.volume_mm3() > 0.0);
    assert!(!clean.report().inside_out);
}

#[test]
fn a_speck_beside_the_vessel_is_dropped_and_reported() {
    let mut mesh = tube().mesh().clone();
    let first = mesh.vertices_mm.len() as u32;
    let corners = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]];
    mesh.vertices_mm.extend(corners.map(|c| Vec3::new(20.0, 0.0, 0.0) + Vec3::from(c)));
    mesh.triangles.extend([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]].map(|t| t.map(|v| v + first)));
    let wall = Wall::from_surface(&mesh).unwrap();
    let report = wall.report();
    assert_eq!((report.pieces_dropped, report.piece_triangles_dropped, report.components), (1, 4, 1));
    assert_eq!(wall.mesh(), tube().mesh());
}

#[test]
fn unusable_surfaces_are_refused() {
    let triangle = |vertices_mm: Vec<Vec3>, t| SurfaceMesh { vertices_mm, triangles: vec![t] };
    let unit = vec![Vec3::zeros(), Vec3::x(), Vec3::y()];
    let mut broken = unit.clone();
    broken[1].y = f64::NAN;
    for (mesh, reason) in [
        (SurfaceMesh::default(), "no triangles"),
        (triangle(unit.clone(), [0, 1, 3]), "names a vertex beyond"),
        (triangle(broken, [0, 1, 2]), "vertex 1 is at (1, NaN, 0)"),
        (triangle(unit, [0, 1, 1]), "no triangle has an area"),
    ] {
        for error in [Wall::from_surface(&mesh).map(|_| ()), check(&mesh).map(|_| ())] {
            let error = error.unwrap_err();
            assert!(matches!(error, Error::Mesh(_)) && error.to_string().contains(reason), "{error}");
        }
    }
}

#[test]
fn winding_numbers_tell_inside_from_outside_and_refuse_a_torn_surface() {
    let wall = tube();
    for (y, radius, inside) in
        [(50.0, 0.0, true), (50.0, 3.5, true), (50.0, 4.1, false), (0.1, 3.0, true), (-0.1, 3.0, false)]
    {
        assert_eq!(wall.contains(&Vec3::new(radius, y, 0.1)).unwrap(), inside, "{y} {radius}");
    }
    assert!((wall.winding_number(&Vec3::new(0.3, 30.0, 0.2)) - 1.0).abs() < 1e-12);
    let mut torn = tube();
    torn.mesh.triangles.truncate(torn.mesh.triangles.len() / 2);
    let message = torn.contains(&Vec3::new(0.0, 50.0, 0.0)).unwrap_err().to_string();
    assert!(message.contains("too broken to tell inside from outside"), "{message}");
    assert!(wall.contains(&Vec3::new(f64::NAN, 0.0, 0.0)).is_err());
}

#[test]
fn distances_are_signed_and_normals_point_into_the_lumen() {
    let wall = tube();
    let query = WallQuery::new(&wall).unwrap();
    for (radius, sign) in [(3.0, 1.0), (4.5, -1.0)] {
        let hit = query.nearest(&Vec3::new(radius, 40.3, 0.2), 5.0).unwrap();
        assert!((hit.distance_mm - (4.0 - radius)).abs() < 0.2 && hit.distance_mm * sign > 0.0);
        assert!((hit.normal + Vec3::x()).norm() < 0.3 && (hit.normal.norm() - 1.0).abs() < 1e-12);
        assert!(!hit.rim);
    }
    assert!(query.nearest(&Vec3::new(0.0, 50.0, 0.0), 1.0).is_none(), "beyond reach");
    assert!(query.nearest(&Vec3::new(f64::NAN, 0.0, 0.0), f64::INFINITY).is_none());
    assert!(query.nearest(&Vec3::new(0.0, -5.0, 0.0), f64::INFINITY).unwrap().rim, "before the inlet");
    assert!(!query.nearest(&Vec3::new(0.0, 5.0, 0.0), f64::INFINITY).unwrap().rim);
}

#[test]
fn on_the_wall_the_normal_is_that_of_the_triangle_even_at_vertices() {
    let wall = tube();
    let query = WallQuery::new(&wall).unwrap();
    let inner = wall.mesh().vertices_mm.iter().find(|v| v.y > 40.0).unwrap();
    let hit = query.nearest(inner, 1.0).unwrap();
    assert!(hit.distance_mm.abs() < 1e-12);
    assert!((hit.normal + Vec3::new(inner.x, 0.0, inner.z) / 4.0).norm() < 0.3);
}

#[test]
fn the_sign_is_right_beside_sharp_edges_and_corners() {
    // A thin wedge: near its edge, both faces are seen from the far side of the other one.
    let corners = [[0., 0., 0.], [4., 0., 0.], [0., 0.4, 0.], [1.0, 0.1, 6.0]];
    let mesh = SurfaceMesh {
        vertices_mm: corners.map(Vec3::from).to_vec(),
        triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
    };
    let wall = Wall::from_surface(&mesh).unwrap();
    let query = WallQuery::new(&wall).unwrap();
    let mut checked = [0, 0];
    for i in 0..20_i32 {
        for j in 0..20_i32 {
            for k in 0..20_i32 {
                let p =
                    Vec3::new(f64::from(i) * 0.31 - 1.0, f64::from(j) * 0.07 - 0.4, f64::from(k) * 0.4 - 1.0);
                let hit = query.nearest(&p, f64::INFINITY).unwrap();
                if hit.distance_mm.abs() > 1e-6 {
                    let inside = wall.contains(&p).unwrap();
                    assert_eq!(hit.distance_mm > 0.0, inside, "{p}");
                    checked[usize::from(inside)] += 1;
                }
            }
        }
    }
    assert!(checked[0] > 1000 && checked[1] > 20, "{checked:?}");
}

#[test]
fn a_check_counts_each_fault_and_a_clean_tube_has_none() {
    let clean = check(&soup(tube().mesh())).unwrap();
    assert!(clean.is_sound() && !clean.watertight && clean.openings.len() == 2, "{clean:?}");
    assert!((clean.area_mm2 / (2.0 * std::f64::consts::PI * 400.0) - 1.0).abs() < 0.02);

    let mut mesh = tube().mesh().clone();
    flip_some(&mut mesh, |i| i == 40);
    mesh.triangles.push(mesh.triangles[0]);
    mesh.triangles.push([0, 1, 1]);
    let v = mesh.vertices_mm.len() as u32;
    // A blade through the wall.
    mesh.vertices_mm.extend([
        Vec3::new(0.0, 50.0, 0.0),
        Vec3::new(9.0, 50.2, 0.3),
        Vec3::new(9.0, 50.0, 0.1),
    ]);
    mesh.triangles.push([v, v + 1, v + 2]);
    let dirty = check(&mesh).unwrap();
    assert_eq!((dirty.flipped_triangles, dirty.duplicate_triangles, dirty.degenerate_triangles), (1, 1, 1));
    assert!(dirty.self_intersections > 0 && !dirty.intersecting_pairs.is_empty() && !dirty.is_sound());
    assert!(serde_json::to_string(&dirty).unwrap().contains("\"volume_mm3\""));
}

#[test]
fn crossing_tubes_are_found_to_intersect() {
    let tube = tube();
    let mut both = tube.mesh().clone();
    let shift = both.vertices_mm.len() as u32;
    both.vertices_mm
        .extend(tube.mesh().vertices_mm.iter().map(|v| Vec3::new(v.y - 50.0, v.x + 50.3, v.z + 1.1)));
    both.triangles.extend(tube.mesh().triangles.iter().map(|t| t.map(|v| v + shift)));
    let report = check(&both).unwrap();
    assert!(report.self_intersections > 20 && report.components == 2, "{report:?}");
}

#[test]
fn a_vertex_that_no_triangle_uses_changes_no_tolerance() {
    let clean = tube();
    let mut stray = soup(clean.mesh());
    stray.vertices_mm.push(Vec3::new(1e9, 0.0, 0.0));
    let wall = Wall::from_surface(&stray).unwrap();
    assert_eq!(wall.mesh(), Wall::from_surface(&soup(clean.mesh())).unwrap().mesh());
    let report = check(&stray).unwrap();
    assert!(report.is_sound() && report.high_mm[0] < 5.0, "{report:?}");
    // Counter-check: as a triangle's corner it does set the scale, and the tube is a point compared with it.
    let far = stray.vertices_mm.len() as u32 - 1;
    stray.triangles.push([0, 1, far]);
    assert!(!check(&stray).is_ok_and(|report| report.is_sound()));
}

#[test]
fn vessel_check_reports_width_and_walls_that_nearly_touch() {
    let tube = tube();
    let report = check(tube.mesh()).unwrap();
    let lumen = report.survey.lumen.unwrap();
    assert!((lumen.smallest_mm - 4.0).abs() < 0.2 && (lumen.median_mm - 4.0).abs() < 0.2, "{lumen:?}");
    assert_eq!((report.survey.septa.thin, report.hints.len()), (0, 0));
    let start = report.survey.start.unwrap();
    let position = Vec3::from(start.position_mm);
    assert!(position.xz().norm() < 0.5 && (0.0..100.0).contains(&position.y), "{start:?}");
    assert!(start.direction[1].abs() > 0.9 && report.contrast, "{start:?}");
    // A second tube half a millimetre beside the first, closed at its ends, and in metres.
    let mut both = tube.closed_mesh();
    let shift = both.vertices_mm.len() as u32;
    let second = tube.closed_mesh();
    both.vertices_mm.extend(second.vertices_mm.iter().map(|v| v + Vec3::new(8.5, 0.0, 0.0)));
    both.triangles.extend(second.triangles.iter().map(|t| t.map(|v| v + shift)));
    let report = check(&both).unwrap();
    let septa = &report.survey.septa;
    assert!(septa.thin > 20 && (0.45..0.7).contains(&septa.thinnest_mm.unwrap()), "{septa:?}");
    assert!(Vec3::from(septa.thinnest_at_mm.unwrap()).x - 4.25 < 0.2);
    assert!(report.hints[0].contains("closed") && report.hints[0].contains("sheath.position_mm"));
    both.vertices_mm.iter_mut().for_each(|v| *v /= 1000.0);
    assert!(check(&both).unwrap().hints[0].contains("unit_mm = 1000"));
    assert!(check_with(&both, 1.0, f64::NAN).is_err());
}

#[test]
fn a_flat_sheet_is_no_vessel() {
    let sheet = SurfaceMesh {
        vertices_mm: [[0., 0.], [9., 0.], [9., 7.], [0., 7.]].map(|[x, y]| Vec3::new(x, y, 3.0)).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    let report = check(&sheet).unwrap();
    assert!(report.flat && !report.is_sound(), "{report:?}");
    assert!(!check(tube().mesh()).unwrap().flat);
}

#[test]
fn thousands_of_overlapping_triangles_are_counted_up_to_a_limit() {
    // Blades about one axis, each slightly rotated and shifted: every one intersects every other.
    let mut pile = SurfaceMesh::default();
    for k in 0..1_000_u32 {
        let (sin, cos) = (3.0 * f64::from(k) / 1_000.0).sin_cos();
        let shift = f64::from(k) * 1e-4;
        pile.vertices_mm.extend(
            [[-9., -5.], [9., -5.], [0., 9.]]
                .map(|[across, along]| Vec3::new(across * cos, across * sin, along + shift)),
        );
        pile.triangles.push([3 * k, 3 * k + 1, 3 * k + 2]);
    }
    let report = check(&pile).unwrap();
    assert!(report.self_intersections_capped, "{}", report.self_intersections);
    assert_eq!(report.self_intersections, 100_000);
    assert!(report.intersecting_pairs.len() == 10 && report.intersecting_pairs.is_sorted());
    assert!(!check(tube().mesh()).unwrap().self_intersections_capped);
}

/// The same cases in every run, limited in number: tests must not fail at random, nor take too long.
pub(super) fn steady(cases: u32) -> ProptestConfig {
    ProptestConfig {
        cases,
        rng_seed: proptest::test_runner::RngSeed::Fixed(2011),
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

/// Moves vertices about by up to so much, each otherwise.
fn jitter(mesh: &mut SurfaceMesh, by_mm: f64) {
    for (i, v) in mesh.vertices_mm.iter_mut().enumerate() {
        *v += Vec3::new((i as f64).sin(), (2.0 * i as f64).sin(), (3.0 * i as f64).sin()) * by_mm;
    }
}

proptest! {
    #![proptest_config(steady(24))]
    #[test]
    fn repair_undoes_any_flips_and_any_split_of_vertices(flips in prop::collection::vec(any::<bool>(), 200), jitter_mm in 0.0f64..2e-5) {
        static CLEAN: std::sync::LazyLock<Wall> = std::sync::LazyLock::new(|| tube_of(40.0));
        let mut dirty = soup(CLEAN.mesh());
        // Well below the tolerance of a millionth of the diagonal.
        jitter(&mut dirty, jitter_mm);
        flip_some(&mut dirty, |i| flips[i % flips.len()]);
        let wall = Wall::from_surface(&dirty).unwrap();
        prop_assert_eq!(wall.mesh().vertices_mm.len(), CLEAN.mesh().vertices_mm.len());
        prop_assert!((wall.volume_mm3() / CLEAN.volume_mm3() - 1.0).abs() < 1e-4);
        prop_assert_eq!(wall.openings().len(), 2);
    }
}

#[test]
fn vertices_apart_by_more_than_any_crack_tear_the_surface() {
    // Twin of the test above.
    let mut torn = soup(tube_of(40.0).mesh());
    jitter(&mut torn, 0.8);
    assert!(Wall::from_surface(&torn).unwrap().openings().len() > 2);
}

#[test]
fn a_surface_whose_triangles_share_no_vertices_is_checked_in_a_moment_and_reported() {
    // Farther apart than vertices that are merged, and nearer than cracks that are joined.
    let mut cracked = soup(tube().mesh());
    jitter(&mut cracked, 1e-3);
    let clock = std::time::Instant::now();
    let reported = check(&cracked).unwrap();
    assert_eq!((reported.openings.len(), reported.repair.components), (2, 1), "{:?}", reported.repair);
    assert!(
        reported.components > 1000 && reported.open_edges > 3000,
        "{} {}",
        reported.components,
        reported.open_edges
    );
    // And farther apart than those.
    let mut torn = soup(tube().mesh());
    jitter(&mut torn, 0.8);
    let report = check(&torn).unwrap();
    assert!(report.hints.iter().any(|hint| hint.contains("merge by distance")), "{:?}", report.hints);
    let took_s = clock.elapsed().as_secs_f64();
    assert!(took_s < 20.0, "{took_s} s");
}

#[test]
fn more_openings_than_a_vessel_can_have_are_refused_with_what_to_do() {
    let corner = |k: u32| Vec3::new(f64::from(k % 100), f64::from(k / 100), 0.0);
    let apart = |count: u32| SurfaceMesh {
        vertices_mm: (0..count)
            .flat_map(|k| [[0.0; 3], [0.5, 0.0, 0.1], [0.0, 0.5, 0.2]].map(|off| corner(k) + Vec3::from(off)))
            .collect(),
        triangles: (0..count).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect(),
    };
    let reported = check(&apart(10_001)).unwrap_err().to_string();
    assert!(
        reported.contains("10001 openings in 10001 pieces") && reported.contains("merge those"),
        "{reported}"
    );
    assert!(Wall::from_surface(&apart(10_001)).is_err());
}

#[test]
fn a_closed_piece_inside_another_is_reported() {
    // Tetrahedra: too few triangles and too unlike for a wall of two skins.
    let corners = [[1., 1., 1.], [-1., -1., 1.], [-1., 1., -1.], [1., -1., -1.]].map(Vec3::from);
    let triangles = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let of = |size: f64, at: Vec3, first: u32| -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let moved = |t: [u32; 3]| t.map(|v| v + first);
        (corners.iter().map(|c| at + *c * size).collect(), triangles.map(moved).to_vec())
    };
    let two = |at: Vec3| {
        let ((mut vertices_mm, mut triangles), other) = (of(9.0, Vec3::zeros(), 0), of(2.5, at, 4));
        vertices_mm.extend(other.0);
        triangles.extend(other.1);
        check(&SurfaceMesh { vertices_mm, triangles }).unwrap()
    };
    let inside = two(Vec3::zeros());
    assert_eq!((inside.nested_pieces, inside.is_sound()), (1, false), "{inside:?}");
    assert!(inside.faults().contains(&"1 piece inside another".to_owned()), "{:?}", inside.faults());
    let beside = two(Vec3::x() * 30.0);
    assert_eq!((beside.nested_pieces, beside.is_sound()), (0, true), "{:?}", beside.faults());
}

/// The folder of shared data, if present.
fn shared(file: &str) -> Option<PathBuf> {
    let beside = || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared");
    let folder = std::env::var_os("ENDOWIRE_SHARED").map_or_else(beside, PathBuf::from);
    let path = folder.join("data").join(file);
    path.exists().then_some(path)
}

#[test]
fn a_real_carotid_surface_is_repaired_and_its_ends_found() {
    let Some(path) = shared("carotids.stl") else { return };
    let surface = SurfaceMesh::read(&path, 1.0).unwrap();
    let wall = Wall::from_surface(&surface).unwrap();
    // A common carotid with its bifurcation, shipped with all triangles wound inwards.
    let report = wall.report();
    assert_eq!((report.components, report.non_manifold_edges, report.stray_edges), (1, 0, 0));
    assert!(report.inside_out && report.vertices_welded > 5000, "{report:?}");
    let radii: Vec<f64> = wall.openings().iter().map(|o| o.radius_mm).collect();
    assert!(radii.len() == 3 && radii.iter().all(|r| (2.5..5.5).contains(r)), "{radii:?}");
    for opening in wall.openings() {
        let inside = opening.centre_mm - opening.direction;
        assert!(
            wall.contains(&inside).unwrap()
                && !wall.contains(&(opening.centre_mm + opening.direction)).unwrap()
        );
    }
    let checked = check(&surface).unwrap();
    assert!((checked.volume_mm3 - wall.volume_mm3()).abs() < 1e-9 && checked.inside_out);
}
