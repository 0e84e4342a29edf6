//! Each repair on a generated wall with one kind of fault, compared with the clean one.

use std::time::Instant;

use proptest::prelude::*;

use super::super::tests::steady;
use super::super::*;
use super::doubles;
use crate::Vec3;
use crate::vessel::mesh::retain_numbered;
use crate::vessel::topology::EdgeTable;

/// A bifurcating vessel: three openings.
fn fork() -> Wall {
    let node = |position: [f64; 3], radius_mm, parent| CentrelineNode {
        position_mm: Vec3::from(position),
        radius_mm,
        parent,
    };
    let tree = CentrelineTree::new(vec![
        node([0., 0., 0.], 4.0, None),
        node([0., 30., 0.], 4.0, Some(0)),
        node([20., 60., 0.], 3.0, Some(1)),
        node([-20., 60., 0.], 3.0, Some(1)),
    ])
    .unwrap();
    GeneratedWall::new(&tree, Resolution::EdgeMm(1.2)).unwrap().wall
}

/// The triangles whose middle is within `reach` of the wall's vertex nearest to `place`.
fn around(mesh: &SurfaceMesh, place: [f64; 3], reach: f64) -> Vec<usize> {
    let place = Vec3::from(place);
    let nearest = mesh.vertices_mm.iter().min_by(|a, b| (*a - place).norm().total_cmp(&(*b - place).norm()));
    let nearest = *nearest.unwrap();
    (0..mesh.triangles.len()).filter(|i| (mesh.middle(*i) - nearest).norm() < reach).collect()
}

fn without(mesh: &SurfaceMesh, gone: &[usize]) -> SurfaceMesh {
    let mut left = mesh.clone();
    retain_numbered(&mut left.triangles, |index, _| !gone.contains(&index));
    left
}

/// A displaced copy of some triangles with their own vertices.
fn add(mesh: &mut SurfaceMesh, from: &SurfaceMesh, triangles: &[usize], moved: impl Fn(Vec3) -> Vec3) {
    let shift = mesh.vertices_mm.len() as u32;
    mesh.vertices_mm.extend(from.vertices_mm.iter().map(|v| moved(*v)));
    mesh.triangles.extend(triangles.iter().map(|i| from.triangles[*i].map(|v| v + shift)));
}

/// Repairs and checks that the result is a sound wall with the openings of the clean one and nearly its volume.
fn repaired(dirty: &SurfaceMesh, clean: &Wall, part: f64) -> RepairReport {
    let wall = Wall::from_surface(dirty).unwrap();
    let report = wall.report().clone();
    let change = wall.volume_mm3() / clean.volume_mm3() - 1.0;
    assert!(change.abs() <= part, "volume changed by {change}: {:?}", report.notes());
    let radii = |w: &Wall| w.openings().iter().map(|o| o.radius_mm).collect::<Vec<_>>();
    assert_eq!(wall.openings().len(), clean.openings().len(), "{:?} {:?}", radii(&wall), report.notes());
    assert!(
        radii(&wall).iter().zip(radii(clean)).all(|(a, b)| (a / b - 1.0).abs() < 1e-6),
        "{:?} {:?}",
        radii(&wall),
        radii(clean)
    );
    let checked = check(wall.mesh()).unwrap();
    assert!(checked.is_sound(), "{checked:?} after {:?}", report.notes());
    report
}

#[test]
fn a_clean_fork_comes_out_bit_for_bit() {
    let clean = fork();
    assert_eq!(clean.openings().len(), 3);
    let again = Wall::from_surface(clean.mesh()).unwrap();
    assert_eq!(again.mesh(), clean.mesh());
    assert!(again.report().notes().is_empty(), "{:?}", again.report().notes());
    assert_eq!(again.openings(), clean.openings());
}

#[test]
fn missing_triangles_are_filled_and_ends_stay_open() {
    let clean = fork();
    for (place, reach) in
        [([4., 15., 0.], 0.9), ([4., 15., 0.], 2.0), ([0., 32., 4.], 2.5), ([15., 52., 3.], 1.5)]
    {
        let gone = around(clean.mesh(), place, reach);
        let report = repaired(&without(clean.mesh(), &gone), &clean, 5e-3);
        assert_eq!((report.holes_filled, report.fold_triangles_removed), (1, 0), "{place:?} {}", gone.len());
        assert!(report.triangles_added > 0);
    }
}

#[test]
fn a_tear_along_the_vessel_is_sewn_up() {
    // Every triangle on one side of a line gets its own vertices there, slightly pulled away.
    let clean = fork();
    let mut torn = clean.mesh().clone();
    let mut double = std::collections::BTreeMap::new();
    for t in 0..torn.triangles.len() {
        let middle = clean.mesh().middle(t);
        if !(8.0..22.0).contains(&middle.y) || middle.x < 0.0 || middle.z < 0.0 {
            continue;
        }
        for k in 0..3 {
            let v = clean.mesh().triangles[t][k];
            let at = clean.mesh().vertices_mm[v as usize];
            let seam = at.z < 0.9 && at.z > -0.9 && (9.0..21.0).contains(&at.y);
            if seam {
                let copy = *double.entry(v).or_insert_with(|| {
                    torn.vertices_mm.push(at + Vec3::new(0.0, 0.0, 0.02));
                    torn.vertices_mm.len() as u32 - 1
                });
                torn.triangles[t][k] = copy;
            }
        }
    }
    assert!(double.len() > 5);
    let report = repaired(&torn, &clean, 1e-2);
    assert!(report.cracks_closed + report.holes_filled > 0, "{report:?}");
}

#[test]
fn a_curved_patch_on_the_surface_is_no_vessel() {
    // Around the bifurcation's crotch, 0.05 mm off to either side: its rim resembles the opening of a vessel.
    let clean = fork();
    let patch = around(clean.mesh(), [0.0, 34.0, 0.0], 6.0);
    for off_mm in [0.05, -0.05] {
        let mut doubled = clean.mesh().clone();
        add(&mut doubled, clean.mesh(), &patch, |v| v + Vec3::y() * off_mm);
        let report = repaired(&doubled, &clean, 1e-12);
        assert_eq!((report.pieces_dropped, report.piece_triangles_dropped), (1, patch.len()));
        assert_eq!((report.cracks_closed, report.fold_triangles_removed), (0, 0));
    }
    // Far from it the same piece may be meaningful.
    let mut apart = clean.mesh().clone();
    add(&mut apart, clean.mesh(), &patch, |v| v + Vec3::y() * 3.0);
    let before = apart.triangles.len();
    let table = EdgeTable::new(&apart.triangles);
    assert_eq!(doubles::drop_doubles(&mut apart, &table, &mut Vec::new()), Default::default());
    assert_eq!(apart.triangles.len(), before);
}

#[test]
fn a_vertex_on_an_edge_opens_no_slit() {
    // A T-junction: one triangle of an edge is divided at the edge's middle, the other is not.
    let clean = fork();
    let mut spoiled = clean.mesh().clone();
    let t = around(clean.mesh(), [4., 15., 0.], 0.8)[0];
    let [a, b, c] = spoiled.triangles[t];
    let middle = (spoiled.vertices_mm[a as usize] + spoiled.vertices_mm[b as usize]) / 2.0;
    spoiled.vertices_mm.push(middle);
    let m = spoiled.vertices_mm.len() as u32 - 1;
    spoiled.triangles[t] = [a, m, c];
    spoiled.triangles.push([m, b, c]);
    let report = repaired(&spoiled, &clean, 1e-9);
    assert_eq!((report.edges_sewn, report.holes_filled), (1, 0), "{report:?}");
}

#[test]
fn coordinates_with_few_digits_are_joined() {
    let clean = fork();
    let mut soup = SurfaceMesh::default();
    for t in 0..clean.mesh().triangles.len() {
        let first = soup.vertices_mm.len() as u32;
        let jitter =
            |k: usize| Vec3::new((t as f64).sin(), (3.0 * t as f64).cos(), (k + t) as f64 % 0.9) * 3e-3;
        let corners = clean.mesh().corners(t);
        soup.vertices_mm.extend((0..3).map(|k| corners[k] + jitter(k)));
        soup.triangles.push([first, first + 1, first + 2]);
    }
    let wall = Wall::from_surface(&soup).unwrap();
    assert!((wall.volume_mm3() / clean.volume_mm3() - 1.0).abs() < 2e-3);
    assert_eq!((wall.openings().len(), wall.report().components), (3, 1), "{:?}", wall.report());
}

#[test]
fn fins_second_layers_and_membranes_go() {
    let clean = fork();
    let mesh = clean.mesh();
    // A fin on an edge.
    let mut finned = mesh.clone();
    let t = around(mesh, [4., 15., 0.], 0.8)[0];
    let [a, b, _] = mesh.triangles[t];
    finned.vertices_mm.push(Vec3::new(9.0, 15.0, 0.0));
    finned.triangles.push([a, b, finned.vertices_mm.len() as u32 - 1]);
    let report = repaired(&finned, &clean, 0.0);
    assert_eq!((report.sheets_removed, report.edges_cut), (1, 0));
    // A layer over some triangles, on the same border.
    let mut layered = mesh.clone();
    let patch = around(mesh, [4., 15., 0.], 2.5);
    let table = topology::EdgeTable::new(&patch.iter().map(|i| mesh.triangles[*i]).collect::<Vec<_>>());
    let mut border = vec![false; mesh.vertices_mm.len()];
    for uses in table.edges().filter(|uses| uses.len() == 1) {
        (border[uses[0].low as usize], border[uses[0].high as usize]) = (true, true);
    }
    let shift = mesh.vertices_mm.len() as u32;
    layered.vertices_mm.extend(mesh.vertices_mm.iter().map(|v| v + Vec3::new(0.4, 0.0, 0.0)));
    let copy = |v: u32| if border[v as usize] { v } else { v + shift };
    layered.triangles.extend(patch.iter().map(|i| mesh.triangles[*i].map(copy)));
    let report = repaired(&layered, &clean, 2e-3);
    assert!(report.sheets_removed > 4 && report.edges_cut == 0, "{report:?}");
    // A lid across an opening: its end is closed by a membrane slightly inside.
    let inner = Opening { ..clean.openings()[0].clone() };
    let mut lidded = mesh.clone();
    let centre = lidded.vertices_mm.len() as u32;
    let ring: Vec<u32> = ring_inside(mesh, &inner);
    lidded.vertices_mm.push(inner.centre_mm - inner.direction);
    lidded.triangles.extend((0..ring.len()).map(|k| [ring[k], ring[(k + 1) % ring.len()], centre]));
    let report = repaired(&lidded, &clean, 0.0);
    assert_eq!(report.sheets_removed, ring.len());
}

/// The second ring of vertices behind an opening, in order: the border without the triangles at the rim.
fn ring_inside(mesh: &SurfaceMesh, opening: &Opening) -> Vec<u32> {
    let at_rim = |t: &[u32; 3]| t.iter().any(|v| opening.boundary.contains(v));
    let rest: Vec<[u32; 3]> = mesh.triangles.iter().copied().filter(|t| !at_rim(t)).collect();
    let table = EdgeTable::new(&rest);
    let rest = SurfaceMesh { vertices_mm: mesh.vertices_mm.clone(), triangles: rest };
    let open = super::super::opening::boundary(&rest, &table);
    let near = |o: &&Opening| (o.centre_mm - opening.centre_mm).norm() < 3.0;
    open.openings.iter().find(near).unwrap().boundary.clone()
}

#[test]
fn tubes_that_touch_along_an_edge_are_cut_apart() {
    let cube = |x: f64, y: f64| {
        let corner = |k: usize| Vec3::new(x + (k & 1) as f64, y + (k >> 1 & 1) as f64, (k >> 2) as f64);
        let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        SurfaceMesh {
            vertices_mm: (0..8).map(corner).collect(),
            triangles: faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect(),
        }
    };
    let mut both = cube(0.0, 0.0);
    let second = cube(1.0, 1.0);
    add(&mut both, &second, &(0..12).collect::<Vec<_>>(), |v| v);
    let wall = Wall::from_surface(&both).unwrap();
    assert_eq!((wall.report().edges_cut, wall.report().components), (1, 2), "{:?}", wall.report());
    assert!((wall.volume_mm3() - 2.0).abs() < 1e-12);
}

#[test]
fn specks_and_floating_patches_go_and_two_vessels_stay() {
    let clean = fork();
    let mut dirty = clean.mesh().clone();
    let patch = around(clean.mesh(), [4., 15., 0.], 3.0);
    add(&mut dirty, clean.mesh(), &patch, |v| v + Vec3::new(0.3, 0.0, 0.0));
    add(&mut dirty, clean.mesh(), &(0..clean.mesh().triangles.len()).collect::<Vec<_>>(), |v| {
        v * 0.01 + Vec3::new(30.0, 0.0, 0.0)
    });
    let report = repaired(&dirty, &clean, 0.0);
    assert_eq!((report.pieces_dropped, report.skins_dropped), (2, 0));
    // Counter-check: a second vessel beside the first is not debris.
    let all: Vec<usize> = (0..clean.mesh().triangles.len()).collect();
    let mut two = clean.mesh().clone();
    add(&mut two, clean.mesh(), &all, |v| v + Vec3::new(0.0, 0.0, 20.0));
    let wall = Wall::from_surface(&two).unwrap();
    assert_eq!((wall.report().components, wall.openings().len()), (2, 6));
    assert!((wall.volume_mm3() / clean.volume_mm3() - 2.0).abs() < 1e-9);
}

#[test]
fn of_a_wall_with_two_skins_the_inner_one_is_kept() {
    let tube = |radius_mm| {
        let node = |y: f64, parent| CentrelineNode { position_mm: Vec3::new(0.0, y, 0.0), radius_mm, parent };
        let tree = CentrelineTree::new(vec![node(0.0, None), node(50.0, Some(0))]).unwrap();
        GeneratedWall::new(&tree, Resolution::EdgeMm(1.0)).unwrap().wall
    };
    let (inner, outer) = (tube(3.0), tube(3.8));
    for turned in [false, true] {
        let mut both = outer.mesh().clone();
        let all: Vec<usize> = (0..inner.mesh().triangles.len()).collect();
        add(&mut both, inner.mesh(), &all, |v| v);
        if turned {
            let first = outer.mesh().triangles.len();
            both.triangles[first..].iter_mut().for_each(|t| t.swap(1, 2));
        }
        let report = repaired(&both, &inner, 1e-9);
        assert_eq!((report.skins_dropped, report.pieces_dropped), (1, 0));
    }
}

#[test]
fn folds_and_spikes_are_cut_out_and_filled() {
    let clean = fork();
    for (place, push) in [
        // Pulled through its neighbours along the wall; and in through the other side of the vessel.
        ([0., 15., 4.], Vec3::new(-0.1, 3.0, 0.0)),
        ([4., 15., 0.], Vec3::new(-9.0, 0.5, 0.3)),
        ([15., 52., 3.], Vec3::new(-3.0, -4.5, -0.1)),
    ] {
        let mut folded = clean.mesh().clone();
        let nearest = (0..folded.vertices_mm.len())
            .min_by(|a, b| {
                let far = |v: &usize| (clean.mesh().vertices_mm[*v] - Vec3::from(place)).norm();
                far(a).total_cmp(&far(b))
            })
            .unwrap();
        folded.vertices_mm[nearest] += push;
        assert!(check(&folded).unwrap().self_intersections > 0, "{place:?} is no fold");
        let report = repaired(&folded, &clean, 5e-3);
        assert!(report.intersections_found > 0 && report.intersections_left == 0);
        assert!(report.fold_triangles_removed > 0 && report.fold_triangles_removed < 200, "{report:?}");
    }
}

#[test]
fn vessels_that_cross_are_united_and_named() {
    let clean = fork();
    let all: Vec<usize> = (0..clean.mesh().triangles.len()).collect();
    let mut both = clean.mesh().clone();
    add(&mut both, clean.mesh(), &all, |v| Vec3::new(v.y - 15.3, v.x + 15.1, v.z + 1.0));
    let wall = Wall::from_surface(&both).unwrap();
    assert_eq!((wall.report().components, wall.report().parts_united), (1, 1));
    assert!(
        wall.report().notes().iter().any(|note| note.contains("overlapped the rest without being joined")),
        "{:?}",
        wall.report().notes()
    );
}

#[test]
fn all_at_once_is_answered_too() {
    let clean = fork();
    let mut dirty = without(clean.mesh(), &around(clean.mesh(), [4., 15., 0.], 1.5));
    for t in (0..dirty.triangles.len()).step_by(5) {
        dirty.triangles[t].swap(1, 2);
    }
    dirty.triangles.push(dirty.triangles[7]);
    add(&mut dirty, clean.mesh(), &around(clean.mesh(), [-15., 52., 3.], 2.0), |v| {
        v + Vec3::new(0.0, 0.0, 0.2)
    });
    let spike = clean.openings()[0].boundary[0] as usize;
    let far = (0..dirty.vertices_mm.len()).max_by(|a, b| {
        let d = |v: &usize| {
            (clean.mesh().vertices_mm[*v % clean.mesh().vertices_mm.len()] - clean.mesh().vertices_mm[spike])
                .norm()
        };
        d(a).total_cmp(&d(b))
    });
    assert!(far.is_some());
    let report = repaired(&dirty, &clean, 5e-3);
    assert_eq!((report.duplicates_removed, report.pieces_dropped, report.holes_filled), (1, 1, 1));
}

proptest! {
    #![proptest_config(steady(400))]
    #[test]
    fn soups_never_panic_and_end_in_time(
        corners in prop::collection::vec(prop::array::uniform3(-4i8..4), 4..24),
        triangles in prop::collection::vec(prop::array::uniform3(any::<prop::sample::Index>()), 1..60),
        jitter in 0.0..0.2,
    ) {
        let started = Instant::now();
        let vertices_mm: Vec<Vec3> = corners
            .iter()
            .enumerate()
            .map(|(i, c)| Vec3::from(c.map(f64::from)) + Vec3::new((i as f64).sin(), (i as f64).cos(), 0.3) * jitter)
            .collect();
        let surface = SurfaceMesh {
            triangles: triangles.iter().map(|t| t.each_ref().map(|i| i.index(vertices_mm.len()) as u32)).collect(),
            vertices_mm,
        };
        if let Ok(wall) = Wall::from_surface(&surface) {
            prop_assert!(!wall.mesh().triangles.is_empty());
            prop_assert_eq!(wall.report().non_manifold_edges, 0);
            let _ = wall.report().notes();
        }
        let _ = check(&surface);
        prop_assert!(started.elapsed().as_secs_f64() < 5.0);
    }

    #[test]
    fn a_wall_with_moved_vertices_never_panics(
        moves in prop::collection::vec((any::<prop::sample::Index>(), prop::array::uniform3(-6.0..6.0)), 1..12),
        gone in prop::collection::vec(any::<prop::sample::Index>(), 0..12),
    ) {
        let node = |y: f64, parent| CentrelineNode { position_mm: Vec3::new(0.0, y, 0.0), radius_mm: 3.0, parent };
        let tree = CentrelineTree::new(vec![node(0.0, None), node(30.0, Some(0))]).unwrap();
        let mut mesh = GeneratedWall::new(&tree, Resolution::EdgeMm(2.0)).unwrap().wall.mesh().clone();
        for (vertex, by) in moves {
            let count = mesh.vertices_mm.len();
            mesh.vertices_mm[vertex.index(count)] += Vec3::from(by);
        }
        for triangle in gone {
            let count = mesh.triangles.len();
            mesh.triangles.swap_remove(triangle.index(count));
        }
        let wall = Wall::from_surface(&mesh).unwrap();
        prop_assert_eq!(wall.report().non_manifold_edges, 0);
        prop_assert!(wall.report().intersections_left <= wall.report().intersections_found);
    }
}
