//! A label map: a volume of whole numbers that say what each voxel is.

use std::collections::BTreeMap;

use nalgebra::Matrix3;

use crate::{Error, Result, Vec3};

/// Labels named in an error.
const NAMED: usize = 16;

/// A segmentation: a label for each voxel, 0 being background. Voxel (i, j, k) is at `origin_mm` + `axes_mm` · (i, j, k) in
/// the axes of scenes (left, posterior, superior); voxels may be oblique, flipped and of different sides.
#[derive(Debug, Clone, PartialEq)]
pub struct LabelMap {
    size: [usize; 3],
    axes_mm: Matrix3<f64>,
    origin_mm: Vec3,
    labels: Vec<u16>,
}

impl LabelMap {
    /// A label map of labels in the order of voxels, the first index fastest.
    ///
    /// # Errors
    /// [`Error::Parameter`] naming `size` if there are not as many labels, and `axes_mm` if these do not span space.
    pub fn new(size: [usize; 3], axes_mm: Matrix3<f64>, origin_mm: Vec3, labels: Vec<u16>) -> Result<Self> {
        let voxels = size.iter().try_fold(1_usize, |product, n| product.checked_mul(*n));
        if voxels != Some(labels.len()) || labels.is_empty() {
            let remedy =
                format!("there are {} labels: one a voxel is needed, and at least one", labels.len());
            return Err(Error::parameter("size", format!("{size:?}"), remedy));
        }
        let spans = axes_mm.try_inverse().is_some_and(|into| into.iter().all(|x| x.is_finite()));
        if !spans || !origin_mm.iter().all(|x| x.is_finite()) {
            let remedy = "must be three independent vectors, finite as the origin is";
            return Err(Error::parameter("axes_mm", format!("{:?}", axes_mm.as_slice()), remedy));
        }
        Ok(Self { size, axes_mm, origin_mm, labels })
    }

    /// Number of voxels along each axis.
    pub fn size(&self) -> [usize; 3] {
        self.size
    }

    /// The vectors from a voxel to the next one along each axis, mm.
    pub fn axes_mm(&self) -> &Matrix3<f64> {
        &self.axes_mm
    }

    /// Centre of the first voxel, mm.
    pub fn origin_mm(&self) -> Vec3 {
        self.origin_mm
    }

    /// The labels, the first index fastest.
    pub fn labels(&self) -> &[u16] {
        &self.labels
    }

    /// The labels that occur, but for the background, with the number of their voxels.
    pub fn counts(&self) -> BTreeMap<u16, usize> {
        let mut counts = vec![0_usize; usize::from(u16::MAX) + 1];
        self.labels.iter().for_each(|label| counts[usize::from(*label)] += 1);
        (1..=u16::MAX)
            .map(|label| (label, counts[usize::from(label)]))
            .filter(|(_, count)| *count > 0)
            .collect()
    }

    /// The requested labels with the number of their voxels.
    pub(super) fn wanted(&self, labels: &[u16]) -> Result<Vec<(u16, usize)>> {
        let counts = self.counts();
        let all = || {
            let mut known: Vec<String> =
                counts.iter().take(NAMED).map(|(label, count)| format!("{label} ({count} voxels)")).collect();
            if counts.len() > NAMED {
                known.push(format!("and {} more, up to {:?}", counts.len() - NAMED, counts.keys().last()));
            }
            match known.is_empty() {
                true => "all voxels are 0, background: nothing is labelled in this file".to_owned(),
                false => format!("it has the labels {}", known.join(", ")),
            }
        };
        if labels.is_empty() {
            return Err(Error::parameter("label", "none", format!("name at least one: {}", all())));
        }
        let mut wanted: Vec<(u16, usize)> = Vec::new();
        for label in labels {
            match counts.get(label) {
                None if *label == 0 => {
                    return Err(Error::parameter("label", 0, format!("is the background: {}", all())));
                }
                None => return Err(Error::parameter("label", label, format!("has no voxel: {}", all()))),
                Some(_) if wanted.iter().any(|(known, _)| known == label) => {}
                Some(count) => wanted.push((*label, *count)),
            }
        }
        Ok(wanted)
    }
}
