//! PLY, ASCII and binary of either byte order: polygons and triangle strips.
//!
//! Own implementation, because the crate for it (ply-rs-bw 4.0) reads only ASCII headers, requires a number in every
//! value of a row, used or not, and a line for every row of text.

mod header;
mod rows;

use super::faces::Faces;
use super::scalar::index;
use super::{Parsed, Reason};
use crate::Vec3;
use crate::vessel::SurfaceMesh;
use header::{Element, Encoding, Header, Role};
use rows::{BinaryRows, Rows, TextRows};

/// What to do about an unreadable file.
const MEND: &str = "mend it, or export the surface again as PLY 1.0, STL or OBJ";

/// Separator of strips in a list of them.
const STRIP_ENDS: i64 = -1;

pub(super) fn parse(bytes: &[u8]) -> Result<Parsed, Reason> {
    let header = Header::read(bytes)?;
    check_counts(&header, bytes.len())?;
    let body = &bytes[header.length..];
    let surface = match header.encoding {
        Encoding::Binary(order) => surface(&header, &mut BinaryRows { rest: body, order })?,
        Encoding::Ascii => {
            let text = String::from_utf8_lossy(body);
            let with = |flowing: bool| {
                let mut rows = TextRows::new(&text, header.lines, flowing);
                surface(&header, &mut rows).map(|surface| (surface, rows))
            };
            with(false).map(|(surface, _)| surface).or_else(|reason| match with(true) {
                // A wrong number of values means that a row is damaged.
                Ok((surface, mut rows)) => rows.is_at_end().then_some(surface).ok_or(reason),
                Err(_) => Err(reason),
            })?
        }
    };
    Ok(Parsed { mesh: surface, axes: header.axes })
}

/// A row takes at least a byte, so a header that declares more rows than bytes is broken or malicious.
fn check_counts(header: &Header, length: usize) -> Result<(), Reason> {
    for Element { name, rows, .. } in &header.elements {
        if *rows > length {
            return Err(format!(
                "declares {rows} elements {name:?} in a file of {length} bytes: it is cut off, or its header is wrong; export the surface again"
            ));
        }
    }
    Ok(())
}

/// The surface in the elements of a file.
fn surface(header: &Header, rows: &mut impl Rows) -> Result<SurfaceMesh, Reason> {
    let (mut mesh, mut faces) = (SurfaceMesh::default(), Faces::default());
    for element in &header.elements {
        if element.name == "vertex" {
            check_vertices(element)?;
        }
        for row in 0..element.rows {
            read_row(element, row, rows, &mut mesh, &mut faces).map_err(|why| {
                let Element { name, rows, .. } = element;
                format!("{why}, in row {row} of the {rows} of element {name:?}: {MEND}")
            })?;
        }
    }
    faces.fill(&mut mesh, |number| format!("face {number}"))?;
    Ok(mesh)
}

/// Rejects vertices without coordinates.
fn check_vertices(element: &Element) -> Result<(), Reason> {
    let has = |axis: usize| element.properties.iter().any(|p| p.role == Role::Coordinate(axis));
    match (0..3).all(has) {
        true => Ok(()),
        false => Err("the element 'vertex' lacks x, y or z; export the surface again".into()),
    }
}

fn read_row(
    element: &Element,
    number: usize,
    rows: &mut impl Rows,
    mesh: &mut SurfaceMesh,
    faces: &mut Faces,
) -> Result<(), Reason> {
    rows.begin()?;
    let mut point = Vec3::zeros();
    for property in &element.properties {
        let count = match property.length {
            None => 1,
            Some(kind) => {
                let length = rows.value(kind)?;
                let fits = length >= 0.0 && length.fract() == 0.0 && length <= rows.left() as f64;
                if !fits {
                    return Err(format!("{length} is no length of a list in this file"));
                }
                length as usize
            }
        };
        match property.role {
            Role::Unused => rows.skip(property.value, count)?,
            Role::Coordinate(axis) => point[axis] = rows.value(property.value)?,
            Role::Corners => {
                let corners: Vec<i64> =
                    (0..count).map(|_| rows.value(property.value).map(index)).collect::<Result<_, _>>()?;
                if element.name == "face" {
                    faces.push(corners, number);
                } else {
                    corners
                        .split(|corner| *corner == STRIP_ENDS)
                        .for_each(|strip| faces.push_strip(strip, number));
                }
            }
        }
    }
    if element.name == "vertex" {
        mesh.vertices_mm.push(point);
    }
    Ok(())
}

/// Binary little-endian PLY with 64-bit coordinates.
pub(super) fn bytes(mesh: &SurfaceMesh) -> Vec<u8> {
    let mut out = format!(
        "ply\nformat binary_little_endian 1.0\ncomment endowire surface, unit mm\nelement vertex {}\n\
         property double x\nproperty double y\nproperty double z\nelement face {}\n\
         property list uchar uint vertex_indices\nend_header\n",
        mesh.vertices_mm.len(),
        mesh.triangles.len()
    )
    .into_bytes();
    for coordinate in mesh.vertices_mm.iter().flatten() {
        out.extend_from_slice(&coordinate.to_le_bytes());
    }
    for triangle in &mesh.triangles {
        out.push(3);
        for vertex in triangle {
            out.extend_from_slice(&vertex.to_le_bytes());
        }
    }
    out
}
