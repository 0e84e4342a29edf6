//! Keys of a scene file, and setting their values.

use std::fmt;

use endowire_core::error::nearest_name;
use endowire_core::{Error, Result};
use toml::{Table, Value};

/// Keys of a scene file that are lists of tables, for hints.
const LISTS: [&str; 6] = ["script", "instrument", "section", "part", "motion", "injection"];
/// Keys of a device file that may also be in a table of the scene.
const OF_DEVICES: [&str; 5] = ["kind", "length_mm", "length_cm", "section", "part"];

/// A key of a scene file in a sweep's notation: names separated by dots, and the index of one of several tables in
/// brackets, as in `device.section[0].radius_mm`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Key {
    text: String,
    parts: Vec<Part>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
enum Part {
    Name(String),
    Index(usize),
}

impl Key {
    /// Parses a key.
    ///
    /// # Errors
    /// [`Error::Parameter`] for text that is not a key.
    pub fn parse(text: &str) -> Result<Self> {
        let parts: Option<Vec<Vec<Part>>> = text.split('.').map(part).collect();
        match parts {
            Some(parts) => Ok(Self { text: text.to_owned(), parts: parts.concat() }),
            None => {
                let remedy =
                    "write a key of the scene as in vessel.wall.friction or device.section[0].radius_mm";
                Err(Error::parameter("key", format!("{text:?}"), remedy))
            }
        }
    }

    /// Its first name: that of a table or key of the scene.
    pub fn begins(&self) -> &str {
        match self.parts.first() {
            Some(Part::Name(name)) => name,
            _ => "",
        }
    }

    /// Whether it names the other key or its ancestor: setting it replaces the other's value.
    pub fn holds(&self, other: &Self) -> bool {
        other.parts.starts_with(&self.parts)
    }

    /// Whether it may be in a device file.
    pub fn is_of_device(&self) -> bool {
        let of = |key: &Part| matches!(key, Part::Name(key) if OF_DEVICES.contains(&key.as_str()));
        match self.parts.as_slice() {
            [Part::Name(first), key, ..] if first == "device" => of(key),
            [Part::Name(first), Part::Index(_), key, ..] if first == "instrument" => of(key),
            _ => false,
        }
    }

    /// The table of `scene` for the device or instrument of the key, if it may be in a device file.
    pub(crate) fn device_table<'a>(&self, scene: &'a mut Value) -> Option<&'a mut Table> {
        let table = scene.get_mut(self.begins()).filter(|_| self.is_of_device())?;
        match self.parts.get(1) {
            Some(Part::Index(index)) => table.get_mut(*index)?.as_table_mut(),
            _ => table.as_table_mut(),
        }
    }

    /// Sets the key of `scene` to a value; missing tables are created.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a path through something that is not a table, or to a nonexistent one of several.
    pub fn set(&self, scene: &mut Value, value: Value) -> Result<()> {
        let mut place = scene;
        let mut last = "";
        for part in &self.parts {
            place = match (part, place) {
                (Part::Name(name), Value::Table(table)) => {
                    table.entry(name.as_str()).or_insert_with(|| Value::Table(Table::new()))
                }
                (Part::Index(index), Value::Array(list)) => {
                    let count = list.len();
                    list.get_mut(*index).ok_or_else(|| {
                        let remedy = format!("the scene has {count} in that list, and [0] is the first");
                        Error::parameter(&self.text, &value, remedy)
                    })?
                }
                (Part::Name(name), _) => {
                    let remedy = format!("what {name} should lie in is no table of the scene");
                    return Err(Error::parameter(&self.text, &value, remedy));
                }
                (Part::Index(index), _) => {
                    let mut remedy = format!("the scene has no list where [{index}] is asked for");
                    if let Some(name) = nearest_name(LISTS.into_iter(), last).filter(|name| *name != last) {
                        remedy += &format!(" – did you mean `{name}[{index}]`?");
                    }
                    return Err(Error::parameter(&self.text, &value, remedy));
                }
            };
            if let Part::Name(name) = part {
                last = name;
            }
        }
        *place = value;
        Ok(())
    }
}

/// The name of one part of a key, and the indices after it.
fn part(text: &str) -> Option<Vec<Part>> {
    let (name, numbers) = text.find('[').map_or((text, ""), |at| text.split_at(at));
    let is_name = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-');
    if name.is_empty() || !name.chars().all(is_name) {
        return None;
    }
    let mut parts = vec![Part::Name(name.to_owned())];
    let mut rest = numbers;
    while !rest.is_empty() {
        let (number, behind) = rest.strip_prefix('[')?.split_once(']')?;
        parts.push(Part::Index(number.parse().ok()?));
        rest = behind;
    }
    Some(parts)
}

impl fmt::Display for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene() -> Value {
        Value::Table(toml::from_str("seed = 1\n[[script]]\nadvance_mm = 1.0\n[[script]]\n").unwrap())
    }

    #[test]
    fn a_key_is_set_where_it_is_and_made_where_it_is_not() {
        let mut scene = scene();
        for (key, value) in [("seed", 7), ("script[1].rotate_deg", 8), ("vessel.wall.friction", 9)] {
            Key::parse(key).unwrap().set(&mut scene, value.into()).unwrap();
        }
        assert_eq!(scene["seed"].as_integer(), Some(7));
        assert_eq!(scene["script"][0]["advance_mm"].as_float(), Some(1.0));
        assert_eq!(scene["script"][1]["rotate_deg"].as_integer(), Some(8));
        assert_eq!(scene["vessel"]["wall"]["friction"].as_integer(), Some(9));
    }

    #[test]
    fn a_key_holds_itself_and_what_lies_in_it() {
        let key = |text: &str| Key::parse(text).unwrap();
        for (outer, inner, holds) in [
            ("vessel.wall", "vessel.wall", true),
            ("vessel.wall", "vessel.wall.friction", true),
            ("script", "script[1].advance_mm", true),
            ("script[01]", "script[1].advance_mm", true),
            ("vessel.wall.friction", "vessel.wall", false),
            ("vessel.wall", "vessel.wall_mm", false),
            ("script[1]", "script[2]", false),
        ] {
            assert_eq!(key(outer).holds(&key(inner)), holds, "{outer} {inner}");
        }
    }

    #[test]
    fn what_is_no_key_or_leads_nowhere_is_refused() {
        for wrong in ["", "a..b", "a[", "a[x]", "a[1", "[0]", "a b", "a[0]b"] {
            assert!(Key::parse(wrong).unwrap_err().to_string().contains("vessel.wall.friction"), "{wrong}");
        }
        for (key, reported) in [
            ("script[2].advance_mm", "script[2].advance_mm = 1: the scene has 2"),
            ("seed.first", "seed.first = 1: what first should lie in is no table"),
            ("device.section[0]", "device.section[0] = 1: the scene has no list where [0] is asked for"),
            (
                "device.prt[0].a",
                "device.prt[0].a = 1: the scene has no list where [0] is asked for – did you mean `part[0]`?",
            ),
        ] {
            let error = Key::parse(key).unwrap().set(&mut scene(), 1.into()).unwrap_err().to_string();
            assert!(error.starts_with(reported), "{error}");
        }
    }
}
