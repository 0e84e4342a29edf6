//! The `[view]` table of a scene file. The core reads the rest.

use std::path::Path;
use std::sync::Arc;

use endowire_core::flow::check_place;
use endowire_core::input::parse_toml;
use endowire_core::methods::MethodChoice;
use endowire_core::scene::SceneOf;
use endowire_core::vessel::{ExtractedCentreline, Wall, WallStore};
use endowire_core::{Error, Result};
use serde::Deserialize;
use serde::de::DeserializeOwned;

use super::ViewSpec;
use crate::contrast::read_tree;

/// The viewer's part of a scene file.
#[derive(Deserialize)]
struct ViewTable {
    #[serde(default)]
    view: ViewSpec,
}

impl ViewSpec {
    /// The `[view]` table of a scene read from `path`: paths are relative to its folder, and contrast medium flows in
    /// the vessel's own tree, or the centre line given with its surface.
    ///
    /// # Errors
    /// [`endowire_core::Error::Content`] for an invalid table, naming line and key.
    pub fn of_scene<M: MethodChoice + DeserializeOwned + Default>(
        scene: &SceneOf<M>,
        path: &Path,
    ) -> Result<Self> {
        let ViewTable { view } = parse_toml(scene.text(), path)?;
        let mut view = view.in_folder(&scene.resolve(Path::new("")));
        view.patient.vessel_moves = !scene.vessel.motion.is_empty();
        let own = scene.vessel.tree.as_ref().or(scene.vessel.centreline.as_ref());
        if let (None, Some(tree)) = (&view.flow.tree, own) {
            view.flow.tree = Some(scene.resolve(tree));
        }
        Ok(view)
    }

    /// Uses a centre line computed from the scene's surface, stored in `store`, for contrast medium if none is given.
    ///
    /// # Errors
    /// As [`SceneOf::centreline`].
    pub fn take_centreline<M: MethodChoice + DeserializeOwned + Default>(
        &mut self,
        scene: &SceneOf<M>,
        store: &dyn WallStore,
    ) -> Result<()> {
        if self.flow.tree.is_none() && self.flow.centreline.is_none() {
            self.flow.centreline = Some(Arc::new(scene.centreline(store)?.clone()));
        }
        Ok(())
    }

    /// Refuses injections at a place outside the vessel. This is for the places that a file gives: a tip injects
    /// wherever it is.
    ///
    /// # Errors
    /// [`Error::Parameter`] for such a place, and the errors of the table of the centre line.
    pub fn check_places(&self) -> Result<()> {
        let mut places =
            self.injection.iter().enumerate().filter_map(|(i, one)| Some((i, one.at_mm?))).peekable();
        if places.peek().is_none() {
            return Ok(());
        }
        let given = self.flow.tree.as_deref().map(read_tree).transpose()?;
        let Some(tree) = given.as_ref().or(self.flow.centreline.as_deref()) else { return Ok(()) };
        places.try_for_each(|(number, at_mm)| {
            check_place(tree, at_mm.into(), &format!("view.injection[{number}].at_mm"))
        })
    }

    /// As [`Self::take_centreline`], with only the surface given, without a store.
    ///
    /// # Errors
    /// A surface from which no centre line can be computed.
    pub fn find_centreline(&mut self, wall: &Wall) -> Result<()> {
        if self.flow.tree.is_none() && self.flow.centreline.is_none() {
            let found = ExtractedCentreline::of(wall, None, &[]).map_err(|error| {
                let remedy =
                    format!("none is found in the surface ({error}): name a table of its centre line");
                Error::parameter("view.flow.tree", "none", remedy)
            })?;
            self.flow.centreline = Some(Arc::new(found.tree));
        }
        Ok(())
    }
}
