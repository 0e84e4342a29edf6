//! What a scene file says about frames: its `[view]` table, with units in the names.

use endowire_core::{Error, Result};
use serde::{Deserialize, Serialize};

use crate::xray::Material;

/// Largest side of a frame. Flat detectors have up to about 3000 pixels a side, and with two rays across a
/// pixel this is the texture size that every adapter offers.
const LARGEST_SIDE_PX: u32 = 4096;

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

/// What computes the frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Backend {
    /// A graphics processor where there is one, else the plain Rust path, which is faster than a software
    /// adapter.
    #[default]
    Auto,
    /// wgpu, a software adapter included; an error without any adapter.
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
    /// Width and height of every frame in pixels.
    pub size_px: [u32; 2],
    /// The frames wanted. Nothing is built for a view that is not named here.
    pub views: Vec<View>,
    /// A frame each so many recorded steps; the last step always gets one. This is the recorder's to obey.
    pub every: u32,
    /// What computes the frames.
    pub backend: Backend,
    /// Position of the C-arm.
    pub c_arm: CArmSpec,
    /// X-ray physics.
    pub xray: XRaySpec,
    /// Direction from which the 3D view looks.
    pub camera: CameraSpec,
}

impl Default for ViewSpec {
    fn default() -> Self {
        Self {
            size_px: [640, 640],
            views: Vec::new(),
            every: 10,
            backend: Backend::Auto,
            c_arm: CArmSpec::default(),
            xray: XRaySpec::default(),
            camera: CameraSpec::default(),
        }
    }
}

/// The `[view.c_arm]` table; conventions are those of [`crate::CArm`].
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct CArmSpec {
    /// Positioner primary angle, LAO positive (DICOM 0018,1510).
    pub primary_deg: f64,
    /// Positioner secondary angle, cranial positive (DICOM 0018,1511).
    pub secondary_deg: f64,
    /// Source to detector.
    pub sid_mm: f64,
    /// Source to isocentre.
    pub sod_mm: f64,
    /// Pixel pitch at the detector; absent: the vessel fills the frame.
    pub pixel_mm: Option<f64>,
    /// Centre of rotation, seen in the middle of the frame; absent: the centre of the vessel's bounding box.
    pub isocentre_mm: Option<[f64; 3]>,
}

impl Default for CArmSpec {
    fn default() -> Self {
        // Middle of the usual ranges: SID 1000–1200 mm, SOD 700–800 mm.
        Self {
            primary_deg: 0.0,
            secondary_deg: 0.0,
            sid_mm: 1100.0,
            sod_mm: 750.0,
            pixel_mm: None,
            isocentre_mm: None,
        }
    }
}

/// The `[view.xray]` table.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct XRaySpec {
    /// Photon energy, 40 to 80 keV: one line in place of a spectrum. 60 keV is near the mean of 80 kVp with
    /// 0.2 mm Cu behind 20 cm of water (57.8 keV).
    pub energy_kev: f64,
    /// Volume fraction of contrast medium (370 mg iodine per ml) in the blood, 0 to 1.
    pub contrast_fraction: f64,
    /// Thickness of soft tissue along the central ray. The body is a slab across the beam, as the 20 cm water
    /// phantom of acceptance tests is: an even background from every angle, whose path lengths are known
    /// exactly. 0 is air.
    pub tissue_mm: f64,
    /// Material of devices that do not name their own.
    pub device_material: Material,
    /// Line integrals shown white and black; absent: fitted to the anatomy, the same for all frames of a run.
    pub window: Option<[f64; 2]>,
}

impl Default for XRaySpec {
    fn default() -> Self {
        Self {
            energy_kev: 60.0,
            contrast_fraction: 0.0,
            tissue_mm: 200.0,
            device_material: Material::Steel316L,
            window: None,
        }
    }
}

/// The `[view.camera]` table of the 3D view. With neither angle given, the camera looks from the front,
/// slightly from the left and above, or across the plane of a vessel that lies in one.
#[derive(Debug, Clone, PartialEq, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct CameraSpec {
    /// Around the long axis of the patient: 0 is anterior, 90 the patient's left.
    pub azimuth_deg: Option<f64>,
    /// Above the transverse plane, towards the head.
    pub elevation_deg: Option<f64>,
}

impl ViewSpec {
    /// Whether frames of this kind are wanted.
    pub fn wants(&self, view: View) -> bool {
        self.views.contains(&view)
    }

    /// Checks every value on its own and against the others.
    ///
    /// # Errors
    /// [`Error::Parameter`] with the key as the scene file has it, the value and the mend.
    pub fn validate(&self) -> Result<()> {
        for side in self.size_px {
            if side == 0 || side > LARGEST_SIDE_PX {
                let mend = format!("each side must be 1 to {LARGEST_SIDE_PX} pixels");
                return Err(Error::parameter("view.size_px", format!("{:?}", self.size_px), mend));
            }
        }
        if self.every == 0 {
            return Err(Error::parameter("view.every", 0, "must be at least 1"));
        }
        self.c_arm.validate()?;
        self.xray.validate()?;
        for (key, angle) in
            [("azimuth_deg", self.camera.azimuth_deg), ("elevation_deg", self.camera.elevation_deg)]
        {
            finite_within(&format!("view.camera.{key}"), angle.unwrap_or(0.0), [-360.0, 360.0])?;
        }
        Ok(())
    }
}

impl CArmSpec {
    fn validate(&self) -> Result<()> {
        finite_within("view.c_arm.primary_deg", self.primary_deg, [-360.0, 360.0])?;
        finite_within("view.c_arm.secondary_deg", self.secondary_deg, [-90.0, 90.0])?;
        positive("view.c_arm.sid_mm", self.sid_mm)?;
        positive("view.c_arm.sod_mm", self.sod_mm)?;
        if self.sod_mm >= self.sid_mm {
            let mend =
                format!("must be less than sid_mm = {}: the isocentre is before the detector", self.sid_mm);
            return Err(Error::parameter("view.c_arm.sod_mm", self.sod_mm, mend));
        }
        if let Some(pitch) = self.pixel_mm {
            positive("view.c_arm.pixel_mm", pitch)?;
        }
        if let Some(isocentre) = self.isocentre_mm
            && !isocentre.iter().all(|x| x.is_finite())
        {
            let value = format!("{isocentre:?}");
            return Err(Error::parameter("view.c_arm.isocentre_mm", value, "must be finite"));
        }
        Ok(())
    }
}

impl XRaySpec {
    fn validate(&self) -> Result<()> {
        for material in [Material::Blood, self.device_material] {
            material.attenuation_per_mm(self.energy_kev)?;
        }
        finite_within("view.xray.contrast_fraction", self.contrast_fraction, [0.0, 1.0])?;
        finite_within("view.xray.tissue_mm", self.tissue_mm, [0.0, 1000.0])?;
        if let Some([white, black]) = self.window
            && !(white.is_finite() && black.is_finite() && white < black)
        {
            let value = format!("[{white}, {black}]");
            let mend = "must be two finite line integrals, the white one less than the black one";
            return Err(Error::parameter("view.xray.window", value, mend));
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

fn positive(key: &str, value: f64) -> Result<()> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(Error::parameter(key, value, "must be a finite number above 0"))
}

#[cfg(test)]
mod tests {
    use super::*;

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

    #[test]
    fn each_bad_value_names_its_key() {
        type Spoil = fn(&mut ViewSpec);
        let cases: [(&str, Spoil); 14] = [
            ("size_px", |s| s.size_px = [0, 10]),
            ("size_px", |s| s.size_px = [10, 9000]),
            ("every", |s| s.every = 0),
            ("primary_deg", |s| s.c_arm.primary_deg = f64::NAN),
            ("secondary_deg", |s| s.c_arm.secondary_deg = 91.0),
            ("sid_mm", |s| s.c_arm.sid_mm = 0.0),
            ("sod_mm", |s| s.c_arm.sod_mm = 1100.0),
            ("pixel_mm", |s| s.c_arm.pixel_mm = Some(-0.1)),
            ("isocentre_mm", |s| s.c_arm.isocentre_mm = Some([0.0, f64::INFINITY, 0.0])),
            ("energy_kev", |s| s.xray.energy_kev = 30.0),
            ("contrast_fraction", |s| s.xray.contrast_fraction = 1.5),
            ("tissue_mm", |s| s.xray.tissue_mm = f64::NAN),
            ("window", |s| s.xray.window = Some([2.0, 1.0])),
            ("azimuth_deg", |s| s.camera.azimuth_deg = Some(f64::NAN)),
        ];
        for (key, spoil) in cases {
            let mut spec = ViewSpec::default();
            spoil(&mut spec);
            let error = spec.validate().unwrap_err().to_string();
            assert!(error.starts_with("view.") && error.contains(key), "{key}: {error}");
        }
    }
}
