//! The header of a PLY file: the elements, and the properties of their rows.

use super::super::scalar::{Order, Scalar};
use super::super::{Reason, ToldAxes};
use super::MEND;
use crate::text::shown;

/// Encoding of rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    Binary(Order),
}

/// Use of a property.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    /// A coordinate, by its axis.
    Coordinate(usize),
    /// The list of a face's or strip's vertices.
    Corners,
    /// Unused.
    Unused,
}

/// A value of each row, or a list of values.
#[derive(Debug)]
pub(super) struct Property {
    pub(super) role: Role,
    /// The type of a list's length; `None` of a single value.
    pub(super) length: Option<Scalar>,
    pub(super) value: Scalar,
}

/// A table of the file.
#[derive(Debug)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) rows: usize,
    pub(super) properties: Vec<Property>,
}

#[derive(Debug)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    pub(super) axes: ToldAxes,
    /// Bytes and lines up to the first row.
    pub(super) length: usize,
    pub(super) lines: usize,
}

/// The end of the first line, which is that of all others: a binary file's rows begin right after it.
fn line_end(bytes: &[u8]) -> &'static [u8] {
    match bytes.iter().position(|byte| matches!(byte, b'\n' | b'\r')) {
        Some(at) if bytes[at..].starts_with(b"\r\n") => b"\r\n",
        Some(at) if bytes[at] == b'\r' => b"\r",
        _ => b"\n",
    }
}

impl Header {
    pub(super) fn read(bytes: &[u8]) -> Result<Self, Reason> {
        let end = line_end(bytes);
        let mut header = Self {
            encoding: Encoding::Ascii,
            elements: Vec::new(),
            axes: ToldAxes::default(),
            length: 0,
            lines: 0,
        };
        let mut has_format = false;
        while header.length < bytes.len() {
            let rest = &bytes[header.length..];
            let length = rest.windows(end.len()).position(|window| window == end);
            // Comments may be in any encoding.
            let line = String::from_utf8_lossy(&rest[..length.unwrap_or(rest.len())]);
            header.length += length.map_or(rest.len(), |length| length + end.len());
            header.lines += 1;
            let words: Vec<&str> = line.split_whitespace().collect();
            let refused =
                |why: &str| Err(format!("line {}, {:?}: {why}: {MEND}", header.lines, shown(line.trim())));
            match words.as_slice() {
                ["ply"] if header.lines == 1 => {}
                _ if header.lines == 1 => {
                    return refused("is no beginning of a PLY file, which is the word ply");
                }
                [] => {}
                ["comment" | "obj_info", ..] => header.axes.look_in(&line),
                ["format", kind, ..] => {
                    header.encoding = match *kind {
                        "ascii" => Encoding::Ascii,
                        "binary_little_endian" => Encoding::Binary(Order::Little),
                        "binary_big_endian" => Encoding::Binary(Order::Big),
                        _ => return refused("is no format of PLY"),
                    };
                    has_format = true;
                }
                ["element", name, rows] => match rows.parse() {
                    Ok(rows) => header.elements.push(Element::new(name, rows)),
                    Err(_) => return refused("has no number of rows"),
                },
                ["property", words @ ..] => {
                    let Some(element) = header.elements.last_mut() else {
                        return refused("is a property of no element");
                    };
                    match element.property(words) {
                        Some(property) => element.properties.push(property),
                        None => return refused("is no property with a type of PLY"),
                    }
                }
                ["end_header"] if has_format => {
                    header.elements.iter_mut().for_each(Element::settle);
                    return Ok(header);
                }
                ["end_header"] => return refused("ends a header without a format"),
                _ => return refused("is no line of a PLY header"),
            }
        }
        Err(format!("line {}: the header has no end_header: {MEND}", header.lines + 1))
    }
}

impl Element {
    fn new(name: &str, rows: usize) -> Self {
        Self { name: name.to_owned(), rows, properties: Vec::new() }
    }

    /// Whether rows are faces or strips.
    pub(super) fn has_corners(&self) -> bool {
        matches!(self.name.as_str(), "face" | "tristrips")
    }

    /// Uses the only list of a face as its corners if none has that name.
    fn settle(&mut self) {
        if !self.has_corners() || self.properties.iter().any(|property| property.role == Role::Corners) {
            return;
        }
        let mut lists = self.properties.iter_mut().filter(|property| property.length.is_some());
        if let (Some(only), None) = (lists.next(), lists.next()) {
            only.role = Role::Corners;
        }
    }

    /// A property from the words after `property`.
    fn property(&self, words: &[&str]) -> Option<Property> {
        let (length, value, name) = match words {
            ["list", length, value, name] => (Some(scalar(length)?), scalar(value)?, *name),
            [value, name] => (None, scalar(value)?, *name),
            _ => return None,
        };
        let axis = ["x", "y", "z"].iter().position(|axis| name.eq_ignore_ascii_case(axis));
        let role = match (length, axis) {
            (None, Some(axis)) if self.name == "vertex" => Role::Coordinate(axis),
            // Both spellings are in use.
            (Some(_), _) if self.has_corners() && matches!(name, "vertex_indices" | "vertex_index") => {
                Role::Corners
            }
            _ => Role::Unused,
        };
        Some(Property { role, length, value })
    }
}

/// A type by its old or its new name.
fn scalar(name: &str) -> Option<Scalar> {
    Some(match name {
        "char" | "int8" => Scalar::I8,
        "uchar" | "uint8" => Scalar::U8,
        "short" | "int16" => Scalar::I16,
        "ushort" | "uint16" => Scalar::U16,
        "int" | "int32" => Scalar::I32,
        "uint" | "uint32" => Scalar::U32,
        "int64" => Scalar::I64,
        "uint64" => Scalar::U64,
        "float" | "float32" => Scalar::F32,
        "double" | "float64" => Scalar::F64,
        _ => return None,
    })
}
