//! STL, binary and ASCII.
//!
//! Own implementation, because the crate for it (stl_io 0.11) reads only the first `solid` of an ASCII file, requires
//! a blank after `solid`, mistakes a binary file whose header begins with "solid" for text, and narrows ASCII numbers
//! to 32 bits. The format itself is 50 bytes per triangle.

use super::faces::Faces;
use super::{Parsed, Reason, ToldAxes};
use crate::Vec3;
use crate::text::lines;
use crate::vessel::SurfaceMesh;

/// Header of free text, then the triangle count.
const HEADER: usize = 80;
/// Header and count.
const BEGIN: usize = HEADER + 4;
/// Normal and three corners as 12 floats, and two unused bytes.
const RECORD: usize = 50;
/// Counts of programs that write the header before they know the number of triangles.
const UNKNOWN: [usize; 2] = [0, u32::MAX as usize];

pub(super) fn parse(bytes: &[u8]) -> Result<Parsed, Reason> {
    let declared = declared_triangles(bytes);
    let room = bytes.len().saturating_sub(BEGIN);
    // The length decides, not the word "solid": many binary files begin with it.
    if declared.is_some_and(|count| count.checked_mul(RECORD) == Some(room)) {
        return Ok(parse_binary(bytes, room / RECORD));
    }
    if holds_facets(bytes) {
        return parse_ascii(&String::from_utf8_lossy(bytes));
    }
    match declared {
        // The count is unknown: the size determines it.
        Some(count) if UNKNOWN.contains(&count) && room > 0 && room.is_multiple_of(RECORD) => {
            Ok(parse_binary(bytes, room / RECORD))
        }
        // Trailing bytes are harmless; missing ones are not.
        Some(count) if count > 0 && count.checked_mul(RECORD).is_some_and(|n| n < room) => {
            Ok(parse_binary(bytes, count))
        }
        Some(count) => Err(format!(
            "binary STL declares {count} triangles of {RECORD} bytes, and {room} bytes are there: the file is cut off, or not an STL"
        )),
        None => Err(format!("not an STL: {} bytes, and no 'solid … facet' text", bytes.len())),
    }
}

fn declared_triangles(bytes: &[u8]) -> Option<usize> {
    let count = bytes.get(HEADER..)?.first_chunk()?;
    Some(u32::from_le_bytes(*count) as usize)
}

/// Whether there is the text of a facet, after what may be the header of a binary file.
fn holds_facets(bytes: &[u8]) -> bool {
    let text = if bytes.len() < 4 * HEADER { bytes } else { &bytes[BEGIN..] };
    text.windows(5).any(|word| word.eq_ignore_ascii_case(b"facet"))
}

/// Reads records that are known to exist.
fn parse_binary(bytes: &[u8], count: usize) -> Parsed {
    let mut parsed = Parsed::default();
    parsed.axes.look_in(&String::from_utf8_lossy(&bytes[..HEADER]));
    let mesh = &mut parsed.mesh;
    for record in bytes[BEGIN..].chunks_exact(RECORD).take(count) {
        let float = |k: usize| {
            let b = &record[4 * k..4 * k + 4];
            f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
        };
        // The stored normal is not used: many programs write zeros there.
        for corner in 1..4 {
            mesh.vertices_mm.push(Vec3::new(float(3 * corner), float(3 * corner + 1), float(3 * corner + 2)));
        }
        let end = mesh.vertices_mm.len() as u32;
        mesh.triangles.push([end - 3, end - 2, end - 1]);
    }
    parsed
}

/// All solids of the file, as one surface. Parsed by words, not lines: some files have only one line.
fn parse_ascii(text: &str) -> Result<Parsed, Reason> {
    let mut mesh = SurfaceMesh::default();
    let (mut faces, mut axes) = (Faces::default(), ToldAxes::default());
    // Number of vertices before those of the current facet.
    let mut facet: Option<usize> = None;
    let mut is_open = false;
    for (number, line) in lines(text) {
        let mut words = line.split_whitespace().peekable();
        while let Some(word) = words.next() {
            let is = |keyword: &str| word.eq_ignore_ascii_case(keyword);
            if is("vertex") {
                facet.get_or_insert(mesh.vertices_mm.len());
                mesh.vertices_mm.push(super::coordinates(&mut words, || format!("line {number}"))?);
            } else if is("facet") && facet.is_some() {
                return Err(format!(
                    "line {number}: a facet begins before the last one is closed by endfacet; mend it"
                ));
            } else if is("facet") && words.peek().is_some_and(|word| word.eq_ignore_ascii_case("normal")) {
                // Otherwise it may be a word of a name.
                is_open = true;
            } else if is("endfacet") {
                is_open = false;
                let first = facet.take().unwrap_or(mesh.vertices_mm.len());
                faces.push(first as i64..mesh.vertices_mm.len() as i64, number);
            } else if is("solid") || is("endsolid") {
                // A name may contain any word, and ends with its line or where a facet begins.
                while words.peek().is_some_and(|word| !word.eq_ignore_ascii_case("facet")) {
                    axes.look_in(words.next().unwrap_or_default());
                }
            }
        }
    }
    if facet.is_some() || is_open {
        return Err("the last facet is not closed: the file is cut off".into());
    }
    faces.fill(&mut mesh, |number| format!("line {number}"))?;
    Ok(Parsed { mesh, axes })
}

/// Binary STL with unit normals.
pub(super) fn bytes(mesh: &SurfaceMesh) -> Vec<u8> {
    let mut out = Vec::with_capacity(BEGIN + RECORD * mesh.triangles.len());
    // Must not begin with "solid", or careless readers mistake it for text.
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
