//! Surface meshes in files: STL, OBJ, PLY and VTK's two formats, distinguished by extension.
//!
//! Files carry no unit, so the caller gives one: millimetres per file unit. Axes are those given by the caller or the
//! file ([`SurfaceFrame`]); surfaces are returned in those of scenes, LPS.

mod faces;
mod frame;
mod obj;
mod ply;
mod scalar;
mod stl;
mod vtk;

use std::path::Path;

use super::SurfaceMesh;
use crate::file::{FileSystem, Files, foreign};
use crate::text;
use crate::{Error, Result, Vec3};
use frame::ToldAxes;
pub use frame::{PatientAxes, SurfaceFrame};
#[cfg(feature = "vtp")]
pub(super) use vtk::parse_lines as vtp_lines;

/// The supported formats, for messages.
const KNOWN: &str = "use .stl, .obj, .ply, .vtp or .vtk";
/// The formats for writing.
const WRITTEN: &str = "write .stl, .obj or .ply";

/// Largest surface file in bytes: the binary STL of 40 million triangles.
const SIZE_LIMIT: u64 = 2 << 30;

/// Largest surface accepted, mm: no vessel is ten metres long, and a wrong unit is often a factor of a thousand.
const EXTENT_LIMIT_MM: f64 = 10_000.0;

/// Why the content of a file is unusable, without the file's name.
type Reason = String;

/// The content of a file, in its own unit and axes.
#[derive(Debug, Default)]
struct Parsed {
    mesh: SurfaceMesh,
    axes: ToldAxes,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Stl,
    Obj,
    Ply,
    /// VTK's XML format.
    #[cfg(feature = "vtp")]
    Vtp,
    /// VTK's older format.
    Vtk,
}

impl Format {
    /// The format of an extension in lower case.
    fn of_extension(extension: &str) -> Option<Self> {
        Some(match extension {
            "stl" => Self::Stl,
            "obj" => Self::Obj,
            "ply" => Self::Ply,
            #[cfg(feature = "vtp")]
            "vtp" => Self::Vtp,
            "vtk" => Self::Vtk,
            _ => return None,
        })
    }

    /// The real kind of a file with this extension, if its first bytes leave no doubt that it differs.
    fn but_seems(self, bytes: &[u8]) -> Option<&'static str> {
        let begins: [(&[u8], Option<Self>, &str); 5] = [
            (b"ply\n", Some(Self::Ply), "PLY files (.ply) do"),
            (b"ply\r", Some(Self::Ply), "PLY files (.ply) do"),
            (b"# vtk DataFile", Some(Self::Vtk), "legacy VTK files (.vtk) do"),
            (b"<VTKFile", Self::of_extension("vtp"), "VTK's XML files (.vtp) do"),
            (b"<?xml", Self::of_extension("vtp"), "XML files, such as .vtp, do"),
        ];
        // A binary STL has any title, and a count that fits its size.
        let count = bytes.get(80..84).and_then(|count| count.try_into().ok()).map(u32::from_le_bytes);
        let is_stl = count.is_some_and(|count| bytes.len() as u64 == 84 + 50 * u64::from(count));
        if is_stl && self != Self::Stl {
            return Some("binary STL files (.stl) do");
        }
        let (_, other, name) = begins.into_iter().find(|(begin, ..)| bytes.starts_with(begin))?;
        (other != Some(self)).then_some(name)
    }
}

fn format_of(path: &Path) -> Result<Format> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    match extension.as_deref() {
        Some("swc") => Err(Error::content(path, "is a centre line, no surface: give it as vessel.tree")),
        Some("vtp") if !cfg!(feature = "vtp") => Err(Error::feature("vtp", path.display())),
        Some(name) => Format::of_extension(name)
            .ok_or_else(|| Error::content(path, format!("unknown mesh format .{name}; {KNOWN}"))),
        None => Err(Error::content(path, format!("no extension tells the mesh format; {KNOWN}"))),
    }
}

impl SurfaceMesh {
    /// Whether the extension of a file's name is that of a readable format.
    pub fn is_named_by(path: &Path) -> bool {
        format_of(path).is_ok()
    }

    /// Reads an STL (ASCII or binary), OBJ, PLY (ASCII or binary), VTP or legacy VTK (all encodings) surface.
    /// Polygons are divided into fans of triangles, strips into their triangles; faces of fewer than three corners
    /// become triangles without area, which the repair removes and counts. The surface is returned unrepaired, in
    /// millimetres and in the axes of scenes; [`Wall::from_surface`](super::Wall::from_surface) repairs it.
    ///
    /// `frame`: the coordinate frame, or just the millimetres per file unit (1 for millimetres, 10 for centimetres,
    /// 1000 for metres).
    ///
    /// # Errors
    /// [`Error::Parameter`] for a unit that is not finite and positive, [`Error::File`] for a file that cannot be
    /// read, [`Error::Content`] for an unknown extension, unusable content (with its location) or a surface over 10 m
    /// across.
    pub fn read(path: &Path, frame: impl Into<SurfaceFrame>) -> Result<Self> {
        Self::read_of(&FileSystem, path, frame)
    }

    /// As [`Self::read`], for a surface in `files`.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub(crate) fn read_of(files: &dyn Files, path: &Path, frame: impl Into<SurfaceFrame>) -> Result<Self> {
        let frame = frame.into();
        frame.check()?;
        // Reject an unknown format before reading a large file.
        format_of(path)?;
        Self::from_bytes(&files.read(path, SIZE_LIMIT)?, path, frame)
    }

    /// Reads a surface from the bytes of a file; the format follows from the extension of `path`, and errors name it.
    ///
    /// # Errors
    /// As [`Self::read`], except those of reading the file.
    pub fn from_bytes(bytes: &[u8], path: &Path, frame: impl Into<SurfaceFrame>) -> Result<Self> {
        let frame = frame.into();
        frame.check()?;
        let bad = |reason| Error::content(path, reason);
        let parsed = parse(format_of(path)?, bytes).map_err(bad)?;
        placed(parsed, frame).map_err(bad)
    }

    /// Writes the surface in millimetres: `.stl` as binary STL (32-bit), `.obj` as text, `.ply` as binary little-endian PLY
    /// (64-bit).
    ///
    /// # Errors
    /// [`Error::Content`] for another extension, [`Error::File`] if writing fails.
    pub fn write(&self, path: &Path) -> Result<()> {
        let bytes = match format_of(path)? {
            Format::Stl => stl::bytes(self),
            Format::Obj => obj::bytes(self),
            Format::Ply => ply::bytes(self),
            _ => {
                return Err(Error::content(path, format!("this format is read, not written; {WRITTEN}")));
            }
        };
        crate::file::whole::write_bytes(path, &bytes).map_err(|e| Error::file(path, e))
    }
}

fn parse(format: Format, bytes: &[u8]) -> std::result::Result<Parsed, Reason> {
    if bytes.is_empty() {
        return Err("the file is empty".into());
    }
    if let Some(kind) = foreign(bytes) {
        return Err(kind.into());
    }
    let bytes = text::without_mark(bytes);
    let parsed = match format {
        Format::Stl => stl::parse(&bytes),
        Format::Obj => obj::parse(&bytes),
        Format::Ply => ply::parse(&bytes),
        #[cfg(feature = "vtp")]
        Format::Vtp => vtk::parse_xml(&bytes),
        Format::Vtk => vtk::parse_legacy(&bytes),
    };
    let parsed = parsed.and_then(|parsed| match parsed.mesh.triangles.is_empty() {
        true => Err("the file holds no triangles".into()),
        false => Ok(parsed),
    });
    // A file of another kind with this extension is the likeliest cause of any error.
    parsed.map_err(|reason| match format.but_seems(&bytes) {
        Some(name) => format!("{reason} (it begins as {name})"),
        None => reason,
    })
}

/// The surface of a file in millimetres and in the axes of scenes.
fn placed(parsed: Parsed, frame: SurfaceFrame) -> std::result::Result<SurfaceMesh, Reason> {
    let SurfaceFrame { unit_mm, axes } = frame;
    let axes = axes.map_or_else(|| parsed.axes.axes(), Ok)?;
    let mut mesh = parsed.mesh;
    mesh.vertices_mm.iter_mut().for_each(|v| *v = axes.to_lps(*v) * unit_mm);
    // A vertex that no triangle uses may be anywhere.
    let lost = |i: &&u32| !mesh.vertices_mm[**i as usize].iter().all(|c| c.is_finite());
    if let Some(index) = mesh.triangles.iter().flatten().find(lost) {
        let v = mesh.vertices_mm[*index as usize];
        let count = mesh.triangles.iter().filter(|t| t.iter().any(|i| lost(&i))).count();
        return Err(format!(
            "vertex {index} is at ({}, {}, {}), and {count} triangles need vertices like it; coordinates must be finite: \
             remove these triangles or mend the export",
            v.x, v.y, v.z
        ));
    }
    let extent_mm = mesh.used_bounds_mm().map_or(0.0, |(low, high)| (high - low).norm());
    if extent_mm > EXTENT_LIMIT_MM {
        return Err(format!(
            "with unit_mm = {} the surface is {extent_mm:.1e} mm across, and no vessel more than {EXTENT_LIMIT_MM:.0e}: give \
             the millimetres per unit of the file{}",
            crate::error::number(unit_mm),
            super::hints::unit_hint(extent_mm, None, unit_mm)
                .map_or_else(String::new, |hint| format!(" ({hint})"))
        ));
    }
    Ok(mesh)
}

/// Three coordinates from an iterator of words.
fn coordinates<'a>(
    mut words: impl Iterator<Item = &'a str>,
    what: impl Fn() -> String,
) -> std::result::Result<Vec3, Reason> {
    let mut point = Vec3::zeros();
    for axis in 0..3 {
        let word = words.next().ok_or_else(|| format!("{} has fewer than 3 coordinates", what()))?;
        point[axis] = text::number(word)
            .ok_or_else(|| format!("{}: {:?} is not a number", what(), text::shown(word)))?;
    }
    Ok(point)
}

#[cfg(test)]
mod foreign_tests;
#[cfg(test)]
mod tests;
