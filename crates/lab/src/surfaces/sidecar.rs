//! The surfaces of a folder, with additional data.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use endowire_core::input::{from_toml, parse_toml};
use endowire_core::scene::SheathSpec;
use endowire_core::vessel::{PatientAxes, SurfaceFrame, SurfaceMesh};
use endowire_core::{Error, Result};

use super::{Cell, WIRES, Wire, cells, matches};

/// One number, or several.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged)]
enum OneOrMore {
    One(f64),
    More(Vec<f64>),
}

impl OneOrMore {
    fn list(&self) -> Vec<f64> {
        match self {
            Self::One(value) => vec![*value],
            Self::More(values) => values.clone(),
        }
    }
}

/// `NAME.toml` for a surface: data that its file lacks. Every key is optional.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Sidecar {
    unit_mm: Option<OneOrMore>,
    /// Axes of the file, `LPS` or `RAS`; if absent, as in its header, or LPS.
    axes: Option<PatientAxes>,
    /// `[sheath]`: `opening` (and `depth_mm`), or `position_mm` and `direction`, as in a scene.
    pub sheath: Option<SheathSpec>,
    /// Length to insert, mm.
    pub length_mm: Option<f64>,
    device_radius_mm: Option<OneOrMore>,
}

impl Sidecar {
    /// `unit_mm`: millimetres per unit of the file, a number or a list; 1 if absent.
    pub(crate) fn units_mm(&self) -> Vec<f64> {
        self.unit_mm.as_ref().map_or_else(|| vec![1.0], OneOrMore::list)
    }

    /// `device_radius_mm`: radii of the wires to insert, instead of the default ones.
    pub fn radii_mm(&self) -> Option<Vec<f64>> {
        self.device_radius_mm.as_ref().map(OneOrMore::list)
    }

    /// Reads a sidecar from TOML text and checks it; `name` is its name in errors.
    ///
    /// # Errors
    /// Names line and key of a value of the wrong form, or key and value of an impossible one.
    pub fn from_toml(text: &str, name: &Path) -> Result<Self> {
        parse_toml::<Self>(text, name)?.checked(name)
    }

    fn checked(self, name: &Path) -> Result<Self> {
        self.check().map_err(|e| Error::content(name, e.to_string()))?;
        Ok(self)
    }

    /// Rejects impossible values.
    fn check(&self) -> Result<()> {
        let units = self.units_mm();
        let radii = self.radii_mm();
        for (name, list) in [("unit_mm", Some(&units)), ("device_radius_mm", radii.as_ref())] {
            let Some(list) = list else { continue };
            if list.is_empty() || !list.iter().all(|v| v.is_finite() && *v > 0.0) {
                return Err(Error::parameter(name, format!("{list:?}"), "give one or more numbers above 0"));
            }
        }
        if let Some(length_mm) = self.length_mm {
            endowire_core::error::in_range("length_mm", length_mm, 1e4)?;
        }
        match &self.sheath {
            Some(SheathSpec { position_mm: Some(position), .. }) if units.len() > 1 => Err(Error::parameter(
                "sheath.position_mm",
                format!("{position:?}"),
                "is a place at one unit_mm: give one, or a second surface file",
            )),
            _ => Ok(()),
        }
    }
}

/// A surface to insert into, not yet read.
#[derive(Debug, Clone)]
pub struct SurfaceFile {
    /// The surface.
    pub path: PathBuf,
    /// File name, with `@UNIT` where the sidecar gives several units.
    pub name: String,
    /// Its coordinate frame.
    pub frame: SurfaceFrame,
    /// Its additional data.
    pub sidecar: Sidecar,
}

impl SurfaceFile {
    /// The wires that are tried in it, whether they fit or not.
    pub fn wires(&self) -> Vec<Wire> {
        match self.sidecar.radii_mm() {
            Some(radii) => radii.into_iter().map(Wire::of_radius).collect(),
            None => WIRES.to_vec(),
        }
    }

    /// Whether it may have a cell that a pattern matches, known before the surface is read.
    pub fn may_match(&self, pattern: &str, full: bool) -> bool {
        let wires = self.wires();
        // Which cells a wire has depends on how many of the thinner ones fit.
        let cells = cells(wires.len().max(2), full);
        let named = |wire: &Wire, cell: &Cell| format!("{} {} {}", self.name, wire.name(), cell.name());
        wires.iter().any(|wire| cells.iter().any(|cell| matches(&named(wire, cell), pattern)))
    }
}

/// The surfaces of a folder in the order of their names, with their sidecars.
///
/// # Errors
/// A folder that cannot be read or contains no surface, or an invalid sidecar.
pub fn surfaces_in(folder: &Path) -> Result<Vec<SurfaceFile>> {
    let failed = |e| Error::file(folder, e);
    let mut paths = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if SurfaceMesh::is_named_by(&path) {
            paths.push(path);
        }
    }
    paths.sort();
    if paths.is_empty() {
        return Err(Error::content(
            folder,
            "holds no surface: give a folder of .stl, .obj, .ply, .vtp or .vtk files",
        ));
    }
    let mut files = Vec::new();
    for path in paths {
        let beside = path.with_extension("toml");
        let sidecar = if beside.exists() {
            from_toml::<Sidecar>(&beside)?.0.checked(&beside)?
        } else {
            Sidecar::default()
        };
        let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let units = sidecar.units_mm();
        for &unit_mm in &units {
            let name = if units.len() > 1 { format!("{name}@{unit_mm}") } else { name.clone() };
            let frame = SurfaceFrame { unit_mm, axes: sidecar.axes };
            files.push(SurfaceFile { path: path.clone(), name, frame, sidecar: sidecar.clone() });
        }
    }
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn surfaces_come_in_order_with_what_is_said_of_them() {
        let folder = tempfile::tempdir().unwrap();
        assert!(surfaces_in(folder.path()).unwrap_err().to_string().contains("holds no surface"));
        for name in ["b.obj", "a.STL", "c.vtp", "d.vtk", "notes.txt"] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        let said = |text: &str| std::fs::write(folder.path().join("b.toml"), text).unwrap();
        said(
            "unit_mm = [1, 3.0]\naxes = \"RAS\"\nlength_mm = 20.0\ndevice_radius_mm = 0.3\n[sheath]\nopening = 2",
        );
        let files = surfaces_in(folder.path()).unwrap();
        let names: Vec<&str> = files.iter().map(|f| f.name.as_str()).collect();
        assert_eq!(names, ["a.STL", "b.obj@1", "b.obj@3", "c.vtp", "d.vtk"]);
        assert_eq!(files[2].frame, SurfaceFrame { unit_mm: 3.0, axes: Some(PatientAxes::Ras) });
        assert_eq!(files[3].frame, 1.0.into());
        assert_eq!(files[2].sidecar.radii_mm(), Some(vec![0.3]));
        // A pattern is known to match none before anything is read, which would fail here.
        let may_match = |pattern: &str| files.iter().filter(|file| file.may_match(pattern, false)).count();
        assert_eq!((may_match("a.STL step0.5 mu0.1"), may_match("@3 el2"), may_match("")), (1, 0, 5));
        assert_eq!((may_match("*@3 el2"), may_match("0.014"), may_match("0.035 k1 step3")), (1, 3, 0));
        for (text, at_fault) in [
            ("unit_mm = []", "unit_mm"),
            ("device_radius_mm = -1.0", "device_radius_mm"),
            ("lenght_mm = 1.0", "did you mean `length_mm`"),
            ("length_mm = 0.0", "length_mm"),
            ("axes = \"RSA\"", "axes"),
            ("unit_mm = [1, 2]\n[sheath]\nposition_mm = [0, 0, 0]\ndirection = [0, 0, 1]", "one unit_mm"),
        ] {
            said(text);
            let message = surfaces_in(folder.path()).unwrap_err().to_string();
            assert!(message.contains("b.toml") && message.contains(at_fault), "{message}");
        }
    }
}
