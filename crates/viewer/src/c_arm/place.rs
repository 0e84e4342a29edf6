//! Position of a C-arm, and its pixel pitch.

use endowire_core::error::number;
use endowire_core::vessel::SurfaceMesh;
use endowire_core::{Error, Result, Vec3};

use super::CArm;
use crate::spec::{CArmSpec, PITCH_MM, Shutter};

/// Fraction of the half frame filled by the vessel if the pixel pitch is chosen automatically.
pub(super) const FILL: f64 = 0.92;
/// Side of the corners that are cut off a square for a regular octagon, in halves of its side: 2 − √2.
const OCTAGON: f64 = 2.0 - std::f64::consts::SQRT_2;

/// Fewest pixels between blades: in the middle of an even number of pixels, of fewer none is wholly open.
const LEAST_OPEN_PX: f64 = 2.0;

impl CArm {
    /// Positions a C-arm; what `spec` leaves open is chosen so that `wall` fills the frame.
    ///
    /// # Errors
    /// [`Error::Parameter`] if the vessel is not between source and detector, and for blades that leave no pixel open.
    /// `spec` must be valid.
    pub(crate) fn new(spec: &CArmSpec, size_px: [u32; 2], wall: &SurfaceMesh) -> Result<Self> {
        let (low, high) = wall.bounds_mm().ok_or_else(|| Error::Mesh("the wall has no vertices".into()))?;
        let angles_deg = spec.angles_deg();
        let [alpha, beta] = angles_deg.map(f64::to_radians);
        let toward_left = Vec3::new(libm::cos(alpha), libm::sin(alpha), 0.0);
        let detector = Vec3::new(libm::sin(alpha), -libm::cos(alpha), 0.0) * libm::cos(beta)
            + Vec3::z() * libm::sin(beta);
        let down = -detector.cross(&toward_left);
        let (sin, cos) = libm::sincos(spec.rotation_deg.to_radians());
        let mut arm = Self {
            isocentre_mm: spec.isocentre_mm.map_or((low + high) / 2.0, Vec3::from),
            axes: [toward_left * cos - down * sin, toward_left * sin + down * cos, detector],
            sid_mm: spec.sid_mm,
            sod_mm: spec.sod_mm,
            pixel_mm: 1.0,
            size_px,
            angles_deg,
            rotation_deg: spec.rotation_deg,
            opening_px: None,
            corners_px: 0.0,
        };
        for vertex in &wall.vertices_mm {
            arm.check_between(vertex)?;
        }
        let whole = match (spec.pixel_mm, spec.field_mm) {
            (Some(pitch), _) => pitch,
            (None, Some(field)) => field / f64::from(size_px[0].max(size_px[1])),
            (None, None) => arm.fitting_pitch(wall)?,
        };
        arm.pixel_mm = whole / spec.magnification;
        check_pitch(spec, size_px, arm.pixel_mm)?;
        check_opening(spec, arm.pixel_mm)?;
        arm.opening_px = spec.collimation_mm.map(|sides| sides.map(|side| side / 2.0 / arm.pixel_mm));
        if spec.shutter == Shutter::Octagon {
            let field = size_px.map(|side| f64::from(side) / 2.0);
            let half = arm.opening_px.map_or(field, |open| [0, 1].map(|k| open[k].min(field[k])));
            arm.opening_px = Some(half);
            arm.corners_px = OCTAGON * half[0].min(half[1]);
        }
        Ok(arm)
    }

    /// The pitch at which a sphere about the isocentre that contains the vessel fills the frame: the same from every
    /// side.
    fn fitting_pitch(&self, wall: &SurfaceMesh) -> Result<f64> {
        let squares = wall.vertices_mm.iter().map(|v| (v - self.isocentre_mm).norm_squared());
        let radius_mm = squares.fold(0.0, f64::max).sqrt();
        let refuse = |remedy: &str| Err(Error::parameter("view.c_arm.pixel_mm", "absent", remedy));
        if radius_mm == 0.0 {
            return refuse("the vessel has no extent to fit; give a pitch");
        }
        if radius_mm >= self.sod_mm {
            return refuse(
                "the vessel reaches as far from the isocentre as the source is, so no field holds it from every side; give a pitch",
            );
        }
        // Rays tangent to the sphere diverge from the axis by its radius over √(SOD² − r²).
        let half_mm = self.sid_mm * radius_mm / (self.sod_mm.powi(2) - radius_mm.powi(2)).sqrt();
        let half_px = f64::from(self.size_px[0].min(self.size_px[1])) / 2.0 * FILL;
        Ok(half_mm / half_px)
    }

    /// Rejects a point of the vessel that is not between source and detector.
    fn check_between(&self, point_mm: &Vec3) -> Result<()> {
        let beam = self.in_beam(point_mm);
        if self.is_between(&beam) {
            return Ok(());
        }
        let depth = self.sod_mm + beam.z;
        let remedy = format!(
            "the vessel must lie between source and detector, but its point ({:.1}, {:.1}, {:.1}) mm is {depth:.1} mm from \
             the source along the beam while the detector is at {} mm; mend the isocentre or the distances",
            point_mm.x, point_mm.y, point_mm.z, self.sid_mm
        );
        Err(Error::parameter("view.c_arm.sod_mm", self.sod_mm, remedy))
    }
}

/// Refuses blades between which no pixel is wholly open: the frame would be black.
fn check_opening(spec: &CArmSpec, pixel_mm: f64) -> Result<()> {
    let Some(open_mm) = spec.collimation_mm else { return Ok(()) };
    let narrow = open_mm.iter().map(|side| side / pixel_mm).find(|px| *px < LEAST_OPEN_PX);
    let Some(px) = narrow else { return Ok(()) };
    let remedy = format!(
        "leaves {px:.2} pixels open at the detector, each {pixel_mm:.3} mm wide; leave at least {LEAST_OPEN_PX} open ({:.2} mm), or \
         draw more pixels",
        LEAST_OPEN_PX * pixel_mm
    );
    let [width, height] = open_mm.map(number);
    Err(Error::parameter("view.c_arm.collimation_mm", format!("[{width}, {height}]"), remedy))
}

/// Rejects pixels outside the computable range, naming the responsible key.
fn check_pitch(spec: &CArmSpec, size_px: [u32; 2], pixel_mm: f64) -> Result<()> {
    let [low, high] = PITCH_MM;
    if (low..=high).contains(&pixel_mm) {
        return Ok(());
    }
    let (key, value) = match (spec.pixel_mm, spec.field_mm) {
        (Some(pitch), _) => ("pixel_mm", pitch.to_string()),
        (None, Some(field)) => ("field_mm", field.to_string()),
        (None, None) => ("pixel_mm", "absent".to_owned()),
    };
    let remedy = format!(
        "with {} pixels and magnification {} a pixel is {pixel_mm:e} mm wide at the detector; it must be {low} to {high} mm",
        size_px[0].max(size_px[1]),
        spec.magnification
    );
    Err(Error::parameter(format!("view.c_arm.{key}"), value, remedy))
}
