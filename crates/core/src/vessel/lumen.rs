//! The lumen of a vessel, given by a surface or a centre line.

use std::sync::{Arc, OnceLock};

use super::{Opening, SweptVessel, Wall, WallQuery, WallStore};
use crate::{Result, Vec3};

/// The lumen of a vessel. Clones share it.
#[derive(Debug, Clone)]
pub enum Lumen {
    /// Given by a surface.
    Meshed(Arc<Meshed>),
    /// Given by a centre line, which is meshed only if needed.
    Swept(Arc<SweptVessel>),
}

/// A wall, with query structures built when first needed.
#[derive(Debug)]
pub struct Meshed {
    wall: Wall,
    query: OnceLock<Arc<WallQuery>>,
}

impl Meshed {
    pub(super) fn new(wall: Wall) -> Self {
        Self { wall, query: OnceLock::new() }
    }

    pub(crate) fn wall(&self) -> &Wall {
        &self.wall
    }

    fn query(&self) -> Result<&Arc<WallQuery>> {
        if let Some(known) = self.query.get() {
            return Ok(known);
        }
        let made = Arc::new(WallQuery::new(&self.wall)?);
        Ok(self.query.get_or_init(|| made))
    }
}

impl From<SweptVessel> for Lumen {
    fn from(vessel: SweptVessel) -> Self {
        Self::Swept(Arc::new(vessel))
    }
}

impl From<Wall> for Lumen {
    fn from(wall: Wall) -> Self {
        Self::Meshed(Arc::new(Meshed::new(wall)))
    }
}

impl AsRef<[Opening]> for Lumen {
    fn as_ref(&self) -> &[Opening] {
        self.openings()
    }
}

impl AsRef<[Opening]> for Wall {
    fn as_ref(&self) -> &[Opening] {
        self.openings()
    }
}

impl Lumen {
    /// Its openings, largest first.
    pub fn openings(&self) -> &[Opening] {
        match self {
            Self::Meshed(meshed) => meshed.wall.openings(),
            Self::Swept(vessel) => vessel.openings(),
        }
    }

    /// The default opening for devices: the root of a centre line; for a surface see [`Wall::inlet`].
    pub fn inlet(&self) -> Option<&Opening> {
        match self {
            Self::Meshed(meshed) => meshed.wall.inlet(),
            Self::Swept(vessel) => vessel.openings().get(vessel.inlet()),
        }
    }

    /// Whether a position is in the lumen.
    ///
    /// # Errors
    /// For a surface, as [`Wall::contains`].
    pub fn contains(&self, x: &Vec3) -> Result<bool> {
        match self {
            Self::Meshed(meshed) => meshed.wall.contains(x),
            Self::Swept(vessel) => Ok(vessel.contains(x)),
        }
    }

    /// Whether a position is more likely in the lumen than not, for a surface however damaged.
    pub(crate) fn holds(&self, x: &Vec3) -> bool {
        match self {
            Self::Meshed(meshed) => meshed.wall.winding_number(x) > 0.5,
            Self::Swept(vessel) => vessel.contains(x),
        }
    }

    /// The bounding box of the vessel, mm; `None` for a surface without vertices.
    pub(crate) fn bounds_mm(&self) -> Option<(Vec3, Vec3)> {
        match self {
            Self::Meshed(meshed) => meshed.wall.mesh().bounds_mm(),
            Self::Swept(vessel) => Some(vessel.bounds_mm()),
        }
    }

    /// Distance of a position from the wall, mm, on either side. For a single query.
    ///
    /// # Errors
    /// For a surface, as [`WallQuery::new`].
    pub(crate) fn distance_mm(&self, x: &Vec3) -> Result<f64> {
        match self {
            Self::Meshed(meshed) => Ok(meshed.query()?.distance_mm(x)),
            Self::Swept(vessel) => Ok(vessel.distance_mm(x)),
        }
    }

    /// Its wall as triangles; for a centre line they are made when first needed, or come from `store`
    /// ([`NoStore`](super::NoStore) stores nothing).
    ///
    /// # Errors
    /// For a centre line, as [`GeneratedWall::new`](super::GeneratedWall::new).
    pub fn wall(&self, store: &dyn WallStore) -> Result<&Wall> {
        self.meshed(store).map(|meshed| &meshed.wall)
    }

    /// Extracts its wall.
    ///
    /// # Errors
    /// As [`Lumen::wall`].
    pub fn into_wall(self, store: &dyn WallStore) -> Result<Wall> {
        match self {
            Self::Meshed(meshed) => {
                Ok(Arc::try_unwrap(meshed).map_or_else(|shared| shared.wall.clone(), |own| own.wall))
            }
            Self::Swept(vessel) => vessel.meshed(store).map(|meshed| meshed.wall.clone()),
        }
    }

    /// Distance queries on its triangles.
    ///
    /// # Errors
    /// As [`Lumen::wall`] and [`WallQuery::new`].
    pub fn query(&self, store: &dyn WallStore) -> Result<&Arc<WallQuery>> {
        self.meshed(store)?.query()
    }

    fn meshed(&self, store: &dyn WallStore) -> Result<&Meshed> {
        match self {
            Self::Meshed(meshed) => Ok(meshed),
            Self::Swept(vessel) => vessel.meshed(store),
        }
    }
}
