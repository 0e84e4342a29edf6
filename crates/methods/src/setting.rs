//! Overrides values of a scene's keys, for a sweep or the command line.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;

use endowire_core::file::{FileSystem, Files};
use endowire_core::input::{from_toml_of, plain};
use endowire_core::{Error, Result};
use toml::{Table, Value};

use crate::Scene;
use crate::key::Key;

/// A key of a scene and its value, `KEY=VALUE`. The key is as in a sweep, the value as in the scene file; text needs
/// no quotes.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// The key.
    pub key: Key,
    /// Its value.
    pub value: Value,
}

impl FromStr for Setting {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let Some((key, value)) = text.split_once('=') else {
            let remedy = "write KEY=VALUE, as in vessel.wall.friction=0.1";
            return Err(Error::parameter("set", format!("{text:?}"), remedy));
        };
        let (key, value) = (Key::parse(key.trim())?, value.trim());
        // What is not a TOML value is text: names of methods and files.
        let document = toml::from_str::<Table>(&format!("value = {value}"));
        let document = document.ok().filter(|document| document.len() == 1);
        let read = document.and_then(|mut document| document.remove("value"));
        Ok(Self { key, value: read.unwrap_or_else(|| Value::from(value)) })
    }
}

impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.key, self.value)
    }
}

/// Reads a scene with these values of its keys, set one after the other; keys of a device file come last, since the
/// file itself may be set. `check` checks what the core leaves to others.
///
/// The scene's text includes all values set: its hash differs from the file's, and equals that of a sweep's run with
/// the same values.
///
/// # Errors
/// Those of the file; a key unknown to the scene, with the most similar valid one, and an invalid value.
pub fn scene_with(path: &Path, settings: &[Setting], check: impl Fn(&Scene) -> Result<()>) -> Result<Scene> {
    scene_with_of(Arc::new(FileSystem), path, settings, check)
}

/// As [`scene_with`], for a scene in `files`, with the files that it names.
///
/// # Errors
/// As [`scene_with`].
pub fn scene_with_of(
    files: Arc<dyn Files>,
    path: &Path,
    settings: &[Setting],
    check: impl Fn(&Scene) -> Result<()>,
) -> Result<Scene> {
    let scene = Scene::read_of(files.clone(), path)?;
    if settings.is_empty() {
        return Ok(scene);
    }
    check(&scene)?;
    let mut tables = SceneTables::of_file(scene.text(), path, files)?;
    let of_device = |setting: &&Setting| setting.key.is_of_device();
    let first = settings.iter().filter(|setting| !of_device(setting));
    for Setting { key, value } in first.chain(settings.iter().filter(of_device)) {
        let tried = tables.check(key, value, &check);
        tried.map_err(|error| match error {
            Error::Parameter { .. } => Error::content(path, format!("--set: {error}")),
            other => other,
        })?;
        tables.set(key, value)?;
    }
    tables.scene()
}

/// The tables of a scene file, to override values of keys.
#[derive(Debug, Clone)]
pub struct SceneTables {
    path: PathBuf,
    files: Arc<dyn Files>,
    tables: Value,
}

impl SceneTables {
    /// The tables of the text of the scene file `path`, which is in `files`.
    ///
    /// # Errors
    /// [`Error::Content`] if it is not TOML.
    pub fn of_file(text: &str, path: &Path, files: Arc<dyn Files>) -> Result<Self> {
        let tables = toml::from_str(text).map_err(|error| Error::content(path, plain(error.message())))?;
        Ok(Self { path: path.to_owned(), files, tables })
    }

    /// The path of the scene file; paths are relative to its folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Sets a key to a value. If the key belongs to a device file, its contents are copied into the scene.
    ///
    /// # Errors
    /// As [`Key::set`], and those of the device file.
    pub fn set(&mut self, key: &Key, value: &Value) -> Result<()> {
        if let Some(table) = key.device_table(&mut self.tables) {
            open_device(&self.path, &*self.files, table)?;
        }
        key.set(&mut self.tables, value.clone())
    }

    /// The tables, for changes beyond single keys.
    pub fn tables_mut(&mut self) -> &mut Value {
        &mut self.tables
    }

    /// Checks that the scene accepts this value, and `check` the scene.
    ///
    /// # Errors
    /// [`Error::Parameter`] with key and value if not.
    pub fn check(&self, key: &Key, value: &Value, check: impl Fn(&Scene) -> Result<()>) -> Result<()> {
        let mut tried = self.clone();
        tried.set(key, value)?;
        tried.scene().and_then(|scene| check(&scene)).map_err(|error| match error {
            Error::Content { reason, .. } => Error::parameter(key, value, without_line(&reason)),
            other => other,
        })
    }

    /// The scene of these tables.
    ///
    /// # Errors
    /// As [`Scene::from_toml`].
    pub fn scene(&self) -> Result<Scene> {
        Ok(Scene::from_toml(&self.text()?, &self.path)?.with_files(self.files.clone()))
    }

    /// The text of a scene file with these tables.
    ///
    /// # Errors
    /// [`Error::Content`] for what TOML cannot represent.
    pub fn text(&self) -> Result<String> {
        toml::to_string(&self.tables).map_err(|error| Error::content(&self.path, error.to_string()))
    }
}

/// Copies the contents of the device file into the table of the scene `path` that names it.
fn open_device(path: &Path, files: &dyn Files, table: &mut Table) -> Result<()> {
    let Some(Value::String(file)) = table.get("file") else { return Ok(()) };
    let file = path.parent().unwrap_or(Path::new("")).join(file);
    let (mut device, _): (Table, String) = from_toml_of(files, &file)?;
    // An instrument's table has its own name.
    device.remove("name");
    table.remove("file");
    table.extend(device);
    Ok(())
}

/// The reason without the line number, which refers to generated text.
fn without_line(reason: &str) -> &str {
    let rest = reason.strip_prefix("line ").and_then(|rest| rest.split_once(": "));
    rest.filter(|(number, _)| number.parse::<usize>().is_ok()).map_or(reason, |(_, rest)| rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &str = "[vessel]\nfile = \"a.stl\"\n[device]\nfile = \"wire.toml\"\n[sheath]\nopening = 0\n";
    const WIRE: &str = "name = \"wire\"\nkind = \"guidewire\"\n[[part]]\nname = \"tip\"\nlength_mm = 50.0\n\
                        outer_diameter_mm = 0.9\nbending_stiffness_nmm2 = 5.0\n[[part]]\nname = \"shaft\"\nlength_mm = 450.0\n\
                        outer_diameter_mm = 0.9\nbending_stiffness_nmm2 = 50.0\n";

    fn setting(text: &str) -> Setting {
        text.parse().unwrap()
    }

    fn with(settings: &[&str]) -> Result<Scene> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.toml");
        std::fs::write(&path, SCENE).unwrap();
        std::fs::write(folder.path().join("wire.toml"), WIRE).unwrap();
        std::fs::write(folder.path().join("other.toml"), WIRE.replace("450.0", "250.0")).unwrap();
        let settings: Vec<Setting> = settings.iter().map(|text| setting(text)).collect();
        let scene = scene_with(&path, &settings, |_| Ok(()))?;
        // The device is read while its file exists.
        scene.stack().map(|_| scene)
    }

    #[test]
    fn values_are_those_of_toml_or_text() {
        for (text, value) in [
            ("a.b=2", Value::from(2)),
            ("a.b = 2.5", Value::from(2.5)),
            ("a.b=true", Value::from(true)),
            ("a.b=li2011-banded", Value::from("li2011-banded")),
            ("a.b=\"2\"", Value::from("2")),
            ("a.b=[0.5, 1.0]", Value::from(vec![0.5, 1.0])),
            ("a.b=1\nc = 2", Value::from("1\nc = 2")),
            ("a.b=x=y", Value::from("x=y")),
        ] {
            assert_eq!(setting(text), Setting { key: Key::parse("a.b").unwrap(), value }, "{text}");
            assert_eq!(setting(&setting(text).to_string()), setting(text), "{text}");
        }
        for wrong in ["a.b", "=1", "a..b=1", ""] {
            assert!(
                wrong.parse::<Setting>().unwrap_err().to_string().contains("vessel.wall.friction"),
                "{wrong}"
            );
        }
    }

    #[test]
    fn parts_of_a_device_file_are_set_and_the_file_may_be_set_too() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.toml");
        std::fs::write(&path, SCENE).unwrap();
        std::fs::write(folder.path().join("wire.toml"), WIRE).unwrap();
        std::fs::write(folder.path().join("other.toml"), WIRE.replace("450.0", "250.0")).unwrap();
        let device = |settings: &[&str]| {
            let settings: Vec<Setting> = settings.iter().map(|text| setting(text)).collect();
            scene_with(&path, &settings, |_| Ok(())).unwrap().device().unwrap()
        };
        assert_eq!(device(&[]).length_mm(), 500.0);
        let stiffer = device(&["device.part[0].bending_stiffness_nmm2=7"]);
        assert_eq!(stiffer.sections()[0].bending_stiffness_nmm2, 7.0);
        assert_eq!(stiffer.sections()[1..], device(&[]).sections()[1..]);
        // In any order.
        let both = ["device.part[0].length_mm=60", "device.file=other.toml"];
        assert_eq!(device(&both).length_mm(), 310.0);
        assert_eq!(device(&[both[1], both[0]]), device(&both));
    }

    #[test]
    fn what_is_wrong_is_reported_with_key_value_and_the_nearest_right_one() {
        for (set, reported) in [
            ("vessel.wall.frction=0.1", "scene.toml: --set: vessel.wall.frction = 0.1: "),
            ("vessel.wall.frction=0.1", "did you mean `friction`?"),
            ("vesel.wall.friction=0.1", "did you mean `vessel`?"),
            (
                "vessel.wall.friction=much",
                "vessel.wall.friction = \"much\": friction: must be a number, not the text \"much\"",
            ),
            ("device.part[2].length_mm=1", "the scene has 2 in that list"),
            ("device.prt[0].length_mm=1", "did you mean `part[0]`?"),
            ("device.part[0].lenth_mm=1", "did you mean `length_mm`?"),
            // Only where the device is made: another key has the same effect.
            (
                "device.part[0].radius_mm=0.4",
                "device.part \"tip\".outer_diameter_mm = 0.9: radius_mm is given too",
            ),
        ] {
            let error = with(&[set]).unwrap_err().to_string();
            assert!(error.contains(reported), "{set}: {error}");
        }
    }

    #[test]
    fn what_is_set_is_in_the_text_of_the_scene() {
        let text = |settings: &[&str]| with(settings).unwrap().text().to_owned();
        assert_eq!(text(&[]), SCENE);
        let soft = text(&["vessel.wall.friction=0.1"]);
        assert!(soft.contains("friction = 0.1") && soft != text(&["vessel.wall.friction=0.2"]));
        let part = text(&["device.part[0].bending_stiffness_nmm2=7"]);
        assert!(part.contains("bending_stiffness_nmm2 = 7") && !part.contains("wire.toml"), "{part}");
    }
}
