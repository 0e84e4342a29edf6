//! The `[view]` table of a scene file. The core reads the rest of it.

use std::path::Path;

use endowire_core::Result;
use endowire_core::input::parse_toml;
use endowire_core::methods::MethodChoice;
use endowire_core::scene::SceneOf;
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
    /// own tree.
    ///
    /// # Errors
    /// [`endowire_core::Error::Content`] for a table that does not fit, naming line and key.
    pub fn of_scene<M: MethodChoice + DeserializeOwned + Default>(
        scene: &SceneOf<M>,
        path: &Path,
    ) -> Result<Self> {
        let ViewTable { view } = parse_toml(scene.text(), path)?;
        let mut view = view.in_folder(&scene.resolve(Path::new("")));
        if let (None, Some(tree)) = (&view.flow.tree, &scene.vessel.tree) {
            view.flow.tree = Some(scene.resolve(tree));
        }
        Ok(view)
    }
}
