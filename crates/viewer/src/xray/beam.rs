//! From path lengths to grey values.
//!
//! **Beer–Lambert.** Along a ray, I/I₀ = exp(−p) with the line integral p = Σ μᵢ Lᵢ over the materials met.
//! They nest: the lumen displaces tissue, a device displaces what fills the lumen. With the geometric lengths
//! B (body), V (inside the wall) and Dⱼ (inside device j),
//!
//! ```text
//! p = μ_tissue · max(B − V, 0) + μ_lumen · V + Σⱼ (μⱼ − μ_lumen) · Dⱼ
//! ```
//!
//! The max covers a vessel that reaches out of the body, and a phantom in air (B = 0). Devices are taken to
//! lie inside the lumen and beside each other: a part outside the wall, or a wire within a catheter,
//! displaces lumen filling all the same.
//!
//! **Pixels** collect energy over their area, so intensities, not line integrals, are averaged over
//! [`SUBRAYS`]² rays a pixel. **Display** is the usual logarithmic one: the averaged transmission T becomes
//! −ln T, and a window maps it linearly from white to black. Adding a layer then darkens by the same step
//! wherever it lies.

use endowire_core::Result;
use endowire_core::vessel::SurfaceMesh;

use crate::c_arm::CArm;
use crate::cpu::wall_path_mm;
use crate::spec::XRaySpec;
use crate::xray::{Material, PathLengths};

/// Rays across a pixel in each direction. Two give four grey levels of edge smoothing, enough beside a real
/// detector's blur, at four times the cost of one.
pub(crate) const SUBRAYS: u32 = 2;

/// Part of the display window kept brighter than the most transparent place of the anatomy, in units of p:
/// the background stays grey rather than white.
const WINDOW_BELOW: f64 = 0.1;
/// Part of the window kept darker than the densest place of the anatomy: what 0.4 mm of steel or 0.55 mm of
/// nitinol add at 60 keV shows as black.
const WINDOW_ABOVE: f64 = 0.4;
/// Size of the decimated detector on which the range of the anatomy is found.
const WINDOW_PROBE_PX: u32 = 128;
/// Line integrals further than this above the window's white end are black whatever the window;
/// clamping there keeps exp() inside f32.
const DEEPEST: f32 = 80.0;

/// The physics of one fluoroscopic set-up, resolved to numbers.
#[derive(Debug, Clone)]
pub(crate) struct Beam {
    energy_kev: f64,
    device_material: Material,
    pub(crate) tissue_mm: f64,
    pub(crate) mu_tissue: f64,
    pub(crate) mu_lumen: f64,
    /// Line integrals shown white and black.
    pub(crate) window: [f64; 2],
}

/// Rounding offset in [0, 1) of a pixel: interleaved gradient noise (Jimenez, Next Generation Post Processing
/// in Call of Duty, SIGGRAPH 2014). Rounding all pixels alike would draw contour lines into the smooth
/// background.
fn dither(x: usize, y: usize) -> f32 {
    (52.982_918 * (0.067_110_56 * x as f32 + 0.005_837_15 * y as f32).fract()).fract()
}

impl Beam {
    pub(crate) fn new(spec: &XRaySpec, c_arm: &CArm, wall: &SurfaceMesh) -> Result<Self> {
        let mu = |material: Material| material.attenuation_per_mm(spec.energy_kev);
        let f = spec.contrast_fraction;
        let mut beam = Self {
            energy_kev: spec.energy_kev,
            device_material: spec.device_material,
            tissue_mm: spec.tissue_mm,
            mu_tissue: mu(Material::SoftTissue)?,
            mu_lumen: (1.0 - f) * mu(Material::Blood)? + f * mu(Material::Contrast370)?,
            window: [0.0, 1.0],
        };
        beam.window = spec.window.unwrap_or_else(|| beam.fitted_window(c_arm, wall));
        Ok(beam)
    }

    fn fitted_window(&self, c_arm: &CArm, wall: &SurfaceMesh) -> [f64; 2] {
        let probe = c_arm.decimated(WINDOW_PROBE_PX);
        let lumen = wall_path_mm(&probe, wall);
        let (low, high) = (0..).zip(&lumen).fold((f64::MAX, f64::MIN), |(low, high), (i, &v)| {
            let p = self.anatomy(probe.obliquity_at(i), v);
            (low.min(p), high.max(p))
        });
        [low - WINDOW_BELOW, high + WINDOW_ABOVE]
    }

    /// Line integral without devices on a ray that is `obliquity` times as long as the central one and runs
    /// `lumen_mm` inside the wall.
    pub(crate) fn anatomy(&self, obliquity: f64, lumen_mm: f64) -> f64 {
        let tissue = (self.tissue_mm * obliquity - lumen_mm).max(0.0);
        self.mu_tissue * tissue + self.mu_lumen * lumen_mm
    }

    /// What a millimetre of `material` (of the scene's device material where a device names none) adds to the
    /// line integral by displacing the filling of the lumen.
    pub(crate) fn device_excess_per_mm(&self, material: Option<Material>) -> Result<f64> {
        Ok(self.device_material(material).attenuation_per_mm(self.energy_kev)? - self.mu_lumen)
    }

    /// The material of a device that may not name one.
    pub(crate) fn device_material(&self, material: Option<Material>) -> Material {
        material.unwrap_or(self.device_material)
    }

    /// Transmission relative to the white end of the window, exp(white − p).
    pub(crate) fn relative_transmission(&self, p: f32) -> f32 {
        (-(p - self.window[0] as f32).min(DEEPEST)).exp()
    }

    /// Grey value of a mean [`Self::relative_transmission`] in column `x` and row `y`.
    pub(crate) fn grey(&self, mean: f32, x: usize, y: usize) -> u8 {
        let span = (self.window[1] - self.window[0]) as f32;
        let value = (1.0 + mean.ln() / span).clamp(0.0, 1.0);
        (value * 255.0 + dither(x, y)).floor() as u8
    }

    /// Line integrals of a whole set of maps, for tests and for users through
    /// [`crate::Renderer::transmission`].
    pub(crate) fn transmission(&self, paths: &PathLengths) -> Result<Vec<f32>> {
        let mut p: Vec<f64> = (paths.body_mm.iter().zip(&paths.lumen_mm))
            .map(|(&body, &lumen)| {
                let (body, lumen) = (f64::from(body), f64::from(lumen));
                self.mu_tissue * (body - lumen).max(0.0) + self.mu_lumen * lumen
            })
            .collect();
        for (material, map) in &paths.devices_mm {
            let excess = self.device_excess_per_mm(Some(*material))?;
            p.iter_mut().zip(map).for_each(|(p, &length)| *p += excess * f64::from(length));
        }
        Ok(p.into_iter().map(|p| (-p).exp() as f32).collect())
    }
}
