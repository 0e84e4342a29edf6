//! Arrays for numpy: an uncompressed zip of `.npy` members, packed from files that grow during a run. Nothing is held
//! in memory.
//!
//! Format: NumPy enhancement proposal 1, version 1.0. Only the 60-byte header is written here, because the crates
//! that read and write the whole format depend on a parser generator. Only files written here can be read back.

use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter, Read, Seek, Write};
use std::path::Path;

use endowire_core::file::whole;
use zip::write::SimpleFileOptions;
use zip::{ZipArchive, ZipWriter};

/// Size of a number in bytes, for both kinds.
const NUMBER_BYTES: u64 = 8;

/// Number type of an array.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Kind {
    /// 64-bit float.
    F64,
    /// 64-bit signed integer.
    I64,
}

/// Name and type of an array.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Member {
    pub(crate) name: &'static str,
    pub(crate) kind: Kind,
    /// Numbers per row; 1 makes a one-dimensional array.
    pub(crate) columns: usize,
    pub(crate) meaning: &'static str,
}

impl Member {
    /// Name of the file in which it grows: bare little-endian numbers, as read by `numpy.fromfile`.
    pub(crate) fn file_name(&self) -> String {
        let kind = match self.kind {
            Kind::F64 => "f64",
            Kind::I64 => "i64",
        };
        format!("{}.{kind}", self.name)
    }
}

/// An array that grows on disk until it is packed. Pushed numbers are handed to the system at once, so they survive
/// if the program is killed.
pub(crate) struct ArrayStream {
    member: Member,
    numbers: u64,
    file: File,
}

impl ArrayStream {
    /// An empty array in `folder`.
    pub(crate) fn new(member: Member, folder: &Path) -> io::Result<Self> {
        let path = folder.join(member.file_name());
        whole::remove(&path)?;
        // Opened for appending, so that numbers stay aligned after the file was truncated.
        let file = OpenOptions::new().read(true).append(true).create_new(true).open(&path)?;
        Ok(Self { member, numbers: 0, file })
    }

    /// The first `numbers` numbers of an array that exists in `folder`.
    pub(crate) fn open(member: Member, folder: &Path, numbers: u64) -> io::Result<Self> {
        let file = OpenOptions::new().read(true).append(true).open(folder.join(member.file_name()))?;
        if file.metadata()?.len() < numbers * NUMBER_BYTES {
            return Err(io::Error::new(
                io::ErrorKind::UnexpectedEof,
                format!("{} is too short", member.file_name()),
            ));
        }
        file.set_len(numbers * NUMBER_BYTES)?;
        Ok(Self { member, numbers, file })
    }

    /// Number of numbers so far.
    pub(crate) fn len(&self) -> u64 {
        self.numbers
    }

    /// Drops all but the first numbers, including the remains of a failed write.
    pub(crate) fn truncate(&mut self, numbers: u64) {
        self.numbers = self.numbers.min(numbers);
        // An error is ignored, because only complete steps are read.
        let _ = self.file.set_len(self.numbers * NUMBER_BYTES);
    }

    /// Appends floats.
    pub(crate) fn push_f64(&mut self, values: impl IntoIterator<Item = f64>) -> io::Result<()> {
        let bytes: Vec<u8> = values.into_iter().flat_map(f64::to_le_bytes).collect();
        self.push(&bytes)
    }

    /// Appends an integer.
    pub(crate) fn push_i64(&mut self, value: i64) -> io::Result<()> {
        self.push(&value.to_le_bytes())
    }

    fn push(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.file.write_all(bytes)?;
        self.numbers += bytes.len() as u64 / NUMBER_BYTES;
        Ok(())
    }

    /// Syncs the numbers to disk, so that they survive a power failure.
    pub(crate) fn sync(&self) -> io::Result<()> {
        self.file.sync_data()
    }

    fn header(&self) -> Vec<u8> {
        let kind = match self.member.kind {
            Kind::F64 => "<f8",
            Kind::I64 => "<i8",
        };
        let shape = match self.member.columns {
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
///
/// # Errors
/// A file that cannot be written.
pub fn write_map(path: &Path, width: usize, values: &[f32]) -> io::Result<()> {
    whole::write(path, |file| {
        let mut file = BufWriter::new(file);
        file.write_all(&header("<f4", &format!("({}, {width})", values.len() / width.max(1))))?;
        values.iter().try_for_each(|v| file.write_all(&v.to_le_bytes()))?;
        file.flush()
    })
}

/// A small array in memory.
#[derive(Debug)]
pub struct Array {
    name: String,
    kind: &'static str,
    shape: Vec<usize>,
    bytes: Vec<u8>,
}

impl Array {
    /// An array of bytes.
    pub fn of_bytes(name: &str, shape: Vec<usize>, bytes: Vec<u8>) -> Self {
        Self { name: name.to_owned(), kind: "|u1", shape, bytes }
    }

    /// An array of floats.
    pub fn of_floats(name: &str, shape: Vec<usize>, values: impl Iterator<Item = f64>) -> Self {
        Self { name: name.to_owned(), kind: "<f8", shape, bytes: values.flat_map(f64::to_le_bytes).collect() }
    }
}

/// Packs arrays in memory into a `.npz` file.
///
/// # Errors
/// A file that cannot be written.
pub fn write_arrays(path: &Path, arrays: &[Array]) -> io::Result<()> {
    whole::write(path, |file| {
        let mut archive = ZipWriter::new(BufWriter::new(file));
        let options = SimpleFileOptions::default()
            .compression_method(zip::CompressionMethod::Stored)
            .last_modified_time(zip::DateTime::default());
        for array in arrays {
            archive.start_file(format!("{}.npy", array.name), options)?;
            let sides: Vec<String> = array.shape.iter().map(|n| format!("{n},")).collect();
            archive.write_all(&header(array.kind, &format!("({})", sides.join(" "))))?;
            archive.write_all(&array.bytes)?;
        }
        archive.finish()?.flush()
    })
}

/// The numbers of an array of 8-byte numbers packed by [`write()`], as little-endian bytes.
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
        let begin: String = text.trim_end().chars().take(100).collect();
        return Err(bad(format!("{name} is no array of 8-byte numbers: {begin:?}")));
    }
    let mut bytes = Vec::new();
    member.read_to_end(&mut bytes)?;
    if !bytes.len().is_multiple_of(8) {
        return Err(bad(format!("{name} ends within a number")));
    }
    Ok(bytes.chunks_exact(8).filter_map(|b| b.try_into().ok()).collect())
}

/// The complete numbers in the file of an array that is not packed; an incomplete last one is dropped.
pub(crate) fn read_unpacked(folder: &Path, member: &Member) -> io::Result<Vec<[u8; 8]>> {
    let bytes = std::fs::read(folder.join(member.file_name()))?;
    Ok(bytes.chunks_exact(8).filter_map(|b| b.try_into().ok()).collect())
}

/// Packs arrays into a `.npz` file.
pub(crate) fn write(file: File, arrays: &mut [ArrayStream]) -> io::Result<()> {
    let mut archive = ZipWriter::new(BufWriter::new(file));
    // Uncompressed, with the fixed time stamp of the zip epoch, so that equal arrays give equal bytes.
    let options = SimpleFileOptions::default()
        .compression_method(zip::CompressionMethod::Stored)
        .last_modified_time(zip::DateTime::default())
        .large_file(true);
    for array in arrays {
        archive.start_file(format!("{}.npy", array.member.name), options)?;
        archive.write_all(&array.header())?;
        array.file.rewind()?;
        let bytes = array.numbers * NUMBER_BYTES;
        if io::copy(&mut (&array.file).take(bytes), &mut archive)? < bytes {
            let text = format!("{} has lost numbers since they were recorded", array.member.file_name());
            return Err(io::Error::new(io::ErrorKind::UnexpectedEof, text));
        }
    }
    archive.finish()?.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()
}
