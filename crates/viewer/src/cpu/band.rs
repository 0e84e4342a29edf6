//! Where a piece of a device is in the image: the rectangle along its projected axis that it is seen within.
//!
//! With the focal length f, a point at depth z along the ray of slopes s is displaced by a small offset o from it by
//! f/z (o_xy − s o_z) in the image, so along a direction e there by f/z (o · g) with g = (e, −e · s). On a mitred end of
//! radius r, o has a part across the axis of at most r and one along it of at most r tan θ, with the angle θ of the
//! mitre: the largest displacement is f/z · r (|g − (g · a) a| + tan θ |g · a|), with the axis a.

use crate::c_arm::CArm;
use crate::device::Piece;

/// Ratio of a piece's radius to its depth up to which displacements are linear within the margin.
const SMALL: f64 = 0.02;
/// Margin of displacements.
const MARGIN: f64 = 1.05;

/// Distance from the projected axis of a piece beyond which it is not visible, pixels; infinite for a piece that reaches
/// behind the source.
pub(super) fn outer_px(view: &CArm, piece: &Piece) -> f64 {
    let reach = piece.reach();
    let near = nearest_mm(view, piece);
    // A sphere beside the axis of the beam is projected to an ellipse.
    if near > 0.0 { MARGIN * reach * view.focal_px() / near } else { f64::INFINITY }
}

fn nearest_mm(view: &CArm, piece: &Piece) -> f64 {
    view.sod_mm() + piece.start.z.min(piece.end.z) - piece.reach()
}

/// Where a piece is in the image, in lines of cells: rows where it is vertical, otherwise columns.
pub(super) struct Band {
    /// Projected centres of its ends.
    pub(super) ends: [[f64; 2]; 2],
    /// Distance from them beyond which it is not visible; infinite for a piece that reaches behind the source.
    pub(super) outer: f64,
    /// The coordinate along lines, and the one across them.
    pub(super) u: usize,
    pub(super) v: usize,
    /// Unit direction of its projected axis, and its length.
    axis: [f64; 2],
    length: f64,
    /// How far it reaches beyond its ends along this direction, and to both sides of it.
    beyond: [f64; 2],
    beside: f64,
}

impl Band {
    pub(super) fn new(view: &CArm, piece: &Piece) -> Self {
        let ends = [&piece.start, &piece.end].map(|at| view.pixel_of(at));
        let outer = outer_px(view, piece);
        let run = [0, 1].map(|k| ends[1][k] - ends[0][k]);
        let (u, v) = if run[1].abs() >= run[0].abs() { (0, 1) } else { (1, 0) };
        let length = libm::hypot(run[0], run[1]);
        let axis = match length > 0.0 {
            true => run.map(|k| k / length),
            // Seen exactly end on it is a disc.
            false => [0.0, 1.0],
        };
        let mut band = Self { ends, outer, u, v, axis, length, beyond: [outer; 2], beside: outer };
        if piece.reach() < SMALL * nearest_mm(view, piece) {
            let across = [-axis[1], axis[0]];
            let reaches = [0, 1].map(|k| {
                let at = if k == 0 { &piece.start } else { &piece.end };
                let slopes = view.slopes(ends[k]);
                let scale = MARGIN * view.focal_px() / (view.sod_mm() + at.z);
                [axis, across].map(|e| scale * displacement_mm(piece, e, slopes))
            });
            band.beyond = reaches.map(|reach| reach[0]);
            band.beside = reaches[0][1].max(reaches[1][1]);
        }
        band
    }

    /// The first and the last position across lines at which it may be visible.
    pub(super) fn lines(&self) -> [f64; 2] {
        let v = self.v;
        // Also where it is infinite.
        let side = self.beside * self.axis[self.u].abs().max(f64::MIN_POSITIVE);
        let corners = [
            self.ends[0][v] - self.axis[v] * self.beyond[0],
            self.ends[1][v] + self.axis[v] * self.beyond[1],
        ];
        [corners[0].min(corners[1]) - side, corners[0].max(corners[1]) + side]
    }

    /// The same along the line at a position across them; the first is the larger one where it is not.
    pub(super) fn along(&self, across: f64) -> [f64; 2] {
        let Self { u, v, axis, .. } = *self;
        let from = across - self.ends[0][v];
        let middle = self.ends[0][u];
        // Beside the axis: lines meet it at 45° or more.
        let side = self.beside / axis[v].abs();
        let on = from * axis[u] / axis[v];
        let mut range = [middle + on - side, middle + on + side];
        if axis[u] != 0.0 {
            let at = |along: f64| middle + (along - from * axis[v]) / axis[u];
            let [a, b] = [at(-self.beyond[0]), at(self.length + self.beyond[1])];
            range = [range[0].max(a.min(b)), range[1].min(a.max(b))];
        }
        // Cells that it covers in part.
        [range[0] - 1.0, range[1] + 1.0]
    }

    /// A position from those along and across lines.
    pub(super) fn place(&self, along: f64, across: f64) -> [f64; 2] {
        if self.u == 0 { [along, across] } else { [across, along] }
    }
}

/// Largest displacement of a point of a piece's end from its centre, mm at its depth, along a direction in the image.
fn displacement_mm(piece: &Piece, [x, y]: [f64; 2], slopes: [f64; 2]) -> f64 {
    let g = endowire_core::Vec3::new(x, y, -(x * slopes[0] + y * slopes[1]));
    let along = g.dot(&piece.axis).abs();
    let across = (g.norm_squared() - along * along).max(0.0).sqrt();
    piece.largest_radius() * across + piece.beyond_mm() * along
}

#[cfg(test)]
mod tests {
    use endowire_core::Vec3;
    use endowire_core::vessel::SurfaceMesh;

    use super::*;
    use crate::cpu::piece::chord;
    use crate::device::{DevicePoint, pieces};
    use crate::spec::CArmSpec;

    /// Rays of cells that meet a piece, those among them that a band lacks, and those that it has.
    fn met(view: &CArm, piece: &Piece, band: &Band) -> [usize; 3] {
        let [width, height] = view.size_px();
        let [low, high] = band.lines();
        let mut counts = [0; 3];
        for y in 0..height {
            for x in 0..width {
                let at = [f64::from(x) + 0.5, f64::from(y) + 0.5];
                let [sx, sy] = view.slopes(at);
                let origin = Vec3::new(sx, sy, 0.0) * view.sod_mm();
                let is_met = chord(piece, &origin, &Vec3::new(sx, sy, 1.0)) > 0.0;
                let across = at[band.v];
                let [first, last] = band.along(across);
                let is_in = (low..=high).contains(&across) && (first..=last).contains(&at[band.u]);
                counts[0] += usize::from(is_met);
                counts[1] += usize::from(is_met && !is_in);
                counts[2] += usize::from(is_in);
            }
        }
        counts
    }

    #[test]
    fn a_band_holds_every_ray_that_meets_its_piece_and_not_many_more() {
        let wall = SurfaceMesh { vertices_mm: vec![Vec3::zeros(), Vec3::repeat(40.0)], triangles: vec![] };
        let spec = CArmSpec { field_mm: Some(35.0), ..CArmSpec::default() };
        let view = CArm::new(&spec, [100, 100], &wall).unwrap();
        let mut all = [0; 3];
        for k in 0..60 {
            let turn = 0.7 * f64::from(k);
            // A bend in all directions, in all parts of the field, also end on.
            let point = |s: f64| {
                let (a, b) = (turn + s, 0.31 * f64::from(k) + 0.4 * s);
                let at = Vec3::new(6.0 * a.cos() * b.sin(), 6.0 * a.sin() * b.sin(), 6.0 * b.cos());
                let off = Vec3::new(f64::from(k % 5) - 2.0, f64::from(k % 7) - 3.0, 0.0);
                let radius_mm = 0.9 + 0.3 * s;
                DevicePoint { position_mm: at + off, tangent: Vec3::x(), radius_mm }
            };
            let pieces = pieces(&[0.0, 0.25, 0.5, 0.75].map(point));
            for piece in &pieces {
                let band = Band::new(&view, piece);
                let [of_piece, lacking, in_band] = met(&view, piece, &band);
                assert_eq!(lacking, 0, "{k}: of {of_piece}");
                all = [all[0] + of_piece, all[1] + in_band, all[2]];
                // Counter-check: one of half its width lacks some.
                let narrow = Band { beside: 0.5 * band.beside, ..band };
                all[2] += met(&view, piece, &narrow)[1];
            }
        }
        assert!(all[1] < 2 * all[0], "{all:?}");
        assert!(all[2] > all[0] / 100, "{all:?}");
    }
}
