//! The `[view]` table of a scene file. The core reads the rest of it.

use std::path::Path;
use std::sync::Arc;

use endowire_core::input::parse_toml;
use endowire_core::methods::MethodChoice;
use endowire_core::scene::SceneOf;
use endowire_core::vessel::{ExtractedCentreline, Wall, WallStore};
use endowire_core::{Error, Result};
use serde::Deserialize;
use serde::de::DeserializeOwned;

use super::ViewSpec;

/// The part of a scene file that is the viewer's.
#[derive(Deserialize)]
struct ViewTable {
    #[serde(default)]
    view: ViewSpec,
}

impl ViewSpec {
    /// The `[view]` table of a scene that was read from `path`: paths start from its folder, and contrast medium flows in the vessel's
    /// own tree, or the centre line that is given beside its surface.
    ///
    /// # Errors
    /// [`endowire_core::Error::Content`] for a table that does not fit, naming line and key.
    pub fn of_scene<M: MethodChoice + DeserializeOwned + Default>(
        scene: &SceneOf<M>,
        path: &Path,
    ) -> Result<Self> {
        let ViewTable { view } = parse_toml(scene.text(), path)?;
        let mut view = view.in_folder(&scene.resolve(Path::new("")));
        let own = scene.vessel.tree.as_ref().or(scene.vessel.centreline.as_ref());
        if let (None, Some(tree)) = (&view.flow.tree, own) {
            view.flow.tree = Some(scene.resolve(tree));
        }
        Ok(view)
    }

    /// Has contrast medium flow along the centre line that is found in the scene's surface, kept in `store`, where none is named.
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

    /// The same where the surface alone is at hand, and kept nowhere.
    ///
    /// # Errors
    /// A surface in which no centre line is found.
    pub fn find_centreline(&mut self, wall: &Wall) -> Result<()> {
        if self.flow.tree.is_none() && self.flow.centreline.is_none() {
            let found = ExtractedCentreline::of(wall, None, &[]).map_err(|error| {
                let mend = format!("none is found in the surface ({error}): name a table of its centre line");
                Error::parameter("view.flow.tree", "none", mend)
            })?;
            self.flow.centreline = Some(Arc::new(found.tree));
        }
        Ok(())
    }
}
