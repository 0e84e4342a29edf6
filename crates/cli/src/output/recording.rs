//! A recorded run, read back.

use std::path::{Path, PathBuf};

use endowire_core::Vec3;
use endowire_core::shape::Shape;
use serde::Deserialize;

use super::npz;
use crate::failure::Failure;

/// The parts of summary.json that frames need.
#[derive(Debug, Deserialize)]
pub(crate) struct RecordedSummary {
    /// File of the scene.
    pub(crate) scene_file: PathBuf,
    /// Hash of the scene's text and of the files it names.
    pub(crate) scene_hash: String,
}

/// One contact of a step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RecordedContact {
    pub(crate) position_mm: Vec3,
    /// Force of the wall on the device.
    pub(crate) force_n: Vec3,
}

/// Shapes and contacts by step.
#[derive(Debug)]
pub(crate) struct Recording {
    pub(crate) summary: RecordedSummary,
    positions: Vec<Vec3>,
    tangents: Vec<Vec3>,
    from_tip: Vec<f64>,
    offsets: Vec<usize>,
    contacts: Vec<RecordedContact>,
    contact_offsets: Vec<usize>,
}

impl Recording {
    /// Reads what `endowire run` has left in a folder.
    pub(crate) fn read(folder: &Path) -> Result<Self, Failure> {
        let at = |path: &Path, error: &dyn std::fmt::Display| {
            Failure::Input(format!(
                "{}: {error}; give the folder of a recorded run (endowire run)",
                path.display()
            ))
        };
        let path = folder.join("summary.json");
        let text = std::fs::read(&path).map_err(|e| at(&path, &e))?;
        let summary = serde_json::from_slice(&text).map_err(|e| at(&path, &e))?;
        let path = folder.join("shapes.npz");
        let floats = |name| -> Result<Vec<f64>, Failure> {
            let bytes = npz::read(&path, name).map_err(|e| at(&path, &e))?;
            Ok(bytes.into_iter().map(f64::from_le_bytes).collect())
        };
        let vectors = |name| -> Result<Vec<Vec3>, Failure> {
            Ok(floats(name)?.chunks_exact(3).map(|x| Vec3::new(x[0], x[1], x[2])).collect())
        };
        let offsets = |name, most: usize| -> Result<Vec<usize>, Failure> {
            let bytes = npz::read(&path, name).map_err(|e| at(&path, &e))?;
            let offsets: Vec<usize> = bytes
                .into_iter()
                .map(|b| usize::try_from(i64::from_le_bytes(b)).unwrap_or(usize::MAX))
                .collect();
            if offsets.first() != Some(&0) || !offsets.is_sorted() || offsets.last() != Some(&most) {
                return Err(at(&path, &format_args!("{name} do not fit the other arrays")));
            }
            Ok(offsets)
        };
        let (positions, tangents, from_tip) =
            (vectors("positions_mm")?, vectors("tangents")?, floats("from_tip_mm")?);
        if positions.len() != tangents.len() || positions.len() != from_tip.len() {
            return Err(at(&path, &"its arrays have different lengths"));
        }
        let forces = vectors("contact_forces_n")?;
        let contacts: Vec<RecordedContact> = vectors("contact_positions_mm")?
            .into_iter()
            .zip(forces)
            .map(|(position_mm, force_n)| RecordedContact { position_mm, force_n })
            .collect();
        let recording = Self {
            summary,
            offsets: offsets("offsets", positions.len())?,
            contact_offsets: offsets("contact_offsets", contacts.len())?,
            positions,
            tangents,
            from_tip,
            contacts,
        };
        if recording.offsets.len() != recording.contact_offsets.len() {
            return Err(at(&path, &"shapes and contacts have different numbers of steps"));
        }
        Ok(recording)
    }

    /// Number of steps.
    pub(crate) fn steps(&self) -> usize {
        self.offsets.len() - 1
    }

    /// The shape after a step, counted from 1.
    pub(crate) fn shape(&self, step: usize) -> Shape {
        let range = self.offsets[step - 1]..self.offsets[step];
        Shape {
            positions_mm: self.positions[range.clone()].to_vec(),
            tangents: self.tangents[range.clone()].to_vec(),
            from_tip_mm: self.from_tip[range].to_vec(),
        }
    }

    /// The contacts after a step, counted from 1.
    pub(crate) fn contacts(&self, step: usize) -> &[RecordedContact] {
        &self.contacts[self.contact_offsets[step - 1]..self.contact_offsets[step]]
    }
}
