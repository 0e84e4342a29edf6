//! `[view.c_arm]`: position of the C-arm.

use std::str::FromStr;

use endowire_core::{Error, Result};
use serde::{Deserialize, Serialize};

use super::{COORDINATE_MM, finite_within};

/// The `[view.c_arm]` table; conventions are those of [`crate::CArm`].
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct CArmSpec {
    /// Angles in clinical words: "LAO 40 CRA 20". Instead of the two below.
    pub pose: Option<Pose>,
    /// Positioner primary angle, LAO positive (DICOM 0018,1510); -360 to 360.
    pub primary_deg: f64,
    /// Positioner secondary angle, cranial positive (DICOM 0018,1511); -90 to 90.
    pub secondary_deg: f64,
    /// Source to detector, 10 to 100,000.
    pub sid_mm: f64,
    /// Source to isocentre, determined by the table height. 1 to 100,000, and less than `sid_mm`.
    pub sod_mm: f64,
    /// Pixel pitch at the detector, 0.0001 to 1000, including magnification; absent: from `field_mm`, or else such
    /// that a sphere about the isocentre that contains the vessel fills the frame, the same from every side.
    pub pixel_mm: Option<f64>,
    /// Longer side of the detector's field of view, 0.01 to 100,000. Instead of `pixel_mm`, whose limits apply to the
    /// pixels.
    pub field_mm: Option<f64>,
    /// Magnification mode: the field of view is the detector's divided by this factor, 0.1 to 100.
    pub magnification: f64,
    /// Rotation of the image about its centre, clockwise on the screen; -360 to 360.
    pub rotation_deg: f64,
    /// Collimation: width and height of the opening between the blades, at the detector, each 0.01 to 100,000.
    /// Absent: the whole field.
    pub collimation_mm: Option<[f64; 2]>,
    /// Shape of the opening: `rectangle`, or `octagon`, whose corners are cut off, with or without `collimation_mm`.
    pub shutter: Shutter,
    /// Whether letters at the borders of the image show directions: L left, R right, H head, F feet, A front, P back.
    pub markers: bool,
    /// Centre of rotation, in the middle of the frame, each coordinate -100,000 to 100,000; absent: the centre of the
    /// vessel's bounding box.
    pub isocentre_mm: Option<[f64; 3]>,
}

impl Default for CArmSpec {
    fn default() -> Self {
        // Middle of the usual ranges: SID 1000–1200 mm, SOD 700–800 mm.
        Self {
            pose: None,
            primary_deg: 0.0,
            secondary_deg: 0.0,
            sid_mm: 1100.0,
            sod_mm: 750.0,
            pixel_mm: None,
            field_mm: None,
            magnification: 1.0,
            rotation_deg: 0.0,
            collimation_mm: None,
            shutter: Shutter::Rectangle,
            markers: false,
            isocentre_mm: None,
        }
    }
}

/// Shape of the opening between the blades.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Shutter {
    /// Two pairs of blades.
    #[default]
    Rectangle,
    /// Two more across the corners: a regular octagon where the opening is a square.
    Octagon,
}

/// Distance of the patient entrance reference point before the isocentre, mm (IEC 60601-2-43).
const REFERENCE_MM: f64 = 150.0;

impl CArmSpec {
    /// Distance from the source to the patient entrance reference point, mm.
    pub fn reference_mm(&self) -> f64 {
        reference_mm(self.sod_mm)
    }
}

/// The same for a distance from the source to the isocentre, mm.
pub(crate) fn reference_mm(sod_mm: f64) -> f64 {
    (sod_mm - REFERENCE_MM).max(1.0)
}

/// Angles of a C-arm in clinical words: LAO or RAO with an angle, CRA or CAU with an angle, or AP.
///
/// ```
/// let pose: endowire_viewer::Pose = "RAO 30, CAU 20".parse()?;
/// assert_eq!((pose.primary_deg(), pose.secondary_deg()), (-30.0, -20.0));
/// # Ok::<(), endowire_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize, Serialize)]
#[serde(try_from = "String", into = "String")]
pub struct Pose {
    primary_deg: f64,
    secondary_deg: f64,
}

impl Pose {
    /// LAO positive.
    pub fn primary_deg(&self) -> f64 {
        self.primary_deg
    }

    /// Cranial positive.
    pub fn secondary_deg(&self) -> f64 {
        self.secondary_deg
    }
}

impl FromStr for Pose {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let bad = || {
            let remedy = "say angles as in \"LAO 40\", \"RAO 30 CAU 20\" or \"AP\", each direction once, 0 to 180 degrees \
                        (CRA and CAU 0 to 90)";
            Error::parameter("view.c_arm.pose", format!("{text:?}"), remedy)
        };
        let words: Vec<String> = text
            .split(|c: char| c.is_whitespace() || matches!(c, ',' | '/' | '°'))
            .filter(|word| !word.is_empty())
            .map(str::to_uppercase)
            .collect();
        if words == ["AP"] {
            return Ok(Self::default());
        }
        let (mut primary, mut secondary) = (None, None);
        for pair in words.chunks(2) {
            let [name, angle] = pair else { return Err(bad()) };
            let angle: f64 = angle.parse().map_err(|_| bad())?;
            let (place, sign, most) = match name.as_str() {
                "LAO" => (&mut primary, 1.0, 180.0),
                "RAO" => (&mut primary, -1.0, 180.0),
                "CRA" | "CRAN" => (&mut secondary, 1.0, 90.0),
                "CAU" | "CAUD" => (&mut secondary, -1.0, 90.0),
                _ => return Err(bad()),
            };
            if place.is_some() || !(0.0..=most).contains(&angle) {
                return Err(bad());
            }
            *place = Some(sign * angle);
        }
        if primary.or(secondary).is_none() {
            return Err(bad());
        }
        Ok(Self { primary_deg: primary.unwrap_or(0.0), secondary_deg: secondary.unwrap_or(0.0) })
    }
}

impl TryFrom<String> for Pose {
    type Error = Error;

    fn try_from(text: String) -> Result<Self> {
        text.parse()
    }
}

impl From<Pose> for String {
    fn from(pose: Pose) -> Self {
        let [lao, cra] = [("LAO", "RAO", pose.primary_deg), ("CRA", "CAU", pose.secondary_deg)].map(
            |(plus, minus, angle)| format!("{} {}", if angle < 0.0 { minus } else { plus }, angle.abs()),
        );
        format!("{lao} {cra}")
    }
}

/// Pixel pitches for which the geometry is numerically accurate, mm.
pub(crate) const PITCH_MM: [f64; 2] = [1e-4, 1e3];
/// Fields of view and openings, mm.
const FIELD_MM: [f64; 2] = [0.01, 1e5];

impl CArmSpec {
    /// Primary and secondary angle, from `pose` if given.
    pub fn angles_deg(&self) -> [f64; 2] {
        self.pose.map_or([self.primary_deg, self.secondary_deg], |p| [p.primary_deg, p.secondary_deg])
    }

    /// The same C-arm, turned by this angle towards LAO.
    pub fn turned(&self, by_deg: f64) -> Self {
        let [primary_deg, secondary_deg] = self.angles_deg();
        Self { pose: None, primary_deg: primary_deg + by_deg, secondary_deg, ..self.clone() }
    }

    pub(super) fn validate(&self) -> Result<()> {
        finite_within("view.c_arm.primary_deg", self.primary_deg, [-360.0, 360.0])?;
        finite_within("view.c_arm.secondary_deg", self.secondary_deg, [-90.0, 90.0])?;
        for (key, angle) in [("primary_deg", self.primary_deg), ("secondary_deg", self.secondary_deg)] {
            if self.pose.is_some() && angle != 0.0 {
                let key = format!("view.c_arm.{key}");
                return Err(Error::parameter(
                    key,
                    angle,
                    "view.c_arm.pose is given too: keep one of the two",
                ));
            }
        }
        finite_within("view.c_arm.sid_mm", self.sid_mm, [10.0, 1e5])?;
        finite_within("view.c_arm.sod_mm", self.sod_mm, [1.0, 1e5])?;
        if self.sod_mm >= self.sid_mm {
            let remedy =
                format!("must be less than sid_mm = {}: the isocentre is before the detector", self.sid_mm);
            return Err(Error::parameter("view.c_arm.sod_mm", self.sod_mm, remedy));
        }
        for (key, value, range) in
            [("pixel_mm", self.pixel_mm, PITCH_MM), ("field_mm", self.field_mm, FIELD_MM)]
        {
            if let Some(value) = value {
                finite_within(&format!("view.c_arm.{key}"), value, range)?;
            }
        }
        if let (Some(field), Some(_)) = (self.field_mm, self.pixel_mm) {
            let remedy = "view.c_arm.pixel_mm is given too: keep one of the two";
            return Err(Error::parameter("view.c_arm.field_mm", field, remedy));
        }
        finite_within("view.c_arm.magnification", self.magnification, [0.1, 100.0])?;
        finite_within("view.c_arm.rotation_deg", self.rotation_deg, [-360.0, 360.0])?;
        for side in self.collimation_mm.into_iter().flatten() {
            finite_within("view.c_arm.collimation_mm", side, FIELD_MM)?;
        }
        for x in self.isocentre_mm.into_iter().flatten() {
            finite_within("view.c_arm.isocentre_mm", x, COORDINATE_MM)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_have_the_signs_of_dicom() {
        for (text, angles) in [
            ("AP", [0.0, 0.0]),
            ("lao 40", [40.0, 0.0]),
            ("RAO 30 CAU 20", [-30.0, -20.0]),
            ("CRA 25.5, LAO 90", [90.0, 25.5]),
        ] {
            let pose: Pose = text.parse().unwrap();
            assert_eq!([pose.primary_deg, pose.secondary_deg], angles, "{text}");
            assert_eq!(String::from(pose).parse::<Pose>().unwrap(), pose);
        }
        for bad in ["", "LAO", "LAO -3", "LAO 3 RAO 4", "left 40", "CRA 91", "LAO nan"] {
            assert!(bad.parse::<Pose>().unwrap_err().to_string().contains("LAO 40"), "{bad}");
        }
    }
}
