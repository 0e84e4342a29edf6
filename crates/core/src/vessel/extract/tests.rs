use super::*;
use crate::vessel::generate::axes;
use crate::vessel::{GeneratedWall, SurfaceMesh, anatomy};

/// Distance of computed centre lines from the exact ones, relative to the tolerance: half a millimetre, or a
/// twentieth of the radius if larger. Positions within a radius of ends, and where two branches overlap, are
/// excluded.
#[derive(Debug, Default)]
struct Miss {
    position: f64,
    radius: f64,
    /// Distance of the computed lines from any exact line, relative to the local radius.
    stray: f64,
}

type Axis = Vec<(Vec3, f64)>;

fn allowed_mm(radius_mm: f64) -> f64 {
    (0.05 * radius_mm).max(0.5)
}

/// Distance from the nearest position of the tree to a point, and the radius there.
fn nearest(tree: &CentrelineTree, x: &Vec3) -> (f64, f64) {
    let nodes = tree.nodes();
    let sides = nodes.iter().filter_map(|b| b.parent.map(|a| (&nodes[a], b)));
    let away = sides.map(|(a, b)| {
        let way = b.position_mm - a.position_mm;
        let part = ((x - a.position_mm).dot(&way) / way.norm_squared()).clamp(0.0, 1.0);
        ((a.position_mm + way * part - x).norm(), a.radius_mm + (b.radius_mm - a.radius_mm) * part)
    });
    away.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap()
}

/// Whether a position of one axis is near an end of it or in the region of another.
fn is_left_out(axes: &[Axis], own: usize, (x, radius_mm): &(Vec3, f64)) -> bool {
    let near_end =
        [axes[own].first(), axes[own].last()].iter().flatten().any(|e| (e.0 - x).norm() < *radius_mm);
    let near = |other: &Axis| other.iter().any(|(y, other)| (y - x).norm() < radius_mm + other);
    near_end || axes.iter().enumerate().any(|(k, other)| k != own && near(other))
}

fn miss(axes: &[Axis], tree: &CentrelineTree) -> Miss {
    let mut miss = Miss::default();
    for (k, axis) in axes.iter().enumerate() {
        for place in axis.iter().filter(|place| !is_left_out(axes, k, place)) {
            let (away_mm, radius_mm) = nearest(tree, &place.0);
            miss.position = miss.position.max(away_mm / allowed_mm(place.1));
            miss.radius = miss.radius.max((radius_mm - place.1).abs() / allowed_mm(place.1));
        }
    }
    for node in tree.nodes() {
        let away = axes.iter().flatten().map(|(x, r)| (x - node.position_mm).norm() / r);
        miss.stray = miss.stray.max(away.fold(f64::INFINITY, f64::min));
    }
    miss
}

fn wall_of(name: &str) -> GeneratedWall {
    GeneratedWall::new(&anatomy::tree(name).unwrap(), anatomy::asset_resolution(name)).unwrap()
}

/// The centre line from the inlet of a built-in anatomy to these openings, or to all.
fn found(made: &GeneratedWall, to: &[CentrelineEnd]) -> ExtractedCentreline {
    ExtractedCentreline::of(&made.wall, Some(CentrelineEnd::Opening(made.inlet)), to).unwrap()
}

#[test]
fn trees_of_walls_are_those_that_the_walls_were_made_from() {
    for name in ["curved_tube", "aortic_arch", "aortic_arch_iii", "hepatic"] {
        let made = wall_of(name);
        let found = found(&made, &[]);
        assert!(found.unreached.is_empty(), "{name}: {:?}", found.unreached);
        assert_eq!(found.tree.targets().len(), made.wall.openings().len() - 1, "{name}");
        let mut exact = axes(&anatomy::tree(name).unwrap()).unwrap();
        let missed = miss(&exact, &found.tree);
        assert!(missed.position < 0.3 && missed.radius < 0.7 && missed.stray < 1.0, "{name}: {missed:?}");

        // Counter-check: displaced axes and changed radii are detected.
        exact.iter_mut().flatten().for_each(|(x, _)| *x += Vec3::new(0.5, 0.4, 0.6));
        assert!(miss(&exact, &found.tree).position > 0.7, "{name}");
        exact.iter_mut().flatten().for_each(|(_, radius_mm)| *radius_mm *= 1.25);
        assert!(miss(&exact, &found.tree).radius > 1.0, "{name}");
    }
}

#[test]
fn a_branch_that_is_left_out_is_missed() {
    let made = wall_of("hepatic");
    let wide: Vec<CentrelineEnd> =
        made.wall.openings()[..4].iter().map(|o| CentrelineEnd::Opening(o.index)).collect();
    let to: Vec<CentrelineEnd> =
        wide.into_iter().filter(|end| *end != CentrelineEnd::Opening(made.inlet)).collect();
    let exact = axes(&anatomy::tree("hepatic").unwrap()).unwrap();
    assert!(miss(&exact, &found(&made, &to).tree).position > 10.0);
}

#[test]
fn the_same_wall_has_the_same_tree_and_its_table_is_read_back() {
    let made = wall_of("hepatic");
    let tree = found(&made, &[]).tree;
    assert_eq!(found(&made, &[]).tree, tree);
    let table = tree.table("a centre line");
    assert_eq!(CentrelineTree::from_bytes(table.as_bytes(), "tree.csv".as_ref()).unwrap(), tree);
    let branches = tree.branches();
    let sum_mm: f64 = branches.iter().map(|branch| branch.length_mm).sum();
    let sides = tree.nodes().iter().filter_map(|b| b.parent.map(|a| (tree.nodes()[a].position_mm, b)));
    let whole_mm: f64 = sides.map(|(a, b)| (b.position_mm - a).norm()).sum();
    assert!((sum_mm - whole_mm).abs() < 1e-9 * whole_mm && branches.len() >= 9, "{branches:?}");
}

#[test]
fn places_inside_are_ends_too_and_others_are_refused() {
    let made = wall_of("curved_tube");
    let place = |x: f64, y: f64, z: f64| CentrelineEnd::Place(Vec3::new(x, y, z));
    let of = |from: CentrelineEnd, to: CentrelineEnd| ExtractedCentreline::of(&made.wall, Some(from), &[to]);
    let tree = of(place(0.0, 0.0, 20.0), place(1.0, 0.0, 60.0)).unwrap().tree;
    assert!((tree.branches()[0].length_mm - 40.0).abs() < 1.5, "{:?}", tree.branches());
    assert_eq!(tree.target("place 1").unwrap().row, tree.nodes().len() - 1);
    // Near the wall: the way to the middle of the lumen there, and no detour.
    for to in [place(0.0, 3.9, 60.0), place(-2.0, -2.0, 60.0)] {
        let tree = of(place(0.0, -3.8, 20.0), to).unwrap().tree;
        assert!((tree.branches()[0].length_mm - 40.0).abs() < 2.0, "{:?}", tree.branches());
    }
    for (from, to, reported) in [
        (place(0.0, 0.0, 20.0), place(8.0, 0.0, 60.0), "to = [8, 0, 60]: is not inside"),
        (place(0.0, 0.0, -5.0), place(0.0, 0.0, 60.0), "from = [0, 0, -5]: is not inside"),
        (place(f64::NAN, 0.0, 0.0), place(0.0, 0.0, 60.0), "from = [NaN, 0, 0]: is not inside"),
        (CentrelineEnd::Opening(2), place(0.0, 0.0, 60.0), "from = opening 2: the surface has 2 openings"),
    ] {
        let error = of(from, to).unwrap_err().to_string();
        assert!(error.starts_with(reported), "{error}");
    }
    let closed = Wall::welded(&made.wall.closed_mesh()).unwrap();
    let error = ExtractedCentreline::of(&closed, None, &[]).unwrap_err().to_string();
    assert!(error.contains("has no opening: give a place inside"), "{error}");
}

#[test]
fn openings_of_another_piece_are_reported() {
    let made = wall_of("straight_tube");
    let mut mesh = made.wall.mesh().clone();
    let count = mesh.vertices_mm.len() as u32;
    mesh.vertices_mm.extend_from_within(..);
    mesh.vertices_mm[count as usize..].iter_mut().for_each(|v| v.x += 20.0);
    mesh.triangles.extend_from_within(..);
    let half = mesh.triangles.len() / 2;
    mesh.triangles[half..].iter_mut().flatten().for_each(|v| *v += count);
    let wall = Wall::welded(&mesh).unwrap();
    let found = ExtractedCentreline::of(&wall, None, &[]).unwrap();
    assert_eq!((found.tree.targets().len(), found.unreached.len()), (1, 2));
    let missed = CentrelineEnd::Opening(found.unreached[0]);
    let error = ExtractedCentreline::of(&wall, None, &[missed]).unwrap_err().to_string();
    assert!(error.contains("no way inside the vessel leads there"), "{error}");
}

#[test]
fn a_way_does_not_cross_the_gap_of_a_ring_that_is_cut_open() {
    use std::f64::consts::TAU;
    let (ring_mm, tube_mm, rows, columns) = (30.0, 4.0, 160u32, 24u32);
    // The ends are 4.7 mm apart.
    let whole = TAU - 4.7 / ring_mm;
    let place = |i: u32, j: u32| {
        let (along, around) =
            (whole * f64::from(i) / f64::from(rows), TAU * f64::from(j) / f64::from(columns));
        let out = Vec3::new(along.cos(), along.sin(), 0.0);
        out * (ring_mm + tube_mm * around.cos()) + Vec3::z() * (tube_mm * around.sin())
    };
    let vertices_mm = (0..=rows).flat_map(|i| (0..columns).map(move |j| place(i, j))).collect();
    let number = |i: u32, j: u32| i * columns + j % columns;
    let quad = |(i, j): (u32, u32)| {
        let [a, b] = [number(i, j), number(i, j + 1)];
        let [c, d] = [number(i + 1, j), number(i + 1, j + 1)];
        [[a, c, b], [b, c, d]]
    };
    let places = (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j)));
    let mesh = crate::vessel::SurfaceMesh { vertices_mm, triangles: places.flat_map(quad).collect() };
    let wall = Wall::from_surface(&mesh).unwrap();
    let found = ExtractedCentreline::of(&wall, Some(CentrelineEnd::Opening(0)), &[]).unwrap();
    let [branch] = found.tree.branches()[..] else { panic!("{found:?}") };
    assert!((branch.length_mm - whole * ring_mm).abs() < 2.0, "{branch:?}");
    // Nor do the extensions of the contact surface of its ends meet.
    let reach: f64 = wall.openings().iter().map(|opening| opening.beyond_mm).sum();
    assert!(reach > 4.0 && reach < 4.7, "{reach}");
}

/// A box from z = −40 to 0 with a pyramid on it, whose apex is at z = 40.
fn spike() -> Wall {
    let corner = |k: usize| {
        let side = |bit: usize| if k >> bit & 1 == 1 { 3.0 } else { -3.0 };
        Vec3::new(side(0), side(1), if k > 3 { 0.0 } else { -40.0 })
    };
    let vertices_mm = (0..8).map(corner).chain([Vec3::z() * 40.0]).collect();
    let quads = [[0, 2, 3, 1], [0, 1, 5, 4], [1, 3, 7, 5], [3, 2, 6, 7], [2, 0, 4, 6]];
    let halves = quads.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
    let triangles = halves.chain([[4, 5, 8], [5, 7, 8], [7, 6, 8], [6, 4, 8]]).collect();
    Wall::from_surface(&SurfaceMesh { vertices_mm, triangles }).unwrap()
}

#[test]
fn a_way_leads_into_a_pointed_corner_and_out_of_it() {
    let wall = spike();
    let place = |x: f64, z: f64| CentrelineEnd::Place(Vec3::new(x, 0.6 * x, z));
    for (from, to) in [(place(0.0, -30.0), place(0.1, 38.0)), (place(0.0, 36.0), place(1.0, -35.0))] {
        let found = ExtractedCentreline::of(&wall, Some(from), &[to]).unwrap();
        let way = found.tree.path_to(found.tree.targets()[0].row).unwrap();
        assert!((way.length_mm() - 69.5).abs() < 2.5, "{}", way.length_mm());
        assert!(found.tree.nodes().iter().all(|node| wall.contains(&node.position_mm).unwrap()));
    }
    // Twin: there is no way into another piece of the surface.
    let mut two = wall.mesh().clone();
    let count = two.vertices_mm.len() as u32;
    two.vertices_mm.extend_from_within(..);
    two.vertices_mm[count as usize..].iter_mut().for_each(|x| x.x += 10.0);
    two.triangles.extend(wall.mesh().triangles.iter().map(|t| t.map(|v| v + count)));
    let two = Wall::from_surface(&two).unwrap();
    let other = CentrelineEnd::Place(Vec3::new(10.0, 0.0, 38.0));
    let error = ExtractedCentreline::of(&two, Some(place(0.0, -30.0)), &[other]).unwrap_err().to_string();
    assert!(error.contains("no way inside the vessel leads there"), "{error}");
    let error = ExtractedCentreline::of(&wall, None, &[other]).unwrap_err().to_string();
    assert!(error.starts_with("from = none: the surface has no opening: give a place inside"), "{error}");
}
