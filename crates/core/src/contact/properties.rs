//! Stiffness and friction of a vessel's wall, uniform or by region.

use serde::{Deserialize, Serialize};

use crate::error::{in_range, number, vector};
use crate::vessel::{Lumen, WallStore};
use crate::{Error, Result, Vec3};

/// Largest foundation modulus, N/mm².
const LARGEST_MODULUS: f64 = 1e9;
/// Largest coefficient of friction, far above any in a vessel.
const LARGEST_FRICTION: f64 = 2.0;
/// Largest radius of a region, mm: it contains any vessel.
const LARGEST_RADIUS_MM: f64 = 1e6;
/// Default width over which the wall changes at the edge of a region, mm. Contact points are about a diameter apart,
/// and a much narrower transition would fall between two of them.
const TRANSITION_MM: f64 = 2.0;

/// Default for the largest distance of the contact surface from the given one, mm: less than a scanner resolves.
const DEVIATION_MM: f64 = 0.1;
/// Largest such distance, mm.
const LARGEST_DEVIATION_MM: f64 = 10.0;

/// The wall of a vessel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WallProperties {
    /// Foundation modulus k, N/mm²: force per length and depth.
    pub modulus_n_per_mm2: f64,
    /// Coulomb coefficient μ of friction between device and wall; 0 is frictionless and costs nothing.
    pub friction: f64,
    /// How far smoothing may move the surface, mm; at most a twentieth of the lumen's local radius. The resulting
    /// distance of the contact surface is measured by [`ContactSurface::deviation`](super::ContactMesh::deviation). 0 uses the
    /// given mesh, for surfaces whose meshes are known to be good.
    pub deviation_mm: f64,
    /// Regions with other properties; later ones override earlier ones.
    pub region: Vec<WallRegion>,
}

impl Default for WallProperties {
    /// Order of magnitude of an artery's modulus, frictionless.
    fn default() -> Self {
        Self { modulus_n_per_mm2: 1.0, friction: 0.0, deviation_mm: DEVIATION_MM, region: Vec::new() }
    }
}

/// The wall inside a sphere: plaque, a stent, an aneurysm. Absent properties stay unchanged.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WallRegion {
    /// Centre of the sphere, mm.
    pub centre_mm: [f64; 3],
    /// Radius of the sphere, mm.
    pub radius_mm: f64,
    /// Width over which the wall changes, mm, half of it on each side of the sphere; if absent, 2 or the radius,
    /// whichever is less. The transition extends over at least one edge of the mesh.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub transition_mm: Option<f64>,
    /// Foundation modulus, N/mm².
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub modulus_n_per_mm2: Option<f64>,
    /// Coefficient of friction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction: Option<f64>,
}

impl WallRegion {
    fn centre(&self) -> Vec3 {
        Vec3::from(self.centre_mm)
    }

    fn width_mm(&self) -> f64 {
        self.transition_mm.unwrap_or(TRANSITION_MM.min(self.radius_mm))
    }

    /// Distance from its centre beyond which it changes nothing, mm.
    fn reach_mm(&self) -> f64 {
        self.radius_mm + 0.5 * self.width_mm()
    }

    /// 1 inside the region, 0 outside, smooth between.
    fn share(&self, x: &Vec3) -> f64 {
        let inside = self.reach_mm() - (x - self.centre()).norm();
        let t = if inside >= self.width_mm() { 1.0 } else { (inside / self.width_mm()).max(0.0) };
        t * t * (3.0 - 2.0 * t)
    }
}

impl WallProperties {
    /// Whether there is friction anywhere.
    pub(crate) fn has_friction(&self) -> bool {
        self.largest_friction() > 0.0
    }

    /// Largest coefficient of friction of all regions.
    pub fn largest_friction(&self) -> f64 {
        self.region.iter().filter_map(|r| r.friction).fold(self.friction, f64::max)
    }

    /// ln(k/k₀), with k₀ the modulus outside all regions, and the coefficient of friction at a position on the wall.
    ///
    /// The logarithm is blended because moduli differ by powers of ten: between walls of 10⁻³ and 10⁴ N/mm² each
    /// decade takes the same part of the transition. Blended linearly, the modulus would rise a thousandfold within
    /// the first ten-thousandth of it, and the range in which a Newton step is reliable, k/|∇k|, would be smallest
    /// where the wall is softest.
    pub(crate) fn at(&self, x: &Vec3) -> (f64, f64) {
        let (mut ln_modulus, mut friction) = (0.0, self.friction);
        for region in &self.region {
            let share = region.share(x);
            if share == 0.0 {
                continue;
            }
            if let Some(modulus) = region.modulus_n_per_mm2 {
                let own = libm::log(modulus / self.modulus_n_per_mm2);
                ln_modulus = if share == 1.0 { own } else { ln_modulus + (own - ln_modulus) * share };
            }
            if let Some(own) = region.friction {
                friction = if share == 1.0 { own } else { friction + (own - friction) * share };
            }
        }
        (ln_modulus, friction)
    }

    /// Rejects regions, for a method that supports only a uniform wall.
    ///
    /// # Errors
    /// Any region.
    pub fn refuse_regions(&self, method: &str) -> Result<()> {
        if self.region.is_empty() {
            return Ok(());
        }
        Err(Error::parameter(
            "vessel.wall.region",
            format!("{} given", self.region.len()),
            format!(
                "{method} knows one wall for the whole vessel: leave regions out or use the method kirchhoff"
            ),
        ))
    }

    /// Checks the values outside regions.
    ///
    /// # Errors
    /// Values out of range.
    pub(crate) fn check_outside_regions(&self) -> Result<()> {
        in_range("vessel.wall.modulus_n_per_mm2", self.modulus_n_per_mm2, LARGEST_MODULUS)?;
        check_friction("vessel.wall.friction", self.friction)?;
        if (0.0..=LARGEST_DEVIATION_MM).contains(&self.deviation_mm) {
            return Ok(());
        }
        let remedy = format!("must be from 0 (surface as it is meshed) to {LARGEST_DEVIATION_MM}");
        Err(Error::parameter("vessel.wall.deviation_mm", self.deviation_mm, remedy))
    }

    /// Checks all values, and that every region contains part of the wall of `lumen`, whose mesh comes from `store`
    /// if there are any.
    ///
    /// # Errors
    /// Values out of range; a region that changes nothing or contains no vertex.
    pub(crate) fn check(&self, lumen: &Lumen, store: &dyn WallStore) -> Result<()> {
        self.check_outside_regions()?;
        for (index, region) in self.region.iter().enumerate() {
            let name = format!("vessel.wall.region[{index}]");
            let key = |key: &str| format!("{name}.{key}");
            if region.centre_mm.iter().any(|c| !c.is_finite()) {
                return Err(Error::parameter(
                    key("centre_mm"),
                    vector(&region.centre()),
                    "must be finite numbers",
                ));
            }
            in_range(&key("radius_mm"), region.radius_mm, LARGEST_RADIUS_MM)?;
            if let Some(transition_mm) = region.transition_mm
                && !(0.0..=2.0 * region.radius_mm).contains(&transition_mm)
            {
                let radius = number(region.radius_mm);
                let remedy = format!("must be from 0 to twice the region's radius of {radius} mm");
                return Err(Error::parameter(key("transition_mm"), transition_mm, remedy));
            }
            if let Some(modulus) = region.modulus_n_per_mm2 {
                in_range(&key("modulus_n_per_mm2"), modulus, LARGEST_MODULUS)?;
            }
            if let Some(friction) = region.friction {
                check_friction(&key("friction"), friction)?;
            }
            if region.modulus_n_per_mm2.is_none() && region.friction.is_none() {
                return Err(Error::parameter(name, "{}", "give modulus_n_per_mm2, friction or both"));
            }
            let away = |v: &Vec3| (v - region.centre()).norm();
            let nearest = lumen.wall(store)?.mesh().vertices_mm.iter().map(away).fold(f64::MAX, f64::min);
            if nearest > region.radius_mm {
                return Err(Error::parameter(
                    key("radius_mm"),
                    region.radius_mm,
                    format!(
                        "reaches no vertex of the wall: the nearest is {nearest:.3} mm from centre_mm = {}; move the centre \
                         or enlarge the radius",
                        vector(&region.centre())
                    ),
                ));
            }
        }
        Ok(())
    }
}

/// Largest force of a valve on an instrument, N.
const LARGEST_VALVE_N: f64 = 100.0;

/// Checks the force of a valve.
pub(crate) fn check_valve(name: &str, force_n: f64) -> Result<()> {
    if (0.0..=LARGEST_VALVE_N).contains(&force_n) {
        return Ok(());
    }
    let remedy = format!("must be a force from 0 (none) to {LARGEST_VALVE_N} N");
    Err(Error::parameter(name, force_n, remedy))
}

/// Checks a Coulomb coefficient.
pub(crate) fn check_friction(name: &str, friction: f64) -> Result<()> {
    if (0.0..=LARGEST_FRICTION).contains(&friction) {
        return Ok(());
    }
    Err(Error::parameter(
        name,
        friction,
        format!("must be a Coulomb coefficient from 0 (none) to {LARGEST_FRICTION}"),
    ))
}
