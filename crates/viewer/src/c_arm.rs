//! Geometry of a C-arm: which ray a pixel sees.
//!
//! **Patient axes** as in DICOM (LPS): +x to the patient's left, +y posterior, +z towards the head. With both
//! angles zero the source is posterior (under the table) and the detector anterior.
//!
//! **Angles** with the signs of DICOM: the primary angle α (0018,1510) is positive towards LAO and turns the
//! detector to the patient's left; the secondary angle β (0018,1511) is positive towards cranial and tilts it
//! to the head. From the isocentre the detector lies in direction
//!
//! ```text
//! d = cos β (sin α, −cos α, 0) + sin β (0, 0, 1)
//! ```
//!
//! **Picture.** Seen from the detector, head up, so the patient's left is on the right of the screen: columns
//! run along e_u = (cos α, sin α, 0), rows along e_v = −d × e_u. The source is at isocentre − SOD·d, the
//! detector plane SID from it and centred on the axis. A point at (a, b, c) along (e_u, e_v, d) from the
//! isocentre is seen at
//!
//! ```text
//! u = W/2 + (SID/pitch) · a/(SOD + c),   v = H/2 + (SID/pitch) · b/(SOD + c)
//! ```
//!
//! A rotation of the picture turns e_u and e_v about d, so that what is shown turns clockwise on the screen. All in pixels; the centre of the pixel in column i is at u = i + ½. A ray is (x, y, 1)·(SOD + c) with
//! x = (u − W/2)·pitch/SID, and √(1 + x² + y²) millimetres long per millimetre of depth: its *obliquity*.

use endowire_core::vessel::SurfaceMesh;
use endowire_core::{Error, Result, Vec3};

use crate::fingerprint::fingerprint;
use crate::spec::{CArmSpec, PITCH_MM};

/// Part of the half frame that the vessel fills where the pixel pitch is left to us.
const FILL: f64 = 0.92;
/// Least depth in front of the source, mm: anything nearer would project to the whole plane.
const NEAREST_MM: f64 = 1.0;

/// A C-arm in place: a pinhole camera with its source as the pinhole.
#[derive(Debug, Clone, PartialEq)]
pub struct CArm {
    isocentre_mm: Vec3,
    /// Columns, rows and depth (source to detector) as unit directions in patient axes.
    axes: [Vec3; 3],
    sid_mm: f64,
    sod_mm: f64,
    pixel_mm: f64,
    size_px: [u32; 2],
    angles_deg: [f64; 2],
    rotation_deg: f64,
    /// Half width and height between the blades, pixels.
    opening_px: Option<[f64; 2]>,
}

impl CArm {
    /// Places a C-arm; what `spec` leaves open is chosen so that `wall` fills the frame.
    ///
    /// # Errors
    /// [`Error::Parameter`] where the vessel does not lie between source and detector. `spec` must be valid.
    pub(crate) fn new(spec: &CArmSpec, size_px: [u32; 2], wall: &SurfaceMesh) -> Result<Self> {
        let (low, high) = wall.bounds_mm().ok_or_else(|| Error::Mesh("the wall has no vertices".into()))?;
        let angles_deg = spec.angles_deg();
        let [alpha, beta] = angles_deg.map(f64::to_radians);
        let toward_left = Vec3::new(alpha.cos(), alpha.sin(), 0.0);
        let detector = Vec3::new(alpha.sin(), -alpha.cos(), 0.0) * beta.cos() + Vec3::z() * beta.sin();
        let down = -detector.cross(&toward_left);
        let (sin, cos) = spec.rotation_deg.to_radians().sin_cos();
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
        arm.opening_px = spec.collimation_mm.map(|sides| sides.map(|side| side / 2.0 / arm.pixel_mm));
        Ok(arm)
    }

    /// The pitch at which a ball about the isocentre that holds the vessel fills the frame: the same from every side.
    fn fitting_pitch(&self, wall: &SurfaceMesh) -> Result<f64> {
        let squares = wall.vertices_mm.iter().map(|v| (v - self.isocentre_mm).norm_squared());
        let radius_mm = squares.fold(0.0, f64::max).sqrt();
        let refuse = |mend: &str| Err(Error::parameter("view.c_arm.pixel_mm", "absent", mend));
        if radius_mm == 0.0 {
            return refuse("the vessel has no extent to fit; give a pitch");
        }
        if radius_mm >= self.sod_mm {
            return refuse(
                "the vessel reaches as far from the isocentre as the source is, so no field holds it from every side; give a pitch",
            );
        }
        // Rays that touch the ball leave the axis by its radius over √(SOD² − r²).
        let half_mm = self.sid_mm * radius_mm / (self.sod_mm.powi(2) - radius_mm.powi(2)).sqrt();
        let half_px = f64::from(self.size_px[0].min(self.size_px[1])) / 2.0 * FILL;
        Ok(half_mm / half_px)
    }

    /// Whether a point given by [`Self::in_beam`] is between source and detector.
    pub(crate) fn is_between(&self, beam: &Vec3) -> bool {
        (NEAREST_MM..=self.sid_mm).contains(&(self.sod_mm + beam.z))
    }

    /// Refuses a point of the vessel that is not between source and detector.
    fn check_between(&self, point_mm: &Vec3) -> Result<()> {
        let beam = self.in_beam(point_mm);
        if self.is_between(&beam) {
            return Ok(());
        }
        let depth = self.sod_mm + beam.z;
        let mend = format!(
            "the vessel must lie between source and detector, but its point ({:.1}, {:.1}, {:.1}) mm is {depth:.1} mm from \
             the source along the beam while the detector is at {} mm; mend the isocentre or the distances",
            point_mm.x, point_mm.y, point_mm.z, self.sid_mm
        );
        Err(Error::parameter("view.c_arm.sod_mm", self.sod_mm, mend))
    }

    /// Coordinates along columns, rows and depth, from the isocentre.
    pub(crate) fn in_beam(&self, point_mm: &Vec3) -> Vec3 {
        let r = point_mm - self.isocentre_mm;
        Vec3::new(r.dot(&self.axes[0]), r.dot(&self.axes[1]), r.dot(&self.axes[2]))
    }

    /// A direction along columns, rows and depth.
    pub(crate) fn direction_in_beam(&self, direction: &Vec3) -> Vec3 {
        Vec3::new(direction.dot(&self.axes[0]), direction.dot(&self.axes[1]), direction.dot(&self.axes[2]))
    }

    /// Pixel coordinates of a point given by [`Self::in_beam`].
    pub(crate) fn pixel_of(&self, beam: &Vec3) -> [f64; 2] {
        let scale = self.focal_px() / (self.sod_mm + beam.z);
        let [w, h] = self.size_px.map(f64::from);
        [w / 2.0 + scale * beam.x, h / 2.0 + scale * beam.y]
    }

    /// Slopes (x, y) of the ray through a pixel coordinate.
    #[inline]
    pub(crate) fn slopes(&self, pixel: [f64; 2]) -> [f64; 2] {
        let [w, h] = self.size_px.map(f64::from);
        [(pixel[0] - w / 2.0) / self.focal_px(), (pixel[1] - h / 2.0) / self.focal_px()]
    }

    /// Obliquity of the central ray of each pixel, row by row.
    pub(crate) fn obliquities(&self) -> impl Iterator<Item = f64> + use<> {
        let [columns, rows] = self.squared_slopes();
        rows.into_iter().flat_map(move |y| {
            let columns = columns.clone();
            columns.into_iter().map(move |x| (1.0 + x + y).sqrt())
        })
    }

    /// Squared slopes of the central rays of each column and of each row.
    pub(crate) fn squared_slopes(&self) -> [Vec<f64>; 2] {
        [0, 1]
            .map(|k| (0..self.size_px[k]).map(|i| self.slopes([f64::from(i) + 0.5; 2])[k].powi(2)).collect())
    }

    /// Obliquity of the central ray of pixel number `index`, counted row by row.
    pub(crate) fn obliquity_at(&self, index: usize) -> f64 {
        let width = self.size_px[0] as usize;
        let [x, y] = self.slopes([(index % width) as f64 + 0.5, (index / width) as f64 + 0.5]);
        (1.0 + x * x + y * y).sqrt()
    }

    /// The same view with `factor` × `factor` pixels for each one.
    pub(crate) fn refined(&self, factor: u32) -> Self {
        let factor_f = f64::from(factor);
        let opening_px = self.opening_px.map(|sides| sides.map(|n| n * factor_f));
        Self {
            pixel_mm: self.pixel_mm / factor_f,
            size_px: self.size_px.map(|n| n * factor),
            opening_px,
            ..self.clone()
        }
    }

    /// Share of pixel number `index` that the blades leave open.
    pub(crate) fn openness(&self, index: usize) -> f64 {
        let Some(opening) = self.opening_px else { return 1.0 };
        let width = self.size_px[0] as usize;
        let at = [(index % width) as f64 + 0.5, (index / width) as f64 + 0.5];
        let share = |k: usize| {
            let from_edge = opening[k] - (at[k] - f64::from(self.size_px[k]) / 2.0).abs();
            (from_edge + 0.5).clamp(0.0, 1.0)
        };
        share(0) * share(1)
    }

    /// Whether a pixel coordinate is on the detector and between the blades.
    pub fn sees(&self, pixel: [f64; 2]) -> bool {
        (0..2).all(|k| {
            let half = f64::from(self.size_px[k]) / 2.0;
            let open = self.opening_px.map_or(half, |opening| opening[k].min(half));
            (pixel[k] - half).abs() <= open
        })
    }

    /// SID in pixels.
    pub(crate) fn focal_px(&self) -> f64 {
        self.sid_mm / self.pixel_mm
    }

    /// Where a point is seen: columns to the right, rows downwards, pixel centres at halves.
    ///
    /// Exactly the projection that draws the frames. A point beside or behind the source gives no finite
    /// pixel.
    pub fn project(&self, point_mm: &Vec3) -> [f64; 2] {
        self.pixel_of(&self.in_beam(point_mm))
    }

    /// Origin and unit direction of the ray through a pixel coordinate, the inverse of [`Self::project`].
    pub fn ray(&self, pixel: [f64; 2]) -> (Vec3, Vec3) {
        let [x, y] = self.slopes(pixel);
        let direction = self.axes[0] * x + self.axes[1] * y + self.axes[2];
        (self.source_mm(), direction.normalize())
    }

    /// Position of the source.
    pub fn source_mm(&self) -> Vec3 {
        self.isocentre_mm - self.axes[2] * self.sod_mm
    }

    /// Corners of what the detector sees at a depth from the source, around.
    pub(crate) fn field_corners_mm(&self, depth_mm: f64) -> [Vec3; 4] {
        let [w, h] = self.size_px.map(f64::from);
        [[0.0, 0.0], [w, 0.0], [w, h], [0.0, h]].map(|pixel| {
            let [x, y] = self.slopes(pixel);
            self.source_mm() + (self.axes[0] * x + self.axes[1] * y + self.axes[2]) * depth_mm
        })
    }

    /// Directions in patient axes that run to the right and upwards in the picture.
    pub(crate) fn right_and_up(&self) -> [Vec3; 2] {
        [self.axes[0], -self.axes[1]]
    }

    /// A number of the geometry, blades apart: what they leave open stays as it is when they move.
    pub(crate) fn fingerprint(&self) -> u128 {
        let axes = self.axes.iter().flatten();
        let places = axes.chain(&self.isocentre_mm).copied().chain([self.sid_mm, self.sod_mm, self.pixel_mm]);
        // 0 and -0 are one place.
        let bytes = places.flat_map(|x| (x + 0.0).to_bits().to_le_bytes());
        fingerprint(bytes.chain(self.size_px.into_iter().flat_map(u32::to_le_bytes)))
    }

    /// The 3 × 4 matrix, row by row, that takes (x, y, z, 1) in mm to (u w, v w, w): pixel coordinates times the depth from the source in
    /// mm.
    pub fn matrix(&self) -> [[f64; 4]; 3] {
        let [w, h] = self.size_px.map(f64::from);
        let [across, down, depth] = self.axes;
        let rows =
            [across * self.focal_px() + depth * (w / 2.0), down * self.focal_px() + depth * (h / 2.0), depth];
        rows.map(|row| [row.x, row.y, row.z, -row.dot(&self.source_mm())])
    }

    /// Where columns and rows run in the words of DICOM (L, R, A, P, H, F), the strongest first.
    pub(crate) fn directions(&self) -> [String; 2] {
        // Parts of less than the sine of about a degree are not told.
        const LEAST: f64 = 0.02;
        [0, 1].map(|k| {
            let axis = &self.axes[k];
            let names = [['L', 'R'], ['P', 'A'], ['H', 'F']].into_iter().zip(axis.iter());
            let mut parts: Vec<(f64, char)> = names
                .map(|([plus, minus], x)| (x.abs(), if *x > 0.0 { plus } else { minus }))
                .filter(|part| part.0 > LEAST)
                .collect();
            parts.sort_by(|a, b| b.0.total_cmp(&a.0));
            parts.into_iter().map(|part| part.1).collect()
        })
    }

    /// Depth of a point from the source along the central ray, mm.
    pub fn depth_mm(&self, point_mm: &Vec3) -> f64 {
        self.sod_mm + self.in_beam(point_mm).z
    }

    /// The point that all rotations leave in place.
    pub fn isocentre_mm(&self) -> Vec3 {
        self.isocentre_mm
    }

    /// Positioner angles, LAO and cranial positive.
    pub fn angles_deg(&self) -> [f64; 2] {
        self.angles_deg
    }

    /// Clockwise turn of the picture.
    pub fn rotation_deg(&self) -> f64 {
        self.rotation_deg
    }

    /// Width and height between the blades in pixels, if there are any.
    pub fn opening_px(&self) -> Option<[f64; 2]> {
        self.opening_px.map(|half| half.map(|n| 2.0 * n))
    }

    /// Source to detector.
    pub fn sid_mm(&self) -> f64 {
        self.sid_mm
    }

    /// Source to isocentre.
    pub fn sod_mm(&self) -> f64 {
        self.sod_mm
    }

    /// Pixel pitch at the detector.
    pub fn pixel_mm(&self) -> f64 {
        self.pixel_mm
    }

    /// Columns and rows.
    pub fn size_px(&self) -> [u32; 2] {
        self.size_px
    }
}

/// Refuses pixels beyond the range in which pictures can be computed, by the key that makes them so.
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
    let mend = format!(
        "with {} pixels and magnification {} a pixel is {pixel_mm:e} mm wide at the detector; it must be {low} to {high} mm",
        size_px[0].max(size_px[1]),
        spec.magnification
    );
    Err(Error::parameter(format!("view.c_arm.{key}"), value, mend))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arm(primary_deg: f64, secondary_deg: f64) -> CArm {
        let wall = SurfaceMesh {
            vertices_mm: vec![Vec3::new(-50.0, -40.0, -30.0), Vec3::new(50.0, 40.0, 30.0)],
            triangles: vec![],
        };
        let spec = CArmSpec { primary_deg, secondary_deg, pixel_mm: Some(0.25), ..CArmSpec::default() };
        CArm::new(&spec, [600, 400], &wall).unwrap()
    }

    #[test]
    fn at_zero_the_source_is_posterior_and_the_patients_left_is_right_on_screen() {
        let arm = arm(0.0, 0.0);
        assert!((arm.source_mm() - Vec3::new(0.0, 750.0, 0.0)).norm() < 1e-12);
        assert_eq!(arm.project(&Vec3::zeros()), [300.0, 200.0]);
        let [u, v] = arm.project(&Vec3::new(10.0, 0.0, 0.0));
        assert!((u - 300.0 - 10.0 * 1100.0 / 750.0 / 0.25).abs() < 1e-9 && (v - 200.0).abs() < 1e-9);
        let [u, v] = arm.project(&Vec3::new(0.0, 0.0, 10.0));
        assert!((u - 300.0).abs() < 1e-9 && v < 200.0 - 10.0, "the head is up: {v}");
    }

    #[test]
    fn lao_moves_the_detector_to_the_left_and_cranial_to_the_head() {
        assert!((arm(90.0, 0.0).source_mm() - Vec3::new(-750.0, 0.0, 0.0)).norm() < 1e-9);
        let source = arm(0.0, 30.0).source_mm();
        assert!(source.z < -370.0 && source.y > 0.0, "detector to the head, source to the feet: {source}");
        // In LAO, what is anterior moves towards the patient's right, left on screen.
        let [u, _] = arm(30.0, 0.0).project(&Vec3::new(0.0, -20.0, 0.0));
        assert!(u < 300.0, "{u}");
        // Cranial view: what is anterior moves down.
        let [_, v] = arm(0.0, 30.0).project(&Vec3::new(0.0, -20.0, 0.0));
        assert!(v > 200.0, "{v}");
    }

    #[test]
    fn a_rotation_turns_the_picture_clockwise_and_magnification_enlarges_it() {
        let wall = SurfaceMesh {
            vertices_mm: vec![Vec3::new(-50.0, -40.0, -30.0), Vec3::new(50.0, 40.0, 30.0)],
            triangles: vec![],
        };
        let spec = CArmSpec {
            rotation_deg: 90.0,
            magnification: 2.0,
            field_mm: Some(150.0),
            collimation_mm: Some([30.0, 15.0]),
            ..CArmSpec::default()
        };
        let arm = CArm::new(&spec, [600, 400], &wall).unwrap();
        assert!((arm.pixel_mm() - 0.125).abs() < 1e-12);
        // The head, up before, is to the right.
        let [u, v] = arm.project(&Vec3::new(0.0, 0.0, 5.0));
        assert!(u > 350.0 && (v - 200.0).abs() < 1e-9, "{u} {v}");
        let point = Vec3::new(3.0, -4.0, 5.0);
        let (origin, direction) = arm.ray(arm.project(&point));
        assert!((point - origin).cross(&direction).norm() < 1e-10);
        assert_eq!(arm.opening_px().unwrap(), [240.0, 120.0]);
        assert!(arm.sees([300.0, 200.0]) && arm.sees([181.0, 141.0]) && !arm.sees([179.0, 200.0]));
        let at = |x: usize, y: usize| arm.openness(y * 600 + x);
        assert_eq!([at(300, 200), at(180, 200), at(179, 200), at(178, 200)], [1.0, 1.0, 0.0, 0.0]);
    }

    #[test]
    fn nearer_to_the_source_is_larger() {
        let arm = arm(0.0, 0.0);
        let at = |y| arm.project(&Vec3::new(10.0, y, 0.0))[0] - 300.0;
        assert!(at(30.0) > at(-30.0));
    }

    #[test]
    fn axes_are_orthonormal_and_rays_invert_projection() {
        let arm = arm(-37.0, 22.0);
        for i in 0..3 {
            for j in 0..3 {
                let expected = if i == j { 1.0 } else { 0.0 };
                assert!((arm.axes[i].dot(&arm.axes[j]) - expected).abs() < 1e-14);
            }
        }
        // Seen from the detector the picture is not mirrored: columns × (upwards) points to the viewer.
        assert!((arm.axes[0].cross(&-arm.axes[1]) - arm.axes[2]).norm() < 1e-14);
        let point = Vec3::new(12.0, -34.0, 25.0);
        let (origin, direction) = arm.ray(arm.project(&point));
        let off = (point - origin) - direction * (point - origin).dot(&direction);
        assert!(off.norm() < 1e-10, "{off}");
    }

    #[test]
    fn left_alone_the_field_holds_the_vessel_and_is_the_same_from_every_side() {
        let wall = SurfaceMesh {
            vertices_mm: vec![Vec3::new(-50.0, -40.0, -30.0), Vec3::new(50.0, 40.0, 30.0)],
            triangles: vec![],
        };
        let mut widest = 0.0_f64;
        let mut pitches = Vec::new();
        for primary_deg in (-180..180).step_by(5) {
            for secondary_deg in (-90..=90).step_by(5) {
                let [primary_deg, secondary_deg] = [primary_deg, secondary_deg].map(f64::from);
                let spec = CArmSpec { primary_deg, secondary_deg, ..CArmSpec::default() };
                let arm = CArm::new(&spec, [800, 600], &wall).unwrap();
                pitches.push(arm.pixel_mm());
                for [u, v] in wall.vertices_mm.iter().map(|vertex| arm.project(vertex)) {
                    widest = widest.max((u - 400.0).hypot(v - 300.0));
                }
            }
        }
        assert!(pitches.iter().all(|pitch| *pitch == pitches[0]));
        assert!(widest <= 300.0 * FILL && widest > 0.99 * 300.0 * FILL, "{widest}");
    }

    #[test]
    fn a_vessel_beyond_the_source_or_the_detector_is_refused() {
        let far =
            SurfaceMesh { vertices_mm: vec![Vec3::zeros(), Vec3::new(0.0, 2000.0, 0.0)], triangles: vec![] };
        let spec = CArmSpec { isocentre_mm: Some([0.0; 3]), ..CArmSpec::default() };
        let error = CArm::new(&spec, [64, 64], &far).unwrap_err().to_string();
        assert!(error.contains("between source and detector"), "{error}");
    }
}
