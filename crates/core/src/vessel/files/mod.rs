//! Surface meshes in files: STL, OBJ and PLY, told apart by extension.
//!
//! Files carry no unit, so the caller gives one: millimetres per file unit.

mod obj;
mod ply;
mod stl;

use std::path::Path;

use super::SurfaceMesh;
use crate::{Error, Result, Vec3};

/// The formats, as messages name them.
const KNOWN: &str = "use .stl, .obj or .ply";

/// Largest surface file in bytes: the binary STL of 40 million triangles.
const SIZE_LIMIT: u64 = 2 << 30;

/// Largest surface accepted, mm: no vessel is ten metres long, and a wrong unit is easily a factor of a thousand.
const EXTENT_LIMIT_MM: f64 = 10_000.0;

/// Why the content of a file is not usable, without the file's name.
type Reason = String;

#[derive(Clone, Copy)]
enum Format {
    Stl,
    Obj,
    Ply,
}

fn format_of(path: &Path) -> Result<Format> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    match extension.as_deref() {
        Some("stl") => Ok(Format::Stl),
        Some("obj") => Ok(Format::Obj),
        Some("ply") => Ok(Format::Ply),
        Some(other) => Err(Error::content(path, format!("unknown mesh format .{other}; {KNOWN}"))),
        None => Err(Error::content(path, format!("no extension tells the mesh format; {KNOWN}"))),
    }
}

impl SurfaceMesh {
    /// Reads an STL (ASCII or binary), OBJ or PLY (ASCII or binary) surface. Polygons are cut into fans of triangles;
    /// faces of fewer than three corners become triangles without area, which the repair removes and counts.
    /// The surface is returned as it is in the file, scaled; [`Wall::from_surface`](super::Wall::from_surface) repairs it.
    ///
    /// `unit_mm`: millimetres per file unit (1 for millimetres, 10 for centimetres, 1000 for metres).
    ///
    /// # Errors
    /// [`Error::Parameter`] for a unit that is not finite and positive, [`Error::File`] for a file that cannot be read,
    /// [`Error::Content`] for an unknown extension, unusable content (the reason says where) or a surface over 10 m across.
    pub fn read(path: &Path, unit_mm: f64) -> Result<Self> {
        check_unit(unit_mm)?;
        // A name that tells no format is refused before a large file is read.
        format_of(path)?;
        Self::from_bytes(&crate::file::read(path, SIZE_LIMIT)?, path, unit_mm)
    }

    /// Reads a surface from the bytes of a file; the extension of `path` tells the format, and errors name it.
    ///
    /// # Errors
    /// As [`Self::read`], less those of reading a file.
    pub fn from_bytes(bytes: &[u8], path: &Path, unit_mm: f64) -> Result<Self> {
        check_unit(unit_mm)?;
        let mesh = parse(format_of(path)?, bytes).map_err(|reason| Error::content(path, reason))?;
        scaled(mesh, unit_mm).map_err(|reason| Error::content(path, reason))
    }

    /// Writes the surface in millimetres: `.stl` as binary STL (32-bit), `.obj` as text, `.ply` as binary little-endian PLY
    /// (64-bit).
    ///
    /// # Errors
    /// [`Error::Content`] for an unknown extension, [`Error::File`] if writing fails.
    pub fn write(&self, path: &Path) -> Result<()> {
        let bytes = match format_of(path)? {
            Format::Stl => stl::bytes(self),
            Format::Obj => obj::bytes(self),
            Format::Ply => ply::bytes(self),
        };
        std::fs::write(path, bytes).map_err(|e| Error::file(path, e))
    }
}

fn check_unit(unit_mm: f64) -> Result<()> {
    if unit_mm.is_finite() && unit_mm > 0.0 {
        return Ok(());
    }
    Err(Error::parameter(
        "unit_mm",
        unit_mm,
        "must be finite and positive: millimetres per file unit (1000 for metres)",
    ))
}

fn parse(format: Format, bytes: &[u8]) -> std::result::Result<SurfaceMesh, Reason> {
    if bytes.is_empty() {
        return Err("the file is empty".into());
    }
    let mesh = match format {
        Format::Stl => stl::parse(bytes),
        Format::Obj => obj::parse(bytes),
        Format::Ply => ply::parse(bytes),
    }?;
    if mesh.triangles.is_empty() {
        return Err("the file holds no triangles".into());
    }
    Ok(mesh)
}

fn scaled(mut mesh: SurfaceMesh, unit_mm: f64) -> std::result::Result<SurfaceMesh, Reason> {
    mesh.vertices_mm.iter_mut().for_each(|v| *v *= unit_mm);
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
            super::unit_hint(extent_mm, unit_mm).map_or_else(String::new, |hint| format!(" ({hint})"))
        ));
    }
    Ok(mesh)
}

/// Cuts a polygon into a fan of triangles after checking its indices; `what` names it in messages.
fn push_fan(
    mesh: &mut SurfaceMesh,
    polygon: &[i64],
    what: impl Fn() -> String,
) -> std::result::Result<(), Reason> {
    let count = mesh.vertices_mm.len();
    if let Some(bad) = polygon.iter().find(|&&v| v < 0 || v >= count as i64 || v >= i64::from(u32::MAX)) {
        return Err(format!(
            "{} names vertex {bad} (counted from 0), but there are {count} vertices: remove the face or mend the export",
            what()
        ));
    }
    // A face of one or two corners is no reason to refuse thousands of others: as a triangle without area it is removed and
    // counted with its like when the surface is repaired.
    match polygon {
        [] => return Ok(()),
        [a] => mesh.triangles.push([*a as u32; 3]),
        [a, b] => mesh.triangles.push([*a as u32, *b as u32, *b as u32]),
        _ => {}
    }
    for pair in polygon[1..].windows(2) {
        mesh.triangles.push([polygon[0] as u32, pair[0] as u32, pair[1] as u32]);
    }
    Ok(())
}

/// Three coordinates from an iterator of words.
fn coordinates<'a>(
    mut words: impl Iterator<Item = &'a str>,
    what: impl Fn() -> String,
) -> std::result::Result<Vec3, Reason> {
    let mut point = Vec3::zeros();
    for axis in 0..3 {
        let word = words.next().ok_or_else(|| format!("{} has fewer than 3 coordinates", what()))?;
        point[axis] = word.parse().map_err(|_| format!("{}: {word:?} is not a number", what()))?;
    }
    Ok(point)
}

#[cfg(test)]
mod tests;
