//! The camera of the 3D view, fitted so that the whole vessel is in the frame.

use endowire_core::Vec3;
use endowire_core::vessel::SurfaceMesh;

use crate::spec::CameraSpec;

/// Half the opening angle along the longer side of the frame, degrees: a mild perspective.
const HALF_ANGLE_DEG: f64 = 14.0;
/// Fraction of the frame that the vessel may fill.
const FILL: f64 = 0.88;
/// Default direction of the camera: from the front, slightly from the left and above.
const AZIMUTH_DEG: f64 = 25.0;
const ELEVATION_DEG: f64 = 18.0;
/// Visible spread of the vessel, relative to the largest possible, below which the view is replaced by one across its
/// plane.
const LEAST_SPREAD: f64 = 0.6;
/// Number of positions of an orbit from which the vessel must fit.
const ORBIT_PLACES: u32 = 36;
/// Fraction of the distance to the vessel that is kept free in front of the camera.
const NEAR: f64 = 0.02;

/// A perspective camera. View coordinates are rightwards, upwards and backwards from the eye.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Camera {
    eye_mm: Vec3,
    axes: [Vec3; 3],
    /// Tangents of half the opening angles, across and up.
    pub(crate) tangents: [f64; 2],
    pub(crate) size_px: [u32; 2],
    /// Nearest and farthest distance of the wall along the view.
    pub(crate) wall_range: [f64; 2],
    pub(crate) near: f64,
    pub(crate) far: f64,
}

impl Camera {
    /// Fits a camera to a wall with at least one vertex, and to further points.
    pub(crate) fn new(spec: &CameraSpec, size_px: [u32; 2], wall: &SurfaceMesh, beside: &[Vec3]) -> Self {
        let first = match (spec.azimuth_deg, spec.elevation_deg) {
            (None, None) => natural_direction(wall),
            (azimuth, elevation) => from_angles(azimuth.unwrap_or(0.0), elevation.unwrap_or(0.0)),
        };
        let axes = axes_from(&turned(&first, spec.turn_deg));
        let longer = f64::from(size_px[0].max(size_px[1]));
        let tangents = size_px.map(|n| libm::tan(HALF_ANGLE_DEG.to_radians()) * f64::from(n) / longer);
        let fitted = match spec.orbit_deg {
            Some(orbit_deg) => Self::orbiting(&first, axes, orbit_deg, (tangents, size_px), wall, beside),
            None => Self::fitted(axes, (tangents, size_px), wall, beside),
        };
        fitted.nearer(spec)
    }

    /// Magnified and shifted.
    fn nearer(mut self, spec: &CameraSpec) -> Self {
        let distance = f64::midpoint(self.wall_range[0], self.wall_range[1]);
        let width_mm = 2.0 * self.tangents[0] * distance;
        for (axis, share) in self.axes.iter().zip(spec.shift) {
            self.eye_mm += axis * (share * width_mm);
        }
        self.tangents = self.tangents.map(|tangent| tangent / spec.magnification);
        self
    }

    /// As near as the whole is seen.
    fn fitted(
        axes: [Vec3; 3],
        (tangents, size_px): ([f64; 2], [u32; 2]),
        wall: &SurfaceMesh,
        beside: &[Vec3],
    ) -> Self {
        // A vertex at (x, y, z) is in the frame of an eye at (cx, cy, D) if |x − cx| ≤ k (D − z): the extremes of x +
        // kz and −x + kz give the smallest D and the corresponding centre, for each direction separately.
        let local: Vec<[f64; 3]> = wall.vertices_mm.iter().map(|v| axes.map(|axis| v.dot(&axis))).collect();
        let all: Vec<[f64; 3]> =
            local.iter().copied().chain(beside.iter().map(|v| axes.map(|axis| v.dot(&axis)))).collect();
        let fit = |side: usize| {
            let k = tangents[side] * FILL;
            let (plus, minus) = all.iter().fold((f64::MIN, f64::MIN), |(plus, minus), p| {
                (plus.max(p[side] + k * p[2]), minus.max(k * p[2] - p[side]))
            });
            ((plus - minus) / 2.0, (plus + minus) / (2.0 * k))
        };
        let ((cx, dx), (cy, dy)) = (fit(0), fit(1));
        let (front, rear) =
            local.iter().fold((f64::MIN, f64::MAX), |(front, rear), p| (front.max(p[2]), rear.min(p[2])));
        // A wall without extent across the view still needs a distance.
        let distance = dx.max(dy).max(front + 1.0);
        Self {
            eye_mm: axes[0] * cx + axes[1] * cy + axes[2] * distance,
            axes,
            tangents,
            size_px,
            wall_range: [distance - front, distance - rear],
            near: NEAR * (distance - front),
            far: 3.0 * (distance - rear),
        }
    }

    /// A camera at a distance from which it sees everything on every position of an orbit that starts at `first`.
    fn orbiting(
        first: &Vec3,
        axes: [Vec3; 3],
        orbit_deg: f64,
        (tangents, size_px): ([f64; 2], [u32; 2]),
        wall: &SurfaceMesh,
        beside: &[Vec3],
    ) -> Self {
        let all = || wall.vertices_mm.iter().chain(beside);
        let low = all().fold(Vec3::repeat(f64::MAX), |low, v| low.inf(v));
        let high = all().fold(Vec3::repeat(f64::MIN), |high, v| high.sup(v));
        let centre = (low + high) / 2.0;
        let (mut distance, mut reach) = (0.0_f64, 0.0_f64);
        for place in 0..=ORBIT_PLACES {
            let axes = axes_from(&turned(first, orbit_deg * f64::from(place) / f64::from(ORBIT_PLACES)));
            for v in all() {
                let [x, y, z] = axes.map(|axis| (v - centre).dot(&axis));
                let wide = (x.abs() / tangents[0]).max(y.abs() / tangents[1]) / FILL;
                distance = distance.max(wide + z);
                reach = reach.max(z.abs());
            }
        }
        let distance = distance.max(reach + 1.0);
        Self {
            eye_mm: centre + axes[2] * distance,
            axes,
            tangents,
            size_px,
            wall_range: [distance - reach, distance + reach],
            near: NEAR * (distance - reach),
            far: 3.0 * (distance + reach),
        }
    }

    /// Directions to the right and upwards in the image.
    pub(crate) fn right_and_up(&self) -> [Vec3; 2] {
        [self.axes[0], self.axes[1]]
    }

    /// View coordinates of a point.
    pub(crate) fn in_view(&self, point_mm: &Vec3) -> [f64; 3] {
        let r = point_mm - self.eye_mm;
        self.axes.map(|axis| r.dot(&axis))
    }

    /// View coordinates of a direction.
    pub(crate) fn direction_in_view(&self, direction: &Vec3) -> [f64; 3] {
        self.axes.map(|axis| direction.dot(&axis))
    }

    /// Pixel coordinates of a point in view coordinates, on a frame with `scale` pixels per pixel.
    pub(crate) fn pixel_of(&self, view: [f64; 3], scale: u32) -> [f64; 2] {
        let [w, h] = self.size_px.map(|n| f64::from(n * scale) / 2.0);
        [
            w * (1.0 - view[0] / (self.tangents[0] * view[2])),
            h * (1.0 + view[1] / (self.tangents[1] * view[2])),
        ]
    }

    /// Size in millimetres of a pixel at the given distance along the view.
    pub(crate) fn pixel_mm_at(&self, distance: f64) -> f64 {
        2.0 * self.tangents[0] * distance / f64::from(self.size_px[0])
    }
}

/// A direction rotated about the long axis of the patient.
fn turned(direction: &Vec3, degrees: f64) -> Vec3 {
    let (sin, cos) = libm::sincos(degrees.to_radians());
    Vec3::new(cos * direction.x - sin * direction.y, sin * direction.x + cos * direction.y, direction.z)
}

/// Rightwards, upwards and backwards for a direction to the camera.
fn axes_from(back: &Vec3) -> [Vec3; 3] {
    // Head up; looking along the body, the front is up.
    let upright = if back.z.abs() > 0.999 { -Vec3::y() } else { Vec3::z() };
    let right = upright.cross(back).normalize();
    [right, back.cross(&right), *back]
}

/// Unit vector from the vessel to the camera.
fn from_angles(azimuth_deg: f64, elevation_deg: f64) -> Vec3 {
    let (a, e) = (azimuth_deg.to_radians(), elevation_deg.to_radians());
    Vec3::new(libm::sin(a) * libm::cos(e), -libm::cos(a) * libm::cos(e), libm::sin(e))
}

/// The usual oblique front view; for a vessel seen edge-on in it, one across the vessel's plane instead.
fn natural_direction(wall: &SurfaceMesh) -> Vec3 {
    let usual = from_angles(AZIMUTH_DEG, ELEVATION_DEG);
    let n = wall.vertices_mm.len().max(1) as f64;
    let mean = wall.vertices_mm.iter().sum::<Vec3>() / n;
    let mut covariance = endowire_core::nalgebra::Matrix3::zeros();
    for v in &wall.vertices_mm {
        covariance += (v - mean) * (v - mean).transpose();
    }
    let eigen = covariance.symmetric_eigen();
    // Spread visible along d: √ of the determinant of the covariance projected along d, which is √(dᵀ adj(C) d).
    let [l0, l1, l2] = [0, 1, 2].map(|i| eigen.eigenvalues[i].max(0.0));
    let adjugate = [l1 * l2, l0 * l2, l0 * l1];
    let spread = |d: &Vec3| -> f64 {
        (0..3).map(|i| adjugate[i] * eigen.eigenvectors.column(i).dot(d).powi(2)).sum::<f64>().sqrt()
    };
    let thinnest = (0..3).max_by(|&i, &j| adjugate[i].total_cmp(&adjugate[j])).unwrap_or(0);
    let across: Vec3 = eigen.eigenvectors.column(thinnest).into_owned();
    if spread(&usual) >= LEAST_SPREAD * spread(&across) {
        return usual;
    }
    let facing = if across.dot(&usual) < 0.0 { -across } else { across };
    // Not quite perpendicular, so that depth is visible.
    (facing + usual * 0.35).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cloud(x: f64, y: f64, z: f64) -> SurfaceMesh {
        let vertices_mm = (0..500)
            .map(|i| {
                let a = f64::from(i);
                Vec3::new(x * (0.7 * a).sin() + 90.0, y * (1.3 * a).cos(), z * (2.1 * a).sin() - 40.0)
            })
            .collect();
        SurfaceMesh { vertices_mm, triangles: vec![] }
    }

    #[test]
    fn the_whole_vessel_is_in_the_frame_and_fills_it() {
        for size in [[640, 640], [800, 300], [200, 900]] {
            let wall = cloud(80.0, 20.0, 50.0);
            let camera = Camera::new(&CameraSpec::default(), size, &wall, &[]);
            let mut widest: f64 = 0.0;
            for v in &wall.vertices_mm {
                let view = camera.in_view(v);
                assert!(-view[2] >= camera.near && -view[2] <= camera.far);
                let pixel = camera.pixel_of(view, 1);
                for k in 0..2 {
                    let half = f64::from(size[k]) / 2.0;
                    widest = widest.max((pixel[k] - half).abs() / half);
                }
            }
            assert!((widest - FILL).abs() < 1e-9, "{size:?}: {widest}");
        }
    }

    #[test]
    fn a_magnified_view_shows_its_shifted_middle_larger() {
        let wall = cloud(80.0, 20.0, 50.0);
        let camera = |magnification: f64, shift: [f64; 2]| {
            let spec = CameraSpec { magnification, shift, ..CameraSpec::default() };
            Camera::new(&spec, [400, 400], &wall, &[])
        };
        let (usual, near) = (camera(1.0, [0.0; 2]), camera(4.0, [0.25, -0.125]));
        let at = |camera: &Camera, p: &Vec3| camera.pixel_of(camera.in_view(p), 1);
        // What was a quarter of the width to the right of the middle and an eighth below it, at the middle's depth.
        let depth = f64::midpoint(usual.wall_range[0], usual.wall_range[1]);
        let width_mm = usual.pixel_mm_at(depth) * 400.0;
        let place = |right: f64, down: f64| {
            usual.eye_mm - usual.axes[2] * depth + usual.axes[0] * (right * width_mm)
                - usual.axes[1] * (down * width_mm)
        };
        assert!(
            at(&usual, &place(0.25, 0.125)).iter().zip([300.0, 250.0]).all(|(a, b)| (a - b).abs() < 1e-9)
        );
        assert!(at(&near, &place(0.25, 0.125)).iter().all(|x| (x - 200.0).abs() < 1e-9));
        assert!((at(&near, &place(0.26, 0.125))[0] - 216.0).abs() < 1e-9, "four times as large");
    }

    #[test]
    fn the_front_is_seen_with_the_head_up_and_the_left_on_the_right() {
        let spec = CameraSpec { azimuth_deg: Some(0.0), elevation_deg: Some(0.0), ..CameraSpec::default() };
        let camera = Camera::new(&spec, [400, 400], &cloud(80.0, 20.0, 50.0), &[]);
        let at = |p: Vec3| camera.pixel_of(camera.in_view(&p), 1);
        let centre = at(Vec3::new(90.0, 0.0, -40.0));
        assert!(at(Vec3::new(95.0, 0.0, -40.0))[0] > centre[0]);
        assert!(at(Vec3::new(90.0, 0.0, -35.0))[1] < centre[1]);
    }

    #[test]
    fn a_vessel_in_a_transverse_plane_is_not_seen_edge_on() {
        let flat = natural_direction(&cloud(80.0, 60.0, 3.0));
        assert!(flat.z > 0.8, "{flat}");
        let upright = natural_direction(&cloud(80.0, 3.0, 60.0));
        assert!((upright - from_angles(AZIMUTH_DEG, ELEVATION_DEG)).norm() < 1e-12);
    }

    #[test]
    fn an_orbit_begins_where_the_view_is_and_goes_on_evenly() {
        let wall = cloud(80.0, 20.0, 50.0);
        let at = |turn_deg: f64| {
            let spec = CameraSpec { turn_deg, orbit_deg: Some(90.0), ..CameraSpec::default() };
            Camera::new(&spec, [320, 320], &wall, &[])
        };
        let places: Vec<Camera> = (0..=9).map(|k| at(10.0 * f64::from(k))).collect();
        let usual = Camera::new(&CameraSpec::default(), [320, 320], &wall, &[]);
        assert!((places[0].axes[2] - usual.axes[2]).norm() < 1e-12, "the first frame looks as any other");
        let step = |pair: &[Camera]| (pair[1].eye_mm - pair[0].eye_mm).norm();
        let steps: Vec<f64> = places.windows(2).map(step).collect();
        assert!(steps.iter().all(|s| (s / steps[0] - 1.0).abs() < 1e-9), "{steps:?}");
        // Counter-check: fitted anew each time, the camera's distance varies.
        let fitted: Vec<Camera> = (0..=9)
            .map(|k| CameraSpec { turn_deg: 10.0 * f64::from(k), ..CameraSpec::default() })
            .map(|spec| Camera::new(&spec, [320, 320], &wall, &[]))
            .collect();
        let steps: Vec<f64> = fitted.windows(2).map(step).collect();
        assert!(steps.iter().any(|s| (s / steps[0] - 1.0).abs() > 0.05), "{steps:?}");
        for camera in &places {
            for v in &wall.vertices_mm {
                let pixel = camera.pixel_of(camera.in_view(v), 1);
                assert!(pixel.iter().all(|p| (0.0..=320.0).contains(p)));
            }
        }
    }

    #[test]
    fn looking_along_the_body_works() {
        let spec = CameraSpec { elevation_deg: Some(90.0), ..CameraSpec::default() };
        let camera = Camera::new(&spec, [100, 100], &cloud(10.0, 20.0, 30.0), &[]);
        assert!(camera.eye_mm.iter().all(|x| x.is_finite()));
    }
}
