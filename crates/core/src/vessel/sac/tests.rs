use std::f64::consts::PI;

use std::collections::BTreeMap;

use super::*;
use crate::vessel::{ExtractedCentreline, GeneratedWall, Resolution, SurfaceMesh, anatomy};

fn measured(name: &str, edge_mm: f64) -> (Sac, f64) {
    let tree = anatomy::tree(name).unwrap();
    let made = GeneratedWall::new(&tree, Resolution::EdgeMm(edge_mm)).unwrap();
    let dome_mm = tree.nodes()[tree.target("dome").unwrap().row].position_mm;
    let parent_mm = tree.nodes()[3].position_mm;
    // Off the middle, like a mouse click.
    let click_mm = dome_mm + Vec3::new(1.0, 0.5, 0.7);
    (Sac::measure(&made.wall, click_mm, parent_mm).unwrap(), made.wall.volume_mm3())
}

#[test]
fn a_sac_is_the_ball_that_it_was_made_of_and_its_neck_is_narrow() {
    let (sac, _) = measured("sidewall_aneurysm", 0.4);
    assert!((sac.dome_diameter_mm - 7.0).abs() < 0.15, "{sac:?}");
    // The artery's fillet widens the tube of 3.2 mm from which it was made.
    assert!((3.2..4.2).contains(&sac.neck_diameter_mm), "{sac:?}");
    assert!(sac.normal.y > 0.95, "{sac:?}");
    // A ball of 7 mm without the cap beyond the neck.
    let cap_mm = 3.5 - (3.5f64.powi(2) - 0.25 * sac.neck_diameter_mm.powi(2)).sqrt();
    let ball_mm3 = 4.0 / 3.0 * PI * 3.5f64.powi(3) - PI * cap_mm * cap_mm * (3.5 - cap_mm / 3.0);
    assert!((sac.volume_mm3 / ball_mm3 - 1.0).abs() < 0.03, "{sac:?} {ball_mm3}");
    assert!((sac.height_mm - (7.0 - cap_mm)).abs() < 0.3, "{sac:?}");
}

#[test]
fn the_sac_neck_does_not_depend_on_the_mesh() {
    let ((coarse, whole_mm3), (fine, _)) =
        (measured("basilar_aneurysm", 0.6), measured("basilar_aneurysm", 0.35));
    assert!((coarse.neck_area_mm2 / fine.neck_area_mm2 - 1.0).abs() < 0.05, "{coarse:?} {fine:?}");
    assert!((coarse.volume_mm3 / fine.volume_mm3 - 1.0).abs() < 0.03, "{coarse:?} {fine:?}");
    // A line from one artery to the other may run through the sac.
    let tree = anatomy::tree("basilar_aneurysm").unwrap();
    let wall = GeneratedWall::new(&tree, Resolution::EdgeMm(0.6)).unwrap().wall;
    let dome_mm = tree.nodes()[8].position_mm;
    let line = ExtractedCentreline::of(&wall, None, &[]).unwrap().tree;
    let found = Sac::on_artery(&wall, dome_mm, &line).unwrap();
    assert!((found.neck_area_mm2 / coarse.neck_area_mm2 - 1.0).abs() < 0.05, "{found:?}");
    assert!((fine.dome_diameter_mm - 8.0).abs() < 0.2 && fine.volume_mm3 < 0.5 * whole_mm3);
}

#[test]
fn a_place_without_a_sac_is_refused() {
    let tree = anatomy::tree("sidewall_aneurysm").unwrap();
    let wall = GeneratedWall::new(&tree, Resolution::EdgeMm(0.8)).unwrap().wall;
    let at = |row: usize| tree.nodes()[row].position_mm;
    let refused = |dome, parent| Sac::measure(&wall, dome, parent).unwrap_err().to_string();
    assert!(refused(at(5) + Vec3::new(0.0, 0.0, -1.0), at(2)).contains("no plane"));
    assert!(refused(Vec3::new(50.0, 0.0, 0.0), at(2)).contains("within the sac"));
    assert!(refused(at(10), at(9)).contains("begins within the sac"));
    assert!(refused(at(10), Vec3::new(50.0, 0.0, 0.0)).contains("within the artery"));
}

/// Edge of the cubes in which surfaces are made, mm.
const CUBE_MM: f64 = 0.4;
/// Number of vertices in a ring of a surface of revolution.
const IN_RING: u32 = 32;
/// Corners of the six tetrahedra of a cube about its diagonal.
const TETRAHEDRA: [[usize; 4]; 6] =
    [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]];

/// The wall where a function of the position is zero, negative inside, in a box at whose sides it is open; turned and
/// displaced.
fn wall_of(inside: impl Fn(&Vec3) -> f64, [low, high]: [Vec3; 2], placed: impl Fn(Vec3) -> Vec3) -> Wall {
    let size = [0, 1, 2].map(|k| ((high[k] - low[k]) / CUBE_MM).ceil() as usize + 1);
    let at = |n: usize| {
        let [x, y, z] = [n % size[0], n / size[0] % size[1], n / size[0] / size[1]].map(|k| k as f64);
        low + Vec3::new(x, y, z) * CUBE_MM
    };
    let values: Vec<f64> = (0..size.iter().product()).map(|n| inside(&at(n))).collect();
    let mut mesh = SurfaceMesh::default();
    let mut known = BTreeMap::new();
    let mut vertex = |mesh: &mut SurfaceMesh, a: usize, b: usize| {
        *known.entry((a.min(b), a.max(b))).or_insert_with(|| {
            let (from, to) = if values[a] < 0.0 { (at(a), at(b)) } else { (at(b), at(a)) };
            // Not at the corners themselves: triangles there would be points, and the wall pierced without them.
            let (mut within, mut beyond) = (0.02, 0.98);
            for _ in 0..20 {
                let middle = (within + beyond) / 2.0;
                *(if inside(&(from + (to - from) * middle)) < 0.0 { &mut within } else { &mut beyond }) =
                    middle;
            }
            mesh.vertices_mm.push(placed(from + (to - from) * within));
            mesh.vertices_mm.len() as u32 - 1
        })
    };
    for cube in (0..values.len())
        .filter(|n| (0..3).all(|k| n / [1, size[0], size[0] * size[1]][k] % size[k] + 1 < size[k]))
    {
        let corner = |k: usize| cube + k % 2 + k / 2 % 2 * size[0] + k / 4 * size[0] * size[1];
        for tetrahedron in TETRAHEDRA {
            let corners = tetrahedron.map(corner);
            let (inner, outer): (Vec<_>, Vec<_>) = corners.into_iter().partition(|n| values[*n] < 0.0);
            let mut v = |a: usize, b: usize| vertex(&mut mesh, a, b);
            let ring: Vec<u32> = match (&inner[..], &outer[..]) {
                ([a], [b, c, d]) | ([b, c, d], [a]) => vec![v(*a, *b), v(*a, *c), v(*a, *d)],
                ([a, b], [c, d]) => vec![v(*a, *c), v(*a, *d), v(*b, *d), v(*b, *c)],
                _ => vec![],
            };
            mesh.triangles.extend((2..ring.len()).map(|k| [ring[0], ring[k - 1], ring[k]]));
        }
    }
    let wall = Wall::from_surface(&mesh).unwrap();
    assert_eq!(wall.report().degenerate_removed, 0);
    wall
}

/// Whether the neck is as wide as a circle: edges between two parts are blunt by a cube, which widens it a little.
fn is_wide(sac: &Sac, radius_mm: f64) -> bool {
    (0.0..CUBE_MM / 4.0).contains(&(sac.neck_diameter_mm / 2.0 - radius_mm))
}

fn ball(centre: Vec3, radius: f64) -> impl Fn(&Vec3) -> f64 {
    move |x| (x - centre).norm() - radius
}

fn tube(radius: f64) -> impl Fn(&Vec3) -> f64 {
    move |x| x.xy().norm() - radius
}

/// A turn about an axis oblique to all, and a displacement.
fn elsewhere(x: Vec3) -> Vec3 {
    let frame = Frame::new(Vec3::new(0.3, -0.8, 0.5), None).turned(1.3);
    frame.t * x.x + frame.u * x.y + frame.v * x.z + Vec3::new(30.0, -50.0, 400.0)
}

/// A box around a tube along z with a sac beside it.
const BOX: [Vec3; 2] = [Vec3::new(-4.53, -2.53, -6.03), Vec3::new(4.53, 10.03, 6.03)];

#[test]
fn the_neck_of_a_ball_on_a_tube_is_the_plane_that_touches_the_tube_whatever_the_place_in_the_artery() {
    // The ball of 4 mm about y = 5 is cut by the plane y = 2, on which the tube of 2 mm lies.
    let exact_mm3 = 4.0 / 3.0 * PI * 64.0 - PI * (4.0 - 1.0 / 3.0);
    let inside = |x: &Vec3| ball(Vec3::y() * 5.0, 4.0)(x).min(tube(2.0)(x));
    let mut areas_mm2 = vec![];
    let mut check = |sac: Result<Sac>, placed: fn(Vec3) -> Vec3| {
        let sac = sac.unwrap();
        assert!(is_wide(&sac, 7.0f64.sqrt()), "{sac:?}");
        assert!((sac.volume_mm3 / exact_mm3 - 1.0).abs() < 0.01, "{sac:?}");
        // The area changes little with the normal.
        let normal = placed(Vec3::y()) - placed(Vec3::zeros());
        assert!(sac.normal.dot(&normal) > libm::cos(2.0f64.to_radians()), "{sac:?}");
        assert!((sac.neck_mm - placed(Vec3::y() * 2.0)).norm() < 0.1, "{sac:?}");
        areas_mm2.push(sac.neck_area_mm2);
    };
    let dome_mm = Vec3::new(0.5, 6.0, -0.3);
    let wall = wall_of(inside, BOX, |x| x);
    check(Sac::measure(&wall, dome_mm, Vec3::z() * 3.0), |x| x);
    let wall = wall_of(inside, BOX, elsewhere);
    for z in [0.0, -5.5] {
        let parent_mm = elsewhere(Vec3::new(0.2, -0.4, z));
        check(Sac::measure(&wall, elsewhere(dome_mm), parent_mm), elsewhere);
    }
    let line = ExtractedCentreline::of(&wall, None, &[]).unwrap().tree;
    check(Sac::on_artery(&wall, elsewhere(dome_mm), &line), elsewhere);
    let [low, high] = [f64::min, f64::max].map(|of| areas_mm2.iter().copied().fold(areas_mm2[0], of));
    assert!(high / low < 1.005, "{areas_mm2:?}");
}

#[test]
fn the_neck_of_a_ball_on_a_pipe_is_the_pipes_waist() {
    let exact_mm2 = PI * 1.2 * 1.2;
    let pipe = |x: &Vec3| {
        let radius = 1.2 + 0.2 * (x.y - 3.0).powi(2);
        (libm::hypot(x.x, x.z) - radius).max(-x.y).max(x.y - 5.0)
    };
    let inside = |x: &Vec3| ball(Vec3::y() * 6.5, 3.0)(x).min(tube(2.0)(x)).min(pipe(x));
    let wall = wall_of(inside, BOX, elsewhere);
    for z in [0.0, 5.5] {
        let parent_mm = elsewhere(Vec3::new(0.2, -0.4, z));
        let sac = Sac::measure(&wall, elsewhere(Vec3::y() * 7.0), parent_mm).unwrap();
        assert!((sac.neck_area_mm2 / exact_mm2 - 1.0).abs() < 0.03, "{z}: {sac:?}");
        assert!((sac.neck_mm - elsewhere(Vec3::y() * 3.0)).norm() < 0.2, "{z}: {sac:?}");
    }
}

#[test]
fn a_straight_neck_ends_where_the_sac_begins() {
    // A ball of 3 mm about the origin on a pipe of 1.2 mm, narrower by a ten thousandth of that at its other end, in a
    // wide artery.
    let begin_mm = -(9.0f64 - 1.2 * 1.2).sqrt();
    let angle = libm::acos(begin_mm / 3.0);
    let ball =
        (1..=16).map(|k| libm::sincos(angle * f64::from(k) / 16.0)).map(|(sin, cos)| (3.0 * cos, 3.0 * sin));
    let pipe = (1..=8).map(|k| (begin_mm - 0.25 * f64::from(k), 1.2 - 1.5e-5 * f64::from(k)));
    let artery = (1..=8).map(|k| (begin_mm - 2.0 - 0.5 * f64::from(k), 1.2 + 0.5 * f64::from(k)));
    let rings: Vec<(f64, f64)> = ball.chain(pipe).chain(artery).collect();
    let mut mesh = SurfaceMesh { vertices_mm: vec![Vec3::y() * 3.0], triangles: vec![] };
    for (ring, (y, radius)) in (0..).zip(&rings) {
        for k in 0..IN_RING {
            let (sin, cos) = libm::sincos(2.0 * PI * f64::from(k) / f64::from(IN_RING));
            mesh.vertices_mm.push(Vec3::new(radius * sin, *y, radius * cos));
            let [a, b] = [k, (k + 1) % IN_RING].map(|k| 1 + ring * IN_RING + k);
            match ring {
                0 => mesh.triangles.push([0, a, b]),
                _ => mesh.triangles.extend([[a - IN_RING, a, b], [a - IN_RING, b, b - IN_RING]]),
            }
        }
    }
    mesh.vertices_mm.iter_mut().for_each(|v| *v = elsewhere(*v));
    let wall = Wall::from_surface(&mesh).unwrap();
    let place = |y: f64| elsewhere(Vec3::y() * y);
    let sac = Sac::measure(&wall, place(0.5), place(begin_mm - 5.0)).unwrap();
    assert!((sac.neck_mm - place(begin_mm)).norm() < 0.05, "{sac:?} {:?}", place(begin_mm));
    assert!((sac.height_mm - 3.0 + begin_mm).abs() < 0.05, "{sac:?}");
}

#[test]
fn the_neck_at_a_fork_and_between_two_lobes() {
    // A trunk from below divides to both sides under a ball of 3.6 mm.
    let trunk = |x: &Vec3| (libm::hypot(x.x, x.z) - 2.2).max(x.y);
    let fork = |x: &Vec3| ball(Vec3::y() * 4.6, 3.6)(x).min(tube(1.9)(x)).min(trunk(x));
    let wall = wall_of(fork, [Vec3::new(-4.53, -7.03, -7.03), Vec3::new(4.53, 10.03, 7.03)], elsewhere);
    for parent_mm in [Vec3::new(0.0, -6.0, 0.0), Vec3::new(0.3, 0.0, 4.0)] {
        let sac = Sac::measure(&wall, elsewhere(Vec3::y() * 5.0), elsewhere(parent_mm)).unwrap();
        assert!(is_wide(&sac, (3.6f64.powi(2) - 2.7f64.powi(2)).sqrt()), "{parent_mm}: {sac:?}");
    }
    // Two lobes one above the other: the plane between them for a place in the upper, that at the tube for one in
    // the lower.
    let lobes = |x: &Vec3| ball(Vec3::y() * 4.0, 3.0)(x).min(ball(Vec3::y() * 7.5, 2.0)(x)).min(tube(2.0)(x));
    let wall = wall_of(lobes, BOX, |x| x);
    let between_mm = 4.0 + (3.0f64.powi(2) - 2.0f64.powi(2) + 3.5f64.powi(2)) / 7.0;
    for (dome, radius_mm) in [(7.7, (9.0 - (between_mm - 4.0).powi(2)).sqrt()), (4.0, 5.0f64.sqrt())] {
        let sac = Sac::measure(&wall, Vec3::y() * dome, Vec3::z() * 5.5).unwrap();
        assert!(is_wide(&sac, radius_mm), "{dome}: {sac:?}");
    }
}
