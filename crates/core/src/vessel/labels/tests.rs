//! Label maps of shapes with exact radii, lengths and volumes.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Rotation3};

use super::*;
use crate::vessel::topology::EdgeTable;
use crate::vessel::{ExtractedCentreline, Wall};

/// A map of label 1 where `is_in` holds at a voxel's centre, of voxels with these sides.
fn map(size: [usize; 3], sides_mm: [f64; 3], is_in: impl Fn(Vec3) -> bool) -> LabelMap {
    placed(size, Matrix3::from_diagonal(&Vec3::from(sides_mm)), Vec3::zeros(), is_in)
}

fn placed(size: [usize; 3], axes: Matrix3<f64>, origin: Vec3, is_in: impl Fn(Vec3) -> bool) -> LabelMap {
    let [nx, ny, nz] = size;
    let mut labels = Vec::with_capacity(nx * ny * nz);
    for z in 0..nz {
        for y in 0..ny {
            for x in 0..nx {
                let at = origin + axes * Vec3::new(x as f64, y as f64, z as f64);
                labels.push(u16::from(is_in(at)));
            }
        }
    }
    LabelMap::new(size, axes, origin, labels).unwrap()
}

fn made(map: &LabelMap) -> LabelSurface {
    LabelSurface::of(map, &LabelOptions::of(&[1])).unwrap()
}

/// Distance from the axis through `centre`.
fn off_axis(x: Vec3, centre: Vec3, axis: Vec3) -> f64 {
    let offset = x - centre;
    (offset - axis * offset.dot(&axis)).norm()
}

fn open_edges(mesh: &SurfaceMesh) -> usize {
    EdgeTable::new(&mesh.triangles).edges().filter(|uses| uses.len() == 1).count()
}

/// Errors of radius (of the cylinder with the volume between the openings) and of the centre line's length, and the
/// number of openings, of a tube that leaves the picture on both sides.
fn tube(radius_mm: f64, axis: Vec3, sides_mm: [f64; 3]) -> (f64, f64, usize) {
    let (axis, centre) = (axis.normalize(), Vec3::new(30.3, 30.7, 30.45));
    let size = sides_mm.map(|side| (61.0 / side) as usize);
    let surface = made(&map(size, sides_mm, |x| off_axis(x, centre, axis) < radius_mm));
    let wall = Wall::from_surface(&surface.mesh).unwrap();
    let [a, b] = [0, 1].map(|k| wall.openings()[k].centre_mm);
    // Both openings are across the axis, so the distance of their planes along it is the exact length.
    let exact_mm = (b - a).dot(&axis).abs();
    let radius = (wall.volume_mm3() / (PI * exact_mm)).sqrt();
    let line = ExtractedCentreline::of(&wall, None, &[]).unwrap().tree.branches()[0].length_mm;
    (radius / radius_mm - 1.0, line / exact_mm - 1.0, wall.openings().len())
}

#[test]
fn tubes_of_three_voxels_and_more_keep_radius_and_length() {
    let mut missed = Vec::new();
    for (radius_mm, sides_mm, bounds) in [
        // The centre of a thin label wanders by a fifth of a voxel, and the line with it.
        (1.5, [1.0; 3], [0.02, 0.02]),
        (2.0, [1.0; 3], [0.02, 0.015]),
        (3.0, [1.0; 3], [0.01, 0.01]),
        (6.0, [1.0; 3], [0.01, 0.01]),
        (4.0, [1.0, 1.0, 2.5], [0.02, 0.01]),
    ] {
        for axis in [Vec3::new(0.3, 0.5, 1.0), Vec3::new(0.55, 0.2, 1.0), Vec3::new(0.2, 1.0, 0.37)] {
            let (radius, length, openings) = tube(radius_mm, axis, sides_mm);
            let told = format!("radius {radius_mm}, axis {axis:?}: {radius:.4} {length:.4} {openings}");
            println!("{told}");
            if radius.abs() > bounds[0] || length.abs() > bounds[1] || openings != 2 {
                missed.push(told);
            }
        }
    }
    assert!(missed.is_empty(), "{missed:#?}");
}

#[test]
fn openings_are_across_the_vessel_and_not_along_the_border() {
    let axis = Vec3::new(0.55, 0.2, 1.0).normalize();
    let centre = Vec3::new(30.3, 30.7, 30.45);
    let surface = made(&map([61; 3], [1.0; 3], |x| off_axis(x, centre, axis) < 5.0));
    let ends = &surface.report.ends;
    assert_eq!(ends.len(), 2);
    for end in ends {
        let direction = Vec3::from(end.direction.unwrap());
        assert!(direction.dot(&axis).abs() > 0.999, "{direction:?}");
        assert_eq!(end.kind, EndKind::Border);
    }
    // The border itself is 30° off: the twin.
    assert!(Vec3::z().dot(&axis) < 0.87);
}

#[test]
fn spheres_keep_their_volume_and_are_closed() {
    for (radius_mm, bound) in [(6.0, 0.02), (12.0, 0.003)] {
        let centre = Vec3::new(20.3, 20.7, 20.45);
        let surface = made(&map([41; 3], [1.0; 3], |x| (x - centre).norm() < radius_mm));
        let volume = surface.mesh.signed_volume_mm3() / (4.0 / 3.0 * PI * radius_mm.powi(3));
        assert!((volume - 1.0).abs() < bound, "{radius_mm}: {volume}");
        assert!(surface.report.volume_error.abs() < 1e-3, "{}", surface.report.volume_error);
        let off = surface.mesh.vertices_mm.iter().map(|x| ((x - centre).norm() / radius_mm - 1.0).abs());
        assert!(off.fold(0.0, f64::max) < 0.05);
        assert_eq!((surface.report.ends.len(), open_edges(&surface.mesh)), (0, 0));
        assert!(surface.report.notes().iter().any(|note| note.contains("closed")));
    }
}

#[test]
fn placement_moves_the_surface_and_nothing_else() {
    let plain = made(&map([31, 33, 35], [0.8, 0.8, 1.5], |x| {
        off_axis(x, Vec3::new(12.0, 13.0, 20.0), Vec3::new(0.2, 0.1, 1.0).normalize()) < 3.2
    }));
    let turn = Rotation3::from_euler_angles(0.4, -0.3, 1.1).into_inner();
    // The first index runs backwards.
    let flip = Matrix3::from_diagonal(&Vec3::new(-1.0, 1.0, 1.0));
    let sides = Matrix3::from_diagonal(&Vec3::new(0.8, 0.8, 1.5));
    for axes in [turn * sides, turn * sides * flip] {
        let flipped = axes.determinant() < 0.0;
        let mut origin = Vec3::new(-100.0, 50.0, 7.0);
        if flipped {
            origin -= axes.column(0) * 30.0;
        }
        let back = |x: Vec3| turn.transpose() * (x - Vec3::new(-100.0, 50.0, 7.0));
        let other = made(&placed([31, 33, 35], axes, origin, |x| {
            off_axis(back(x), Vec3::new(12.0, 13.0, 20.0), Vec3::new(0.2, 0.1, 1.0).normalize()) < 3.2
        }));
        assert_eq!(other.report.ends.len(), 2);
        let volumes = [&plain, &other].map(|made| Wall::from_surface(&made.mesh).unwrap().volume_mm3());
        assert!(volumes[1] > 0.0 && (volumes[1] / volumes[0] - 1.0).abs() < 0.01, "{volumes:?}");
        let axis = Vec3::new(0.2, 0.1, 1.0).normalize();
        let off =
            other.mesh.vertices_mm.iter().map(|x| off_axis(back(*x), Vec3::new(12.0, 13.0, 20.0), axis));
        assert!(off.fold(0.0, f64::max) < 3.2 + 0.8, "the surface lies elsewhere");
    }
}

#[test]
fn branches_that_end_within_the_picture_are_opened_and_domes_are_not() {
    // A trunk along z through the picture, a branch along x that ends within it, and a sac on the other side.
    let branch =
        |x: &Vec3| x.x > 30.0 && x.x < 52.0 && (x.yz() - nalgebra::Vector2::new(30.3, 30.6)).norm() < 2.5;
    let sac = |x: &Vec3| (x - Vec3::new(21.0, 30.3, 15.2)).norm() < 5.5;
    let trunk = |x: &Vec3| (x.xy() - nalgebra::Vector2::new(30.4, 30.2)).norm() < 5.0;
    let surface = made(&map([61; 3], [1.0; 3], |x| trunk(&x) || branch(&x) || sac(&x)));
    let kinds: Vec<EndKind> = surface.report.ends.iter().map(|end| end.kind).collect();
    assert_eq!(kinds.iter().filter(|kind| **kind == EndKind::Border).count(), 2, "{:?}", surface.report);
    assert_eq!(kinds.iter().filter(|kind| **kind == EndKind::Blunt).count(), 1, "{:?}", surface.report);
    let wall = Wall::from_surface(&surface.mesh).unwrap();
    assert_eq!(wall.openings().len(), 3);
    let blunt = wall.openings().iter().find(|opening| opening.centre_mm.x > 40.0).unwrap();
    assert!(blunt.direction.x > 0.99 && (blunt.radius_mm - 2.5).abs() < 0.3, "{blunt:?}");
    assert!((46.0..52.0).contains(&blunt.centre_mm.x), "{blunt:?}");
    // Only the border's, and none.
    for (ends, openings) in [(Ends::Border, 2), (Ends::None, 0)] {
        let options = LabelOptions { ends, ..LabelOptions::of(&[1]) };
        let map = map([61; 3], [1.0; 3], |x| trunk(&x) || branch(&x) || sac(&x));
        let surface = LabelSurface::of(&map, &options).unwrap();
        assert_eq!(Wall::from_surface(&surface.mesh).unwrap().openings().len(), openings);
    }
}

#[test]
fn a_picture_cut_to_the_label_has_no_ends_at_its_sides() {
    // Half a circle whose top touches the border of a picture that is no larger than it.
    let is_in = |x: Vec3| {
        let ring = libm::hypot(x.x - 22.3, x.z) - 18.0;
        libm::hypot(ring, x.y - 4.3) < 4.2
    };
    let surface = made(&map([45, 9, 23], [1.0; 3], is_in));
    assert_eq!(surface.report.ends.len(), 2, "{:?}", surface.report);
    for end in &surface.report.ends {
        assert!(Vec3::from(end.direction.unwrap()).z < -0.9, "{end:?}");
    }
    assert!(surface.report.border_touches > 0);
}

#[test]
fn rings_are_named_and_have_no_ends() {
    let torus = |x: Vec3| libm::hypot(libm::hypot(x.x - 20.3, x.y - 20.2) - 14.0, x.z - 6.4) < 3.0;
    let surface = made(&map([41, 41, 13], [1.0; 3], torus));
    assert_eq!((surface.report.rings, surface.report.ends.len()), (1, 0), "{:?}", surface.report);
    assert!(surface.report.notes()[0].contains("a ring"), "{:?}", surface.report.notes());
    let open = made(&map([41, 41, 13], [1.0; 3], |x| torus(x) && (x.x > 20.0 || (x.y - 20.2).abs() > 5.0)));
    assert_eq!((open.report.rings, open.report.ends.len()), (0, 2), "the twin");
}

#[test]
fn what_is_wrong_with_a_label_is_named() {
    let mut labels = vec![0; 1000];
    labels[..9].fill(3);
    labels[500] = 7;
    let map = LabelMap::new([10; 3], Matrix3::identity(), Vec3::zeros(), labels).unwrap();
    let message = |labels: &[u16]| LabelSurface::of(&map, &LabelOptions::of(labels)).unwrap_err().to_string();
    assert_eq!(message(&[5]), "label = 5: has no voxel: it has the labels 3 (9 voxels), 7 (1 voxels)");
    assert!(message(&[0]).contains("background"));
    assert!(message(&[]).contains("name at least one"));
    assert!(message(&[7]).contains("has 1 voxels; a vessel needs at least 8"), "{}", message(&[7]));
    let empty = LabelMap::new([2; 3], Matrix3::identity(), Vec3::zeros(), vec![0; 8]).unwrap();
    let none = LabelSurface::of(&empty, &LabelOptions::of(&[1])).unwrap_err().to_string();
    assert!(none.contains("nothing is labelled"), "{none}");
    assert!(LabelMap::new([3; 3], Matrix3::identity(), Vec3::zeros(), vec![0; 8]).is_err());
    assert!(LabelMap::new([2; 3], Matrix3::zeros(), Vec3::zeros(), vec![0; 8]).is_err());
    // A row of nine voxels: thin, but a vessel.
    let thin = made(&map_of(&map, 3));
    assert!(thin.report.notes().iter().any(|note| note.contains("single voxel thick")));
}

/// The same map with one label as label 1.
fn map_of(map: &LabelMap, label: u16) -> LabelMap {
    let labels = map.labels().iter().map(|of| u16::from(*of == label)).collect();
    LabelMap::new(map.size(), *map.axes_mm(), map.origin_mm(), labels).unwrap()
}

#[test]
fn two_labels_are_one_vessel_and_parts_are_reported() {
    let tube = |x: Vec3| (x.xy() - nalgebra::Vector2::new(10.3, 10.4)).norm() < 4.0;
    let mut map = map([21, 21, 41], [1.0; 3], |x| tube(x) && (x.z - 30.0).abs() > 2.0);
    let upper = |index: usize| index / (21 * 21) >= 15;
    let labels = map.labels().iter().enumerate().map(|(k, label)| *label * if upper(k) { 2 } else { 1 });
    map = LabelMap::new([21, 21, 41], *map.axes_mm(), map.origin_mm(), labels.collect()).unwrap();
    let both = LabelSurface::of(&map, &LabelOptions::of(&[1, 2])).unwrap();
    let lower = LabelSurface::of(&map, &LabelOptions::of(&[1])).unwrap();
    assert_eq!(both.report.labels.len(), 2);
    let height = |surface: &LabelSurface| surface.mesh.bounds_mm().map(|(low, high)| high.z - low.z).unwrap();
    assert!(height(&both) > 20.0 && height(&lower) < 15.0);
    assert_eq!(both.report.parts, 2);
    assert!(both.report.left_out_voxels > 0 && both.report.notes()[0].contains("2 parts"));
    let all = LabelOptions { parts: Parts::All, ..LabelOptions::of(&[1, 2]) };
    let all = LabelSurface::of(&map, &all).unwrap();
    assert_eq!((all.report.left_out_voxels, height(&all) > 38.0), (0, true));
}

#[test]
fn hollows_of_labels_are_filled_and_reported() {
    let centre = Vec3::repeat(10.2);
    let hollow = map([21; 3], [1.0; 3], |x| (3.0..8.0).contains(&(x - centre).norm()));
    let solid = map([21; 3], [1.0; 3], |x| (x - centre).norm() < 8.0);
    let (hollow, solid) = (made(&hollow), made(&solid));
    assert_eq!(hollow.mesh, solid.mesh);
    assert!(hollow.report.filled_voxels > 90 && solid.report.filled_voxels == 0);
}

#[test]
fn any_label_map_gives_closed_surfaces_whose_edges_have_two_triangles() {
    let mut joined = 0;
    for seed in 0..40 {
        let mut next = 0;
        let mut word = || {
            next += 1;
            crate::random::splitmix64(seed, next)
        };
        let share = 20 + seed % 60;
        let labels: Vec<u16> = (0..12 * 11 * 10).map(|_| u16::from(word() % 100 < share)).collect();
        let map = LabelMap::new([12, 11, 10], Matrix3::identity(), Vec3::zeros(), labels).unwrap();
        let options = LabelOptions { parts: Parts::All, ends: Ends::None, ..LabelOptions::of(&[1]) };
        let Ok(surface) = LabelSurface::of(&map, &options) else { continue };
        joined += surface.report.joined_voxels;
        let table = EdgeTable::new(&surface.mesh.triangles);
        assert!(table.edges().all(|uses| uses.len() == 2 && uses[0].forward != uses[1].forward), "{seed}");
        assert!(surface.mesh.vertices_mm.iter().all(|x| x.iter().all(|k| k.is_finite())));
        assert!(surface.mesh.signed_volume_mm3() > 0.0);
    }
    assert!(joined > 0, "no map had an edge to be joined");
}

#[test]
fn a_surface_is_the_same_every_time() {
    let is_in = |x: Vec3| off_axis(x, Vec3::repeat(15.3), Vec3::new(0.3, 0.5, 1.0).normalize()) < 3.0;
    let map = map([31; 3], [1.0; 3], is_in);
    assert_eq!(made(&map).mesh, made(&map).mesh);
}
