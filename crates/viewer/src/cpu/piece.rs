//! Length of a ray inside one mitred frustum, exactly.
//!
//! With the ray q + tD relative to the frustum's first centre, its unit axis a and radius R(s) = r + g s at s
//! along the axis, the infinite cone is |x|² − (x·a)² ≤ R(x·a)², that is At² + 2Bt + C ≤ 0 with
//!
//! ```text
//! A = D·D − (1 + g²)(D·a)²,   B = D·q − (D·a)(q·a) − g (D·a) R(q·a),   C = q·q − (q·a)² − R(q·a)²
//! ```
//!
//! For A > 0 the inside is the interval between the roots. For A ≤ 0 the ray is steeper than the cone's flank: the
//! inside is outside the roots, and of these two parts the one with R > 0 counts. The interval is then clipped by the
//! half-spaces of the two mitre planes.

use endowire_core::Vec3;

use crate::c_arm::CArm;
use crate::device::Piece;

/// Share of D·D below which A counts as zero: the ray is along the flank.
const ALONG: f64 = 1e-13;

/// Length of the line through `origin` inside `piece`.
///
/// All pieces of a device must be evaluated with the same `origin` for the same line: their common planes then cut it
/// at the same point, rounding included, and a line in such a plane belongs to one of them only.
pub(crate) fn chord(piece: &Piece, origin: &Vec3, direction: &Vec3) -> f64 {
    // Computed from the point nearest to the first centre: the source is far away, and squares would cancel.
    let dd = direction.norm_squared();
    let shift = (piece.start - origin).dot(direction) / dd;
    let q = origin - piece.start + direction * shift;
    let (da, qa, g) = (direction.dot(&piece.axis), q.dot(&piece.axis), piece.slope);
    let radius = piece.radius + g * qa;
    let a = dd - da * da * (1.0 + g * g);
    let b = direction.dot(&q) - da * qa - g * da * radius;
    let c = q.norm_squared() - qa * qa - radius * radius;
    let disc = b * b - a * c;
    let mut interval = [f64::NEG_INFINITY, f64::INFINITY];
    if a > ALONG * dd {
        if disc <= 0.0 {
            return 0.0;
        }
        let root = disc.sqrt();
        interval = [(-b - root) / a, (-b + root) / a];
    } else if a < -ALONG * dd {
        if disc > 0.0 {
            let root = disc.sqrt();
            // a is negative: the larger root is (−b − √)/a.
            if g * da > 0.0 {
                interval[0] = (-b - root) / a;
            } else {
                interval[1] = (-b + root) / a;
            }
        }
    } else if b.abs() > ALONG * dd {
        interval[usize::from(b > 0.0)] = -c / (2.0 * b);
    } else if c > 0.0 {
        return 0.0;
    }
    let heights = [0, 1].map(|k| piece.planes[k].dot(origin) - piece.offsets[k]);
    let rises = piece.planes.map(|normal| normal.dot(direction));
    for (k, onwards) in [(0, 1.0), (1, -1.0)] {
        let crossing = -heights[k] / rises[k] - shift;
        if onwards * rises[k] > 0.0 {
            interval[0] = interval[0].max(crossing);
        } else if onwards * rises[k] < 0.0 {
            interval[1] = interval[1].min(crossing);
        } else if (heights[k] < 0.0) == (k == 0) {
            return 0.0;
        }
    }
    (interval[1] - interval[0]).max(0.0) * dd.sqrt()
}

/// A row or column of cells that crosses a cylinder obliquely.
pub(super) struct Row<'a> {
    pub(super) view: &'a CArm,
    pub(super) piece: &'a Piece,
    /// 0 for a row, 1 for a column.
    pub(super) along: usize,
    /// The middle of its first cell.
    pub(super) first: [f64; 2],
}

/// A row and the lengths of its rays inside the cylinder, to be computed: as [`chord`], in a form that compilers
/// vectorise.
pub(super) struct Lengths<'a> {
    row: Row<'a>,
    lengths: &'a mut [f64],
}

impl<'a> Row<'a> {
    /// With the lengths of its cells.
    pub(super) fn into(self, lengths: &'a mut [f64]) -> Lengths<'a> {
        Lengths { row: self, lengths }
    }
}

impl pulp::WithSimd for Lengths<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Row { view, piece, along, first } = self.row;
        let (u, v) = (along, 1 - along);
        // The coordinate along the row first.
        let turned = |of: &Vec3| [of[u], of[v], of.z];
        let (start, axis, planes) =
            (turned(&piece.start), turned(&piece.axis), piece.planes.each_ref().map(turned));
        let slopes = view.slopes(first);
        let (from, step, across) = (slopes[u], 1.0 / view.focal_px(), slopes[v]);
        let (sod, square) = (view.sod_mm(), piece.radius * piece.radius);
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        // Counted from where a ray is as deep as the first centre: near the piece, where squares do not cancel.
        let depth = sod + start[2];
        let heights = [0, 1].map(|plane| dot(planes[plane], start) - piece.offsets[plane]);
        for (k, length) in self.lengths.iter_mut().enumerate() {
            let direction = [from + k as f64 * step, across, 1.0];
            let q = [direction[0] * depth - start[0], across * depth - start[1], 0.0];
            let dd = dot(direction, direction);
            let (da, qa) = (dot(direction, axis), dot(q, axis));
            let a = dd - da * da;
            let b = dot(direction, q) - da * qa;
            let c = dot(q, q) - qa * qa - square;
            let root = (b * b - a * c).max(0.0).sqrt();
            let each = 1.0 / a;
            let (mut low, mut high) = ((-b - root) * each, (-b + root) * each);
            for (plane, onwards) in [(0, true), (1, false)] {
                let height = dot(planes[plane], q) + heights[plane];
                // Parallel to the plane, a ray crosses it infinitely far away; −0 becomes 0.
                let rise = dot(planes[plane], direction) + 0.0;
                let crossing = -height / rise;
                let enters = (rise >= 0.0) == onwards;
                low = low.max(if enters { crossing } else { f64::NEG_INFINITY });
                high = high.min(if enters { f64::INFINITY } else { crossing });
            }
            *length = (high - low).max(0.0) * dd.sqrt();
        }
    }
}

#[cfg(test)]
mod tests {
    use endowire_core::vessel::SurfaceMesh;

    use super::*;
    use crate::device::{DevicePoint, pieces};
    use crate::spec::CArmSpec;

    fn rod(points: &[(f64, f64, f64, f64)]) -> Vec<Piece> {
        let points: Vec<DevicePoint> = points
            .iter()
            .map(|&(x, y, z, radius_mm)| DevicePoint {
                position_mm: Vec3::new(x, y, z),
                tangent: Vec3::x(),
                radius_mm,
            })
            .collect();
        pieces(&points)
    }

    fn total(pieces: &[Piece], origin: Vec3, direction: Vec3) -> f64 {
        pieces.iter().map(|p| chord(p, &origin, &direction)).sum()
    }

    #[test]
    fn across_along_and_oblique_through_a_cylinder() {
        let rod = rod(&[(0.0, 0.0, 0.0, 0.5), (4.0, 0.0, 0.0, 0.5), (10.0, 0.0, 0.0, 0.5)]);
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
        near(total(&rod, Vec3::new(3.0, 0.0, -9.0), Vec3::z()), 1.0);
        near(total(&rod, Vec3::new(3.0, 0.3, -9.0), Vec3::z() * 2.0), 0.8);
        // A ray in the very plane where two pieces meet is counted once.
        near(total(&rod, Vec3::new(4.0, 0.0, -9.0), Vec3::z()), 1.0);
        near(total(&rod, Vec3::new(4.0 + 1e-16, 0.0, -750.0), Vec3::new(1e-17, 0.0, 1.0)), 1.0);
        near(total(&rod, Vec3::new(-7.0, 0.1, 0.2), Vec3::x()), 10.0);
        near(total(&rod, Vec3::new(-7.0, 0.6, 0.0), Vec3::x()), 0.0);
        near(total(&rod, Vec3::new(5.0, 0.0, 0.0), Vec3::new(1.0, 0.0, 1.0)), 2.0_f64.sqrt());
    }

    #[test]
    fn a_bend_has_neither_gap_nor_overlap() {
        // An L of two legs: the volume by rays is that of two mitred cylinders, π r² (length along the axes).
        let rod = rod(&[(-3.0, 0.0, 0.0, 0.5), (0.0, 0.0, 0.0, 0.5), (0.0, 3.0, 0.0, 0.5)]);
        let n = 1200;
        let step = 8.0 / f64::from(n);
        let mut volume = 0.0;
        for i in 0..n {
            for j in 0..n {
                let at = |k: i32| -4.0 + (f64::from(k) + 0.5) * step;
                volume += total(&rod, Vec3::new(at(i), at(j), -5.0), Vec3::z()) * step * step;
            }
        }
        let exact = std::f64::consts::PI * 0.25 * 6.0;
        assert!((volume / exact - 1.0).abs() < 1e-3, "{volume} {exact}");
        // Counter-check: a flat end at the corner misses the outer wedge.
        let mut flat = rod.clone();
        flat[0].planes[1] = flat[0].axis;
        let ray = (Vec3::new(0.2, -0.3, -5.0), Vec3::z());
        assert!(
            total(&rod, ray.0, ray.1) > 0.5
                && (total(&flat, ray.0, ray.1) - total(&rod, ray.0, ray.1)).abs() > 0.3
        );
    }

    #[test]
    fn a_row_of_rays_has_the_lengths_of_each() {
        let wall = SurfaceMesh { vertices_mm: vec![Vec3::zeros(), Vec3::repeat(40.0)], triangles: vec![] };
        let view =
            CArm::new(&CArmSpec { field_mm: Some(30.0), ..CArmSpec::default() }, [400, 400], &wall).unwrap();
        let bend =
            rod(&[(-3.0, -1.0, 0.0, 0.5), (0.0, 0.2, 1.0, 0.5), (1.0, 3.0, 1.5, 0.5), (0.0, 4.0, 5.0, 0.5)]);
        let mut met = 0;
        for piece in &bend {
            for along in [0, 1] {
                for line in 0..40 {
                    let mut first = [0.5; 2];
                    first[1 - along] = 10.0 * f64::from(line) + 0.5;
                    let mut lengths = vec![0.0; 400];
                    let row = Row { view: &view, piece, along, first };
                    pulp::Arch::new().dispatch(row.into(&mut lengths));
                    for (k, length) in lengths.into_iter().enumerate() {
                        let mut at = first;
                        at[along] += k as f64;
                        let [x, y] = view.slopes(at);
                        let exact =
                            chord(piece, &(Vec3::new(x, y, 0.0) * view.sod_mm()), &Vec3::new(x, y, 1.0));
                        assert!((length - exact).abs() < 1e-9, "{line} {k}: {length} {exact}");
                        met += usize::from(exact > 0.1);
                    }
                }
            }
        }
        // Counter-check: there is something to compare.
        assert!(met > 500, "{met}");
    }

    #[test]
    fn tapers_are_cones_also_seen_from_the_tip() {
        let rod = rod(&[(0.0, 0.0, 0.0, 1.0), (10.0, 0.0, 0.0, 0.0)]);
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
        near(total(&rod, Vec3::new(5.0, 0.0, -9.0), Vec3::z()), 1.0);
        near(total(&rod, Vec3::new(-5.0, 0.0, 0.25), Vec3::x()), 7.5);
        near(total(&rod, Vec3::new(20.0, 0.0, 0.25), -Vec3::x()), 7.5);
        near(total(&rod, Vec3::new(-5.0, 0.0, 1.25), Vec3::x()), 0.0);
    }
}
