//! The numbers by which results are differentiated, and that fits and designs change.

use std::sync::Arc;

use crate::contact::WallProperties;
use crate::device::{Device, Stack};
use crate::error::nearest_name;
use crate::field::Field;
use crate::methods::Sheath;
use crate::{Error, Result};

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
    /// Outer radius of a section, mm. The felt wall stays as it is.
    Radius {
        /// The instrument.
        instrument: usize,
        /// The section.
        section: usize,
    },
    /// Coordinate of the sheath's mouth, mm.
    EntryPosition {
        /// 0, 1 or 2: x, y or z.
        axis: usize,
    },
    /// Component of the sheath's direction, which is made of unit length again; devices roll with it by the smallest rotation.
    EntryDirection {
        /// 0, 1 or 2: x, y or z.
        axis: usize,
    },
    /// Component of a field after the command: of a magnet's field, T, or of a weight, N/mm.
    Field {
        /// Number of the field.
        field: usize,
        /// 0, 1 or 2: x, y or z.
        axis: usize,
    },
    /// Foundation modulus of the wall, N/mm²; with it those of its regions change in proportion.
    WallModulus,
    /// Coefficient of friction of the wall, where it is the same everywhere.
    WallFriction,
}

/// Parameters that change together, each so much per unit of the change.
pub(crate) type Together = Vec<(Parameter, f64)>;

/// The parts of a scene that parameters change.
#[derive(Debug, Clone)]
pub(crate) struct Parts {
    pub(crate) stack: Stack,
    pub(crate) wall: WallProperties,
    pub(crate) sheath: Sheath,
    /// The fields after the command.
    pub(crate) fields: Arc<[Arc<dyn Field>]>,
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
            | Self::RestCurvature { instrument, .. }
            | Self::Radius { instrument, .. } => Some(instrument),
            Self::EntryPosition { .. }
            | Self::EntryDirection { .. }
            | Self::Field { .. }
            | Self::WallModulus
            | Self::WallFriction => None,
        }
    }

    /// Its section, if it belongs to one.
    pub fn section(&self) -> Option<usize> {
        match *self {
            Self::BendingStiffness { section, .. }
            | Self::TorsionalStiffness { section, .. }
            | Self::RestCurvature { section, .. }
            | Self::Radius { section, .. } => Some(section),
            _ => None,
        }
    }

    /// The parameters that a word stands for, of these instruments.
    ///
    /// `advance`, `rotate`, `hand` (both) and `steer` are of the hand; `EI[0]`, `GJ[0]`, `rest_u[0]`, `rest_v[0]` and `rest[0]` (both) of
    /// the section of that number, the tip's 0, and so is `radius[0]`; `wall` is the modulus of the wall and `friction` its coefficient;
    /// `entry_x`, `entry_y`, `entry_z` are coordinates of the sheath's mouth, `direction_x`, … components of its direction, `field_x[0]`, … those of
    /// the field of that number, and `entry`, `direction` and `field[0]` all three. Those of an
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
        if let Some(of_place) = Self::of_place(word) {
            return Ok(of_place);
        }
        // A full stop between brackets ends no name.
        let (instrument, rest) = match word[..word.rfind('[').unwrap_or(word.len())].rfind('.') {
            Some(end) => (stack.find(&word[..end])?, &word[end + 1..]),
            None => (0, word),
        };
        let numbered = rest.strip_suffix(']').and_then(|rest| rest.split_once('['));
        let section = numbered.and_then(|(_, digits)| number(digits));
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
            ("radius", Some(section)) => vec![Self::Radius { instrument, section }],
            (name, _) => {
                let nearest = nearest_name(WORDS.iter().map(|(word, _)| *word), name).unwrap_or("advance");
                let remedy = match WORDS.iter().find(|(word, _)| *word == nearest) {
                    Some((word, true)) => {
                        format!("did you mean \"{word}[0]\", with a number, the first is 0?")
                    }
                    _ => format!("did you mean {nearest:?}?"),
                };
                return Err(Error::parameter(NAME, format!("{word:?}"), remedy));
            }
        })
    }

    /// The parameters that have x, y and z, of a word.
    fn of_place(word: &str) -> Option<Vec<Self>> {
        let (name, number) = match word.strip_suffix(']').and_then(|word| word.split_once('[')) {
            Some((name, digits)) => (name, Some(number(digits)?)),
            None => (word, None),
        };
        let (kind, axes) = match AXES.iter().position(|axis| name.ends_with(&format!("_{axis}"))) {
            Some(axis) => (&name[..name.len() - 2], axis..axis + 1),
            None => (name, 0..AXES.len()),
        };
        let of: &dyn Fn(usize) -> Self = match (kind, number) {
            ("entry", None) => &|axis| Self::EntryPosition { axis },
            ("direction", None) => &|axis| Self::EntryDirection { axis },
            ("field", Some(field)) => &move |axis| Self::Field { field, axis },
            _ => return None,
        };
        Some(axes.map(of).collect())
    }

    /// The word for it. An instrument that these do not have is named by its number.
    pub fn name(&self, stack: &Stack) -> String {
        let word = self.word();
        match self.instrument() {
            None | Some(0) => word,
            Some(index) => match stack.instruments().get(index) {
                Some(instrument) => format!("{}.{word}", instrument.name),
                None => format!("{index}.{word}"),
            },
        }
    }

    /// The word for it, without the name of an instrument.
    fn word(&self) -> String {
        match *self {
            Self::Advance { .. } => "advance".to_owned(),
            Self::Rotation { .. } => "rotate".to_owned(),
            Self::Steering { .. } => "steer".to_owned(),
            Self::BendingStiffness { section, .. } => format!("EI[{section}]"),
            Self::TorsionalStiffness { section, .. } => format!("GJ[{section}]"),
            Self::RestCurvature { section, direction, .. } => {
                format!("rest_{}[{section}]", ["u", "v"][direction.min(1)])
            }
            Self::Radius { section, .. } => format!("radius[{section}]"),
            Self::EntryPosition { axis } => format!("entry_{}", AXES[axis.min(2)]),
            Self::EntryDirection { axis } => format!("direction_{}", AXES[axis.min(2)]),
            Self::Field { field, axis } => format!("field_{}[{field}]", AXES[axis.min(2)]),
            Self::WallModulus => "wall".to_owned(),
            Self::WallFriction => "friction".to_owned(),
        }
    }

    /// Refuses a parameter that occurs twice.
    pub(crate) fn check_each_once<'a>(all: impl IntoIterator<Item = &'a Self>) -> Result<()> {
        let mut known: Vec<&Self> = Vec::new();
        for one in all {
            if known.contains(&one) {
                return Err(one.refused("it occurs twice: give it once"));
            }
            known.push(one);
        }
        Ok(())
    }

    /// Its value in a scene with these parts; none if it is one of a command.
    ///
    /// # Errors
    /// An instrument, a section, an axis or a field that does not exist, and what instruments without material angles do not have.
    pub(crate) fn value(&self, parts: &Parts) -> Result<Option<f64>> {
        let Parts { stack, wall, sheath, fields } = parts;
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
        let along = |values: [f64; 3], axis: usize| {
            let value = values.get(axis).copied();
            value.ok_or_else(|| self.refused("its axis is 0, 1 or 2"))
        };
        Ok(match (*self, section) {
            (Self::BendingStiffness { .. }, Some(section)) => Some(section.bending_stiffness_nmm2),
            (Self::Radius { .. }, Some(section)) => Some(section.radius_mm),
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
            (Self::EntryPosition { axis }, _) => Some(along(sheath.position_mm.into(), axis)?),
            (Self::EntryDirection { axis }, _) => Some(along(sheath.direction.into(), axis)?),
            (Self::Field { field, axis }, _) => {
                let Some(acting) = fields.get(field) else {
                    if fields.is_empty() {
                        return Err(self.refused("no field acts: set one"));
                    }
                    return Err(self.refused(format!("there are {} fields, the first is 0", fields.len())));
                };
                let spec = acting.spec();
                let spec = spec
                    .ok_or_else(|| self.refused("its numbers are known to itself alone: set another one"))?;
                Some(along(spec.vector(), axis)?)
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

    /// Sets its value in parts that have it; one of a command has none.
    ///
    /// # Errors
    /// A direction or a field that cannot be.
    pub(crate) fn set(&self, parts: &mut Parts, value: f64) -> Result<()> {
        if let Some(place) = self.instrument().zip(self.section()) {
            parts.stack.change_section(place, |section| match *self {
                Self::BendingStiffness { .. } => section.bending_stiffness_nmm2 = value,
                Self::TorsionalStiffness { .. } => section.torsional_stiffness_nmm2 = Some(value),
                Self::RestCurvature { direction, .. } => section.rest_curvature_per_mm[direction] = value,
                Self::Radius { .. } => section.radius_mm = value,
                _ => {}
            });
        }
        let sheath = parts.sheath;
        match *self {
            Self::WallModulus => parts.wall.modulus_n_per_mm2 = value,
            Self::WallFriction => parts.wall.friction = value,
            Self::EntryPosition { axis } => {
                let mut position_mm = sheath.position_mm;
                position_mm[axis] = value;
                let moved = Sheath::new(position_mm, sheath.direction)?;
                parts.sheath = Sheath { position_mm: moved.position_mm, ..sheath };
            }
            Self::EntryDirection { axis } => {
                let mut along = sheath.direction;
                along[axis] = value;
                let direction = Sheath::new(sheath.position_mm, along)?.direction;
                if direction.dot(&sheath.direction) <= 0.0 {
                    return Err(self.refused("the sheath would point backwards: give a smaller change"));
                }
                let bends_towards = Some(sheath.frame().transported_to(&direction).u);
                parts.sheath = Sheath { direction, bends_towards, ..sheath };
            }
            Self::Field { field, axis } => {
                let mut fields = parts.fields.to_vec();
                if let Some(mut spec) = fields[field].spec() {
                    let mut vector = spec.vector();
                    vector[axis] = value;
                    spec.set_vector(vector);
                    fields[field] = spec.field()?;
                }
                parts.fields = fields.into();
            }
            _ => {}
        }
        Ok(())
    }

    /// An error about it.
    pub(crate) fn refused(&self, remedy: impl Into<String>) -> Error {
        let word = format!("{:?}", self.word());
        let value = match self.instrument() {
            None | Some(0) => word,
            Some(index) => format!("{word} of instrument {index}"),
        };
        Error::parameter(NAME, value, remedy.into())
    }
}

/// What errors call a parameter: several calls take them, each under another name.
const NAME: &str = "parameter";

/// A number between brackets, as it is written by [`Parameter::name`].
fn number(digits: &str) -> Option<usize> {
    digits.parse().ok().filter(|number: &usize| number.to_string() == digits)
}

/// Axes of coordinates.
const AXES: [&str; 3] = ["x", "y", "z"];

/// Words for parameters, and whether a number follows.
const WORDS: [(&str, bool); 21] = [
    ("advance", false),
    ("rotate", false),
    ("hand", false),
    ("steer", false),
    ("EI", true),
    ("GJ", true),
    ("rest_u", true),
    ("rest_v", true),
    ("rest", true),
    ("radius", true),
    ("field", true),
    ("field_x", true),
    ("field_y", true),
    ("field_z", true),
    ("entry", false),
    ("entry_x", false),
    ("entry_y", false),
    ("entry_z", false),
    ("direction", false),
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
        let words = "advance rotate steer EI[0] GJ[3] rest_u[0] rest_v[12] radius[1] wall friction entry_x entry_z direction_y field_z[2]";
        for word in words.split(' ').chain(["microcatheter 2.4.EI[1]", "microcatheter 2.4.advance"]) {
            let [one] = Parameter::named(word, &stack).unwrap()[..] else { panic!("{word}") };
            assert_eq!(one.name(&stack), word);
        }
        assert_eq!(Parameter::named("wire.EI[1]", &stack).unwrap()[0].name(&stack), "EI[1]");
        assert_eq!(Parameter::named("hand", &stack).unwrap().len(), 2);
        assert_eq!(Parameter::named("rest[0]", &stack).unwrap().len(), 2);
        for word in ["entry", "direction", "field[1]"] {
            assert_eq!(Parameter::named(word, &stack).unwrap().len(), 3, "{word}");
        }
        let refused = |word: &str| Parameter::named(word, &stack).unwrap_err().to_string();
        assert!(refused("EI").contains("EI[0]") && refused("EI[x]").contains("EI[0]"), "{}", refused("EI"));
        assert!(refused("advanc").contains("\"advance\""), "{}", refused("advanc"));
        assert!(refused("field").contains("field[0]") && refused("entry_w").contains("entry"));
        assert!(refused("wier.advance").contains("wire"), "{}", refused("wier.advance"));
        // A number is written in one way, and a full stop in it begins no name.
        for word in ["EI[00]", "EI[+0]", "EI[0.0]", "EI[ 0]", "field[01]", "field_x[+1]", "wire.EI[1.0]"] {
            let error = refused(word);
            let kind = if word.contains("field") { "field" } else { "EI" };
            assert!(error.starts_with(&format!("parameter = {word:?}: did you mean \"{kind}")), "{error}");
        }
    }

    #[test]
    fn errors_call_parameters_by_their_words() {
        let device = Device::uniform(100.0, 0.3, 5.0).unwrap();
        let named = |name: &str| Instrument { name: name.to_owned(), device: device.clone(), may_lead: true };
        let stack = Stack::new(vec![named("wire"), named("catheter")]).unwrap();
        let field = Parameter::Field { field: 0, axis: 0 };
        assert_eq!(field.refused("no field acts").to_string(), "parameter = \"field_x[0]\": no field acts");
        let other = Parameter::BendingStiffness { instrument: 2, section: 1 };
        assert_eq!(other.refused("none").to_string(), "parameter = \"EI[1]\" of instrument 2: none");
        assert_eq!(other.name(&stack), "2.EI[1]", "of no instrument there");
        let first = Parameter::BendingStiffness { instrument: 0, section: 1 };
        assert!(Parameter::check_each_once([&first, &other, &field]).is_ok());
        let twice = Parameter::check_each_once([&first, &other, &first]).unwrap_err().to_string();
        assert_eq!(twice, "parameter = \"EI[1]\": it occurs twice: give it once");
    }
}
