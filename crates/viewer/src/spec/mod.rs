//! The specification of frames in a scene file: its `[view]` table, with units in the names.

mod anatomy;
mod c_arm;
mod exposure;
mod of_scene;
mod xray;

use std::path::Path;

use endowire_core::{Error, Result};
use serde::{Deserialize, Serialize};

pub use anatomy::{CtSpec, FlowSpec, InjectionSpec, PatientSpec, TorsoSpec};
pub use c_arm::{CArmSpec, Pose, Shutter};
pub(crate) use c_arm::{PITCH_MM, reference_mm};
pub use exposure::ExposureSpec;
pub use xray::{DetectorSpec, Mode, XRaySpec};

use crate::device::DevicePart;
use crate::output::Animation;
use crate::xray::check_exposure;

/// Largest side of a frame. Flat detectors have up to about 3000 pixels per side, and with two rays across a pixel
/// this is the texture size supported by every adapter.
const LARGEST_SIDE_PX: u32 = 4096;

/// Range of coordinates, mm: vessels are smaller than ten metres, and enough digits remain for a pixel.
const COORDINATE_MM: [f64; 2] = [-1e5, 1e5];

/// A hundred turns.
const MOST_TURN_DEG: f64 = 36_000.0;

/// Forces that arrows may be scaled by, N: those of coils are tenths of a millinewton.
const FORCE_N: [f64; 2] = [1e-6, 1000.0];

/// Largest number of tables of injections and of parts.
const MOST_TABLES: usize = 1000;

/// One of the two kinds of frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Deserialize, Serialize)]
pub enum View {
    /// The shaded scene: translucent wall, opaque devices.
    #[serde(rename = "3d")]
    ThreeD,
    /// The simulated fluoroscopic picture.
    #[serde(rename = "fluoro")]
    Fluoro,
}

/// The engine for the frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Backend {
    /// A graphics processor if there is one, otherwise the plain Rust path, which is faster than a software adapter.
    #[default]
    Auto,
    /// wgpu, including a software adapter; an error without any adapter.
    Gpu,
    /// Plain Rust.
    Cpu,
}

/// The `[view]` table of a scene.
///
/// ```
/// use endowire_viewer::{View, ViewSpec};
///
/// let spec = ViewSpec { views: vec![View::Fluoro], size_px: [512, 512], ..ViewSpec::default() };
/// assert!(spec.validate().is_ok());
/// ```
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct ViewSpec {
    /// Width and height of every frame in pixels, each 1 to 4096.
    pub size_px: [u32; 2],
    /// The wanted frames. Nothing is prepared for other views.
    pub views: Vec<View>,
    /// One frame per this many recorded steps, from 1; the last step always gets one. Used by the recorder.
    pub every: u32,
    /// An animation of all frames, the views side by side: `gif`, `png` or `apng`, and `mp4` with the feature of that
    /// name. Used by the recorder.
    pub film: Option<String>,
    /// The engine for the frames.
    pub backend: Backend,
    /// Position of the C-arm.
    pub c_arm: CArmSpec,
    /// A second plane of fluoroscopy, turned by this angle (towards LAO) from the first, -180 to 180. A
    /// [`crate::Renderer`] draws one plane: [`Self::planes`] gives the view of each.
    pub biplane_deg: Option<f64>,
    /// X-ray physics.
    pub xray: XRaySpec,
    /// Exposure control; absent: voltage and dose as given.
    pub exposure: Option<ExposureSpec>,
    /// The detector.
    pub detector: DetectorSpec,
    /// The patient.
    pub patient: PatientSpec,
    /// Blood flow.
    pub flow: FlowSpec,
    /// Injections of contrast medium; at most 1000 tables.
    pub injection: Vec<InjectionSpec>,
    /// The parts of the device with their materials; without any, it is a solid rod of `xray.device_material`. At
    /// most 1000 tables.
    pub device: Vec<DevicePart>,
    /// Frames per second, 0.01 to 1000: it converts recorded steps to times.
    pub frames_per_s: f64,
    /// Bits per pixel of the fluoroscopic frames, 8 or 16.
    pub bits: u32,
    /// Viewing direction of the 3D view.
    pub camera: CameraSpec,
}

/// What films there are.
const FILMS: &str = "is no moving picture that is written: gif, png, apng, or mp4 where the program was built with that feature";

impl Default for ViewSpec {
    fn default() -> Self {
        Self {
            size_px: [640, 640],
            views: Vec::new(),
            every: 10,
            film: None,
            backend: Backend::Auto,
            c_arm: CArmSpec::default(),
            biplane_deg: None,
            xray: XRaySpec::default(),
            exposure: None,
            detector: DetectorSpec::default(),
            patient: PatientSpec::default(),
            flow: FlowSpec::default(),
            injection: Vec::new(),
            device: Vec::new(),
            frames_per_s: 15.0,
            bits: 8,
            camera: CameraSpec::default(),
        }
    }
}

/// The `[view.camera]` table of the 3D view. Without either angle, the camera looks from the front, slightly from the
/// left and above, or across the plane of a planar vessel.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct CameraSpec {
    /// Around the long axis of the patient: 0 is anterior, 90 the patient's left; -360 to 360.
    pub azimuth_deg: Option<f64>,
    /// Above the transverse plane, towards the head; -360 to 360.
    pub elevation_deg: Option<f64>,
    /// Rotation about the long axis of the patient from the direction of these angles, -36,000 to 36,000.
    pub turn_deg: f64,
    /// If given, the camera is so far away that it sees everything during such a rotation, -36,000 to 36,000; absent:
    /// from its own direction.
    pub orbit_deg: Option<f64>,
    /// Whether a scale bar is drawn.
    pub scale_bar: bool,
    /// Whether letters at the borders show directions (L left, R right, H head, F feet, A front, P back), and a
    /// legend the scale of the forces.
    pub markers: bool,
    /// Force whose arrow is as long as that of the legend, 0.000001 to 1000 N: one scale for all frames. Absent: the
    /// largest of each frame; of all that it draws in `endowire render`.
    pub force_n: Option<f64>,
    /// By how much the picture is magnified about its middle, 0.1 to 100.
    pub magnification: f64,
    /// How far its middle goes to the right and up, in widths of the picture without magnification, each -10 to 10.
    pub shift: [f64; 2],
    /// Whether the beam of the C-arm is drawn; the camera then moves back to show the field at the isocentre.
    pub c_arm: bool,
}

impl Default for CameraSpec {
    fn default() -> Self {
        Self {
            azimuth_deg: None,
            elevation_deg: None,
            turn_deg: 0.0,
            orbit_deg: None,
            scale_bar: true,
            markers: true,
            force_n: None,
            magnification: 1.0,
            shift: [0.0; 2],
            c_arm: false,
        }
    }
}

impl ViewSpec {
    /// Makes the files it names relative to `folder`, that of the scene.
    pub fn in_folder(mut self, folder: &Path) -> Self {
        let named = [self.flow.tree.as_mut(), self.patient.ct.as_mut().map(|ct| &mut ct.file)];
        named.into_iter().flatten().for_each(|path| *path = folder.join(&*path));
        self
    }

    /// Whether frames of this kind are wanted.
    pub fn wants(&self, view: View) -> bool {
        self.views.contains(&view)
    }

    /// Whether medium comes out of an instrument's tip.
    pub fn injects_at_tip(&self) -> bool {
        self.injection.iter().any(|one| one.at_tip)
    }

    /// The view of each plane: this one and, with `biplane_deg`, the fluoroscopy of the second.
    pub fn planes(&self) -> Vec<Self> {
        let first = Self { biplane_deg: None, ..self.clone() };
        let second = self.biplane_deg.filter(|_| self.wants(View::Fluoro)).map(|turn_deg| Self {
            views: vec![View::Fluoro],
            c_arm: first.c_arm.turned(turn_deg),
            ..first.clone()
        });
        std::iter::once(first).chain(second).collect()
    }

    /// The parts of the `[[view.device]]` tables, if there are any.
    ///
    /// # Errors
    /// If there are tables although there are `several` instruments: they describe one.
    pub fn own_parts(&self, several: bool) -> Result<Option<&[DevicePart]>> {
        let own = Some(&self.device[..]).filter(|parts| !parts.is_empty());
        if several && own.is_some() {
            let remedy = "describes one device, and there are several instruments: leave it out, and give materials in their files";
            return Err(Error::parameter("view.device", self.device.len(), remedy));
        }
        Ok(own)
    }

    /// Checks every value separately and against the others.
    ///
    /// # Errors
    /// [`Error::Parameter`] with the key as in the scene file, the value and the correction.
    pub fn validate(&self) -> Result<()> {
        for side in self.size_px {
            if side == 0 || side > LARGEST_SIDE_PX {
                let remedy = format!("each side must be 1 to {LARGEST_SIDE_PX} pixels");
                return Err(Error::parameter("view.size_px", format!("{:?}", self.size_px), remedy));
            }
        }
        if self.every == 0 {
            return Err(Error::parameter("view.every", 0, "must be at least 1"));
        }
        if let Some(film) = &self.film {
            Animation::check_name(&Path::new("film").with_extension(film))
                .map_err(|_| Error::parameter("view.film", film, FILMS))?;
        }
        self.c_arm.validate()?;
        if let Some(turn_deg) = self.biplane_deg {
            finite_within("view.biplane_deg", turn_deg, [-180.0, 180.0])?;
        }
        self.xray.validate()?;
        self.detector.validate()?;
        self.patient.validate()?;
        self.flow.validate()?;
        for (key, tables) in [("injection", self.injection.len()), ("device", self.device.len())] {
            if tables > MOST_TABLES {
                let remedy = format!("at most {MOST_TABLES} are read");
                return Err(Error::parameter(format!("view.{key}"), format!("{tables} tables"), remedy));
            }
        }
        self.injection.iter().enumerate().try_for_each(|(i, injection)| injection.validate(i))?;
        anatomy::validate_parts(&self.device)?;
        finite_within("view.frames_per_s", self.frames_per_s, [0.01, 1000.0])?;
        // Rounded, for the message.
        let most_ms = (1e4 / self.frames_per_s).round() / 10.0;
        finite_within("view.xray.pulse_ms", self.xray.pulse_ms, [0.0, most_ms])?;
        self.exposure.as_ref().map_or(Ok(()), ExposureSpec::validate)?;
        check_exposure(self)?;
        if ![8, 16].contains(&self.bits) {
            return Err(Error::parameter("view.bits", self.bits, "must be 8 or 16"));
        }
        for (key, angle) in
            [("azimuth_deg", self.camera.azimuth_deg), ("elevation_deg", self.camera.elevation_deg)]
        {
            finite_within(&format!("view.camera.{key}"), angle.unwrap_or(0.0), [-360.0, 360.0])?;
        }
        finite_within("view.camera.magnification", self.camera.magnification, [0.1, 100.0])?;
        for share in self.camera.shift {
            finite_within("view.camera.shift", share, [-10.0, 10.0])?;
        }
        finite_within("view.camera.force_n", self.camera.force_n.unwrap_or(1.0), FORCE_N)?;
        for (key, turn) in
            [("turn_deg", self.camera.turn_deg), ("orbit_deg", self.camera.orbit_deg.unwrap_or(0.0))]
        {
            finite_within(&format!("view.camera.{key}"), turn, [-MOST_TURN_DEG, MOST_TURN_DEG])?;
        }
        Ok(())
    }
}

fn finite_within(key: &str, value: f64, [low, high]: [f64; 2]) -> Result<()> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    Err(Error::parameter(key, value, format!("must be a number from {low} to {high}")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::Material;

    fn parse(text: &str) -> std::result::Result<ViewSpec, String> {
        toml::from_str(text).map_err(|e: toml::de::Error| e.to_string())
    }

    #[test]
    fn a_whole_table_is_read() {
        let spec = parse(
            r#"
            size_px = [320, 240]
            views = ["3d", "fluoro"]
            every = 5
            backend = "cpu"
            [c_arm]
            primary_deg = 30.0
            pixel_mm = 0.3
            isocentre_mm = [1.0, 2.0, 3.0]
            [xray]
            contrast_fraction = 0.3
            device_material = "nitinol"
            [camera]
            azimuth_deg = 20.0
            "#,
        )
        .unwrap();
        assert!(spec.validate().is_ok());
        assert!(spec.wants(View::ThreeD) && spec.wants(View::Fluoro));
        assert_eq!(spec.xray.device_material, Material::Nitinol);
        assert_eq!(spec.c_arm.sid_mm, 1100.0);
    }

    #[test]
    fn an_empty_table_is_the_default_and_wants_nothing() {
        assert_eq!(parse("").unwrap(), ViewSpec::default());
        assert!(ViewSpec::default().views.is_empty() && ViewSpec::default().validate().is_ok());
    }

    #[test]
    fn unknown_keys_views_and_materials_are_refused_by_name() {
        for (text, named) in [
            ("sizepx = [1, 1]", "size_px"),
            ("views = [\"2d\"]", "fluoro"),
            ("[c_arm]\nlao_deg = 3", "primary_deg"),
            ("[xray]\ndevice_material = \"stell_316l\"", "steel_316l"),
        ] {
            let error = parse(text).unwrap_err();
            assert!(error.contains(named), "{error}");
        }
    }

    fn injection(duration_s: f64, rate_ml_per_s: f64) -> InjectionSpec {
        InjectionSpec { start_s: 0.0, duration_s, rate_ml_per_s, at_mm: None, at_tip: false }
    }

    #[test]
    fn each_bad_value_names_its_key() {
        type Spoil = fn(&mut ViewSpec);
        let cases: [(&str, Spoil); 58] = [
            ("camera.magnification", |s| s.camera.magnification = 0.0),
            ("camera.shift", |s| s.camera.shift = [0.0, 11.0]),
            ("xray.brightness_s", |s| s.xray.brightness_s = 10.1),
            ("xray.edges", |s| s.xray.edges = 5.1),
            ("camera.force_n", |s| s.camera.force_n = Some(0.0)),
            ("size_px", |s| s.size_px = [0, 10]),
            ("size_px", |s| s.size_px = [10, 9000]),
            ("every", |s| s.every = 0),
            ("film", |s| s.film = Some("avi".to_owned())),
            ("primary_deg", |s| s.c_arm.primary_deg = f64::NAN),
            ("secondary_deg", |s| s.c_arm.secondary_deg = 91.0),
            ("sid_mm", |s| s.c_arm.sid_mm = 0.0),
            ("sod_mm", |s| s.c_arm.sod_mm = 1100.0),
            ("pixel_mm", |s| s.c_arm.pixel_mm = Some(-0.1)),
            ("isocentre_mm", |s| s.c_arm.isocentre_mm = Some([0.0, f64::INFINITY, 0.0])),
            ("energy_kev", |s| s.xray.energy_kev = Some(10.0)),
            ("contrast_fraction", |s| s.xray.contrast_fraction = 1.5),
            ("tissue_mm", |s| s.xray.tissue_mm = f64::NAN),
            ("window", |s| s.xray.window = Some([2.0, 1.0])),
            ("kvp", |s| s.xray.kvp = 30.0),
            ("energy_bins", |s| s.xray.energy_bins = Some(0)),
            ("dose_ngy", |s| s.detector.dose_ngy = Some(0.0)),
            ("lag", |s| s.detector.lag = 1.0),
            ("rotation_deg", |s| s.c_arm.rotation_deg = f64::NAN),
            ("magnification", |s| s.c_arm.magnification = 0.0),
            ("field_mm", |s| (s.c_arm.field_mm, s.c_arm.pixel_mm) = (Some(200.0), Some(0.2))),
            ("inflow_ml_per_s", |s| s.flow.inflow_ml_per_s = -1.0),
            ("pulsatility", |s| s.flow.pulsatility = 1.0),
            ("heart_rate_per_min", |s| s.flow.heart_rate_per_min = 0.0),
            ("tissue_s", |s| s.flow.tissue_s = 0.0),
            ("flow.tissue_mm", |s| s.flow.tissue_mm = Some(0.5)),
            ("at_tip", |s| {
                s.injection =
                    vec![InjectionSpec { at_tip: true, at_mm: Some([0.0; 3]), ..injection(1.0, 1.0) }];
            }),
            ("torso.width_mm", |s| {
                s.patient.torso = Some(TorsoSpec { width_mm: f64::NAN, ..TorsoSpec::default() });
            }),
            ("torso.breath_mm", |s| {
                s.patient.torso = Some(TorsoSpec { breath_mm: Some(41.0), ..TorsoSpec::default() });
            }),
            ("torso.breath_s", |s| {
                s.patient.torso = Some(TorsoSpec { breath_s: 0.0, ..TorsoSpec::default() });
            }),
            ("torso.table_mm", |s| {
                s.patient.torso = Some(TorsoSpec { table_mm: Some(1e300), ..TorsoSpec::default() });
            }),
            ("bits", |s| s.bits = 12),
            ("azimuth_deg", |s| s.camera.azimuth_deg = Some(f64::NAN)),
            ("sid_mm", |s| s.c_arm.sid_mm = 1e300),
            ("sod_mm", |s| s.c_arm.sod_mm = 1e-308),
            ("pixel_mm", |s| s.c_arm.pixel_mm = Some(1e-308)),
            ("field_mm", |s| s.c_arm.field_mm = Some(1e-308)),
            ("field_mm", |s| s.c_arm.field_mm = Some(1e308)),
            ("collimation_mm", |s| s.c_arm.collimation_mm = Some([1e-308, 1.0])),
            ("isocentre_mm", |s| s.c_arm.isocentre_mm = Some([0.0, 1e300, 0.0])),
            ("csi_mm", |s| s.xray.csi_mm = 1e-308),
            ("window", |s| s.xray.window = Some([-1e308, 1e308])),
            ("window", |s| s.xray.window = Some([1.0, 1.0 + 1e-12])),
            ("dose_ngy", |s| s.detector.dose_ngy = Some(1e308)),
            ("inflow_ml_per_s", |s| s.flow.inflow_ml_per_s = 1e-308),
            ("injection[1].rate_ml_per_s", |s| {
                s.injection = vec![injection(1.0, 1.0), injection(1.0, 1e308)];
            }),
            ("injection[0].duration_s", |s| s.injection = vec![injection(1e-308, 1.0)]),
            ("injection[0].duration_s", |s| s.injection = vec![injection(1e4, 1.0)]),
            ("view.injection = 1001 tables", |s| s.injection = vec![injection(1.0, 1.0); 1001]),
            ("diaphragm_mm", |s| {
                s.patient.torso = Some(TorsoSpec { diaphragm_mm: Some(1e300), ..TorsoSpec::default() });
            }),
            ("device[0].outer_radius_mm", |s| {
                s.device = vec![DevicePart { outer_radius_mm: Some(1e308), ..DevicePart::default() }];
            }),
            ("device[0].inner_radius_mm", |s| {
                s.device = vec![DevicePart { inner_radius_mm: 1e308, ..DevicePart::default() }];
            }),
            ("device[0].from_tip_mm", |s| {
                s.device = vec![DevicePart { from_tip_mm: Some([0.0, 1e308]), ..DevicePart::default() }];
            }),
        ];
        for (key, spoil) in cases {
            let mut spec = ViewSpec::default();
            spoil(&mut spec);
            let error = spec.validate().unwrap_err().to_string();
            assert!(error.starts_with("view.") && error.contains(key), "{key}: {error}");
        }
    }
}
