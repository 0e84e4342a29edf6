//! The smooth wall about an oblique, jagged rim along triangles of a surface made from voxels.

use super::surface::{ContactSurface, Hint};
use crate::Vec3;
use crate::insertion::WallProperties;
use crate::random::{splitmix64, unit};
use crate::vessel::{NoStore, SurfaceMesh, Wall};

/// Edge, mm.
const EDGE_MM: f64 = 0.9;
/// Radius of the tube, mm.
const RADIUS_MM: f64 = 4.0;

/// A pseudorandom number, -1 to 1.
fn noise(seed: u64, n: u64) -> f64 {
    2.0 * unit(splitmix64(seed, n)) - 1.0
}

/// Height of a point above the cut, mm.
fn above_cut(x: &Vec3) -> f64 {
    x.z - 20.0 - 0.45 * x.x
}

/// A tube along z with the unevenness of voxels, which ends in a rim with teeth of one edge.
fn stump(seed: u64) -> Wall {
    let (rows, columns) = (32, 28);
    let mut mesh = SurfaceMesh::default();
    for j in 0..rows {
        for i in 0..columns {
            let angle = std::f64::consts::TAU * (f64::from(i) + 0.5 * f64::from(j % 2)) / f64::from(columns);
            let r = RADIUS_MM + 0.25 * noise(seed, u64::from(j * columns + i));
            mesh.vertices_mm.push(Vec3::new(r * angle.cos(), r * angle.sin(), EDGE_MM * f64::from(j)));
        }
    }
    for j in 0..rows - 1 {
        for i in 0..columns {
            let next = (i + 1) % columns;
            let at = |i: u32, j: u32| j * columns + i;
            let [a, b, c, d] = [at(i, j), at(next, j), at(next, j + 1), at(i, j + 1)];
            let both = if j % 2 == 0 { [[a, b, d], [b, c, d]] } else { [[a, b, c], [a, c, d]] };
            for triangle in both {
                let middle: Vec3 = triangle.iter().map(|v| mesh.vertices_mm[*v as usize]).sum::<Vec3>() / 3.0;
                let tooth =
                    EDGE_MM * noise(seed + 1000, u64::from(triangle[0]) * 2 + u64::from(triangle[1] == b));
                if above_cut(&middle) < tooth {
                    mesh.triangles.push([triangle[0], triangle[2], triangle[1]]);
                }
            }
        }
    }
    // What is attached by a corner only is not vessel.
    let mut whole = vec![mesh.triangles[0]];
    let mut rest = mesh.triangles.split_off(1);
    loop {
        let shares = |t: &[u32; 3]| whole.iter().any(|w| w.iter().filter(|v| t.contains(v)).count() == 2);
        let (beside, others): (Vec<_>, Vec<_>) = rest.iter().partition(|t| shares(t));
        if beside.is_empty() {
            break;
        }
        whole.extend(beside);
        rest = others;
    }
    mesh.triangles = whole;
    Wall::welded(&mesh).unwrap()
}

#[test]
fn no_spikes_stand_on_the_teeth_of_a_rim() {
    let mut all = [0.0f64; 2];
    for seed in 0..12 {
        let surface =
            ContactSurface::new(&stump(seed), (0.178, 0.178), &WallProperties::default(), &NoStore).unwrap();
        let mut farthest = [0.0f64; 2];
        for k in 0..20_000 {
            let [angle, r, up] = [0, 1, 2].map(|n| unit(splitmix64(seed, 3 * k + n)));
            let (angle, r) = (std::f64::consts::TAU * angle, RADIUS_MM * r.sqrt());
            let x = r * angle.cos();
            let x = Vec3::new(x, r * angle.sin(), 20.0 + 0.45 * x + 6.0 * (up - 0.5));
            let Some((triangle, flat_mm)) = surface.nearest_piece(&x, surface.reach_mm) else { continue };
            if flat_mm < 0.2 {
                continue;
            }
            let felt_mm = surface.nearness(&x, Hint::Near(triangle), f64::INFINITY).value_mm();
            let place = usize::from(felt_mm > flat_mm);
            farthest[place] = farthest[place].max((felt_mm - flat_mm).abs());
        }
        all = [all[0].max(farthest[0]), all[1].max(farthest[1])];
    }
    // With the teeth in the fit, it stands up to 3.2 mm before the flat one.
    assert!(all[0] < 0.3 && all[1] < 0.2, "{all:?}");
}
