//! The rest shape of a device, without contact: one arc per section.

use super::Device;
use crate::Vec3;
use crate::rod::Frame;
use crate::shape::Shape;

/// Largest number of points per section.
const MOST_POINTS: f64 = 10_000.0;

impl Device {
    /// The centre line of the last `length_mm` before the tip in the rest shape, with points at most `step_mm` apart.
    ///
    /// It begins at the origin along z, its first material direction along x. Arcs are exact: a section of curvature
    /// κ and length L bends by κL in the plane of its curvature, which is transported along the arcs behind it
    /// without twist.
    pub fn rest_shape(&self, length_mm: f64, step_mm: f64) -> Shape {
        // Start of each section in view, from the tip, and its length.
        let mut pieces = Vec::new();
        let mut seen_mm = 0.0;
        for section in self.sections() {
            let length = section.length_mm.min(length_mm - seen_mm);
            if length.is_nan() || length <= 0.0 {
                break;
            }
            pieces.push((seen_mm, length, section.rest_curvature_per_mm));
            seen_mm += length;
        }
        let mut frame = Frame::new(Vec3::z(), Some(Vec3::x()));
        let mut position = Vec3::zeros();
        let mut shape =
            Shape { positions_mm: vec![position], tangents: vec![frame.t], from_tip_mm: vec![seen_mm] };
        for (begin_mm, length, [first, second]) in pieces.into_iter().rev() {
            let points = (length / step_mm).ceil().clamp(1.0, MOST_POINTS);
            for k in 1..=points as usize {
                let s = length * (k as f64 / points);
                shape.positions_mm.push(position + along_arc(&frame, [first, second], s));
                shape.tangents.push(frame.transported(first * s, second * s).t);
                shape.from_tip_mm.push(begin_mm + (length - s));
            }
            position += along_arc(&frame, [first, second], length);
            frame = frame.transported(first * length, second * length);
        }
        shape
    }
}

/// From the start of an arc to the point at arc length `s`.
fn along_arc(frame: &Frame, [first, second]: [f64; 2], s: f64) -> Vec3 {
    let curvature = libm::hypot(first, second);
    let angle = curvature * s;
    if angle == 0.0 {
        return frame.t * s;
    }
    let across = (frame.u * first + frame.v * second) / curvature;
    // (1 − cos)/κ as 2 sin²(half)/κ, to avoid cancellation at small angles.
    frame.t * (libm::sin(angle) / curvature) + across * (2.0 * libm::sin(0.5 * angle).powi(2) / curvature)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::Section;

    fn bent(length_mm: f64, curvature: [f64; 2]) -> Section {
        Section { rest_curvature_per_mm: curvature, ..Section::straight(length_mm, 0.5, 1.0) }
    }

    #[test]
    fn a_semicircle_ends_beside_its_beginning() {
        let pi = std::f64::consts::PI;
        let device = Device::new(vec![bent(10.0 * pi, [0.1, 0.0]), bent(50.0, [0.0; 2])]).unwrap();
        let shape = device.rest_shape(10.0 * pi + 20.0, 1.0);
        assert!((shape.tip_mm().unwrap() - Vec3::new(20.0, 0.0, 20.0)).norm() < 1e-12);
        assert!((shape.tangents.last().unwrap() + Vec3::z()).norm() < 1e-12);
        assert_eq!((shape.from_tip_mm[0], shape.from_tip_mm.last()), (10.0 * pi + 20.0, Some(&0.0)));
        for pair in shape.positions_mm.windows(2) {
            assert!((pair[1] - pair[0]).norm() <= 1.0 + 1e-12);
        }
    }

    #[test]
    fn arcs_in_two_planes_follow_one_another() {
        let quarter = std::f64::consts::FRAC_PI_2;
        // From the shaft: a quarter turn towards x, then one towards the second direction, which is still y.
        let device =
            Device::new(vec![bent(5.0 * quarter, [0.0, 0.2]), bent(10.0 * quarter, [0.1, 0.0])]).unwrap();
        let shape = device.rest_shape(1e3, 0.5);
        assert!(
            (shape.tip_mm().unwrap() - Vec3::new(15.0, 5.0, 10.0)).norm() < 1e-12,
            "{:?}",
            shape.tip_mm()
        );
        assert!((shape.tangents.last().unwrap() - Vec3::y()).norm() < 1e-12);
    }
}
