//! The centre line of a scene's vessel: the tree it is built from, the one given with its surface, or one computed
//! from that surface. It is computed at most once, and only when needed.

use std::path::PathBuf;

use serde::de::DeserializeOwned;

use super::SceneOf;
use super::spec::{missing, missing_tree};
use crate::flow::BloodFlow;
use crate::insertion::ScriptLine;
use crate::methods::MethodChoice;
use crate::vessel::{CentrelineEnd, CentrelineRecipe, CentrelineTree, Course, Lumen, Wall, WallStore};
use crate::{Error, Result, Vec3};

impl<M: MethodChoice + DeserializeOwned + Default> SceneOf<M> {
    /// The vessel's centre line: the tree it is built from, the one given with its surface, or, without either, one
    /// computed from the surface, from the sheath's opening (`Wall::inlet` if the sheath is given by a position) to
    /// all others, with targets named `opening 1` and so on.
    ///
    /// # Errors
    /// A missing or unusable file; one given in addition to a tree; a surface from which none can be computed.
    pub fn centreline(&self, store: &dyn WallStore) -> Result<&CentrelineTree> {
        self.known_or(store, || self.wall(store))
    }

    /// The centre line computed from the surface, if one was needed so far and none is given.
    pub fn found_centreline(&self) -> Option<&CentrelineTree> {
        self.centreline.get().filter(|_| !self.gives_centreline())
    }

    /// Whether the centre line must be, or was, computed from the surface: something needs one, and none is given.
    pub fn finds_centreline(&self) -> bool {
        let vessel = &self.vessel;
        let is_needed = vessel.flow.is_some()
            || vessel.yielding.is_some()
            || self.script.iter().any(ScriptLine::has_target);
        !self.gives_centreline() && (is_needed || self.centreline.get().is_some())
    }

    fn gives_centreline(&self) -> bool {
        self.vessel.tree.is_some() || self.vessel.centreline.is_some()
    }

    /// The blood flow in the given vessel; `None` if the scene has none.
    ///
    /// # Errors
    /// As [`SceneOf::centreline`] and [`BloodFlow::new`].
    pub(crate) fn flow(&self, lumen: &Lumen, store: &dyn WallStore) -> Result<Option<BloodFlow>> {
        let Some(flow) = &self.vessel.flow else { return Ok(None) };
        let tree = self.known_or(store, || lumen.wall(store).cloned())?;
        BloodFlow::new(tree, flow).map(Some)
    }

    /// The course of a vessel that yields; `None` if only its wall does.
    ///
    /// # Errors
    /// As [`SceneOf::centreline`] and [`Course::new`].
    pub fn course(&self, lumen: &Lumen, store: &dyn WallStore) -> Result<Option<Course>> {
        let Some(spec) = &self.vessel.yielding else { return Ok(None) };
        let tree = self.known_or(store, || lumen.wall(store).cloned())?;
        Course::new(tree, spec).map(Some)
    }

    /// The file of the centre line and the key that names it; `None` if there is neither.
    pub(super) fn centreline_path(&self) -> Result<Option<(&'static str, PathBuf)>> {
        match (&self.vessel.tree, &self.vessel.centreline) {
            (None, None) => Ok(None),
            (Some(path), None) => Ok(Some(("vessel.tree", self.resolve(path)))),
            (None, Some(path)) => Ok(Some(("vessel.centreline", self.resolve(path)))),
            (Some(_), Some(path)) => {
                let remedy = "vessel.tree is given too, and is the centre line: keep one of the two";
                Err(Error::parameter("vessel.centreline", path.display(), remedy))
            }
        }
    }

    /// The centre line if already known, or that of the scene's files.
    fn known_or(
        &self,
        store: &dyn WallStore,
        wall: impl FnOnce() -> Result<Wall>,
    ) -> Result<&CentrelineTree> {
        if let Some(known) = self.centreline.get() {
            return Ok(known);
        }
        let tree = match self.centreline_path()? {
            Some((key, path)) => CentrelineTree::read_of(&*self.files, &path).map_err(|error| match key {
                "vessel.tree" => missing_tree(&path, error),
                _ => missing(key, error),
            })?,
            None => self.find(&wall()?, store)?,
        };
        Ok(self.centreline.get_or_init(|| tree))
    }

    /// Computes the centre line of the surface.
    fn find(&self, wall: &Wall, store: &dyn WallStore) -> Result<CentrelineTree> {
        let recipe = CentrelineRecipe { wall, from: self.begin(wall) };
        store.centreline(&recipe).map_err(|error| {
            let remedy = format!(
                "none is found in the surface ({error}): name a table of it, as `endowire vessel centreline SURFACE --from END --to END --out TABLE` \
                 writes it between openings or places inside"
            );
            Error::parameter("vessel.centreline", "none", remedy)
        })
    }

    /// The start of the centre line to be computed: at the sheath, unless another opening is needed.
    fn begin(&self, wall: &Wall) -> Option<CentrelineEnd> {
        let count = wall.openings().len();
        match (self.sheath.opening, self.sheath.position_mm) {
            // A nonexistent opening is rejected where the sheath is placed.
            (Some(opening), _) if opening < count => Some(CentrelineEnd::Opening(opening)),
            (None, Some(position)) if count == 1 => Some(CentrelineEnd::Place(Vec3::from(position))),
            _ => None,
        }
    }
}
