//! Options of the exact rod, set one by one or together.

use serde::{Deserialize, Serialize};

use super::mesh::Fineness;
use crate::methods::Surroundings;
use crate::tuning::Tuning;
use crate::{Error, Result};

/// Largest tolerance: a larger residual does not indicate an equilibrium.
const LARGEST_TOLERANCE: f64 = 1e-2;
/// Largest spacing of contact points: beyond it most of a device would have no contact.
const LARGEST_CONTACT_SPACING_RADII: f64 = 10.0;
/// Largest number of contact points of all instruments: hundreds of bytes each.
const POINT_LIMIT: usize = 1_000_000;
/// Largest number of elements of a device: some kilobytes each.
const ELEMENT_LIMIT: f64 = 100_000.0;

/// Accuracy of equilibria: `method.accuracy` sets element length, spacing of contact points and tolerance together.
///
/// Errors are those of the device's line against elements of 1 mm with points a quarter of a radius apart, at nine of
/// ten commands, in the worst of eight scenes with wires of 0.5 to 0.9 mm in arteries of 2 to 12 mm radius; times are
/// means over these, relative to `Balanced` (`cargo run --release -p endowire-benches --bin precision`). Most of the
/// error is due to the spacing of points, little to elements up to 4 mm, and none to the tolerance, but each factor
/// of ten costs at most one more iteration.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Accuracy {
    /// Elements of 6 mm, points 1.5 radii apart, tolerance 10⁻⁴: 0.05 mm in 0.7 of the time, for learning and manual
    /// play.
    Fast,
    /// Elements of 4 mm, points a radius apart, tolerance 10⁻⁵: 0.02 mm.
    #[default]
    Balanced,
    /// Elements of 2 mm, points half a radius apart, tolerance 10⁻⁹: 0.007 mm in 1.9 times the time.
    Fine,
}

/// Options as written in a scene: absent ones are those of the accuracy, if given.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    accuracy: Option<Accuracy>,
    element_mm: Option<f64>,
    tolerance: Option<f64>,
    max_iterations: Option<usize>,
    contact_spacing_radii: Option<f64>,
    self_contact: Option<bool>,
    self_friction: Option<f64>,
}

impl From<Written> for KirchhoffOptions {
    fn from(written: Written) -> Self {
        let of = Self::of(written.accuracy.unwrap_or_default());
        Self {
            element_mm: written.element_mm.unwrap_or(of.element_mm),
            tolerance: written.tolerance.unwrap_or(of.tolerance),
            max_iterations: written.max_iterations.unwrap_or(of.max_iterations),
            contact_spacing_radii: written.contact_spacing_radii.unwrap_or(of.contact_spacing_radii),
            self_contact: written.self_contact.unwrap_or(of.self_contact),
            self_friction: written.self_friction.unwrap_or(of.self_friction),
            tuning: of.tuning,
        }
    }
}

/// Options of the exact rod.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(from = "Written")]
pub struct KirchhoffOptions {
    /// Element length, mm.
    pub element_mm: f64,
    /// Largest unbalanced force or moment at a node, relative to the largest in the device, its wall and its
    /// supports.
    pub tolerance: f64,
    /// Largest number of Newton iterations of one solution; after ten times as many in one command the device only
    /// moves to where it rests.
    pub max_iterations: usize,
    /// Largest spacing of contact points, in radii of the device. At 1.5 a sharp crest between two of them comes to
    /// within two thirds of a radius of the axis before contact, above 2 it may be missed. On walls without sharp
    /// crests a few radii save time at little loss.
    pub contact_spacing_radii: f64,
    /// Contact between loops of the device. Off by default, since most vessels are too narrow for loops; switch it on
    /// where a loop has room.
    pub self_contact: bool,
    /// Coefficient of friction between loops, and with detached coils; about 0.2 for platinum on platinum in blood.
    pub self_friction: f64,
    /// Numbers of solver and contact that are choices; scene files cannot set them.
    #[serde(skip)]
    pub tuning: Tuning,
}

impl KirchhoffOptions {
    /// The options for an accuracy.
    pub fn of(accuracy: Accuracy) -> Self {
        let (element_mm, contact_spacing_radii, tolerance) = match accuracy {
            Accuracy::Fast => (6.0, 1.5, 1e-4),
            Accuracy::Balanced => (4.0, 1.0, 1e-5),
            Accuracy::Fine => (2.0, 0.5, 1e-9),
        };
        Self {
            element_mm,
            contact_spacing_radii,
            tolerance,
            max_iterations: 500,
            self_contact: false,
            self_friction: 0.0,
            tuning: Tuning::default(),
        }
    }

    /// Checks them for a device in its surroundings.
    ///
    /// # Errors
    /// An element length that is not positive or leads to too many elements, and other values that are out of range or not
    /// possible together.
    pub(super) fn check(&self, surroundings: &Surroundings<'_>) -> Result<()> {
        let length_mm = surroundings.stack.length_mm();
        crate::error::in_range("method.element_mm", self.element_mm, length_mm)?;
        crate::error::in_range("method.tolerance", self.tolerance, LARGEST_TOLERANCE)?;
        let spacing_radii = self.contact_spacing_radii;
        crate::error::in_range("method.contact_spacing_radii", spacing_radii, LARGEST_CONTACT_SPACING_RADII)?;
        if length_mm / self.element_mm > ELEMENT_LIMIT {
            return Err(Error::parameter(
                "method.element_mm",
                self.element_mm,
                format!(
                    "cuts the device of {length_mm} mm into {:.1e} elements, and more than {ELEMENT_LIMIT:.0e} take gigabytes: use \
                     longer elements or a shorter device",
                    length_mm / self.element_mm
                ),
            ));
        }
        let points: usize = surroundings.stack.devices().map(|device| self.fineness().points(device)).sum();
        if points > POINT_LIMIT {
            let remedy = format!(
                "makes {points} contact points along the device, and more than {POINT_LIMIT} take gigabytes: allow them farther apart"
            );
            return Err(Error::parameter("method.contact_spacing_radii", spacing_radii, remedy));
        }
        if self.self_contact {
            crate::contact::pairs::check_built("method.self_contact = true")?;
        }
        if self.self_contact && surroundings.motion.is_some() {
            let remedy =
                "a vessel that moves may take loops along through each other: leave it or vessel.motion out";
            return Err(Error::parameter("method.self_contact", true, remedy));
        }
        crate::contact::check_friction("method.self_friction", self.self_friction)?;
        if self.self_friction > 0.0 && !self.self_contact {
            let remedy = "nothing touches itself that could rub: set method.self_contact = true as well";
            return Err(Error::parameter("method.self_friction", self.self_friction, remedy));
        }
        if self.max_iterations == 0 {
            return Err(Error::parameter("method.max_iterations", 0, "allow at least one"));
        }
        Ok(())
    }

    /// The resolution of the mesh.
    pub(super) fn fineness(&self) -> Fineness {
        let Self { element_mm, contact_spacing_radii, .. } = *self;
        Fineness { element_mm, contact_spacing_radii, tuning: self.tuning.mesh }
    }
}

impl Default for KirchhoffOptions {
    fn default() -> Self {
        Self::of(Accuracy::default())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::methods::OwnMethod;

    #[test]
    fn an_accuracy_sets_what_is_not_said() {
        let read = |text: &str| toml::from_str::<OwnMethod>(text);
        let options = |text: &str| {
            let OwnMethod::Kirchhoff(options) = read(&format!("name = \"kirchhoff\"\n{text}")).unwrap();
            options
        };
        assert_eq!(options(""), KirchhoffOptions::default());
        for (name, accuracy) in
            [("fast", Accuracy::Fast), ("balanced", Accuracy::Balanced), ("fine", Accuracy::Fine)]
        {
            let of = KirchhoffOptions::of(accuracy);
            assert_eq!(options(&format!("accuracy = {name:?}")), of);
            let own = options(&format!("accuracy = {name:?}\nelement_mm = 3.0"));
            assert_eq!(own, KirchhoffOptions { element_mm: 3.0, ..of });
        }
        let wrong = read("name = \"kirchhoff\"\naccuracy = \"best\"").unwrap_err().to_string();
        assert!(wrong.contains("balanced"), "{wrong}");
        assert!(read("name = \"kirchhoff\"\nelement = 2.0").is_err());
    }
}
