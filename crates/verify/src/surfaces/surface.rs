//! A surface ready for its insertions.

use std::path::PathBuf;

use crate::crossing::CrossingTest;
use endowire_core::contact::{ContactMesh, WallProperties};
use endowire_core::insertion::Sheath;
use endowire_core::vessel::{
    Conditioning, NoStore, RepairOptions, SurfaceFrame, SurfaceMesh, Wall, WallQuery, WallRecipe, WallStore,
};
use endowire_core::{Error, Result};

use super::start::{Found, at_opening, inside};
use super::{SurfaceFile, Wire};

/// Default for the longest insertion, mm.
const LENGTH_MM: f64 = 400.0;
/// The same in sizes of the vessel: by then a wire has passed through it, or coils up in it.
const LENGTH_IN_SIZES: f64 = 2.0;

/// A wire that fits into a surface, and its entry.
#[derive(Debug, Clone)]
pub struct Place {
    /// The wire.
    pub wire: Wire,
    /// Where it enters.
    pub sheath: Sheath,
    /// How the entry was found.
    pub found: Found,
    /// Stated distance of the wire's contact surface from the repaired surface, mm; at least the target.
    pub stated_mm: f64,
    /// Distance of the smooth wall from the triangles that it is made of, mm.
    pub smooth_mm: f64,
}

/// A surface, repaired into a wall, with data shared by its insertions.
#[derive(Debug)]
pub struct Surface {
    /// Name in tables and patterns.
    pub name: String,
    /// File.
    pub path: PathBuf,
    /// Coordinate frame of the file.
    pub frame: SurfaceFrame,
    /// The wall to insert into.
    pub wall: Wall,
    /// The triangles as they were given, before any repair.
    pub given: CrossingTest,
    /// The triangles of the contact surface, as `endowire vessel check --felt` writes them.
    pub felt: CrossingTest,
    /// These triangles as a wall.
    pub even: Wall,
    /// Longest side of the surface's bounding box, mm.
    pub size_mm: f64,
    /// Length to insert, mm.
    pub length_mm: f64,
    /// The wires that fit, with their entries.
    pub places: Vec<Place>,
    /// The wires that do not fit, and why.
    pub skipped: Vec<String>,
}

impl Surface {
    /// Reads a surface, takes its wall from `store` and finds the entries of the wires.
    ///
    /// # Errors
    /// A file that cannot be read or repaired, or an impossible sheath.
    pub fn read(file: &SurfaceFile, store: &dyn WallStore) -> Result<Self> {
        let mesh = SurfaceMesh::read(&file.path, file.frame)?;
        let wall = store
            .wall(&WallRecipe::Repaired { surface: &mesh, options: &RepairOptions::default() })
            .map_err(|e| Error::content(&file.path, e.to_string()))?;
        let aimed = Conditioning::default();
        let even = store.wall(&WallRecipe::Even { wall: &wall, options: aimed })?;
        // Without remeshing.
        let properties = WallProperties { deviation_mm: 0.0, ..WallProperties::default() };
        let (low, high) = wall.mesh().bounds_mm().unwrap_or_default();
        let size_mm = (high - low).amax();
        let mut surface = Self {
            name: file.name.clone(),
            path: file.path.clone(),
            frame: file.frame,
            given: CrossingTest::new(&mesh),
            felt: CrossingTest::new(even.mesh()),
            size_mm,
            length_mm: file.sidecar.length_mm.unwrap_or_else(|| LENGTH_MM.min(LENGTH_IN_SIZES * size_mm)),
            places: Vec::new(),
            skipped: Vec::new(),
            even,
            wall,
        };
        let query = WallQuery::new(&surface.wall)?;
        let wires = file.wires();
        let thinnest_mm = wires.iter().map(|w| w.radius_mm).fold(f64::MAX, f64::min);
        let given = file.sidecar.sheath.as_ref().map(|sheath| sheath.place(&surface.wall)).transpose()?;
        // Openings that not even the thinnest wire can enter are cracks.
        let open = given.is_some() || at_opening(&surface.wall, &query, thinnest_mm).is_some();
        for wire in wires {
            let radius_mm = wire.radius_mm;
            let (room_mm, start) = match given {
                Some(sheath) => {
                    let room =
                        query.nearest(&sheath.position_mm, f64::MAX).map(|near| near.distance_mm.abs());
                    // Other errors of a given sheath are reported by the insertion.
                    (room, room.is_none_or(|room| room > radius_mm).then_some((sheath, Found::Given)))
                }
                None if open => (None, at_opening(&surface.wall, &query, radius_mm)),
                None => (None, inside(&surface.wall, &query, radius_mm)),
            };
            match start {
                Some((sheath, found)) => {
                    let felt = ContactMesh::new(&surface.even, radius_mm, &properties, &NoStore)?;
                    let stated_mm = felt.deviation(&surface.wall)?.most_mm.max(aimed.deviation_mm);
                    let smooth_mm = felt.deviation(&surface.even)?.most_mm;
                    surface.places.push(Place { wire, sheath, found, stated_mm, smooth_mm });
                }
                None => {
                    let room =
                        room_mm.map_or_else(String::new, |room| format!(", the wall is {room:.3} mm away"));
                    let name = wire.name();
                    surface.skipped.push(if given.is_some() || open {
                        format!("{name} is too thick at the sheath{room}")
                    } else {
                        format!("{name}: no place inside was found: give [sheath] position_mm and direction")
                    });
                }
            }
        }
        Ok(surface)
    }
}

/// A tube of radius 4 mm along z from the origin.
#[cfg(test)]
pub(super) fn straight_tube(length_mm: f64) -> SurfaceMesh {
    use endowire_core::Vec3;
    use endowire_core::vessel::{CentrelineNode, CentrelineTree, GeneratedWall, Resolution};
    let node = |z_mm: f64, parent: Option<usize>| CentrelineNode {
        position_mm: Vec3::z() * z_mm,
        radius_mm: 4.0,
        parent,
    };
    let tree = CentrelineTree::new(vec![node(0.0, None), node(length_mm, Some(0))]).unwrap();
    GeneratedWall::new(&tree, Resolution::EdgeMm(1.5)).unwrap().wall.mesh().clone()
}
