//! Label maps: segmentations in NIfTI files, as TotalSegmentator and 3D Slicer write them.
//!
//! They are stored in any type of number, decimal ones too, with or without a slope. Values are whole to within what a
//! slope leaves of them.

use std::path::Path;

use endowire_core::vessel::LabelMap;
use endowire_core::{Error, Result};

use super::VOXEL_MM;
use super::nifti::Stored;

/// Largest distance of a value from the label that is meant: files of 16 bits with a slope are off by less.
const WHOLE: f32 = 0.01;
/// Largest number of different values: segmentations of the whole body or of brains have some hundreds, a tomogram
/// thousands.
const MOST_LABELS: usize = 1000;

/// Reads a label map (NIfTI-1 or NIfTI-2, bare or compressed) in the axes of scenes: voxels lie where those of a tomogram
/// with the same header lie.
///
/// # Errors
/// [`Error::Content`] for a file that is no volume or whose values are no labels, [`Error::File`] for one that cannot be
/// opened.
pub fn read_label_map(path: &Path) -> Result<LabelMap> {
    let of_file = std::fs::metadata(path).map_err(|source| Error::file(path, source))?;
    let bad = |reason: String| Error::content(path, reason);
    if of_file.is_dir() {
        return Err(bad("is a folder: give the NIfTI file of a label map (.nii, .nii.gz)".into()));
    }
    let stored = Stored::read(path)?;
    if stored.size.iter().any(|n| *n < 2) {
        return Err(bad(format!("{:?} voxels are no volume: a single slice has no thickness", stored.size)));
    }
    if !stored.axes.column_iter().all(|side| VOXEL_MM.contains(&side.norm())) {
        return Err(bad("its voxels are no 0.001 to 1000 mm wide; mend its sform or pixdim".into()));
    }
    let mut labels = Vec::with_capacity(stored.size.iter().product());
    let mut seen = vec![false; usize::from(u16::MAX) + 1];
    let (mut fault, mut least, mut most) = (None, f32::INFINITY, f32::NEG_INFINITY);
    stored
        .each(|at, value| {
            (least, most) = (least.min(value), most.max(value));
            let label = value.round();
            let is_label = (value - label).abs() <= WHOLE && (0.0..=f32::from(u16::MAX)).contains(&label);
            if !is_label && fault.is_none() {
                fault = Some((at, value));
            }
            // A value out of range is reported below.
            let label = label as u16;
            seen[usize::from(label)] |= is_label;
            labels.push(label);
            Ok(())
        })
        .map_err(bad)?;
    let different = seen.iter().filter(|seen| **seen).count();
    if let Some((at, value)) = fault {
        let kind = match () {
            () if !value.is_finite() => "a value that is no number",
            () if value < 0.0 || value > f32::from(u16::MAX) => "a value that is no label from 0 to 65535",
            () => "a value that is not whole, as in a map of probabilities",
        };
        return Err(bad(format!(
            "is no label map: voxel {at:?} is {value}, {kind}; its values are {least} to {most}. A picture such as a CT has to be segmented \
             first, and probabilities cut off"
        )));
    }
    if different > MOST_LABELS {
        return Err(bad(format!(
            "is no label map: it has {different} different values, {least} to {most}, and a label map has at most {MOST_LABELS}. A picture \
             such as a CT has to be segmented first"
        )));
    }
    LabelMap::new(stored.size, stored.axes, stored.origin_mm, labels).map_err(|error| bad(error.to_string()))
}
