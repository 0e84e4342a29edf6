//! The smooth wall over a sharp ridge that stands into the lumen, finely meshed on its crest and coarsely on its flanks.

use super::surface::{ContactSurface, Hint};
use crate::Vec3;
use crate::insertion::WallProperties;
use crate::vessel::{NoStore, SurfaceMesh, Wall};

/// Distances from the crest at which the flanks have vertices, mm: edges grow by a half from one to the next.
const ROWS: [f64; 7] = [0.0, 0.45, 1.1, 2.1, 3.6, 5.6, 7.6];
/// Slope of the flanks.
const SLOPE: f64 = 1.6;

/// A channel along the y axis with a ridge on its floor, its crest through the origin.
fn ridge() -> Wall {
    let floor = ROWS[1..].iter().rev().map(|x| -x).chain(ROWS).map(|x| (x, -SLOPE * x.abs()));
    let ceiling = [7.6, 3.8, 0.0, -3.8, -7.6].map(|x| (x, 5.0));
    let around: Vec<(f64, f64)> = floor.chain(ceiling).collect();
    let (rows, columns) = (21, around.len() as u32);
    let mut mesh = SurfaceMesh::default();
    for j in 0..rows {
        for (i, (x, z)) in around.iter().enumerate() {
            let y = (f64::from(j) - 10.0) * 0.8 + if i % 2 == 0 { 0.0 } else { 0.2 };
            mesh.vertices_mm.push(Vec3::new(*x, y, *z));
        }
    }
    for j in 0..rows - 1 {
        for i in 0..columns {
            let next = (i + 1) % columns;
            let [a, b, c, d] = [(i, j), (next, j), (next, j + 1), (i, j + 1)].map(|(i, j)| j * columns + i);
            mesh.triangles.extend([[a, c, b], [a, d, c]]);
        }
    }
    Wall::welded(&mesh).unwrap()
}

pub(super) fn surface() -> ContactSurface {
    let properties = WallProperties { deviation_mm: 0.0, ..WallProperties::default() };
    ContactSurface::new(&ridge(), (0.2, 0.2), &properties, &NoStore).unwrap()
}

/// Points up to a millimetre above the crest and the upper flanks.
pub(super) fn points() -> impl Iterator<Item = Vec3> {
    (0..4000).map(|i| {
        let i = f64::from(i);
        let (x, y) = (0.8 * (2.399 * i).sin(), 1.7 * (0.37 * i).sin());
        Vec3::new(x, y, -SLOPE * x.abs() + 0.55 + 0.5 * (1.13 * i).sin())
    })
}

#[test]
fn neither_flank_goes_on_beyond_the_crest() {
    let surface = surface();
    let mut farthest = 0.0f64;
    for x in points() {
        let (triangle, flat_mm) = surface.nearest_piece(&x, 5.0).unwrap();
        let felt_mm = surface.nearness(&x, Hint::Near(triangle), f64::INFINITY).value_mm();
        farthest = farthest.max((felt_mm - flat_mm).abs());
    }
    // Part of an edge of the crest is rounded off; flanks extended to the ends of their supports would be wrong by
    // 0.77 mm.
    assert!(farthest < 0.5, "{farthest}");
}

#[test]
fn derivatives_are_those_of_the_value_there_too() {
    let surface = surface();
    let surface = surface.mesh().unwrap();
    let h = 1e-6;
    let mut narrowed = 0;
    for x in points() {
        let triangle = surface.query.nearest(&x, 5.0).unwrap().triangle;
        let Some((here, coverage, slope)) = surface.smooth.covered(&x, triangle) else { continue };
        // At the surface the front distance begins to blend into the back distance: third derivatives jump there.
        if coverage < 0.1 || here.value_mm.abs() < 2.0 * h {
            continue;
        }
        let at = |x: Vec3| surface.smooth.covered(&x, triangle).unwrap();
        let steep = 1e-4 * (1.0 + here.hessian.norm());
        for k in 0..3 {
            let (plus, minus) = (at(x + Vec3::ith(k, h)), at(x - Vec3::ith(k, h)));
            let rate = (plus.0.value_mm - minus.0.value_mm) / (2.0 * h);
            assert!((rate - here.gradient[k]).abs() < 1e-5 * (1.0 + here.gradient.norm()), "{rate} {here:?}");
            let column = (plus.0.gradient - minus.0.gradient) / (2.0 * h);
            assert!((column - here.hessian.column(k)).norm() < steep, "{column} {here:?}");
            assert!(((plus.1 - minus.1) / (2.0 * h) - slope[k]).abs() < 1e-5 * (1.0 + slope.norm()));
        }
        narrowed += usize::from(coverage < 0.2);
    }
    assert!(narrowed > 20, "{narrowed} points near the rims of supports");
}
