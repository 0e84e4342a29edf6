//! Recipes of walls and of centre lines computed from them: keys under which costly results can be stored.

use serde::Serialize;

use super::{
    CentrelineEnd, CentrelineTree, Conditioning, ExtractedCentreline, GeneratedWall, RepairOptions,
    Resolution, SurfaceMesh, Wall, condition,
};
use crate::Result;

/// All inputs that determine the bits of a costly wall. Different recipes serialise differently.
#[derive(Debug, Clone, Copy, Serialize)]
pub enum WallRecipe<'a> {
    /// The wall of a centre-line tree, [`GeneratedWall`].
    Generated {
        /// The tree.
        tree: &'a CentrelineTree,
        /// Its resolution.
        resolution: Resolution,
    },
    /// A repaired surface, [`Wall::repaired`].
    Repaired {
        /// The surface as given, mm.
        surface: &'a SurfaceMesh,
        /// What is repaired.
        options: &'a RepairOptions,
    },
    /// The uniform mesh of a wall for contact, [`Wall::with_even_rims`] and [`condition`].
    Even {
        /// The wall.
        wall: &'a Wall,
        /// Limits of the changes to its mesh.
        options: Conditioning,
    },
}

impl WallRecipe<'_> {
    /// Makes the wall.
    ///
    /// # Errors
    /// As [`GeneratedWall::new`], [`Wall::repaired`] and [`condition`].
    pub fn make(&self) -> Result<Wall> {
        match self {
            Self::Generated { tree, resolution } => Ok(GeneratedWall::new(tree, *resolution)?.wall),
            Self::Repaired { surface, options } => Wall::repaired(surface, options),
            Self::Even { wall, options } => {
                let trimmed = wall.with_even_rims()?;
                let even = condition(trimmed.mesh(), options)?;
                // A mesh that is already uniform keeps its vertex numbers.
                if even.changed { Wall::welded(&even.mesh) } else { Ok(trimmed.into_owned()) }
            }
        }
    }
}

/// All inputs that determine the bits of a centre line computed from a wall.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct CentrelineRecipe<'a> {
    /// The wall.
    pub wall: &'a Wall,
    /// Its start; [`Wall::inlet`] if `None`. It leads to all other openings.
    pub from: Option<CentrelineEnd>,
}

impl CentrelineRecipe<'_> {
    /// Computes the centre line.
    ///
    /// # Errors
    /// As [`ExtractedCentreline::of`].
    pub fn make(&self) -> Result<CentrelineTree> {
        ExtractedCentreline::of(self.wall, self.from, &[]).map(|found| found.tree)
    }
}

/// Storage of costly walls and their centre lines. The core has none: a program provides it.
pub trait WallStore {
    /// The wall of a recipe, stored or made, bitwise equal to [`WallRecipe::make`].
    ///
    /// # Errors
    /// Those of [`WallRecipe::make`]. Failures of the store are not errors: then the wall is made.
    fn wall(&self, recipe: &WallRecipe<'_>) -> Result<Wall>;

    /// The centre line of a recipe, stored or computed, bitwise equal to [`CentrelineRecipe::make`].
    ///
    /// # Errors
    /// Those of [`CentrelineRecipe::make`].
    fn centreline(&self, recipe: &CentrelineRecipe<'_>) -> Result<CentrelineTree>;
}

/// Stores nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoStore;

impl WallStore for NoStore {
    fn wall(&self, recipe: &WallRecipe<'_>) -> Result<Wall> {
        recipe.make()
    }

    fn centreline(&self, recipe: &CentrelineRecipe<'_>) -> Result<CentrelineTree> {
        recipe.make()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vec3;
    use crate::vessel::{RepairMode, anatomy};

    fn tube() -> Wall {
        let tree = anatomy::tree("curved_tube").unwrap();
        WallRecipe::Generated { tree: &tree, resolution: Resolution::EdgeMm(1.5) }.make().unwrap()
    }

    #[test]
    fn recipes_that_make_different_walls_are_written_differently() {
        let mut trees = ["curved_tube", "straight_tube"].map(|name| anatomy::tree(name).unwrap());
        trees.sort_by_key(|tree| tree.nodes().len());
        let wall = tube();
        let mut moved = wall.mesh().clone();
        moved.vertices_mm[7].x = f64::from_bits(moved.vertices_mm[7].x.to_bits() + 1);
        let moved_wall = Wall::welded(&moved).unwrap();
        let coarse = Conditioning { deviation_mm: 0.2, ..Conditioning::default() };
        let fewer = Conditioning { most_triangles: 1000, ..Conditioning::default() };
        let generated = |tree, resolution| WallRecipe::Generated { tree, resolution };
        let even = |wall, options| WallRecipe::Even { wall, options };
        let repaired = |surface, options| WallRecipe::Repaired { surface, options };
        let options = [
            RepairOptions::default(),
            RepairOptions { mode: RepairMode::None, ..RepairOptions::default() },
            RepairOptions { keep_open_mm: vec![Vec3::x()], ..RepairOptions::default() },
        ];
        let recipes = [
            generated(&trees[0], Resolution::EdgeMm(1.0)),
            generated(&trees[0], Resolution::EdgeMm(2.0)),
            generated(&trees[0], Resolution::Triangles(1)),
            generated(&trees[1], Resolution::EdgeMm(1.0)),
            repaired(wall.mesh(), &options[0]),
            repaired(&moved, &options[0]),
            repaired(&moved, &options[1]),
            repaired(&moved, &options[2]),
            even(&wall, Conditioning::default()),
            even(&moved_wall, Conditioning::default()),
            even(&wall, coarse),
            even(&wall, fewer),
        ];
        let written: std::collections::BTreeSet<String> =
            recipes.iter().map(|recipe| serde_json::to_string(recipe).unwrap()).collect();
        assert_eq!(written.len(), recipes.len());
    }

    #[test]
    fn a_wall_that_was_written_and_read_is_the_same_wall() {
        let mut surface = tube().mesh().clone();
        // Something to repair and report.
        surface.triangles.swap_remove(5);
        surface.triangles[9].swap(0, 1);
        let wall = Wall::from_surface(&surface).unwrap();
        let report = wall.report();
        assert!(report.triangles_flipped > 0 && report.holes_filled > 0, "{report:?}");
        let read: Wall = serde_json::from_str(&serde_json::to_string(&wall).unwrap()).unwrap();
        assert_eq!(read.mesh(), wall.mesh());
        assert_eq!(read.report(), report);
        assert_eq!(read.openings(), wall.openings());
        assert_eq!(read.caps(), wall.caps());
    }

    #[test]
    fn stored_walls_that_are_damaged_are_refused() {
        let written = serde_json::to_string(&tube()).unwrap();
        let odd = written.replacen("\"triangles\":[[", "\"triangles\":[[4000000,1,2],[", 1);
        assert_ne!(odd, written);
        let refused = serde_json::from_str::<Wall>(&odd).unwrap_err().to_string();
        assert!(refused.contains("beyond the last one"), "{refused}");
    }
}
