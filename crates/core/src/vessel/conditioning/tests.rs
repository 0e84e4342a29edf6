//! What conditioning leaves unchanged, makes uniform, and preserves.

use std::f64::consts::TAU;

use super::*;
use crate::vessel::{CentrelineNode, CentrelineTree, GeneratedWall, Resolution, Wall, anatomy, check};

fn conditioned(mesh: &SurfaceMesh) -> Conditioned<'_> {
    condition(mesh, &Conditioning::default()).unwrap()
}

/// Reproducible pseudorandom numbers between 0 and 1.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// A tube of radius 2 mm along z, open at both ends: rings at the given heights, vertices at given angles.
fn tube(heights: &[f64], angles: &[f64]) -> SurfaceMesh {
    let mut mesh = SurfaceMesh::default();
    let around = angles.len() as u32;
    for z in heights {
        mesh.vertices_mm.extend(angles.iter().map(|a| Vec3::new(2.0 * a.cos(), 2.0 * a.sin(), *z)));
    }
    for i in 0..heights.len() as u32 - 1 {
        for k in 0..around {
            let l = (k + 1) % around;
            let (p, q, r, s) = (i * around + k, i * around + l, (i + 1) * around + k, (i + 1) * around + l);
            mesh.triangles.extend([[p, q, r], [q, s, r]]);
        }
    }
    mesh
}

/// Steps whose lengths span three decades, from 0 to `length`.
fn uneven(length: f64, count: usize, seed: u64) -> Vec<f64> {
    let mut numbers = Numbers(seed);
    let steps: Vec<f64> = (0..count).map(|_| 10f64.powf(-3.0 * numbers.next())).collect();
    let sum: f64 = steps.iter().sum();
    let mut at = 0.0;
    let mut all = vec![0.0];
    for step in steps {
        at += step * length / sum;
        all.push(at);
    }
    all
}

fn even(length: f64, count: usize) -> Vec<f64> {
    (0..=count).map(|i| length * i as f64 / count as f64).collect()
}

/// A tube with extremely irregular triangles.
fn uneven_tube(seed: u64) -> SurfaceMesh {
    let mut angles = even(TAU, 24);
    angles.pop();
    // Slivers beside regular facets.
    angles.extend([0.003, 1.5704, 3.3]);
    angles.sort_by(f64::total_cmp);
    tube(&uneven(20.0, 60, seed), &angles)
}

/// Largest distance of vertices and centres of triangles from the true tube.
fn off_tube(mesh: &SurfaceMesh) -> f64 {
    let off = |v: &Vec3| (v.x.hypot(v.y) - 2.0).abs();
    let centre = |i: usize| mesh.middle(i);
    let centres = (0..mesh.triangles.len()).map(|i| off(&centre(i)));
    mesh.vertices_mm.iter().map(off).chain(centres).fold(0.0, f64::max)
}

#[test]
fn generated_walls_are_returned_bit_for_bit() {
    for (name, edges) in [
        ("straight_tube", vec![0.8, 1.25, 3.0]),
        ("curved_tube", vec![1.2, 2.4]),
        ("aortic_arch", vec![2.25, 4.0]),
        ("hepatic", vec![1.1]),
    ] {
        let tree = anatomy::tree(name).unwrap();
        for edge_mm in edges {
            let wall = GeneratedWall::new(&tree, Resolution::EdgeMm(edge_mm)).unwrap().wall;
            let found = conditioned(wall.mesh());
            assert!(!found.changed, "{name} {edge_mm}: {found:?}");
            assert_eq!(&*found.mesh, wall.mesh());
        }
    }
}

#[test]
fn a_regular_grid_of_three_to_one_is_fine() {
    let mut angles = even(TAU, 24);
    angles.pop();
    let mesh = tube(&even(20.0, 13), &angles);
    assert!(!conditioned(&mesh).changed);
}

#[test]
fn an_uneven_tube_comes_back_even_and_within_the_limit() {
    let mesh = uneven_tube(1);
    let found = conditioned(&mesh);
    assert!(found.changed && !found.too_many);
    let before = check(&mesh).unwrap();
    assert!(before.edge_max_mm / before.edge_min_mm > 1000.0, "{before:?}");
    // Rims are preserved; elsewhere no edge is short.
    assert!(
        found.edge_max_mm < 1.3 && found.edge_median_mm > 0.25,
        "{:?}",
        (found.edge_max_mm, found.edge_median_mm)
    );
    assert!(
        found.least_angle > 0.2 && found.largest_turn < 0.5,
        "{} {}",
        found.least_angle,
        found.largest_turn
    );
    assert!(off_tube(&found.mesh) < 0.1);
}

#[test]
fn meshings_of_one_tube_come_out_within_the_limit_of_each_other() {
    let mut angles = even(TAU, 31);
    angles.pop();
    // Facets five times as long as wide, and steps over three decades: both are within the limit from the tube.
    for mesh in [tube(&even(20.0, 10), &angles), uneven_tube(7)] {
        let found = conditioned(&mesh);
        assert!(found.changed && off_tube(&found.mesh) < 0.1, "{}", off_tube(&found.mesh));
    }
}

#[test]
fn openings_and_topology_are_kept() {
    let mesh = uneven_tube(2);
    let (before, after) = (check(&mesh).unwrap(), check(&conditioned(&mesh).mesh).unwrap());
    assert!(after.is_sound(), "{after:?}");
    assert_eq!((after.openings.len(), after.components), (before.openings.len(), before.components));
    assert!((after.volume_mm3 / before.volume_mm3 - 1.0).abs() < 0.03);
}

#[test]
fn the_same_surface_gives_the_same_mesh() {
    let mesh = uneven_tube(3);
    assert_eq!(conditioned(&mesh), conditioned(&mesh));
}

#[test]
fn soups_do_not_panic() {
    for seed in 0..8 {
        let mut numbers = Numbers(seed);
        let points = 4 + (40.0 * numbers.next()) as usize;
        let vertices_mm = (0..points)
            .map(|_| Vec3::new(10.0 * numbers.next(), 10.0 * numbers.next(), (10.0 * numbers.next()).floor()))
            .collect();
        let mut mesh = SurfaceMesh { vertices_mm, triangles: Vec::new() };
        for _ in 0..3 * points {
            mesh.triangles.push([0; 3].map(|_: u32| (points as f64 * numbers.next()) as u32));
        }
        let options = Conditioning { most_triangles: 2000, ..Conditioning::default() };
        let found = condition(&mesh, &options).unwrap();
        assert!(found.mesh.vertices_mm.iter().all(|v| v.iter().all(|c| c.is_finite())));
        assert!(found.mesh.triangles.iter().flatten().all(|&v| (v as usize) < found.mesh.vertices_mm.len()));
    }
}

#[test]
fn a_wall_made_of_what_comes_out_is_sound() {
    let wall = Wall::from_surface(&conditioned(&uneven_tube(4)).mesh).unwrap();
    assert_eq!(wall.openings().len(), 2);
    assert!(wall.report().notes().is_empty(), "{:?}", wall.report());
}

#[test]
fn options_out_of_range_are_named() {
    let mesh = uneven_tube(5);
    let with =
        |deviation_mm: f64| condition(&mesh, &Conditioning { deviation_mm, ..Conditioning::default() });
    for value in [0.0, f64::NAN, 10.1, 1e9, f64::INFINITY] {
        let error = with(value).unwrap_err().to_string();
        assert!(error.starts_with("deviation_mm = ") && error.contains("at most 10"), "{error}");
    }
    assert!(with(0.05).is_ok() && with(10.0).is_ok());
}

/// A closed box.
fn cuboid(low: Vec3, size: Vec3, cell: f64) -> SurfaceMesh {
    Wall::welded(&SurfaceMesh::cuboid(low, low + size, cell)).unwrap().mesh().clone()
}

fn joined(a: &SurfaceMesh, b: &SurfaceMesh) -> SurfaceMesh {
    let (mut mesh, first) = (a.clone(), a.vertices_mm.len() as u32);
    mesh.vertices_mm.extend(&b.vertices_mm);
    mesh.triangles.extend(b.triangles.iter().map(|t| t.map(|v| v + first)));
    mesh
}

/// A closed tube along z from `from_mm` on.
fn closed_tube(from_mm: f64, length_mm: f64, radius_mm: f64) -> SurfaceMesh {
    let node = |z_mm: f64, parent: Option<usize>| CentrelineNode {
        position_mm: Vec3::z() * z_mm,
        radius_mm,
        parent,
    };
    let tree = CentrelineTree::new(vec![node(from_mm, None), node(from_mm + length_mm, Some(0))]).unwrap();
    GeneratedWall::new(&tree, Resolution::EdgeMm(1.0)).unwrap().wall.closed_mesh()
}

#[test]
fn passages_that_few_devices_pass_are_meshed_as_wider_ones() {
    let count = |gap_mm: f64| {
        let mut plug = closed_tube(6.0, 5.0, 2.0 - gap_mm);
        plug.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        conditioned(&joined(&closed_tube(0.0, 16.0, 2.0), &plug)).mesh.triangles.len()
    };
    let counts = [0.1, 0.2, 0.3].map(count);
    let (least, most) = (counts[0].min(counts[1]).min(counts[2]), counts[0].max(counts[1]).max(counts[2]));
    assert!(most < 2 * least, "{counts:?}");
}

#[test]
fn two_components_are_as_far_apart_as_they_were() {
    // Two adjacent lumens: a septum of 0.15 mm between parallel sheets.
    let size = Vec3::new(10.0, 6.0, 4.0);
    let above = Vec3::new(0.0, 0.0, size.z + 0.15);
    let mesh = joined(&cuboid(Vec3::zeros(), size, 3.0), &cuboid(above, size, 2.0));
    let found = conditioned(&mesh);
    let report = check(&found.mesh).unwrap();
    assert!(found.changed && report.components == 2 && report.self_intersections == 0, "{report:?}");
    let middle = size.z + 0.075;
    assert!(found.mesh.vertices_mm.iter().all(|v| (v.z - middle).abs() > 0.02));
}

#[test]
fn a_spike_is_cut_off() {
    let mut mesh = uneven_tube(6);
    let (least, _) = mesh
        .vertices_mm
        .iter()
        .enumerate()
        .min_by(|a, b| (a.1.z - 10.0).abs().total_cmp(&(b.1.z - 10.0).abs()))
        .unwrap();
    let out = Vec3::new(mesh.vertices_mm[least].x, mesh.vertices_mm[least].y, 0.0).normalize();
    mesh.vertices_mm[least] += out * 3.0;
    let found = conditioned(&mesh);
    assert!(
        found.largest_turn < 1.92 && found.least_angle > 0.2,
        "{} {}",
        found.largest_turn,
        found.least_angle
    );
    assert_eq!(check(&found.mesh).unwrap().self_intersections, 0);
}

#[test]
fn duplicated_triangles_do_no_harm() {
    let mut mesh = uneven_tube(8);
    mesh.triangles.extend(mesh.triangles.clone().iter().step_by(97));
    let found = conditioned(&mesh);
    assert!(found.mesh.vertices_mm.iter().all(|v| v.iter().all(|c| c.is_finite())));
    assert!(off_tube(&found.mesh) < 0.2, "{}", off_tube(&found.mesh));
}

/// Mean bump of a mesh, in edges.
fn roughness(mesh: &SurfaceMesh) -> f64 {
    let mut corners = Corners::new(mesh, 0.1);
    corners.set_normals();
    fairing::roughness(&corners)
}

#[test]
fn a_smooth_tube_has_no_bumps_however_it_is_meshed_and_a_noisy_one_has() {
    let mut numbers = Numbers(3);
    // Eight vertices around, and 24 that are displaced along the tube by a fifth of an edge.
    let coarse: Vec<f64> = (0..8).map(|k| TAU * f64::from(k) / 8.0).collect();
    let coarse = tube(&even(20.0, 13), &coarse);
    let fine: Vec<f64> = (0..24).map(|k| TAU * (f64::from(k) + 0.4 * numbers.next()) / 24.0).collect();
    let mut fine = tube(&even(20.0, 38), &fine);
    for v in fine.vertices_mm.iter_mut().filter(|v| v.z > 1.0 && v.z < 19.0) {
        v.z += 0.2 * (numbers.next() - 0.5);
    }
    for mesh in [&coarse, &fine] {
        assert!(roughness(mesh) < 0.4 * ROUGH, "{}", roughness(mesh));
    }
    // Noise of a fortieth of an edge of 0.52 mm.
    let mut noisy = fine;
    for v in &mut noisy.vertices_mm {
        let off = 1.0 + 0.5 * (0.0258 * (numbers.next() - 0.5));
        (v.x, v.y) = (v.x * off, v.y * off);
    }
    assert!(roughness(&noisy) > ROUGH, "{}", roughness(&noisy));
}
