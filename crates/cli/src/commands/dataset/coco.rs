//! Annotations in COCO format (Lin et al., ECCV 2014): images, categories, and masks as uncompressed run lengths.

use endowire_core::Result;
use endowire_viewer::{DeviceLabel, Image, Labels, Mask, Pushed};
use serde::{Deserialize, Serialize};

/// Category of a mask.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Category {
    id: u32,
    name: &'static str,
    supercategory: &'static str,
    /// Names of the keypoints of its annotations, and how they are connected.
    #[serde(flatten)]
    points: Option<Points>,
}

#[derive(Debug, Clone, Serialize)]
struct Points {
    keypoints: [&'static str; 1],
    skeleton: [[u32; 2]; 0],
}

const VESSEL: u32 = 1;
const GUIDEWIRE: u32 = 2;
const CATHETER: u32 = 3;
const PART: u32 = 4;
const COIL: u32 = 5;

/// All categories. Microwires count as guidewires, everything with a lumen as a catheter, and a coil as such both on
/// its pusher and detached.
pub(super) fn categories() -> [Category; 5] {
    let tip = Points { keypoints: ["tip"], skeleton: [] };
    [
        (VESSEL, "vessel", "anatomy", None),
        (GUIDEWIRE, "guidewire", "device", Some(tip.clone())),
        (CATHETER, "catheter", "device", Some(tip.clone())),
        (PART, "part", "device", None),
        (COIL, "coil", "device", Some(tip)),
    ]
    .map(|(id, name, supercategory, points)| Category { id, name, supercategory, points })
}

/// A picture.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct ImageRow {
    pub(super) id: usize,
    /// Number of the pose: pictures of a pose have C-arm, body and noise in common.
    #[serde(default)]
    pub(super) pose: usize,
    /// `train`, `val` or `test`, by anatomy; known when all is joined.
    #[serde(default)]
    pub(super) split: String,
    pub(super) file_name: String,
    pub(super) arrays: String,
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) scene: String,
    pub(super) device: Option<String>,
    pub(super) instruments: Vec<String>,
    pub(super) step: usize,
    /// Whether the step converged; true for pictures of versions that did not record it.
    #[serde(default = "yes")]
    pub(super) converged: bool,
    /// End time of the step, in the time of the script and of a moving vessel.
    pub(super) step_time_s: f64,
    /// Time for injections.
    pub(super) time_s: f64,
    /// 0, or 1 for the second plane of a pair.
    pub(super) plane: usize,
    /// Id of the picture of the other plane.
    pub(super) pair: Option<usize>,
    pub(super) primary_deg: f64,
    pub(super) secondary_deg: f64,
    pub(super) kvp: f64,
    pub(super) dose_ngy: f64,
    #[serde(default)]
    pub(super) magnification: f64,
    /// Width of the generated body, if there is one.
    #[serde(default)]
    pub(super) width_mm: Option<f64>,
    #[serde(default)]
    pub(super) scatter_fraction: f64,
    #[serde(default)]
    pub(super) contrast_fraction: f64,
    pub(super) camera_matrix: [[f64; 4]; 3],
}

fn yes() -> bool {
    true
}

/// One object in a picture.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Annotation {
    id: usize,
    image_id: usize,
    category_id: u32,
    iscrowd: u8,
    area: usize,
    bbox: [u32; 4],
    segmentation: RunLengths,
    #[serde(skip_serializing_if = "Option::is_none", default)]
    instrument: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none", default)]
    material: Option<String>,
    /// Name of the part in the device file.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    part: Option<String>,
    /// Column, row, and visibility of the tip: visible (2) or behind a collimator blade (1); zeros if it is outside
    /// the picture.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    keypoints: Option<[f64; 3]>,
    /// Number of keypoints in the picture.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    num_keypoints: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none", default)]
    tip_mm: Option<[f64; 3]>,
    /// Contrast to noise in the picture; null where nothing surrounds it.
    #[serde(default)]
    visible: Option<f64>,
}

/// Height and width, and run lengths in column order.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct RunLengths {
    size: [u32; 2],
    counts: Vec<u32>,
}

/// Largest number of annotations per picture. The id of an annotation is that of its picture times this number, plus
/// at least 1; it is never 0, which pycocotools takes for no match.
const MOST: usize = 1000;

/// The annotations of a picture; objects without a visible pixel are left out.
///
/// `drawn` are the indices and names of the instruments that the devices are, or were before they were detached.
pub(super) fn annotations(
    (image, picture): (usize, &Image),
    labels: &Labels,
    pushed: &Pushed,
    drawn: &[(usize, &str)],
) -> Result<Vec<Annotation>> {
    let mut rows = Vec::new();
    let devices: Vec<&Mask> = labels.devices.iter().map(|device| &device.mask).collect();
    let mut add =
        |category_id: u32, mask: &Mask, seen: &Mask, finish: &dyn Fn(&mut Annotation)| -> Result<()> {
            let (Some(bbox), true) = (mask.bounds(), rows.len() < MOST) else { return Ok(()) };
            let [width, height] = mask.size_px();
            let segmentation = RunLengths { size: [height, width], counts: mask.run_lengths() };
            let mut row = Annotation {
                id: image * MOST + rows.len() + 1,
                image_id: image,
                category_id,
                iscrowd: 0,
                area: mask.pixels().len(),
                bbox,
                segmentation,
                instrument: None,
                material: None,
                part: None,
                keypoints: None,
                num_keypoints: None,
                tip_mm: None,
                visible: seen.contrast_to_noise(picture, &devices)?,
            };
            finish(&mut row);
            rows.push(row);
            Ok(())
        };
    if let Some(vessel) = &labels.vessel {
        add(VESSEL, vessel, &vessel.without(&devices)?, &|_| {})?;
    }
    for (device, &(instrument, name)) in labels.devices.iter().zip(drawn) {
        let category = if pushed.is_coil(instrument) {
            COIL
        } else if pushed.is_wire(instrument) {
            GUIDEWIRE
        } else {
            CATHETER
        };
        add(category, &device.mask, &device.mask, &|row| {
            row.instrument = Some(name.to_owned());
            let tip = keypoint(device, labels.size_px);
            (row.keypoints, row.num_keypoints) = (Some(tip), Some(u32::from(tip[2] > 0.0)));
            row.tip_mm = device.tip_mm;
        })?;
        for part in &device.parts {
            add(PART, &part.mask, &part.mask, &|row| {
                row.instrument = Some(name.to_owned());
                row.part = pushed.part_name(instrument, part.number).map(str::to_owned);
                row.material = Some(part.material.name().to_owned());
            })?;
        }
    }
    Ok(rows)
}

/// The tip as a keypoint, if it is in the picture.
fn keypoint(device: &DeviceLabel, size_px: [u32; 2]) -> [f64; 3] {
    let inside = |pixel: &[f64; 2]| (0..2).all(|k| (0.0..=f64::from(size_px[k])).contains(&pixel[k]));
    match device.tip_px.filter(inside) {
        Some([x, y]) => [x, y, if device.tip_visible { 2.0 } else { 1.0 }],
        None => [0.0; 3],
    }
}
