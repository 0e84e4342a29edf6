//! What devices are pushed into: a surface, or what a centre line says.

use std::sync::{Arc, OnceLock};

use super::{Opening, SweptVessel, Wall, WallQuery, WallStore};
use crate::{Result, Vec3};

/// The lumen of a vessel. Shared by all who have a copy.
#[derive(Debug, Clone)]
pub enum Lumen {
    /// That of a surface.
    Meshed(Arc<Meshed>),
    /// That of a centre line, which has a mesh when somebody wants one.
    Swept(Arc<SweptVessel>),
}

/// A wall, and what answers questions about it once one was asked.
#[derive(Debug)]
pub struct Meshed {
    wall: Wall,
    query: OnceLock<Arc<WallQuery>>,
}

impl Meshed {
    pub(super) fn new(wall: Wall) -> Self {
        Self { wall, query: OnceLock::new() }
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

    /// The opening that devices come in by unless another is given: that at the root of a centre line, of a surface as [`Wall::inlet`] says.
    pub fn inlet(&self) -> Option<&Opening> {
        match self {
            Self::Meshed(meshed) => meshed.wall.inlet(),
            Self::Swept(vessel) => vessel.openings().get(vessel.inlet()),
        }
    }

    /// Whether a place is in the lumen.
    ///
    /// # Errors
    /// As [`Wall::contains`], of a surface.
    pub fn contains(&self, x: &Vec3) -> Result<bool> {
        match self {
            Self::Meshed(meshed) => meshed.wall.contains(x),
            Self::Swept(vessel) => Ok(vessel.contains(x)),
        }
    }

    /// Whether a place is likelier in the lumen than not: of a surface however broken.
    pub(crate) fn holds(&self, x: &Vec3) -> bool {
        match self {
            Self::Meshed(meshed) => meshed.wall.winding_number(x) > 0.5,
            Self::Swept(vessel) => vessel.contains(x),
        }
    }

    /// The box about the vessel, mm; none of a surface without vertices.
    pub(crate) fn bounds_mm(&self) -> Option<(Vec3, Vec3)> {
        match self {
            Self::Meshed(meshed) => meshed.wall.mesh().bounds_mm(),
            Self::Swept(vessel) => Some(vessel.bounds_mm()),
        }
    }

    /// How far a place is from the wall, mm, on whichever side. For one question, not for many.
    ///
    /// # Errors
    /// As [`WallQuery::new`], of a surface.
    pub(crate) fn distance_mm(&self, x: &Vec3) -> Result<f64> {
        match self {
            Self::Meshed(meshed) => Ok(meshed.query()?.distance_mm(x)),
            Self::Swept(vessel) => Ok(vessel.distance_mm(x)),
        }
    }

    /// Its wall as triangles; of a centre line they are made with the first question, or come from `store`
    /// ([`NoStore`](super::NoStore) keeps nothing).
    ///
    /// # Errors
    /// As [`GeneratedWall::new`](super::GeneratedWall::new), of a centre line.
    pub fn wall(&self, store: &dyn WallStore) -> Result<&Wall> {
        self.meshed(store).map(|meshed| &meshed.wall)
    }

    /// Its wall alone.
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

    /// Distance queries to the triangles.
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
