//! One plane of fluoroscopy: its renderer, and its frames for DICOM.

use std::path::{Path, PathBuf};

use endowire_core::vessel::Wall;
use endowire_core::{Error, Result};
use endowire_viewer::{
    Angiogram, CArm, CArmSpec, DeviceView, Exposure, Image, Mode, Pace, Renderer, ViewSpec,
};

/// A plane.
pub(super) struct Plane {
    /// Ending of its file names.
    pub(super) ending: &'static str,
    pub(super) renderer: Renderer,
    /// Pose of the C-arm in the first frame, as specified and as computed.
    start: CArmSpec,
    arm: Option<CArm>,
    /// Exposure of the first frame.
    exposure: Option<Exposure>,
    /// Devices in the first frame, which the masks of a rotating C-arm show.
    first: Option<Vec<DeviceView>>,
    /// Its frames, if they are kept, and the mask of those that are not subtracted yet.
    series: Vec<Image>,
    mask: Option<Image>,
}

impl Plane {
    /// The planes of a view, each with its renderer.
    pub(super) fn all(spec: &ViewSpec, wall: &Wall) -> Result<Vec<Self>> {
        let endings = ["", "_b"].into_iter();
        let plane = |(spec, ending): (ViewSpec, &'static str)| {
            let renderer = Renderer::of_wall(&spec, wall)?;
            let arm = renderer.c_arm().cloned();
            Ok(Self {
                ending,
                renderer,
                start: spec.c_arm,
                arm,
                exposure: None,
                first: None,
                series: vec![],
                mask: None,
            })
        };
        spec.planes().into_iter().zip(endings).map(plane).collect()
    }

    /// Rotates the C-arm by `turn_deg` from its initial pose, if given. Subtraction masks then show the devices of
    /// the first frame, as if from an earlier run without medium and with the same rotation.
    pub(super) fn turn(&mut self, views: &[DeviceView], turn_deg: Option<f64>) -> Result<()> {
        let Some(turn_deg) = turn_deg else { return Ok(()) };
        let first = self.first.get_or_insert_with(|| views.to_vec());
        self.renderer.turn_c_arm(&self.start.turned(turn_deg))?;
        match self.renderer.spec().xray.mode {
            Mode::Dsa => self.renderer.take_mask(first),
            _ => Ok(()),
        }
    }

    /// Keeps a frame for DICOM; of a subtraction, what was read with its mask, unless the C-arm turns, where each
    /// frame has its own.
    pub(super) fn keep(&mut self, frame: Image) {
        self.exposure = self.exposure.or(self.renderer.exposure());
        let still = self.first.is_none();
        match self.renderer.unsubtracted().filter(|_| still) {
            Some([mask, read]) => {
                self.mask.get_or_insert(mask);
                self.series.push(read);
            }
            None => self.series.push(frame),
        }
    }

    /// DICOM attributes of the frames, which rotate by `turn_deg` from one to the next.
    fn angiogram(&self, turn_deg: f64, pace: &Pace) -> Result<Angiogram<'_>> {
        let spec = self.renderer.spec();
        let none = || Error::parameter("view.views", "without fluoro", "add \"fluoro\"");
        Ok(Angiogram {
            c_arm: self.arm.as_ref().ok_or_else(none)?,
            turn_deg,
            exposure: self.exposure.ok_or_else(none)?,
            pace: pace.clone(),
            mode: spec.xray.mode,
            mask: self.mask.as_ref(),
            contrast: !spec.injection.is_empty() || spec.xray.contrast_fraction > 0.0,
            description: "endowire",
        })
    }
}

/// Writes the frames of one plane, or of two that refer to each other; returns the files.
pub(super) fn write_dicom(planes: &[Plane], path: &Path, turn_deg: f64, pace: &Pace) -> Result<Vec<PathBuf>> {
    match planes {
        [first, second] => {
            let other = beside(path);
            let reported = [first.angiogram(turn_deg, pace)?, second.angiogram(turn_deg, pace)?];
            Angiogram::write_biplane(
                [&reported[0], &reported[1]],
                [path, &other],
                [&first.series, &second.series],
            )?;
            Ok(vec![path.to_owned(), other])
        }
        [one, ..] => {
            one.angiogram(turn_deg, pace)?.write(path, &one.series)?;
            Ok(vec![path.to_owned()])
        }
        [] => Ok(vec![]),
    }
}

/// Path for the second plane: `run_b.dcm` beside `run.dcm`.
fn beside(path: &Path) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    name.push("_b");
    if let Some(extension) = path.extension() {
        name.push(".");
        name.push(extension);
    }
    path.with_file_name(name)
}
