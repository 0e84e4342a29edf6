//! Derivatives of what a command leads to.

use crate::contact::WallProperties;
use crate::device::{Device, Stack};
use crate::error::nearest_name;
use crate::methods::{Energy, StepReport};
use crate::shape::Shape;
use crate::{Error, Result, Vec3};

/// A number by which the result of a command is differentiated. Instruments are counted from the innermost, 0, and
/// sections from the tip, 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Parameter {
    /// Advance of an instrument's hand in the first command, mm.
    Advance {
        /// The instrument.
        instrument: usize,
    },
    /// Rotation of an instrument's hand in the first command, rad.
    Rotation {
        /// The instrument.
        instrument: usize,
    },
    /// Change of an instrument's steering in the first command.
    Steering {
        /// The instrument.
        instrument: usize,
    },
    /// Bending stiffness of a section, N·mm², of one with a soft plane that across it. Its torsional stiffness follows unless that is given.
    BendingStiffness {
        /// The instrument.
        instrument: usize,
        /// The section.
        section: usize,
    },
    /// Torsional stiffness of a section, N·mm².
    TorsionalStiffness {
        /// The instrument.
        instrument: usize,
        /// The section.
        section: usize,
    },
    /// Rest curvature of a section along its first (0) or second (1) material direction, 1/mm.
    RestCurvature {
        /// The instrument.
        instrument: usize,
        /// The section.
        section: usize,
        /// 0 or 1.
        direction: usize,
    },
    /// Foundation modulus of the wall, N/mm²; with it those of its regions change in proportion.
    WallModulus,
    /// Coefficient of friction of the wall, where it is the same everywhere.
    WallFriction,
}

/// Derivatives of what a command leads to, from a state that is given.
///
/// Contacts keep their status: those that press go on pressing, and each sticks or slips as far as friction lets it. What
/// would be needed for another status is the [`Margin`].
#[derive(Debug, Clone)]
pub struct Gradient {
    /// The report of the command.
    pub report: StepReport,
    /// The centre line after it.
    pub shape: Shape,
    /// One for each parameter, in their order.
    pub slopes: Vec<Slope>,
    /// How far the next change of a contact is.
    pub margin: Margin,
}

/// Derivatives in one parameter, per unit of it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Slope {
    /// Of the tip, mm.
    pub tip_mm: Vec3,
    /// Of the nodes of the [`Gradient::shape`], mm. All but the first are marks on the device and move with it.
    pub positions_mm: Vec<Vec3>,
    /// Of the push force of each hand, N; `None` where it jumps.
    pub push_force_n: Vec<Option<f64>>,
    /// Of the torque of each hand, N·mm.
    pub torque_nmm: Vec<f64>,
    /// Of the energy terms, mJ.
    pub energy: Energy,
    /// Of the normal forces of the contacts of the [`Gradient::report`], N. Empty if a contact opens or closes right there.
    pub contact_forces_n: Vec<f64>,
    /// Whether it is the slope on one side only: right there a contact opens or closes, or a node of the mesh comes in.
    pub one_sided: bool,
}

/// Distance to the next change of a contact.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Margin {
    /// The least force of a contact that presses, N: it opens without it. Infinite without contacts.
    pub least_force_n: f64,
    /// At least so far are points from the wall that do not touch it, mm. Infinite without any.
    pub least_gap_mm: f64,
}

impl Parameter {
    /// The instrument that it belongs to, if any.
    pub fn instrument(&self) -> Option<usize> {
        match *self {
            Self::Advance { instrument }
            | Self::Rotation { instrument }
            | Self::Steering { instrument }
            | Self::BendingStiffness { instrument, .. }
            | Self::TorsionalStiffness { instrument, .. }
            | Self::RestCurvature { instrument, .. } => Some(instrument),
            Self::WallModulus | Self::WallFriction => None,
        }
    }

    /// Its section, if it belongs to one.
    pub fn section(&self) -> Option<usize> {
        match *self {
            Self::BendingStiffness { section, .. }
            | Self::TorsionalStiffness { section, .. }
            | Self::RestCurvature { section, .. } => Some(section),
            _ => None,
        }
    }

    /// The parameters that a word stands for, of these instruments.
    ///
    /// `advance`, `rotate`, `hand` (both) and `steer` are of the hand; `EI[0]`, `GJ[0]`, `rest_u[0]`, `rest_v[0]` and `rest[0]` (both) of
    /// the section of that number, the tip's 0; `wall` is the modulus of the wall and `friction` its coefficient. Those of an
    /// instrument begin with its name and a full stop, `catheter.EI[1]`; without a name they are of the innermost.
    ///
    /// # Errors
    /// A word that means none of these, an unknown instrument.
    pub fn named(word: &str, stack: &Stack) -> Result<Vec<Self>> {
        match word {
            "wall" => return Ok(vec![Self::WallModulus]),
            "friction" => return Ok(vec![Self::WallFriction]),
            _ => {}
        }
        let (instrument, rest) = match word.rsplit_once('.') {
            Some((name, rest)) => (stack.find(name)?, rest),
            None => (0, word),
        };
        let numbered = rest.strip_suffix(']').and_then(|rest| rest.split_once('['));
        let section = numbered.and_then(|(_, number)| number.parse().ok());
        let curved = |section, direction| Self::RestCurvature { instrument, section, direction };
        Ok(match (numbered.map_or(rest, |(name, _)| name), section) {
            ("advance", None) => vec![Self::Advance { instrument }],
            ("rotate", None) => vec![Self::Rotation { instrument }],
            ("hand", None) => vec![Self::Advance { instrument }, Self::Rotation { instrument }],
            ("steer", None) => vec![Self::Steering { instrument }],
            ("EI", Some(section)) => vec![Self::BendingStiffness { instrument, section }],
            ("GJ", Some(section)) => vec![Self::TorsionalStiffness { instrument, section }],
            ("rest_u", Some(section)) => vec![curved(section, 0)],
            ("rest_v", Some(section)) => vec![curved(section, 1)],
            ("rest", Some(section)) => vec![curved(section, 0), curved(section, 1)],
            (name, _) => {
                let nearest = nearest_name(WORDS.iter().map(|(word, _)| *word), name).unwrap_or("advance");
                let remedy = match WORDS.iter().find(|(word, _)| *word == nearest) {
                    Some((word, true)) => {
                        format!("did you mean \"{word}[0]\", with the number of a section?")
                    }
                    _ => format!("did you mean {nearest:?}?"),
                };
                return Err(Error::parameter("gradient.by", format!("{word:?}"), remedy));
            }
        })
    }

    /// The word for it.
    pub fn name(&self, stack: &Stack) -> String {
        let of = |instrument: usize, word: String| match instrument {
            0 => word,
            _ => format!("{}.{word}", stack.instruments()[instrument].name),
        };
        match *self {
            Self::Advance { instrument } => of(instrument, "advance".to_owned()),
            Self::Rotation { instrument } => of(instrument, "rotate".to_owned()),
            Self::Steering { instrument } => of(instrument, "steer".to_owned()),
            Self::BendingStiffness { instrument, section } => of(instrument, format!("EI[{section}]")),
            Self::TorsionalStiffness { instrument, section } => of(instrument, format!("GJ[{section}]")),
            Self::RestCurvature { instrument, section, direction } => {
                of(instrument, format!("rest_{}[{section}]", ["u", "v"][direction.min(1)]))
            }
            Self::WallModulus => "wall".to_owned(),
            Self::WallFriction => "friction".to_owned(),
        }
    }

    /// Its value in a scene, of instruments and a wall in which it exists; none if it is one of a command.
    ///
    /// # Errors
    /// An instrument or a section that does not exist, and what instruments without material angles do not have.
    pub(crate) fn value(&self, stack: &Stack, wall: &WallProperties) -> Result<Option<f64>> {
        let device = match self.instrument() {
            Some(index) => {
                let Some(instrument) = stack.instruments().get(index) else {
                    let count = stack.instruments().len();
                    return Err(self.refused(format!("there are {count} instruments, the innermost is 0")));
                };
                Some(&instrument.device)
            }
            None => None,
        };
        let section = match (device, self.section()) {
            (Some(device), Some(index)) => {
                let Some(section) = device.sections().get(index) else {
                    let count = device.sections().len();
                    return Err(self.refused(format!("it has {count} sections, that of the tip is 0")));
                };
                Some(section)
            }
            _ => None,
        };
        let twists = self.instrument().is_some_and(|index| stack.sets()[index].is_some());
        Ok(match (*self, section) {
            (Self::BendingStiffness { .. }, Some(section)) => Some(section.bending_stiffness_nmm2),
            (Self::TorsionalStiffness { .. } | Self::RestCurvature { .. }, _) if !twists => {
                return Err(self.refused(
                    "it is straight and does not twist: without a rest curvature or friction it has no angles",
                ));
            }
            (Self::TorsionalStiffness { .. }, Some(section)) => Some(section.torsion_nmm2()),
            (Self::RestCurvature { direction, .. }, Some(section)) => {
                let value = section.rest_curvature_per_mm.get(direction);
                Some(*value.ok_or_else(|| self.refused("its direction is 0 or 1"))?)
            }
            (Self::WallModulus, _) => Some(wall.modulus_n_per_mm2),
            (Self::WallFriction, _) => {
                if wall.friction == 0.0 || wall.region.iter().any(|region| region.friction.is_some()) {
                    return Err(self.refused("it needs a wall with the same friction above 0 everywhere"));
                }
                Some(wall.friction)
            }
            (Self::Steering { .. }, _) if !device.is_some_and(Device::is_steerable) => {
                return Err(self.refused("it has no section that is steered"));
            }
            _ => None,
        })
    }

    /// Sets its value; one of a command has none.
    pub(crate) fn set(&self, stack: &mut Stack, wall: &mut WallProperties, value: f64) {
        if let Some(place) = self.instrument().zip(self.section()) {
            stack.change_section(place, |section| match *self {
                Self::BendingStiffness { .. } => section.bending_stiffness_nmm2 = value,
                Self::TorsionalStiffness { .. } => section.torsional_stiffness_nmm2 = Some(value),
                Self::RestCurvature { direction, .. } => section.rest_curvature_per_mm[direction] = value,
                _ => {}
            });
        }
        match self {
            Self::WallModulus => wall.modulus_n_per_mm2 = value,
            Self::WallFriction => wall.friction = value,
            _ => {}
        }
    }

    /// An error about it.
    pub(crate) fn refused(&self, remedy: impl Into<String>) -> Error {
        Error::parameter("gradient.by", format!("{self:?}"), remedy.into())
    }
}

/// Words for parameters, and whether the number of a section follows.
const WORDS: [(&str, bool); 11] = [
    ("advance", false),
    ("rotate", false),
    ("hand", false),
    ("steer", false),
    ("EI", true),
    ("GJ", true),
    ("rest_u", true),
    ("rest_v", true),
    ("rest", true),
    ("wall", false),
    ("friction", false),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::{Device, Instrument};

    #[test]
    fn words_stand_for_parameters_and_back() {
        let device = Device::uniform(100.0, 0.3, 5.0).unwrap();
        let named = |name: &str| Instrument { name: name.to_owned(), device: device.clone(), may_lead: true };
        let stack = Stack::new(vec![named("wire"), named("microcatheter 2.4")]).unwrap();
        let words = "advance rotate steer EI[0] GJ[3] rest_u[0] rest_v[12] wall friction";
        for word in words.split(' ').chain(["microcatheter 2.4.EI[1]", "microcatheter 2.4.advance"]) {
            let [one] = Parameter::named(word, &stack).unwrap()[..] else { panic!("{word}") };
            assert_eq!(one.name(&stack), word);
        }
        assert_eq!(Parameter::named("wire.EI[1]", &stack).unwrap()[0].name(&stack), "EI[1]");
        assert_eq!(Parameter::named("hand", &stack).unwrap().len(), 2);
        assert_eq!(Parameter::named("rest[0]", &stack).unwrap().len(), 2);
        let refused = |word: &str| Parameter::named(word, &stack).unwrap_err().to_string();
        assert!(refused("EI").contains("EI[0]") && refused("EI[x]").contains("EI[0]"), "{}", refused("EI"));
        assert!(refused("advanc").contains("\"advance\""), "{}", refused("advanc"));
        assert!(refused("wier.advance").contains("wire"), "{}", refused("wier.advance"));
    }
}
