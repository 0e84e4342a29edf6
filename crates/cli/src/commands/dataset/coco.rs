//! Annotations in the form of COCO (Lin et al., ECCV 2014): images, categories, and masks as uncompressed run lengths.

use endowire_viewer::{DeviceLabel, Labels, Mask};
use serde::{Deserialize, Serialize};

/// What a mask is of.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Category {
    id: u32,
    name: &'static str,
    supercategory: &'static str,
}

const VESSEL: u32 = 1;
const INSTRUMENT: u32 = 2;
const PART: u32 = 3;

/// All categories.
pub(super) fn categories() -> [Category; 3] {
    [(VESSEL, "vessel", "anatomy"), (INSTRUMENT, "instrument", "device"), (PART, "part", "device")]
        .map(|(id, name, supercategory)| Category { id, name, supercategory })
}

/// A picture.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct ImageRow {
    pub(super) id: usize,
    pub(super) file_name: String,
    pub(super) arrays: String,
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) scene: String,
    pub(super) device: Option<String>,
    pub(super) instruments: Vec<String>,
    pub(super) step: usize,
    pub(super) time_s: f64,
    /// 0, or 1 of the second plane of a pair.
    pub(super) plane: usize,
    /// Picture of the other plane.
    pub(super) pair: Option<usize>,
    pub(super) primary_deg: f64,
    pub(super) secondary_deg: f64,
    pub(super) kvp: f64,
    pub(super) dose_ngy: f64,
    pub(super) camera_matrix: [[f64; 4]; 3],
}

/// One thing in a picture.
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
    /// Column, row, and whether it is seen (2) or not (1), of the tip.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    keypoints: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none", default)]
    tip_mm: Option<[f64; 3]>,
}

/// Height and width, and lengths of runs down the columns.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct RunLengths {
    size: [u32; 2],
    counts: Vec<u32>,
}

/// Most annotations of a picture: numbers of annotations are those of their picture times it, and more.
const MOST: usize = 1000;

/// What is seen in a picture; things that no pixel shows are left out.
pub(super) fn annotations(image: usize, labels: &Labels, instruments: &[String]) -> Vec<Annotation> {
    let mut rows = Vec::new();
    let mut add = |category_id: u32, mask: &Mask, finish: &dyn Fn(&mut Annotation)| {
        let (Some(bbox), true) = (mask.bounds(), rows.len() < MOST) else { return };
        let [width, height] = mask.size_px();
        let segmentation = RunLengths { size: [height, width], counts: mask.run_lengths() };
        let mut row = Annotation {
            id: image * MOST + rows.len(),
            image_id: image,
            category_id,
            iscrowd: 0,
            area: mask.pixels().len(),
            bbox,
            segmentation,
            instrument: None,
            material: None,
            keypoints: None,
            tip_mm: None,
        };
        finish(&mut row);
        rows.push(row);
    };
    if let Some(vessel) = &labels.vessel {
        add(VESSEL, vessel, &|_| {});
    }
    for (device, name) in labels.devices.iter().zip(instruments) {
        add(INSTRUMENT, &device.mask, &|row| {
            row.instrument = Some(name.clone());
            row.keypoints = keypoints(device);
            row.tip_mm = device.tip_mm;
        });
        for part in &device.parts {
            add(PART, &part.mask, &|row| {
                row.instrument = Some(name.clone());
                row.material = Some(part.material.name().to_owned());
            });
        }
    }
    rows
}

fn keypoints(device: &DeviceLabel) -> Option<[f64; 3]> {
    device.tip_px.map(|[x, y]| [x, y, if device.tip_visible { 2.0 } else { 1.0 }])
}
