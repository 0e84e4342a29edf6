//! A rod between flat walls.

use endowire_core::insertion::{WallProperties, WallRegion};
use endowire_core::shape::Frame;
use endowire_core::statics::{WallRod, WallRodSpec};
use endowire_core::vessel::{SurfaceMesh, Wall};
use endowire_core::{Result, Vec3};

/// Stiffness of the plates at a node, relative to that of a rod of the element's length.
const PLATES: f64 = 1e3;

/// A straight rod along x from the origin, clamped there, in a channel whose walls are the planes y = floor and y = ceiling.
///
/// Two rigid plates without clearance hold the nodes in the plane z = 0: between flat walls alone a buckled rod could
/// turn about its axis and escape. In the plane they have no effect.
pub(super) fn channel(setup: &WallRodSpec, heights: [f64; 2]) -> Result<WallRod> {
    with_regions(setup, heights, 0.25 * setup.length, Vec::new())
}

/// The same with `region`s in walls whose triangles have sides of about `cell`.
pub(super) fn with_regions(
    setup: &WallRodSpec,
    [floor, ceiling]: [f64; 2],
    cell: f64,
    region: Vec<WallRegion>,
) -> Result<WallRod> {
    let (length, radius) = (setup.length, setup.radius);
    // So far away that the box's edges have no effect: each of three steps (the edge is moved in, vertices reach it,
    // points reach these vertices) extends over at most a diagonal and a half of a cell.
    let lateral = cell * (6.0 * (radius / cell).max(1.0)).ceil();
    let low = Vec3::new(-lateral, floor, -lateral);
    let high = Vec3::new(length + lateral, ceiling, lateral);
    let wall = Wall::from_surface(&SurfaceMesh::cuboid(low, high, cell))?;
    // Planes need no other mesh, and the box's edges must not be rounded.
    let properties = WallProperties {
        modulus_n_per_mm2: setup.modulus,
        deviation_mm: 0.0,
        region,
        ..WallProperties::default()
    };
    let straight = Frame::new(Vec3::x(), Some(Vec3::y()));
    let mut rod = WallRod::on_wall(&wall, &properties, setup, Vec3::zeros(), |_| straight)?;
    let h = rod.element_length(0);
    rod.plates = PLATES * setup.bending / (h * h * h);
    Ok(rod)
}
