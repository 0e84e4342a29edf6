//! PLY, ASCII and binary of either byte order, by the crate ply-rs-bw.

use std::io::BufReader;

use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{Encoding, Header, PropertyAccess, PropertyAccessResult};

use super::Reason;
use crate::Vec3;
use crate::vessel::SurfaceMesh;

/// One row of any element: what a vertex or a face has, all else is dropped.
#[derive(Debug, Default)]
struct Row {
    xyz: [Option<f64>; 3],
    polygon: Vec<i64>,
}

impl Row {
    fn set(&mut self, name: &str, value: f64) -> PropertyAccessResult {
        let Some(axis) = ["x", "y", "z"].iter().position(|axis| *axis == name) else {
            return PropertyAccessResult::Ignored;
        };
        self.xyz[axis] = Some(value);
        PropertyAccessResult::Set
    }

    fn set_list<T: Into<i64>>(&mut self, name: &str, values: Vec<T>) -> PropertyAccessResult {
        // Both spellings are in use.
        if name != "vertex_indices" && name != "vertex_index" {
            return PropertyAccessResult::Ignored;
        }
        self.polygon = values.into_iter().map(Into::into).collect();
        PropertyAccessResult::Set
    }
}

impl PropertyAccess for Row {
    fn new() -> Self {
        Self::default()
    }
    fn set_char(&mut self, name: &str, value: i8) -> PropertyAccessResult {
        self.set(name, value.into())
    }
    fn set_uchar(&mut self, name: &str, value: u8) -> PropertyAccessResult {
        self.set(name, value.into())
    }
    fn set_short(&mut self, name: &str, value: i16) -> PropertyAccessResult {
        self.set(name, value.into())
    }
    fn set_ushort(&mut self, name: &str, value: u16) -> PropertyAccessResult {
        self.set(name, value.into())
    }
    fn set_int(&mut self, name: &str, value: i32) -> PropertyAccessResult {
        self.set(name, value.into())
    }
    fn set_uint(&mut self, name: &str, value: u32) -> PropertyAccessResult {
        self.set(name, value.into())
    }
    fn set_float(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        self.set(name, value.into())
    }
    fn set_double(&mut self, name: &str, value: f64) -> PropertyAccessResult {
        self.set(name, value)
    }
    fn set_list_char(&mut self, name: &str, values: Vec<i8>) -> PropertyAccessResult {
        self.set_list(name, values)
    }
    fn set_list_uchar(&mut self, name: &str, values: Vec<u8>) -> PropertyAccessResult {
        self.set_list(name, values)
    }
    fn set_list_short(&mut self, name: &str, values: Vec<i16>) -> PropertyAccessResult {
        self.set_list(name, values)
    }
    fn set_list_ushort(&mut self, name: &str, values: Vec<u16>) -> PropertyAccessResult {
        self.set_list(name, values)
    }
    fn set_list_int(&mut self, name: &str, values: Vec<i32>) -> PropertyAccessResult {
        self.set_list(name, values)
    }
    fn set_list_uint(&mut self, name: &str, values: Vec<u32>) -> PropertyAccessResult {
        self.set_list(name, values)
    }
    fn set_list_float(&mut self, _: &str, _: Vec<f32>) -> PropertyAccessResult {
        PropertyAccessResult::Ignored
    }
    fn set_list_double(&mut self, _: &str, _: Vec<f64>) -> PropertyAccessResult {
        PropertyAccessResult::Ignored
    }
}

pub(super) fn parse(bytes: &[u8]) -> Result<SurfaceMesh, Reason> {
    let parser = Parser::<Row>::new();
    let mut reader = Reader::new(BufReader::new(bytes));
    let header = parser
        .read_header(&mut reader)
        .map_err(|e| refused(&e, Some(bytes), "is no line of a PLY header"))?;
    check_counts(&header, bytes.len())?;
    // Only text has lines to show.
    let lines = (header.encoding == Encoding::Ascii).then_some(bytes);
    let payload = parser
        .read_payload(&mut reader, &header)
        .map_err(|e| refused(&e, lines, "cannot be read as the header declares it"))?;
    let mut mesh = SurfaceMesh::default();
    let rows = |name: &str| payload.iter().find(|(key, _)| key.as_str() == name).map(|(_, rows)| rows);
    for (index, row) in rows("vertex").into_iter().flatten().enumerate() {
        let [Some(x), Some(y), Some(z)] = row.xyz else {
            return Err(format!(
                "vertex {index} lacks x, y or z: the element 'vertex' needs these properties; export the surface again"
            ));
        };
        mesh.vertices_mm.push(Vec3::new(x, y, z));
    }
    for (index, row) in rows("face").into_iter().flatten().enumerate() {
        super::push_fan(&mut mesh, &row.polygon, || format!("face {index}"))?;
    }
    Ok(mesh)
}

/// What to do about a file that cannot be read.
const MEND: &str = "mend it, or export the surface again as PLY 1.0, STL or OBJ";

/// Longest piece of a line that is shown.
const SHOWN: usize = 60;

/// What the parser says over several lines and in its own words, on one: where, what is there, what is wrong with it, and the mend. `unlike`
/// is what is said of a line that the parser can make nothing of.
fn refused(error: &ParseError, lines: Option<&[u8]>, unlike: &str) -> Reason {
    let said = error.to_string();
    let first = said.lines().next().unwrap_or_default().trim_end_matches(['.', ' ']);
    let what = first.strip_prefix(&format!("Line {}: ", error.line().unwrap_or(0))).unwrap_or(first);
    let value = said.lines().find_map(|line| line.trim().strip_prefix("Value: "));
    let what = match value {
        Some(value) => format!("{} is no number of the declared type", shown(value)),
        None if said.contains("but found nothing") => {
            "has fewer values than its element has properties".to_owned()
        }
        None if what.starts_with("Couldn't") => {
            let inner = said.lines().find_map(|line| line.split_once("Error: Expected "));
            inner.map_or_else(
                || unlike.to_owned(),
                |(_, rest)| format!("expected {}", rest.trim_end_matches('.')),
            )
        }
        None => what.to_owned(),
    };
    let place = error.line().zip(lines).map_or_else(String::new, |(number, bytes)| {
        let line = bytes.split(|byte| *byte == b'\n').nth(number.saturating_sub(1)).unwrap_or_default();
        match String::from_utf8_lossy(line).trim() {
            "" => format!("line {number}: "),
            line => format!("line {number}, {:?}: ", shown(line)),
        }
    });
    format!("{place}{what}: {MEND}")
}

/// The beginning of a text that may be the whole of a binary file.
fn shown(text: &str) -> String {
    text.chars().take(SHOWN).chain((text.chars().count() > SHOWN).then_some('…')).collect()
}

/// A row takes at least a byte, so a header that declares more rows than bytes is broken or malicious.
fn check_counts(header: &Header, length: usize) -> Result<(), Reason> {
    for (name, element) in &header.elements {
        if element.count > length {
            return Err(format!(
                "declares {} elements '{name}' in a file of {length} bytes: it is cut off, or its header is wrong; export the surface again",
                element.count
            ));
        }
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
