//! The rest shape of a coil, its secondary shape, which it takes where nothing holds it straight.
//!
//! A part is an arc or a sequence of arcs joined without twist. The curvature of a helix of radius R that rises by c
//! per radian is R/(R² + c²), and its direction rotates about the axis by the torsion c/(R² + c²) per length; a curve
//! through points consists of arcs between the middles of its chords.

use serde::Deserialize;

use super::LENGTH_LIMIT_MM;
use crate::rod::Frame;
use crate::{Error, Result, Vec3};

/// Largest rotation of the plane between consecutive arcs of a helix, rad: half of it is the error of the direction
/// of bending at their ends.
const PLANE_TURN: f64 = 0.1;
/// Angle between points of a cage, seen from its centre, rad.
const CAGE_STEP: f64 = 0.25;
/// Largest number of arcs of a part.
const MOST_ARCS: usize = 400;
/// Largest angle between two chords of a curve of points, rad: above it the curve between them is ambiguous.
const LARGEST_TURN: f64 = 1.0;

/// A length of constant curvature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Arc {
    pub(super) length_mm: f64,
    /// Along the first and second material direction, 1/mm.
    pub(super) curvature_per_mm: [f64; 2],
}

/// A `secondary` table of the file.
#[derive(Debug, Clone, Deserialize)]
#[serde(tag = "shape", rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum Secondary {
    /// A helix.
    Helix {
        /// Diameter of the centre line's cylinder.
        diameter_mm: f64,
        /// Advance per turn.
        pitch_mm: f64,
    },
    /// Loops on a sphere, each tilted against an axis about which the next one is rotated: a cage.
    Complex {
        /// Diameter of the sphere on which the centre line lies.
        diameter_mm: f64,
        /// Angle between the loops and the plane normal to the axis.
        tilt_deg: f64,
        /// Angle about the axis from one loop to the next.
        turn_deg: f64,
    },
    /// A curve through points, tip first.
    Curve {
        /// The points, mm.
        points_mm: Vec<[f64; 3]>,
    },
}

impl Secondary {
    /// The length of the curve, if the shape determines it, mm.
    pub(super) fn length_mm(&self) -> Option<f64> {
        let Self::Curve { points_mm } = self else { return None };
        Some(points_mm.windows(2).map(|ends| (Vec3::from(ends[1]) - Vec3::from(ends[0])).norm()).sum())
    }

    /// The arcs of a part of this length and radius, mm, tip first.
    ///
    /// # Errors
    /// Values out of range, by key; a shape with a radius below the part's own; one with too many arcs.
    pub(super) fn arcs(&self, place: &str, length_mm: f64, radius_mm: f64) -> Result<Vec<Arc>> {
        let part = place;
        let place = format!("{place}.secondary");
        let arcs = match self {
            Self::Helix { diameter_mm, pitch_mm } => {
                let bend_mm = bend_radius_mm(&place, *diameter_mm, radius_mm)?;
                if !(pitch_mm.is_finite() && (0.0..=LENGTH_LIMIT_MM).contains(pitch_mm)) {
                    let remedy = format!("must be a number from 0 to {LENGTH_LIMIT_MM}");
                    return Err(Error::parameter(format!("{place}.pitch_mm"), pitch_mm, remedy));
                }
                let rise_mm = pitch_mm / std::f64::consts::TAU;
                let square = bend_mm * bend_mm + rise_mm * rise_mm;
                let (curvature, torsion) = (bend_mm / square, rise_mm / square);
                let count = (length_mm * torsion / PLANE_TURN).ceil().max(1.0);
                check_count(&place, count)?;
                let arc_mm = length_mm / count;
                // From the tip backwards the direction of a right-handed helix rotates the other way about the
                // material directions.
                let arc = |k: usize| turned(arc_mm, curvature, -torsion * arc_mm * (k as f64 + 0.5));
                (0..count as usize).map(arc).collect()
            }
            Self::Complex { diameter_mm, tilt_deg, turn_deg } => {
                let ball_mm = bend_radius_mm(&place, *diameter_mm, radius_mm)?;
                for (key, value, most) in [("tilt_deg", *tilt_deg, 90.0), ("turn_deg", *turn_deg, 180.0)] {
                    if !(0.0..=most).contains(&value) {
                        let remedy = format!("must be a number from 0 to {most}");
                        return Err(Error::parameter(format!("{place}.{key}"), value, remedy));
                    }
                }
                check_count(&place, length_mm / (ball_mm * CAGE_STEP))?;
                let points_mm = cage(length_mm, ball_mm, tilt_deg.to_radians(), turn_deg / 360.0);
                if points_mm.len() < 3 {
                    let remedy = format!(
                        "is too short for loops of {diameter_mm} mm: make the part longer or its shape narrower"
                    );
                    return Err(Error::parameter(format!("{part}.length_mm"), length_mm, remedy));
                }
                curve(&place, &points_mm)?
            }
            Self::Curve { points_mm } => curve(&place, points_mm)?,
        };
        Ok(arcs)
    }
}

/// An arc of this curvature in a plane at an angle, rad, to the first material direction.
fn turned(length_mm: f64, curvature: f64, angle: f64) -> Arc {
    let (sin, cos) = libm::sincos(angle);
    Arc { length_mm, curvature_per_mm: [curvature * cos, curvature * sin] }
}

/// The radius of a shape, at least the part's own.
fn bend_radius_mm(place: &str, diameter_mm: f64, radius_mm: f64) -> Result<f64> {
    crate::error::in_range(&format!("{place}.diameter_mm"), diameter_mm, LENGTH_LIMIT_MM)?;
    if 0.5 * diameter_mm < radius_mm {
        let remedy = format!("must be at least the part's own diameter, {:.4} mm", 2.0 * radius_mm);
        return Err(Error::parameter(format!("{place}.diameter_mm"), diameter_mm, remedy));
    }
    Ok(0.5 * diameter_mm)
}

fn check_count(place: &str, count: f64) -> Result<()> {
    if count > MOST_ARCS as f64 {
        let value = format!("{count} arcs");
        let remedy = format!("at most {MOST_ARCS} are taken: make the part shorter or its shape wider");
        return Err(Error::parameter(place, value, remedy));
    }
    Ok(())
}

/// Points, tip first, of a curve of this length on a sphere: loops with a tilt, rad, advancing by `turn` about the
/// axis per loop.
fn cage(length_mm: f64, ball_mm: f64, tilt: f64, turn: f64) -> Vec<[f64; 3]> {
    let (sin_tilt, cos_tilt) = libm::sincos(tilt);
    let place = |k: usize| {
        let angle = k as f64 * CAGE_STEP;
        let ((sin, cos), (sin_turn, cos_turn)) = (libm::sincos(angle), libm::sincos(turn * angle));
        let (x, y) = (cos, sin * cos_tilt);
        Vec3::new(x * cos_turn - y * sin_turn, x * sin_turn + y * cos_turn, sin * sin_tilt) * ball_mm
    };
    let mut points = vec![place(0)];
    let mut left_mm = length_mm;
    for k in 1.. {
        let chord = place(k) - place(k - 1);
        let size_mm = chord.norm();
        // The last chord must not be a sliver.
        if left_mm <= 1.5 * size_mm {
            points.push(place(k - 1) + chord * (left_mm / size_mm));
            break;
        }
        left_mm -= size_mm;
        points.push(place(k));
    }
    points.into_iter().map(Into::into).collect()
}

/// The arcs of a curve through points: half chords at its ends, and around each interior point an arc that bends by
/// the angle of its chords.
fn curve(place: &str, points_mm: &[[f64; 3]]) -> Result<Vec<Arc>> {
    let name = format!("{place}.points_mm");
    let few = points_mm.len() < 3;
    if few || points_mm.iter().flatten().any(|value| !value.is_finite()) {
        let value = format!("{} points", points_mm.len());
        return Err(Error::parameter(name, value, "give at least 3 points of finite numbers, tip first"));
    }
    check_count(place, points_mm.len() as f64)?;
    // In the order of the material directions: from the last point to the tip.
    let chords: Vec<Vec3> =
        points_mm.windows(2).rev().map(|ends| Vec3::from(ends[0]) - Vec3::from(ends[1])).collect();
    if let Some(k) = chords.iter().position(|chord| chord.norm() == 0.0) {
        let k = points_mm.len() - 1 - k;
        return Err(Error::parameter(name, format!("points {} and {k}", k - 1), "must be two places"));
    }
    let mut frame = Frame::new(chords[0].normalize(), None);
    let mut arcs = vec![turned(0.5 * chords[0].norm(), 0.0, 0.0)];
    for (k, ends) in chords.windows(2).enumerate() {
        let (length_mm, next) = (0.5 * (ends[0].norm() + ends[1].norm()), ends[1].normalize());
        let across = next - frame.t * next.dot(&frame.t);
        let angle = libm::atan2(across.norm(), next.dot(&frame.t));
        if angle > LARGEST_TURN {
            let value = format!("{:.0}° at point {}", angle.to_degrees(), points_mm.len() - 2 - k);
            return Err(Error::parameter(
                name,
                value,
                "chords turn by at most 57°: give points nearer to each other",
            ));
        }
        let towards = if angle > 0.0 { across.normalize() } else { across };
        let (first, second) = (towards.dot(&frame.u) * angle, towards.dot(&frame.v) * angle);
        arcs.push(Arc { length_mm, curvature_per_mm: [first / length_mm, second / length_mm] });
        frame = frame.transported(first, second);
    }
    arcs.push(turned(0.5 * chords[chords.len() - 1].norm(), 0.0, 0.0));
    arcs.reverse();
    Ok(arcs)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::{Device, Section};

    /// The centre line of the rest shape of a coil with this secondary shape.
    fn rest(secondary: &Secondary, length_mm: f64) -> Vec<Vec3> {
        let arcs = secondary.arcs("part", length_mm, 0.15).unwrap();
        let section = |arc: &Arc| Section {
            rest_curvature_per_mm: arc.curvature_per_mm,
            ..Section::straight(arc.length_mm, 0.15, 1e-3)
        };
        let device = Device::new(arcs.iter().map(section).collect()).unwrap();
        assert!((device.length_mm() - length_mm).abs() < 1e-9 * length_mm);
        device.rest_shape(length_mm, 0.05).positions_mm
    }

    #[test]
    fn a_helix_has_its_diameter_its_pitch_and_is_right_handed() {
        let (diameter, pitch) = (4.0, 1.5);
        let turn_mm = libm::hypot(std::f64::consts::PI * diameter, pitch);
        let helix = Secondary::Helix { diameter_mm: diameter, pitch_mm: pitch };
        let points = rest(&helix, 5.0 * turn_mm);
        let turn = points.len() / 5;
        // Points one turn apart differ by the pitch along the axis.
        let rise = points[2 * turn] - points[turn];
        assert!((rise.norm() - pitch).abs() < 0.02 * pitch, "{}", rise.norm());
        let axis = rise.normalize();
        let across = points[2 * turn] - points[turn + turn / 2];
        let across = across - axis * across.dot(&axis);
        assert!((across.norm() - diameter).abs() < 0.01 * diameter, "{}", across.norm());
        // A quarter turn advances about the axis in its direction.
        let centre = points[turn] - across * 0.5;
        let out = |k: usize| {
            let off = points[k] - centre;
            off - axis * off.dot(&axis)
        };
        assert!(out(turn).cross(&out(turn + turn / 4)).dot(&axis) > 0.9 * 0.25 * diameter * diameter);
    }

    #[test]
    fn a_flat_helix_is_a_circle_and_a_cage_lies_on_a_ball() {
        let circle = rest(&Secondary::Helix { diameter_mm: 4.0, pitch_mm: 0.0 }, 4.0 * std::f64::consts::PI);
        assert!((circle[0] - circle[circle.len() - 1]).norm() < 1e-9);
        let cage = |tilt_deg: f64, turn_deg: f64| {
            let points = rest(&Secondary::Complex { diameter_mm: 4.0, tilt_deg, turn_deg }, 120.0);
            let mean = points.iter().sum::<Vec3>() / points.len() as f64;
            let moment =
                points.iter().map(|x| (x - mean) * (x - mean).transpose()).sum::<nalgebra::Matrix3<f64>>();
            let values = moment.symmetric_eigenvalues();
            let off_mm = points.iter().map(|x| ((x - mean).norm() - 2.0).abs()).fold(0.0, f64::max);
            (values.min() / values.max(), off_mm)
        };
        assert!(cage(60.0, 0.0).0 < 1e-9, "one plane");
        let (spread, off_mm) = cage(60.0, 40.0);
        assert!(spread > 0.5 && off_mm < 0.25, "{spread} {off_mm}");
    }

    #[test]
    fn a_curve_through_points_is_followed() {
        // It bends in all directions.
        let at = |t: f64| [4.0 * libm::sin(t), 3.0 * libm::cos(1.3 * t), 2.0 * t];
        let points_mm: Vec<[f64; 3]> = (0..160).map(|k| at(f64::from(k) * 0.04)).collect();
        let curve = Secondary::Curve { points_mm: points_mm.clone() };
        let length_mm = curve.length_mm().unwrap();
        let arcs = curve.arcs("part", length_mm, 0.15).unwrap();
        let section = |arc: &Arc| Section {
            rest_curvature_per_mm: arc.curvature_per_mm,
            ..Section::straight(arc.length_mm, 0.15, 1e-3)
        };
        let device = Device::new(arcs.iter().map(section).collect()).unwrap();
        let shape = device.rest_shape(length_mm, 0.1);
        // Distances within the curve do not depend on its position.
        let (found, given) = (|mm: f64| shape.position_at(mm).unwrap(), |k: usize| Vec3::from(points_mm[k]));
        let along = |k: usize| -> f64 { (1..=k).map(|i| (given(i) - given(i - 1)).norm()).sum() };
        for (a, b) in [(0, 40), (20, 150), (80, 120), (5, 159)] {
            let (found, given) = ((found(along(a)) - found(along(b))).norm(), (given(a) - given(b)).norm());
            assert!((found - given).abs() < 0.03, "{a} {b}: {found} {given}");
        }
    }

    #[test]
    fn what_has_no_shape_is_refused_by_key() {
        let refused =
            |secondary: Secondary| secondary.arcs("part \"a\"", 100.0, 0.15).unwrap_err().to_string();
        let helix = |diameter_mm, pitch_mm| Secondary::Helix { diameter_mm, pitch_mm };
        assert!(refused(helix(0.2, 1.0)).contains("secondary.diameter_mm = 0.2"));
        assert!(refused(helix(2.0, f64::INFINITY)).contains("pitch_mm"));
        let complex =
            |diameter_mm, tilt_deg, turn_deg| Secondary::Complex { diameter_mm, tilt_deg, turn_deg };
        assert!(refused(complex(2.0, -1.0, 90.0)).contains("tilt_deg = -1"));
        assert!(refused(complex(2.0, 60.0, 200.0)).contains("turn_deg = 200"));
        assert!(refused(complex(0.5, 60.0, 40.0)).contains("arcs"));
        let short = complex(4.0, 60.0, 40.0).arcs("part \"a\"", 1e-5, 0.15).unwrap_err().to_string();
        assert!(short.contains("\"a\".length_mm = 1e-5: is too short for loops of 4 mm"), "{short}");
        assert!(refused(Secondary::Curve { points_mm: vec![[0.0; 3]; 2] }).contains("2 points"));
        assert!(refused(Secondary::Curve { points_mm: vec![[0.0; 3]; 3] }).contains("two places"));
        let back = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.5, 0.1, 0.0]];
        assert!(refused(Secondary::Curve { points_mm: back }).contains("at point 1"));
    }
}
