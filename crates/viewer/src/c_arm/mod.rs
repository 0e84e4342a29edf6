//! Geometry of a C-arm: the ray of each pixel.
//!
//! **Patient axes** as in DICOM (LPS): +x to the patient's left, +y posterior, +z towards the head. With both
//! angles zero the source is posterior (under the table) and the detector anterior.
//!
//! **Angles** with the signs of DICOM: the primary angle α (0018,1510) is positive towards LAO and turns the detector
//! to the patient's left; the secondary angle β (0018,1511) is positive towards cranial and tilts it to the head.
//! From the isocentre the detector is in the direction
//!
//! ```text
//! d = cos β (sin α, −cos α, 0) + sin β (0, 0, 1)
//! ```
//!
//! **Image.** Seen from the detector, head up, so the patient's left is on the right of the screen: columns are along
//! e_u = (cos α, sin α, 0), rows along e_v = −d × e_u. The source is at isocentre − SOD·d, the detector plane at a
//! distance SID from it and centred on the axis. A point at (a, b, c) along (e_u, e_v, d) from the isocentre is
//! projected to
//!
//! ```text
//! u = W/2 + (SID/pitch) · a/(SOD + c),   v = H/2 + (SID/pitch) · b/(SOD + c)
//! ```
//!
//! A rotation of the image rotates e_u and e_v about d, so that its content turns clockwise on the screen. All in
//! pixels; the centre of the pixel in column i is at u = i + ½. A ray is (x, y, 1)·(SOD + c) with x = (u −
//! W/2)·pitch/SID, and √(1 + x² + y²) millimetres long per millimetre of depth: its *obliquity*.

mod place;
#[cfg(test)]
mod tests;

use endowire_core::Vec3;

use crate::fingerprint::fingerprint;

/// Smallest depth in front of the source, mm: nearer points would project to the whole plane.
const NEAREST_MM: f64 = 1.0;

/// A positioned C-arm: a pinhole camera with its source as the pinhole.
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
    /// Half width and height between the collimator blades, pixels.
    opening_px: Option<[f64; 2]>,
    /// Side of the corners of the opening that are cut off, pixels.
    corners_px: f64,
}

impl CArm {
    /// Whether a point from [`Self::in_beam`] is between source and detector.
    pub(crate) fn is_between(&self, beam: &Vec3) -> bool {
        (NEAREST_MM..=self.sid_mm).contains(&(self.sod_mm + beam.z))
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

    /// Pixel coordinates of a point from [`Self::in_beam`].
    pub(crate) fn pixel_of(&self, beam: &Vec3) -> [f64; 2] {
        let scale = self.focal_px() / (self.sod_mm + beam.z);
        let [w, h] = [f64::from(self.size_px[0]), f64::from(self.size_px[1])];
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

    /// Obliquity of the central ray of the pixel with this index, counted row by row.
    pub(crate) fn obliquity_at(&self, index: usize) -> f64 {
        let width = self.size_px[0] as usize;
        let [x, y] = self.slopes([(index % width) as f64 + 0.5, (index / width) as f64 + 0.5]);
        (1.0 + x * x + y * y).sqrt()
    }

    /// The same view with `factor` × `factor` pixels for each pixel.
    pub(crate) fn refined(&self, factor: u32) -> Self {
        let factor_f = f64::from(factor);
        let opening_px = self.opening_px.map(|sides| sides.map(|n| n * factor_f));
        Self {
            pixel_mm: self.pixel_mm / factor_f,
            size_px: self.size_px.map(|n| n * factor),
            opening_px,
            corners_px: self.corners_px * factor_f,
            ..self.clone()
        }
    }

    /// Fraction of the pixel with this index left open by the blades.
    pub(crate) fn openness(&self, index: usize) -> f64 {
        let Some(opening) = self.opening_px else { return 1.0 };
        let width = self.size_px[0] as usize;
        let at = [(index % width) as f64 + 0.5, (index / width) as f64 + 0.5];
        let share = |k: usize| {
            let from_edge = opening[k] - (at[k] - f64::from(self.size_px[k]) / 2.0).abs();
            (from_edge + 0.5).clamp(0.0, 1.0)
        };
        // Wholly open or closed: what is open in part is not displayed like its surroundings.
        let corners = if self.corners_px > 0.0 && self.corner_px(at) < 0.0 { 0.0 } else { 1.0 };
        share(0) * share(1) * corners
    }

    /// Distance of a pixel coordinate to the blade across its corner, negative behind it.
    fn corner_px(&self, at: [f64; 2]) -> f64 {
        let half = self.opening_px.unwrap_or(self.size_px.map(|side| f64::from(side) / 2.0));
        let off = (0..2).map(|k| (at[k] - f64::from(self.size_px[k]) / 2.0).abs());
        (half[0] + half[1] - self.corners_px - off.sum::<f64>()) * std::f64::consts::FRAC_1_SQRT_2
    }

    /// Whether a pixel coordinate is on the detector and between the blades.
    pub fn sees(&self, pixel: [f64; 2]) -> bool {
        (0..2).all(|k| {
            let half = f64::from(self.size_px[k]) / 2.0;
            let open = self.opening_px.map_or(half, |opening| opening[k].min(half));
            (pixel[k] - half).abs() <= open
        }) && (self.corners_px == 0.0 || self.corner_px(pixel) >= 0.0)
    }

    /// SID in pixels.
    pub(crate) fn focal_px(&self) -> f64 {
        self.sid_mm / self.pixel_mm
    }

    /// Projection of a point: columns to the right, rows downwards, pixel centres at halves.
    ///
    /// Exactly the projection of the frames. A point beside or behind the source has no finite pixel.
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

    /// Corners of the field of view at a depth from the source, in order around it.
    pub(crate) fn field_corners_mm(&self, depth_mm: f64) -> [Vec3; 4] {
        let [w, h] = self.size_px.map(f64::from);
        [[0.0, 0.0], [w, 0.0], [w, h], [0.0, h]].map(|pixel| {
            let [x, y] = self.slopes(pixel);
            self.source_mm() + (self.axes[0] * x + self.axes[1] * y + self.axes[2]) * depth_mm
        })
    }

    /// Directions in patient axes to the right and upwards in the image.
    pub(crate) fn right_and_up(&self) -> [Vec3; 2] {
        [self.axes[0], -self.axes[1]]
    }

    /// A hash of the geometry without the blades: the image between them does not depend on them.
    pub(crate) fn fingerprint(&self) -> u128 {
        let axes = self.axes.iter().flatten();
        let places = axes.chain(&self.isocentre_mm).copied().chain([self.sid_mm, self.sod_mm, self.pixel_mm]);
        // 0 and -0 are equal.
        let bytes = places.flat_map(|x| (x + 0.0).to_bits().to_le_bytes());
        fingerprint(bytes.chain(self.size_px.into_iter().flat_map(u32::to_le_bytes)))
    }

    /// The 3 × 4 matrix, row by row, from (x, y, z, 1) in mm to (u w, v w, w): pixel coordinates times the depth from
    /// the source in mm.
    pub fn matrix(&self) -> [[f64; 4]; 3] {
        let [w, h] = self.size_px.map(f64::from);
        let [across, down, depth] = self.axes;
        let rows =
            [across * self.focal_px() + depth * (w / 2.0), down * self.focal_px() + depth * (h / 2.0), depth];
        rows.map(|row| [row.x, row.y, row.z, -row.dot(&self.source_mm())])
    }

    /// Directions of columns and rows in DICOM's letters (L, R, A, P, H, F), the dominant first.
    pub(crate) fn directions(&self) -> [String; 2] {
        // Components smaller than the sine of about a degree are omitted.
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

    /// Direction of the central ray.
    pub(crate) fn beam(&self) -> Vec3 {
        self.axes[2]
    }

    /// The point that is fixed under all rotations.
    pub fn isocentre_mm(&self) -> Vec3 {
        self.isocentre_mm
    }

    /// Positioner angles, LAO and cranial positive.
    pub fn angles_deg(&self) -> [f64; 2] {
        self.angles_deg
    }

    /// Clockwise rotation of the image.
    pub fn rotation_deg(&self) -> f64 {
        self.rotation_deg
    }

    /// Width and height between the blades in pixels, if there are any.
    pub fn opening_px(&self) -> Option<[f64; 2]> {
        self.opening_px.map(|half| half.map(|n| 2.0 * n))
    }

    /// Side of the corners of the opening that are cut off, pixels; 0 for a rectangle.
    pub fn corners_px(&self) -> f64 {
        self.corners_px
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
