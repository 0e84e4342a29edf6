//! Specifications of datasets, in TOML.

use std::path::{Path, PathBuf};

use endowire_core::input::from_toml;
use endowire_viewer::{ViewSpec, XRaySpec};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::failure::Failure;

/// Largest number of pictures of a dataset.
const MOST_PICTURES: usize = 10_000_000;

/// A specification. Paths are relative to its folder.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Spec {
    /// Seed of all random numbers.
    #[serde(default = "one")]
    pub(super) seed: u64,
    /// Scene files: vessels, sheaths, scripts and views.
    pub(super) scenes: Vec<PathBuf>,
    /// Device files, each of which replaces the device of every scene with a single one; by default the scenes' own
    /// devices are used.
    #[serde(default)]
    pub(super) devices: Vec<PathBuf>,
    /// Number of poses per scene and device.
    #[serde(default = "eight")]
    pub(super) poses: usize,
    /// Number of states per pose, with one picture each, or one per plane.
    #[serde(default = "sixteen")]
    pub(super) moments: usize,
    /// Primary angle of the second plane relative to the first, degrees; absent for a single plane.
    pub(super) biplane_deg: Option<f64>,
    /// Ranges of random parameters.
    #[serde(default)]
    pub(super) vary: Vary,
    /// Keys that override those of the scenes' `[view]`.
    #[serde(default)]
    pub(super) view: Map<String, Value>,
}

/// Ranges of uniform distributions.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Vary {
    /// Drawn for each pose.
    pub(super) primary_deg: [f64; 2],
    pub(super) secondary_deg: [f64; 2],
    /// Chosen from this list for each pose; by default the scene's.
    pub(super) kvp: Option<Vec<f64>>,
    /// Drawn for each pose on a logarithmic scale; by default the usual dose of the mode.
    pub(super) dose_ngy: Option<[f64; 2]>,
    /// Drawn for each pose; by default the scene's: magnification mode, width of the generated body, fraction of
    /// scattered photons, fraction of contrast medium constantly in the blood.
    pub(super) magnification: Option<[f64; 2]>,
    pub(super) width_mm: Option<[f64; 2]>,
    pub(super) scatter_fraction: Option<[f64; 2]>,
    pub(super) contrast_fraction: Option<[f64; 2]>,
    /// Drawn for each picture: time of injections.
    pub(super) time_s: [f64; 2],
    /// Drawn for each picture: fraction of the script that has been carried out.
    pub(super) progress: [f64; 2],
}

impl Default for Vary {
    fn default() -> Self {
        Self {
            primary_deg: [-45.0, 45.0],
            secondary_deg: [-25.0, 25.0],
            kvp: None,
            dose_ngy: None,
            magnification: None,
            width_mm: None,
            scatter_fraction: None,
            contrast_fraction: None,
            time_s: [0.0, 0.0],
            progress: [0.2, 1.0],
        }
    }
}

/// Keys of `[view]` that change nothing in the pictures of a dataset, and what to do instead.
pub(super) const NOT_DRAWN: [(&str, &str); 12] = [
    ("biplane_deg", "a dataset has biplane_deg beside its seed"),
    ("views", "a dataset draws fluoroscopy alone: leave the key out"),
    ("every", "moments are drawn: give moments, and vary.progress"),
    ("film", "a dataset has pictures alone: leave the key out"),
    ("camera", "belongs to the 3D view, and a dataset draws fluoroscopy alone: leave it out"),
    ("c_arm.pose", "poses are drawn: give vary.primary_deg and vary.secondary_deg"),
    ("c_arm.primary_deg", "poses are drawn: give vary.primary_deg"),
    ("c_arm.secondary_deg", "poses are drawn: give vary.secondary_deg"),
    ("device", "device files say what their devices are made of (devices)"),
    ("detector.seed", "noise is drawn: give seed"),
    ("xray.brightness_s", "times are drawn at random, and no picture follows another: leave it out"),
    ("detector.lag", "times are drawn at random, and no picture follows another: leave it out"),
];

fn one() -> u64 {
    1
}

fn eight() -> usize {
    8
}

fn sixteen() -> usize {
    16
}

impl Spec {
    /// Reads and checks a specification.
    pub(super) fn read(path: &Path) -> Result<Self, Failure> {
        let (mut spec, _): (Self, String) = from_toml(path)?;
        spec.check().map_err(|failure| failure.at(path.display()))?;
        let folder = path.parent().unwrap_or(Path::new(""));
        for (key, files) in [("scenes", &mut spec.scenes), ("devices", &mut spec.devices)] {
            for file in files {
                let found = folder.join(&*file);
                if !found.is_file() {
                    let text = format!(
                        "{key} = [\"{}\"]: there is no file {}; paths start from the folder of the specification",
                        file.display(),
                        found.display()
                    );
                    return Err(Failure::Input(text).at(path.display()));
                }
                *file = found;
            }
        }
        Ok(spec)
    }

    /// Number of pictures per state, one for each plane.
    pub(super) fn views(&self) -> usize {
        if self.biplane_deg.is_some() { 2 } else { 1 }
    }

    fn check(&self) -> Result<(), Failure> {
        let refuse = |text: String| Err(Failure::Input(text));
        if self.scenes.is_empty() {
            return refuse("scenes = []: name at least one scene file".to_owned());
        }
        let courses = self.scenes.len() * self.devices.len().max(1);
        let pictures =
            courses.saturating_mul(self.poses).saturating_mul(self.moments).saturating_mul(self.views());
        if !(1..=MOST_PICTURES).contains(&pictures) {
            return refuse(format!(
                "poses = {} and moments = {} make {pictures} pictures: they must be 1 to {MOST_PICTURES}",
                self.poses, self.moments
            ));
        }
        let vary = &self.vary;
        let dose = vary.dose_ngy.unwrap_or([1.0; 2]);
        let magnification = vary.magnification.unwrap_or([1.0; 2]);
        for (key, [low, high], [least, most]) in [
            ("magnification", magnification, [0.1, 100.0]),
            ("width_mm", vary.width_mm.unwrap_or([100.0; 2]), [100.0, 800.0]),
            ("scatter_fraction", vary.scatter_fraction.unwrap_or([0.0; 2]), [0.0, 0.95]),
            ("contrast_fraction", vary.contrast_fraction.unwrap_or([0.0; 2]), [0.0, 1.0]),
            ("primary_deg", vary.primary_deg, [-180.0, 180.0]),
            ("secondary_deg", vary.secondary_deg, [-90.0, 90.0]),
            ("dose_ngy", dose, [0.001, 1e6]),
            ("time_s", vary.time_s, [-1e4, 1e4]),
            ("progress", vary.progress, [0.0, 1.0]),
        ] {
            if !(least <= low && low <= high && high <= most) {
                return refuse(format!(
                    "vary.{key} = [{low}, {high}]: must be two numbers from {least} to {most}, the first not above the second"
                ));
            }
        }
        if let Some([]) = vary.kvp.as_deref() {
            return refuse("vary.kvp = []: name at least one voltage, or leave the key out".to_owned());
        }
        for &kvp in vary.kvp.iter().flatten() {
            let xray = XRaySpec { kvp, ..XRaySpec::default() };
            let view = ViewSpec { xray, ..ViewSpec::default() };
            view.validate().map_err(|e| Failure::from(e).at("vary.kvp"))?;
        }
        self.check_view()?;
        match self.biplane_deg {
            Some(turn) if !(-180.0..=180.0).contains(&turn) => {
                refuse(format!("biplane_deg = {turn}: must be a number from -180 to 180"))
            }
            _ => Ok(()),
        }
    }

    /// Refuses keys of `[view]` that have no effect on the pictures of a dataset.
    fn check_view(&self) -> Result<(), Failure> {
        for (key, remedy) in NOT_DRAWN {
            let mut parts = key.split('.');
            let first = parts.next().and_then(|part| self.view.get(part));
            if let Some(value) = parts.fold(first, |value, part| value?.get(part)) {
                return Err(Failure::Input(format!("view.{key} = {value}: {remedy}")));
            }
        }
        let mode = self.view.get("xray").and_then(|xray| xray.get("mode"));
        let mode = mode.filter(|mode| mode.as_str().is_some_and(|mode| ["dsa", "roadmap"].contains(&mode)));
        if let Some(mode) = mode {
            return Err(Failure::Input(format!(
                "view.xray.mode = {mode}: pictures are of single moments drawn at random, and this mode shows what was added since \
                 another: give \"fluoro\" or \"cine\", or leave the key out"
            )));
        }
        Ok(())
    }
}
