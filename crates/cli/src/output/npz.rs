//! Arrays for numpy: an uncompressed zip of `.npy` members, written without holding them in memory.
//!
//! Format: NumPy enhancement proposal 1, version 1.0. Only the 60-byte header is ours; the crates that read and write
//! the whole format bring a parser generator for it. Only what is written here is read back.

use std::fs::File;
use std::io::{self, BufWriter, Read, Seek, Write};
use std::path::Path;

use zip::write::SimpleFileOptions;
use zip::{ZipArchive, ZipWriter};

/// Bytes of a number, of either kind.
const NUMBER_BYTES: u64 = 8;

/// Number type of an array.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Kind {
    /// 64-bit float.
    F64,
    /// 64-bit signed integer.
    I64,
}

/// One array that grows row by row, kept in an unnamed temporary file until it is packed.
pub(crate) struct ArrayStream {
    name: &'static str,
    kind: Kind,
    /// Numbers in a row; 1 makes a one-dimensional array.
    columns: usize,
    numbers: u64,
    file: BufWriter<File>,
}

impl ArrayStream {
    /// Numbers so far.
    pub(crate) fn len(&self) -> u64 {
        self.numbers
    }

    /// Forgets all but the first numbers: what a write that failed half way has left.
    pub(crate) fn truncate(&mut self, numbers: u64) {
        self.numbers = self.numbers.min(numbers);
    }

    /// An empty array.
    pub(crate) fn new(name: &'static str, kind: Kind, columns: usize) -> io::Result<Self> {
        Ok(Self { name, kind, columns, numbers: 0, file: BufWriter::new(tempfile::tempfile()?) })
    }

    /// Appends floats.
    pub(crate) fn push_f64(&mut self, values: impl IntoIterator<Item = f64>) -> io::Result<()> {
        for value in values {
            self.file.write_all(&value.to_le_bytes())?;
            self.numbers += 1;
        }
        Ok(())
    }

    /// Appends an integer.
    pub(crate) fn push_i64(&mut self, value: i64) -> io::Result<()> {
        self.numbers += 1;
        self.file.write_all(&value.to_le_bytes())
    }

    fn header(&self) -> Vec<u8> {
        let kind = match self.kind {
            Kind::F64 => "<f8",
            Kind::I64 => "<i8",
        };
        let shape = match self.columns {
            1 => format!("({},)", self.numbers),
            columns => format!("({}, {columns})", self.numbers / columns as u64),
        };
        header(kind, &shape)
    }
}

/// Magic string, version, and the dictionary padded so that the data starts at a multiple of 64 bytes.
fn header(kind: &str, shape: &str) -> Vec<u8> {
    let mut text = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
    while (10 + text.len() + 1) % 64 != 0 {
        text.push(' ');
    }
    text.push('\n');
    let mut header = b"\x93NUMPY\x01\x00".to_vec();
    header.extend((text.len() as u16).to_le_bytes());
    header.extend(text.as_bytes());
    header
}

/// Writes a map of 32-bit floats, row by row, as a `.npy` file.
pub(crate) fn write_map(path: &Path, width: usize, values: &[f32]) -> io::Result<()> {
    let mut file = BufWriter::new(File::create(path)?);
    file.write_all(&header("<f4", &format!("({}, {width})", values.len() / width.max(1))))?;
    values.iter().try_for_each(|v| file.write_all(&v.to_le_bytes()))?;
    file.flush()
}

/// The numbers of an array of 8-byte numbers that [`write()`] has packed, as little-endian bytes.
pub(crate) fn read(path: &Path, name: &str) -> io::Result<Vec<[u8; 8]>> {
    let bad = |what: String| io::Error::new(io::ErrorKind::InvalidData, what);
    let mut archive = ZipArchive::new(File::open(path)?)?;
    let mut member = archive.by_name(&format!("{name}.npy"))?;
    let mut head = [0; 10];
    member.read_exact(&mut head)?;
    let mut text = vec![0; usize::from(u16::from_le_bytes([head[8], head[9]]))];
    member.read_exact(&mut text)?;
    let text = String::from_utf8_lossy(&text).into_owned();
    if !head.starts_with(b"\x93NUMPY\x01") || !(text.contains("'<f8'") || text.contains("'<i8'")) {
        return Err(bad(format!("{name} is no array of 8-byte numbers: {text}")));
    }
    let mut bytes = Vec::new();
    member.read_to_end(&mut bytes)?;
    if !bytes.len().is_multiple_of(8) {
        return Err(bad(format!("{name} ends within a number")));
    }
    Ok(bytes.chunks_exact(8).filter_map(|b| b.try_into().ok()).collect())
}

/// Packs arrays into a `.npz` file.
pub(crate) fn write(path: &Path, arrays: Vec<ArrayStream>) -> io::Result<()> {
    let mut archive = ZipWriter::new(BufWriter::new(File::create(path)?));
    // Stored, with the fixed time stamp of the zip epoch: the same arrays are the same bytes.
    let options = SimpleFileOptions::default()
        .compression_method(zip::CompressionMethod::Stored)
        .last_modified_time(zip::DateTime::default())
        .large_file(true);
    for array in arrays {
        archive.start_file(format!("{}.npy", array.name), options)?;
        archive.write_all(&array.header())?;
        let mut data = array.file.into_inner().map_err(io::IntoInnerError::into_error)?;
        data.rewind()?;
        io::copy(&mut data.take(array.numbers * NUMBER_BYTES), &mut archive)?;
    }
    archive.finish()?.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()
}
