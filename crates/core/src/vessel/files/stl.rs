//! STL, binary and ASCII.
//!
//! By hand, because the crate for it (stl_io 0.11) reads only the first `solid` of an ASCII file, wants a blank after
//! `solid`, takes a binary file whose header begins with "solid" for text, and narrows ASCII numbers to 32 bits. The format
//! itself is 50 bytes a triangle.

use super::Reason;
use crate::Vec3;
use crate::vessel::SurfaceMesh;

/// Header of free text, then the triangle count.
const HEADER: usize = 80;
/// Normal and three corners as 12 floats, and two spare bytes.
const RECORD: usize = 50;

pub(super) fn parse(bytes: &[u8]) -> Result<SurfaceMesh, Reason> {
    let declared = declared_triangles(bytes);
    // The length decides, not the word "solid": many binary files begin with it.
    if declared.is_some_and(|count| count.checked_mul(RECORD) == Some(bytes.len() - HEADER - 4)) {
        return Ok(parse_binary(bytes));
    }
    let text = String::from_utf8_lossy(bytes);
    let begins_solid = text.trim_start().get(..5).is_some_and(|word| word.eq_ignore_ascii_case("solid"));
    match declared {
        _ if begins_solid && text.to_ascii_lowercase().contains("facet") => parse_ascii(&text),
        // Trailing bytes are harmless; missing ones are not.
        Some(count) if count.checked_mul(RECORD).is_some_and(|n| n < bytes.len() - HEADER - 4) => {
            Ok(parse_binary(bytes))
        }
        Some(count) => Err(format!(
            "binary STL declares {count} triangles, but only {} are there: the file is cut off, or not an STL",
            (bytes.len() - HEADER - 4) / RECORD
        )),
        None => Err(format!("not an STL: {} bytes, and no 'solid … facet' text", bytes.len())),
    }
}

fn declared_triangles(bytes: &[u8]) -> Option<usize> {
    let count = bytes.get(HEADER..HEADER + 4)?;
    Some(u32::from_le_bytes([count[0], count[1], count[2], count[3]]) as usize)
}

/// Reads as many records as the header declares; the caller has checked that they are there.
fn parse_binary(bytes: &[u8]) -> SurfaceMesh {
    let mut mesh = SurfaceMesh::default();
    let count = declared_triangles(bytes).unwrap_or(0);
    for record in bytes[HEADER + 4..].chunks_exact(RECORD).take(count) {
        let float = |k: usize| {
            let b = &record[4 * k..4 * k + 4];
            f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
        };
        // The stored normal is not used: many programs write zeros there.
        for corner in 1..4 {
            mesh.vertices_mm.push(Vec3::new(float(3 * corner), float(3 * corner + 1), float(3 * corner + 2)));
        }
        push_last_three(&mut mesh);
    }
    mesh
}

fn push_last_three(mesh: &mut SurfaceMesh) {
    let end = mesh.vertices_mm.len() as u32;
    mesh.triangles.push([end - 3, end - 2, end - 1]);
}

/// All solids of the file, as one surface.
fn parse_ascii(text: &str) -> Result<SurfaceMesh, Reason> {
    let mut mesh = SurfaceMesh::default();
    let mut corners = 0;
    for (index, line) in text.lines().enumerate() {
        let mut words = line.split_whitespace();
        let what = || format!("line {}", index + 1);
        match words.next().map(str::to_ascii_lowercase).as_deref() {
            Some("vertex") => {
                mesh.vertices_mm.push(super::coordinates(words, what)?);
                corners += 1;
            }
            Some("endfacet") => {
                let first = (mesh.vertices_mm.len() - corners) as i64;
                let polygon: Vec<i64> = (first..first + corners as i64).collect();
                super::push_fan(&mut mesh, &polygon, what)?;
                corners = 0;
            }
            _ => {}
        }
    }
    if corners != 0 {
        return Err("the last facet is not closed: the file is cut off".into());
    }
    Ok(mesh)
}

/// Binary STL with unit normals.
pub(super) fn bytes(mesh: &SurfaceMesh) -> Vec<u8> {
    let mut out = Vec::with_capacity(HEADER + 4 + RECORD * mesh.triangles.len());
    // Must not begin with "solid", or careless readers take it for text.
    let title = b"endowire surface, unit mm";
    out.extend_from_slice(title);
    out.resize(HEADER, b' ');
    out.extend_from_slice(&(mesh.triangles.len() as u32).to_le_bytes());
    for index in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(index);
        let normal = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default();
        for coordinate in [normal, a, b, c].iter().flatten() {
            out.extend_from_slice(&(*coordinate as f32).to_le_bytes());
        }
        out.extend_from_slice(&[0, 0]);
    }
    out
}
