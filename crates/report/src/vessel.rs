//! The vessel on a page: reduced to few triangles, since it is redrawn with every rotation.

use std::collections::HashMap;

use endowire_core::Vec3;
use endowire_core::vessel::SurfaceMesh;
use serde::Serialize;

use crate::run::scaled;

/// Largest number of triangles.
const MOST: usize = 6000;

/// The vessel for drawing.
#[derive(Debug, Clone, Serialize)]
pub struct Vessel {
    /// Coordinates x y z of its vertices, in tenths of a millimetre.
    vertices: Vec<i32>,
    triangles: Vec<[u32; 3]>,
}

impl Vessel {
    /// The reduced vessel of a mesh.
    pub fn of(mesh: &SurfaceMesh) -> Self {
        let mesh = simplified(mesh);
        let vertices = mesh.vertices_mm.iter().flat_map(|v| scaled(v, 10.0)).collect();
        Self { vertices, triangles: mesh.triangles }
    }
}

/// Merges nearby vertices of the mesh until it has few triangles.
fn simplified(mesh: &SurfaceMesh) -> SurfaceMesh {
    let Some((low, high)) = mesh.bounds_mm() else { return mesh.clone() };
    if mesh.triangles.len() <= MOST {
        return mesh.clone();
    }
    let mut cell_mm = (high - low).amax() / 150.0;
    loop {
        let coarse = clustered(mesh, &low, cell_mm);
        if coarse.triangles.len() <= MOST {
            return coarse;
        }
        cell_mm *= 1.2;
    }
}

fn clustered(mesh: &SurfaceMesh, low: &Vec3, cell_mm: f64) -> SurfaceMesh {
    let mut cells: HashMap<[i64; 3], u32> = HashMap::new();
    let mut sums: Vec<(Vec3, f64)> = Vec::new();
    let of: Vec<u32> = mesh
        .vertices_mm
        .iter()
        .map(|vertex| {
            let place = (vertex - low) / cell_mm;
            let cell = [place.x as i64, place.y as i64, place.z as i64];
            let number = *cells.entry(cell).or_insert_with(|| {
                sums.push((Vec3::zeros(), 0.0));
                sums.len() as u32 - 1
            });
            let (sum, count) = &mut sums[number as usize];
            *sum += vertex;
            *count += 1.0;
            number
        })
        .collect();
    let triangles = mesh.triangles.iter().map(|t| t.map(|v| of[v as usize]));
    let triangles = triangles.filter(|[a, b, c]| a != b && b != c && a != c).collect();
    SurfaceMesh { vertices_mm: sums.into_iter().map(|(sum, count)| sum / count).collect(), triangles }
}
