//! `endowire device`: device files as tables and pictures.

mod picture;
pub(super) mod table;

use std::path::{Path, PathBuf};

use endowire_core::device::{DeviceFile, Kind, Section};
use endowire_viewer::device_parts;
use serde::Serialize;

use self::table::{PartRow, columns, diameters};
use crate::failure::Failure;
use crate::output::provenance::{Provenance, read_input};
use crate::output::{answer, tell};
use crate::scenes;

/// The document of `device show`.
#[derive(Serialize)]
struct Shown {
    #[serde(flatten)]
    provenance: Provenance,
    file: String,
    name: String,
    kind: Option<Kind>,
    length_mm: f64,
    source: Option<String>,
    parts: Vec<PartRow>,
}

/// The document of `device list`.
#[derive(Serialize)]
struct Listed {
    #[serde(flatten)]
    provenance: Provenance,
    folder: String,
    devices: Vec<Row>,
}

/// One device of a folder.
#[derive(Serialize)]
struct Row {
    file: String,
    name: String,
    kind: Option<Kind>,
    length_mm: f64,
    /// Smallest and largest value.
    outer_diameter_mm: [f64; 2],
    /// Of the softest and the stiffest section.
    bending_stiffness_nmm2: [f64; 2],
    /// Length with a curved rest shape.
    shaped_mm: f64,
}

/// Reads a device file, and checks its materials, which the core does not know.
fn read(path: &Path) -> Result<DeviceFile, Failure> {
    let file = DeviceFile::read(path)?;
    device_parts(&file).map_err(|e| Failure::from(e).at(path.display()))?;
    Ok(file)
}

/// Shows one device, and draws it into `out` if given.
pub(crate) fn show(path: &Path, out: Option<&Path>, json: bool) -> Result<(), Failure> {
    let provenance = Provenance::new(&[&read_input(path)?], 0);
    let device = read(path)?;
    let parts = device.parts.iter().map(PartRow::new).collect();
    if let Some(out) = out {
        picture::one(out, &device)?;
        tell(format_args!("wrote {}", out.display()));
    }
    let document = Shown {
        provenance,
        file: path.display().to_string(),
        length_mm: device.device.length_mm(),
        name: device.name,
        kind: device.kind,
        source: device.source,
        parts,
    };
    answer(&document, json, || text_of_one(&document))
}

/// Lists the devices of a folder, and draws them into `out` if given.
pub(crate) fn list(folder: &Path, out: Option<&Path>, json: bool) -> Result<(), Failure> {
    let paths = scenes::files(folder)?;
    if paths.is_empty() {
        return Err(Failure::Input(format!("{}: has no device files (.toml)", folder.display())));
    }
    let inputs = paths.iter().map(|path| read_input(path)).collect::<Result<Vec<_>, _>>()?;
    let devices = paths.iter().map(|path| read(path)).collect::<Result<Vec<_>, _>>()?;
    let stem =
        |path: &PathBuf| path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let stems: Vec<String> = paths.iter().map(stem).collect();
    if let Some(out) = out {
        picture::sheet(out, &stems, &devices)?;
        tell(format_args!("wrote {}", out.display()));
    }
    let document = Listed {
        provenance: Provenance::new(&inputs, 0),
        folder: folder.display().to_string(),
        devices: stems.into_iter().zip(devices).map(|(file, device)| Row::new(file, device)).collect(),
    };
    answer(&document, json, || text_of_all(&document.devices))
}

impl Row {
    fn new(file: String, device: DeviceFile) -> Self {
        let sections = device.device.sections();
        let softest = sections.iter().map(Section::softest_nmm2).fold(f64::MAX, f64::min);
        let stiffest = sections.iter().map(|s| s.bending_stiffness_nmm2).fold(0.0, f64::max);
        Self {
            file,
            length_mm: device.device.length_mm(),
            outer_diameter_mm: [2.0 * device.device.min_radius_mm(), 2.0 * device.device.max_radius_mm()],
            bending_stiffness_nmm2: [softest, stiffest],
            shaped_mm: device.device.shaped_mm(),
            name: device.name,
            kind: device.kind,
        }
    }
}

fn text_of_one(document: &Shown) -> String {
    let kind = document.kind.map_or_else(String::new, |kind| format!(", {}", words(kind)));
    let mut lines = vec![format!("{}: {}{kind}, {} mm", document.file, document.name, document.length_mm)];
    lines.extend(document.source.iter().map(|source| format!("source: {source}")));
    lines.push(table::text(&document.parts));
    lines.join("\n")
}

fn text_of_all(devices: &[Row]) -> String {
    let head = ["file", "kind", "length mm", "OD mm", "OD F", "OD inch", "EI N·mm²", "shaped mm", "name"];
    let rows = devices.iter().map(|row| {
        let [mm, french, inch] = diameters(row.outer_diameter_mm);
        vec![
            row.file.clone(),
            row.kind.map_or("–", words).to_owned(),
            format!("{:.0}", row.length_mm),
            mm,
            french,
            inch,
            table::range(row.bending_stiffness_nmm2, 3),
            format!("{:.0}", row.shaped_mm),
            row.name.clone(),
        ]
    });
    columns(&head, rows)
}

/// A kind in words.
fn words(kind: Kind) -> &'static str {
    match kind {
        Kind::Guidewire => "guidewire",
        Kind::Microwire => "microwire",
        Kind::Microcatheter => "microcatheter",
        Kind::Catheter => "catheter",
        Kind::GuidingCatheter => "guiding catheter",
        Kind::Sheath => "sheath",
        Kind::Coil => "coil",
    }
}
