//! The body around the vessel: a slab, a generated body, or a tomogram.

mod beside;
mod body;
mod electrodes;
mod head;
mod loft;
mod lungs;
mod motion;
mod pelvis;
mod spine;
mod table;
mod texture;
mod thorax;
mod tomogram;
mod trunk;

use endowire_core::vessel::SurfaceMesh;
use endowire_core::{Error, Result};

pub(crate) use body::Body;
pub(crate) use motion::Rhythm;
pub(crate) use texture::Of;
pub(crate) use tomogram::Volume;
pub use tomogram::read_label_map;

use crate::spec::ViewSpec;

/// Who is in the beam.
#[derive(Debug)]
pub(crate) enum Patient {
    /// A slab of soft tissue across the beam.
    Slab {
        /// Its thickness along the central ray.
        tissue_mm: f64,
    },
    /// A body of closed surfaces.
    Torso(Box<Body>),
    /// A computed tomogram.
    Tomogram(Box<Volume>),
}

impl Patient {
    pub(crate) fn new(spec: &ViewSpec, wall: &SurfaceMesh) -> Result<Self> {
        if let Some(torso) = &spec.patient.torso {
            if wall.vertices_mm.is_empty() {
                return Err(Error::Mesh("the wall has no vertices".into()));
            }
            return Ok(Self::Torso(Box::new(Body::new(torso, wall))));
        }
        if let Some(ct) = &spec.patient.ct {
            return Ok(Self::Tomogram(Box::new(Volume::read(ct, wall)?)));
        }
        Ok(Self::Slab { tissue_mm: spec.xray.tissue_mm })
    }

    /// Fraction of the vessel's surface contained in the tomogram, 0 to 1.
    pub(crate) fn vessel_held(&self) -> Option<f64> {
        match self {
            Self::Tomogram(volume) => Some(volume.vessel_held()),
            Self::Slab { .. } | Self::Torso(_) => None,
        }
    }

    /// The air of a generated body.
    pub(crate) fn air(&self) -> Option<&SurfaceMesh> {
        match self {
            Self::Torso(body) => Some(&body.lungs),
            Self::Slab { .. } | Self::Tomogram(_) => None,
        }
    }
}
