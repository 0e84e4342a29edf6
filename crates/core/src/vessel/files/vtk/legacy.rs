//! VTK's older format (`.vtk`), text or bytes: polygonal data, and the surface cells of unstructured grids.
//!
//! "VTK Legacy Formats" in the documentation of VTK; since version 5 cells have arrays of offsets and corners, before
//! that counts.

use super::super::faces::Faces;
use super::super::scalar::{Order, Scalar};
use super::super::{Parsed, Reason};
use super::{Cells, EXTRACT};
use crate::Vec3;
use crate::text::{number, shown};

pub(crate) fn parse(bytes: &[u8]) -> Result<Parsed, Reason> {
    let mut input = Input { rest: bytes, line: 1, is_binary: false };
    let version = input.take_line();
    if !version.to_ascii_lowercase().starts_with("# vtk datafile") {
        return Err(format!(
            "line 1, {:?}: a legacy VTK file begins with # vtk DataFile Version",
            shown(&version)
        ));
    }
    let mut parsed = Parsed::default();
    parsed.axes.look_in(&input.take_line());
    input.is_binary = match input.word().to_ascii_uppercase().as_str() {
        "ASCII" => false,
        "BINARY" => true,
        other => return Err(input.here(&format!("{:?} is neither ASCII nor BINARY", shown(other)))),
    };
    let mut found = Found::default();
    while let Some(keyword) = input.next_word() {
        // Point and cell data follow the surface and are not needed.
        if matches!(keyword.to_ascii_uppercase().as_str(), "POINT_DATA" | "CELL_DATA") {
            break;
        }
        section(&keyword, &mut input, &mut found, &mut parsed)?;
    }
    let mut faces = Faces::default();
    found.polygons.add_polygons(&mut faces);
    found.strips.add_strips(&mut faces);
    found.add_cells(&mut faces)?;
    faces.fill(&mut parsed.mesh, |number| format!("polygon {number}"))?;
    if parsed.mesh.triangles.is_empty() {
        return Err(format!("holds no triangles: {} lines and lone points", found.others));
    }
    Ok(parsed)
}

/// Cells of a file.
#[derive(Debug, Default)]
struct Found {
    polygons: Cells,
    strips: Cells,
    /// Cells of an unstructured grid, and their types.
    cells: Cells,
    types: Vec<f64>,
    /// Number of lines and isolated points.
    others: usize,
}

impl Found {
    /// Adds the surface cells of an unstructured grid.
    fn add_cells(&mut self, faces: &mut Faces) -> Result<(), Reason> {
        for (k, cell) in self.cells.iter().enumerate() {
            let kind = self.types.get(k).copied().unwrap_or(f64::NAN);
            // Cell types: vtkCellType.h.
            match (kind as i64, cell) {
                (1..=4, _) => self.others += 1,
                (5 | 7 | 9, polygon) => faces.push(polygon.iter().copied(), k),
                (6, strip) => faces.push_strip(strip, k),
                (8, &[a, b, c, d]) => faces.push([a, b, d, c], k),
                _ => return Err(format!("cell {k} is of type {kind}, which is no surface: {EXTRACT}")),
            }
        }
        Ok(())
    }
}

/// Reads the section of a keyword.
fn section(
    keyword: &str,
    input: &mut Input<'_>,
    found: &mut Found,
    parsed: &mut Parsed,
) -> Result<(), Reason> {
    match keyword.to_ascii_uppercase().as_str() {
        "DATASET" => {
            let kind = input.word();
            if !matches!(kind.to_ascii_uppercase().as_str(), "POLYDATA" | "UNSTRUCTURED_GRID") {
                return Err(input.here(&format!("a {:?} is no surface: {EXTRACT}", shown(&kind))));
            }
        }
        "POINTS" => {
            let count = input.count()?.saturating_mul(3);
            let kind = input.kind()?;
            let points = input.numbers(kind, count)?;
            parsed.mesh.vertices_mm = points.chunks_exact(3).map(|p| Vec3::new(p[0], p[1], p[2])).collect();
        }
        "POLYGONS" => found.polygons = input.cells()?,
        "TRIANGLE_STRIPS" => found.strips = input.cells()?,
        "CELLS" => found.cells = input.cells()?,
        "CELL_TYPES" => {
            let count = input.count()?;
            found.types = input.numbers(Scalar::I32, count)?;
        }
        "LINES" | "VERTICES" => found.others += input.cells()?.iter().count(),
        "FIELD" => {
            input.word();
            for _ in 0..input.count()? {
                let (name, columns, rows) = (input.word_beyond_metadata(), input.count()?, input.count()?);
                let count = columns.saturating_mul(rows);
                let values = input.field(count)?;
                if name == "SPACE" {
                    parsed.axes.say(values.first().map_or("", String::as_str));
                }
            }
        }
        "METADATA" => input.skip_paragraph(),
        _ => return Err(input.here(&format!("{:?} is no keyword of a legacy VTK file", shown(keyword)))),
    }
    Ok(())
}

/// The rest of a file, and its line number, which is meaningful in text only.
struct Input<'a> {
    rest: &'a [u8],
    line: usize,
    is_binary: bool,
}

impl<'a> Input<'a> {
    fn here(&self, why: &str) -> Reason {
        if self.is_binary { why.to_owned() } else { format!("line {}: {why}", self.line) }
    }

    /// The rest of the line, without its end.
    fn take_line(&mut self) -> String {
        let length =
            self.rest.iter().position(|byte| matches!(byte, b'\n' | b'\r')).unwrap_or(self.rest.len());
        let line = String::from_utf8_lossy(&self.rest[..length]).into_owned();
        self.rest = &self.rest[length..];
        self.end_line();
        line
    }

    /// Skips the end of a line and blanks before it, and nothing else: bytes may follow.
    fn end_line(&mut self) {
        let blanks = self.rest.iter().take_while(|byte| matches!(byte, b' ' | b'\t')).count();
        match &self.rest[blanks..] {
            [b'\r', b'\n', rest @ ..] | [b'\r' | b'\n', rest @ ..] => {
                self.rest = rest;
                self.line += 1;
            }
            _ => {}
        }
    }

    fn next_word(&mut self) -> Option<String> {
        let blanks = self.rest.iter().take_while(|byte| byte.is_ascii_whitespace()).count();
        self.line += self.rest[..blanks].iter().filter(|byte| **byte == b'\n').count();
        self.rest = &self.rest[blanks..];
        let length = self.rest.iter().take_while(|byte| !byte.is_ascii_whitespace()).count();
        let (word, rest) = self.rest.split_at(length);
        self.rest = rest;
        (!word.is_empty()).then(|| String::from_utf8_lossy(word).into_owned())
    }

    /// The next word, empty at the end of the file.
    fn word(&mut self) -> String {
        self.next_word().unwrap_or_default()
    }

    /// The next word that does not belong to metadata, which may follow any array.
    fn word_beyond_metadata(&mut self) -> String {
        loop {
            match self.word() {
                word if word == "METADATA" => self.skip_paragraph(),
                word => return word,
            }
        }
    }

    fn count(&mut self) -> Result<usize, Reason> {
        let word = self.word();
        word.parse().map_err(|_| self.here(&format!("{:?} is no count", shown(&word))))
    }

    fn kind(&mut self) -> Result<Scalar, Reason> {
        let word = self.word();
        scalar(&word).ok_or_else(|| self.here(&format!("{:?} is no type of number", shown(&word))))
    }

    /// This many numbers; as bytes they begin on the next line.
    fn numbers(&mut self, kind: Scalar, count: usize) -> Result<Vec<f64>, Reason> {
        if !self.is_binary {
            // A number takes at least a character and a blank.
            if count > self.rest.len() {
                return Err(self.here(&format!(
                    "{count} numbers are announced, more than are left: the file is cut off"
                )));
            }
            let mut numbers = Vec::with_capacity(count);
            for _ in 0..count {
                let word = self.word();
                numbers.push(
                    number(&word).ok_or_else(|| self.here(&format!("{:?} is no number", shown(&word))))?,
                );
            }
            return Ok(numbers);
        }
        let bytes = self.bytes(kind.size().saturating_mul(count))?;
        Ok(bytes.chunks_exact(kind.size()).filter_map(|bytes| kind.read(bytes, Order::Big)).collect())
    }

    fn bytes(&mut self, length: usize) -> Result<&'a [u8], Reason> {
        self.end_line();
        let Some(bytes) = self.rest.get(..length) else {
            return Err(format!(
                "{length} bytes are announced and {} are left: the file is cut off",
                self.rest.len()
            ));
        };
        self.rest = &self.rest[length..];
        Ok(bytes)
    }

    /// Cells after their keyword, in either version.
    fn cells(&mut self) -> Result<Cells, Reason> {
        let (first, second) = (self.count()?, self.count()?);
        let (rest, line) = (self.rest, self.line);
        self.end_line();
        if self.word() == "OFFSETS" {
            let kind = self.kind()?;
            let offsets = self.numbers(kind, first)?;
            let keyword = self.word_beyond_metadata();
            if keyword != "CONNECTIVITY" {
                return Err(self.here(&format!("{:?} stands where CONNECTIVITY must", shown(&keyword))));
            }
            let kind = self.kind()?;
            let corners = self.numbers(kind, second)?;
            return Cells::from_ends(&corners, offsets.get(1..).unwrap_or_default())
                .map_err(|why| self.here(&why));
        }
        (self.rest, self.line) = (rest, line);
        let numbers = self.numbers(Scalar::I32, second)?;
        Cells::from_counts(&numbers, first).map_err(|why| self.here(&why))
    }

    /// Values of an array of a field after its counts: strings, or nothing for numbers, which are not needed.
    fn field(&mut self, count: usize) -> Result<Vec<String>, Reason> {
        let kind = self.word();
        if kind == "bit" {
            let wanted = if self.is_binary { count.div_ceil(8) } else { count };
            return self.numbers(Scalar::U8, wanted).map(|_| Vec::new());
        }
        if kind != "string" {
            let kind = scalar(&kind)
                .ok_or_else(|| self.here(&format!("{:?} is no type of number", shown(&kind))))?;
            return self.numbers(kind, count).map(|_| Vec::new());
        }
        self.end_line();
        let mut values = Vec::new();
        for _ in 0..count {
            if self.rest.is_empty() {
                return Err(self.here("strings are announced that are not there: the file is cut off"));
            }
            values.push(if self.is_binary { self.string()? } else { self.take_line() });
        }
        Ok(values)
    }

    /// A string of a binary file: its length takes 1, 2, 4 or 8 bytes, as encoded in the first two bits
    /// (`vtkDataReader::DecodeString` and related functions).
    fn string(&mut self) -> Result<String, Reason> {
        let first = self.rest.first().copied().unwrap_or_default();
        let (kind, bits) = match first >> 6 {
            3 => (Scalar::U8, 6),
            2 => (Scalar::U16, 14),
            1 => (Scalar::U32, 30),
            _ => (Scalar::U64, 62),
        };
        let reported = kind.read(self.rest, Order::Big).unwrap_or_default() as u64 & ((1 << bits) - 1);
        let length = kind.size().saturating_add(reported as usize);
        let bytes = self.rest.get(kind.size()..length).ok_or("a string is cut off")?;
        self.rest = &self.rest[length..];
        Ok(String::from_utf8_lossy(bytes).into_owned())
    }

    /// Skips lines up to an empty one.
    fn skip_paragraph(&mut self) {
        self.end_line();
        while !self.rest.is_empty() && !self.take_line().trim().is_empty() {}
    }
}

/// A type by its name in legacy files.
fn scalar(name: &str) -> Option<Scalar> {
    Some(match name {
        "char" | "signed_char" | "vtktypeint8" => Scalar::I8,
        "unsigned_char" | "vtktypeuint8" => Scalar::U8,
        "short" | "vtktypeint16" => Scalar::I16,
        "unsigned_short" | "vtktypeuint16" => Scalar::U16,
        "int" | "vtkIdType" | "vtktypeint32" => Scalar::I32,
        "unsigned_int" | "vtktypeuint32" => Scalar::U32,
        "long" | "long_long" | "vtktypeint64" => Scalar::I64,
        "unsigned_long" | "unsigned_long_long" | "vtktypeuint64" => Scalar::U64,
        "float" => Scalar::F32,
        "double" => Scalar::F64,
        _ => return None,
    })
}
