//! `[view.xray]` and `[view.detector]`: the beam, the mode, the detector.

use endowire_core::{Error, Result};
use serde::{Deserialize, Serialize};

use super::finite_within;
use crate::material::Material;
use crate::xray::check_kvp;

/// Display modes of fluoroscopy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// Live fluoroscopy: low dose, the log-transformed signal.
    #[default]
    Fluoro,
    /// Cine: the same with ten times the dose.
    Cine,
    /// Digital subtraction angiography, ln(mask) − ln(frame): additions since the mask are dark.
    Dsa,
    /// The device, dark, over the white vessels of a stored angiogram.
    Roadmap,
}

impl Mode {
    /// Usual air kerma at the detector, nGy per frame.
    pub fn dose_ngy(self) -> f64 {
        match self {
            Self::Fluoro | Self::Roadmap => 30.0,
            Self::Cine => 300.0,
            Self::Dsa => 1500.0,
        }
    }
}

/// The `[view.xray]` table.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct XRaySpec {
    /// The display mode.
    pub mode: Mode,
    /// Peak voltage of the tube in kV, 50 to 125 in steps of 5; overridden by `[view.exposure]`.
    pub kvp: f64,
    /// Length of a pulse: a frame shows motion over this time, up to the frame's time. From 0, instantaneous, to the
    /// time between two frames.
    pub pulse_ms: f64,
    /// Time constant of the automatic brightness control in fluoroscopy and cine, 0 (exposure is held) to 10: how fast
    /// the tube follows the mean signal between the blades when medium, blades or C-arm change it.
    pub brightness_s: f64,
    /// Filtration, aluminium; 0 to 20.
    pub aluminium_mm: f64,
    /// Filtration, copper; 0 to 5.
    pub copper_mm: f64,
    /// Number of energies that represent the spectrum. Absent: every line of its table, exact to a millionth. Eight
    /// are within a ten-thousandth of it for most scenes, at an eighth of the work. 1 to 1000.
    pub energy_bins: Option<u32>,
    /// A single energy instead of the spectrum, 15 to 125 keV.
    pub energy_kev: Option<f64>,
    /// Volume fraction of contrast medium (370 mg iodine per ml) constantly in the blood, 0 to 1.
    pub contrast_fraction: f64,
    /// Thickness of soft tissue along the central ray. This body is a slab across the beam, like the 20 cm water
    /// phantom of acceptance tests: a uniform background from every angle, with exactly known path lengths. 0 is air,
    /// and 1000 the maximum. Overridden by a patient (`[view.patient]`).
    pub tissue_mm: f64,
    /// Scintillator: solid caesium iodide, 0.001 to 10.
    pub csi_mm: f64,
    /// Focal spot, 0 to 3: tubes of angiography have nominal ones of 0.3 to 1.2 mm (IEC 60336), 0 is a point. Its
    /// penumbra is that of objects at the isocentre.
    pub focal_spot_mm: f64,
    /// Material of devices that do not name their own.
    pub device_material: Material,
    /// Fraction of the anatomy's low-frequency shading removed in the display of fluoroscopy and cine, so that lungs
    /// and spine are both visible; 0 shows the logarithm of the signal unchanged, 1 removes all of it.
    pub harmonised: f64,
    /// Edge enhancement of the display: this much of what is finer than half a millimetre at the detector is added once
    /// more, 0 to 5. It makes wires stand out, and noise.
    pub edges: f64,
    /// Line integrals shown white and black in fluoroscopy and cine, -100 to 100 with the black one larger by at
    /// least 0.0001; absent: fitted to the anatomy, equal for all frames of a run.
    pub window: Option<[f64; 2]>,
}

impl Default for XRaySpec {
    fn default() -> Self {
        Self {
            mode: Mode::Fluoro,
            kvp: 80.0,
            pulse_ms: 0.0,
            brightness_s: 0.3,
            aluminium_mm: 2.5,
            copper_mm: 0.2,
            energy_bins: None,
            energy_kev: None,
            contrast_fraction: 0.0,
            tissue_mm: 200.0,
            // Absorbs 88 % at 57.8 keV.
            csi_mm: 0.6,
            focal_spot_mm: 0.6,
            device_material: Material::Steel316L,
            harmonised: 0.55,
            edges: 0.0,
            window: None,
        }
    }
}

impl XRaySpec {
    pub(super) fn validate(&self) -> Result<()> {
        if let Some(energy) = self.energy_kev {
            Material::SoftTissue.attenuation_per_mm(energy)?;
        }
        check_kvp(self.kvp)?;
        finite_within("view.xray.brightness_s", self.brightness_s, [0.0, 10.0])?;
        finite_within("view.xray.aluminium_mm", self.aluminium_mm, [0.0, 20.0])?;
        finite_within("view.xray.copper_mm", self.copper_mm, [0.0, 5.0])?;
        if let Some(count) = self.energy_bins.filter(|count| !(1..=1000).contains(count)) {
            return Err(Error::parameter("view.xray.energy_bins", count, "must be 1 to 1000"));
        }
        finite_within("view.xray.contrast_fraction", self.contrast_fraction, [0.0, 1.0])?;
        finite_within("view.xray.tissue_mm", self.tissue_mm, [0.0, 1000.0])?;
        finite_within("view.xray.csi_mm", self.csi_mm, [0.001, 10.0])?;
        finite_within("view.xray.focal_spot_mm", self.focal_spot_mm, [0.0, 3.0])?;
        finite_within("view.xray.harmonised", self.harmonised, [0.0, 1.0])?;
        finite_within("view.xray.edges", self.edges, [0.0, 5.0])?;
        if let Some([white, black]) = self.window
            && !(white >= -100.0 && black <= 100.0 && black - white >= 1e-4)
        {
            let value = format!("[{white}, {black}]");
            let remedy = "must be two line integrals from -100 to 100, the white one less than the black one by 0.0001 at least";
            return Err(Error::parameter("view.xray.window", value, remedy));
        }
        Ok(())
    }
}

/// Largest blur in pixels: beyond it a frame would take minutes.
const MOST_BLUR_PX: f64 = 50.0;

/// The `[view.detector]` table.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct DetectorSpec {
    /// Air kerma at the detector behind the patient, per frame, 0.001 to a million; absent: usual for the mode.
    pub dose_ngy: Option<f64>,
    /// Whether there is photon noise; without it, frames are smooth.
    pub noise: bool,
    /// Seed of the noise, any whole number from 0: equal seeds give equal frames. Another pose or plane has different
    /// noise.
    pub seed: u64,
    /// Spread of the scintillator's light: standard deviation of a Gaussian at the detector, 0 to 10 and no more than 50 pixels.
    pub blur_mm: f64,
    /// Dose whose photon noise equals the electronic noise of reading a pixel, 0 to 10,000: flat detectors have 1 to
    /// 10 nGy, 0 is none.
    pub electronic_ngy: f64,
    /// Fraction of a frame that is read again a thirtieth of a second later, 0 to 0.99: at other rates what has not decayed
    /// by then.
    pub lag: f64,
    /// Fraction of scattered photons behind the grid, 0 to 0.95. Behind 20 cm of tissue two thirds of all photons are
    /// scattered; a grid that lets seven tenths of the others and a tenth of these through leaves a quarter.
    pub scatter_fraction: f64,
}

impl Default for DetectorSpec {
    fn default() -> Self {
        Self {
            dose_ngy: None,
            noise: true,
            seed: 1,
            blur_mm: 0.15,
            electronic_ngy: 0.0,
            lag: 0.04,
            scatter_fraction: 0.25,
        }
    }
}

impl DetectorSpec {
    /// An ideal detector: no noise, blur, lag or scatter. The focal spot is the tube's ([`XRaySpec::focal_spot_mm`]).
    pub fn ideal() -> Self {
        Self { noise: false, blur_mm: 0.0, lag: 0.0, scatter_fraction: 0.0, ..Self::default() }
    }

    pub(super) fn validate(&self) -> Result<()> {
        if let Some(dose) = self.dose_ngy {
            finite_within("view.detector.dose_ngy", dose, [0.001, 1e6])?;
        }
        finite_within("view.detector.blur_mm", self.blur_mm, [0.0, 10.0])?;
        finite_within("view.detector.electronic_ngy", self.electronic_ngy, [0.0, 1e4])?;
        finite_within("view.detector.lag", self.lag, [0.0, 0.99])?;
        finite_within("view.detector.scatter_fraction", self.scatter_fraction, [0.0, 0.95])
    }

    /// Checks the blur relative to the pixels: the kernel extends over three times its deviation.
    pub(crate) fn check_blur(&self, pixel_mm: f64) -> Result<()> {
        if self.blur_mm <= MOST_BLUR_PX * pixel_mm {
            return Ok(());
        }
        let remedy = format!(
            "is {:.0} pixels of {pixel_mm} mm, and at most {MOST_BLUR_PX} are spread over: give at most {} mm, or larger pixels \
             (view.c_arm)",
            self.blur_mm / pixel_mm,
            MOST_BLUR_PX * pixel_mm
        );
        Err(Error::parameter("view.detector.blur_mm", self.blur_mm, remedy))
    }
}
