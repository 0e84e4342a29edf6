//! The shaft of a device outside the vessel: from the sheath's mouth back towards the hand.
//!
//! What is simulated begins at the sheath's mouth. In a real picture nothing begins there: the shaft comes from the
//! groin or the arm, and leaves the picture at its edge. In fluoroscopy it is drawn on along such a way. In a
//! patient, a shaft that leaves the vessel towards the feet goes down beside the spine and out through the groin;
//! one that leaves it sideways or towards the head goes down the arm of its side. Without a patient it goes straight
//! on; one that would end at the source or the detector, within the picture, is led out of the beam.

use endowire_core::Vec3;
use endowire_core::shape::Shape;

use crate::device::DevicePoint;

/// Length of a shaft: more than the diagonal of any detector.
const LENGTH_MM: f64 = 900.0;
/// Distance between points of a curved way.
const STRIDE_MM: f64 = 10.0;
/// Length over which a shaft turns into its course.
const TURN_MM: f64 = 50.0;
/// A shaft that points less than this towards the feet when it leaves the vessel goes down an arm, if it points
/// sideways more than to front or back, or towards the head.
const LEVEL: f64 = 0.4;
/// Lengths from the mouth between which a shaft from below crosses the pelvis, and its direction there, for the right
/// groin: left, posterior, head.
const PELVIS_MM: [f64; 2] = [170.0, 380.0];
const TO_GROIN: [f64; 3] = [-0.42, -0.22, -1.0];
/// Length from the mouth to the shoulder, and directions before and behind it, for the left arm.
const SHOULDER_MM: f64 = 110.0;
const TO_SHOULDER: [f64; 3] = [1.0, 0.1, 0.15];
const DOWN_ARM: [f64; 3] = [0.3, 0.1, -1.0];
/// Part of a direction along the beam up to which a straight shaft leaves the picture before it meets the detector.
const ACROSS: f64 = 0.3;

/// What a shaft goes through.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Outside {
    /// A patient with this middle, to the left.
    Patient {
        /// Coordinate of the middle.
        middle_mm: f64,
    },
    /// Air, in a beam of this direction.
    Air {
        /// Unit vector from the source to the detector.
        beam: Vec3,
    },
}

/// Where a device leaves the sheath.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SheathMouth {
    /// The mouth.
    pub position_mm: Vec3,
    /// Direction into the vessel, of any length above zero.
    pub direction: Vec3,
}

impl SheathMouth {
    /// The mouth that a simulated line comes out of; `None` for an empty one.
    pub fn of_line(line: &Shape) -> Option<Self> {
        let (position_mm, direction) = (*line.positions_mm.first()?, *line.tangents.first()?);
        Some(Self { position_mm, direction })
    }

    /// Points of a shaft of this radius outside, from far to near, without the mouth; none for a direction of no
    /// length.
    pub(crate) fn shaft(&self, radius_mm: f64, outside: Outside) -> Vec<DevicePoint> {
        let Some(into) = self.direction.try_normalize(0.0) else { return vec![] };
        let point = |position_mm: Vec3, out: Vec3| DevicePoint { position_mm, tangent: -out, radius_mm };
        let course = match outside {
            Outside::Air { beam } if into.dot(&beam).abs() <= ACROSS => {
                return vec![point(self.position_mm - into * LENGTH_MM, -into)];
            }
            Outside::Air { beam } => Course::Beside(beside(-into, beam)),
            Outside::Patient { middle_mm } => Course::leaving(-into, self.position_mm.x - middle_mm),
        };
        let (mut at, mut out, mut gone_mm) = (self.position_mm, -into, 0.0);
        let mut points = vec![];
        while gone_mm < LENGTH_MM {
            let wanted = course.direction(gone_mm);
            // Straight as in a sheath first, then turned by a share of the difference.
            let turned = if gone_mm < STRIDE_MM { out } else { out + (wanted - out) * (STRIDE_MM / TURN_MM) };
            // Opposite directions have no mean: across to the side of the course.
            out = turned.try_normalize(1e-6).unwrap_or(wanted);
            at += out * STRIDE_MM;
            gone_mm += STRIDE_MM;
            points.push(point(at, out));
        }
        points.reverse();
        points
    }
}

/// The direction across the beam that is nearest to another; towards the feet for one along it, or to the left.
fn beside(out: Vec3, beam: Vec3) -> Vec3 {
    let across = |v: Vec3| (v - beam * beam.dot(&v)).try_normalize(0.05);
    across(out).or_else(|| across(-Vec3::z())).unwrap_or_else(Vec3::x)
}

/// By which way a shaft leaves the patient; −1 is the right side, 1 the left.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Course {
    Groin(f64),
    Arm(f64),
    /// Out of the beam, in this direction.
    Beside(Vec3),
}

impl Course {
    /// The course of a shaft that leaves the vessel in this direction, so far to the left of the patient's middle.
    fn leaving(out: Vec3, left_mm: f64) -> Self {
        let level = out.z > -LEVEL;
        if level && (out.x.abs() > out.y.abs() || out.z > LEVEL) {
            // One that goes up is on its side already.
            let side = if out.x.abs() > LEVEL { out.x } else { left_mm };
            return Self::Arm(if side < 0.0 { -1.0 } else { 1.0 });
        }
        // The right groin, unless it comes from the left.
        Self::Groin(if out.x > LEVEL { 1.0 } else { -1.0 })
    }

    /// The direction of the course at this length from the mouth.
    fn direction(self, gone_mm: f64) -> Vec3 {
        let mirrored = |[x, y, z]: [f64; 3], side: f64| Vec3::new(side * x, y, z).normalize();
        match self {
            Self::Groin(side) if (PELVIS_MM[0]..PELVIS_MM[1]).contains(&gone_mm) => mirrored(TO_GROIN, -side),
            Self::Groin(_) => -Vec3::z(),
            Self::Arm(side) if gone_mm < SHOULDER_MM => mirrored(TO_SHOULDER, side),
            Self::Arm(side) => mirrored(DOWN_ARM, side),
            Self::Beside(direction) => direction,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PATIENT: Outside = Outside::Patient { middle_mm: 0.0 };

    fn shaft(direction: Vec3, outside: Outside) -> Vec<DevicePoint> {
        SheathMouth { position_mm: Vec3::new(1.0, 2.0, 3.0), direction }.shaft(0.5, outside)
    }

    #[test]
    fn a_shaft_leaves_by_groin_or_arm_in_a_patient_and_straight_without() {
        let from = Vec3::new(1.0, 2.0, 3.0);
        let far = |direction: Vec3| shaft(direction, PATIENT)[0].position_mm - from;
        // From below: the right groin, or the left one where it comes from there.
        let groin = far(Vec3::z());
        assert!(groin.z < -700.0 && groin.x < -50.0 && groin.x > -130.0 && groin.y < -20.0, "{groin}");
        let left = far(Vec3::new(-1.0, 0.0, 1.0));
        assert!(left.z < -600.0 && left.x > 50.0, "{left}");
        // From an arm, out of the left subclavian artery.
        let arm = far(Vec3::new(-1.0, 0.2, 0.0));
        assert!(arm.z < -300.0 && arm.x > 200.0, "{arm}");
        // Counter-check: without a patient nothing turns.
        let air = Outside::Air { beam: Vec3::x() };
        let straight = shaft(Vec3::new(0.0, 0.0, -2.0), air);
        assert_eq!(straight.len(), 1);
        assert!((straight[0].position_mm - from - Vec3::z() * LENGTH_MM).norm() < 1e-9);
        assert!(shaft(Vec3::zeros(), PATIENT).is_empty());
    }

    #[test]
    fn a_shaft_from_above_keeps_to_its_side() {
        for lean in [-0.3, 0.0, 0.3] {
            // To either side of a patient's middle.
            for (middle_mm, side) in [(20.0, -1.0), (-20.0, 1.0)] {
                let shaft = shaft(Vec3::new(lean, 0.0, -1.0), Outside::Patient { middle_mm });
                let crossed = shaft.iter().filter(|p| (p.position_mm.x - middle_mm) * side < 0.0);
                assert_eq!(crossed.count(), 0, "{lean} {side}");
                assert!((shaft[0].position_mm.x - middle_mm) * side > 150.0, "{lean} {side}");
            }
        }
    }

    #[test]
    fn a_shaft_that_runs_towards_the_detector_leaves_the_beam_before_it() {
        let beam = -Vec3::y();
        for direction in [beam, -beam, Vec3::new(0.5, 0.8, -0.2)] {
            let shaft = shaft(direction, Outside::Air { beam });
            let from = Vec3::new(1.0, 2.0, 3.0);
            let along = |p: &DevicePoint| (p.position_mm - from).dot(&beam).abs();
            // The detector is a third of a metre away, the picture as wide.
            assert!(shaft.iter().all(|p| along(p) < 120.0), "{direction}");
            assert!((shaft[0].position_mm - from).norm() > 600.0);
            // Counter-check: straight on it would be far behind the detector.
            assert!((LENGTH_MM * direction.normalize()).dot(&beam).abs() > 600.0);
        }
    }

    #[test]
    fn a_shaft_goes_on_from_its_device_without_a_kink() {
        for direction in [Vec3::z(), -Vec3::z(), Vec3::x(), Vec3::y(), Vec3::new(-1.0, 0.3, 0.6)] {
            let shaft = shaft(direction, PATIENT);
            let near = shaft.last().unwrap();
            assert!((near.tangent - direction.normalize()).norm() < 1e-9, "{direction}");
            let turns = shaft.windows(2).map(|pair| pair[0].tangent.dot(&pair[1].tangent));
            // No sharper than over 25 mm.
            assert!(turns.fold(1.0, f64::min) > (STRIDE_MM / 25.0_f64).cos(), "{direction}");
        }
    }
}
